//! What a recording has of its run besides data: the lines of the logs, the decisions of the mission,
//! and the parameters, each as an output of `armor`.

use armor_sdk::messages::Log;
use armor_sdk::prelude::Message;

/// The data under which the lines of the logs are recorded, as [`Log`].
pub const LOGS: &str = "armor.logs";
/// The data under which the records of the journal are recorded, as [`RecordedDecision`].
pub const JOURNAL: &str = "armor.journal";
/// The data under which parameters are recorded, as [`RecordedParameter`].
pub const PARAMETERS: &str = "armor.parameters";
/// The component of these outputs, which no component of a system can be called.
pub(crate) const OWN_COMPONENT: &str = "armor";

/// A record of the mission's journal.
#[derive(Clone, Debug, Default, PartialEq, Message)]
pub struct RecordedDecision {
    /// System time at which it was recorded.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Its line in the journal, as docs/journal.md describes it.
    pub line: String,
}

/// A parameter: its value when the recording began, or a change.
#[derive(Clone, Debug, Default, PartialEq, Message)]
pub struct RecordedParameter {
    /// System time.
    #[message(unit = "s")]
    pub stamp: f64,
    /// The component.
    pub component: String,
    /// The parameter.
    pub parameter: String,
    /// Its value; empty for the default after it was removed from the file.
    pub value: String,
    /// Its value before the change; empty for one of the beginning.
    pub before: String,
    /// The version of the file with which it came.
    pub version: u64,
    /// Where its value stands: `file:line:column`, `--set` or `default`; empty for a change.
    pub origin: String,
    /// The client that has set it, or the holder of its key; empty if the file was edited.
    pub set_by: String,
}

/// Levels of [`Log`] by the words of a log file, the lowest first.
const LEVELS: [(&str, u8); 5] =
    [("TRACE", 10), ("DEBUG", 10), ("INFO", 20), ("WARN", 30), ("ERROR", 40)];
/// The level of a line that has none.
const NO_LEVEL: u8 = 20;

/// Makes the message of a line of a log.
pub(crate) fn make_log(stamp: f64, name: &str, level: &str, text: &str) -> Log {
    let known = LEVELS.iter().find(|(word, _)| *word == level);
    Log {
        stamp,
        level: known.map_or(NO_LEVEL, |(_, number)| *number),
        name: name.into(),
        msg: text.into(),
        file: String::new(),
        function: String::new(),
        line: 0,
    }
}

/// Returns the word of a level, as log files have it.
pub fn name_log_level(level: u8) -> &'static str {
    let known = LEVELS.iter().rev().find(|(_, number)| *number <= level);
    known.map_or("DEBUG", |(word, _)| word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_written_and_read_as_words() {
        for word in ["DEBUG", "INFO", "WARN", "ERROR"] {
            assert_eq!(name_log_level(make_log(0.0, "a", word, "").level), word);
        }
        assert_eq!(name_log_level(make_log(0.0, "a", "", "").level), "INFO");
        assert_eq!([0, 50].map(name_log_level), ["DEBUG", "ERROR"]);
    }
}
