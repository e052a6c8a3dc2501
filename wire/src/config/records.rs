//! Parameters, findings and changes of configd's versions, as records that every tool can read.
//! Their lengths are bounded, so that every answer fits into a frame.

use std::fmt;
use std::str::FromStr;

use crate::Message;
use crate::manifest::ParameterType;

/// Most parameters, findings or changes in one answer.
pub const MAX_RECORDS: usize = 128;
/// Longest text of a record, in bytes; a longer one is cut and ends in `…`.
pub const MAX_RECORD_TEXT_LEN: usize = 1024;

/// Cuts the text to [`MAX_RECORD_TEXT_LEN`].
pub fn cut_text(text: impl Into<String>) -> String {
    let mut text = text.into();
    if text.len() > MAX_RECORD_TEXT_LEN {
        text.truncate(text.floor_char_boundary(MAX_RECORD_TEXT_LEN - '…'.len_utf8()));
        text.push('…');
    }
    text
}

/// Defines an enum that is sent as a text: its variants with their texts. The first one is the
/// default.
macro_rules! text_enum {
    ($(#[$doc:meta])* $name:ident {
        $(#[$first_doc:meta])* $first:ident = $first_text:literal,
        $($(#[$variant_doc:meta])* $variant:ident = $text:literal,)*
    }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub enum $name {
            $(#[$first_doc])* #[default] $first,
            $($(#[$variant_doc])* $variant,)*
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self {
                    Self::$first => $first_text,
                    $(Self::$variant => $text,)*
                })
            }
        }

        impl FromStr for $name {
            type Err = &'static str;
            fn from_str(text: &str) -> Result<Self, Self::Err> {
                match text {
                    $first_text => Ok(Self::$first),
                    $($text => Ok(Self::$variant),)*
                    _ => Err("an unknown word"),
                }
            }
        }
    };
}

text_enum! {
    /// How severe a finding is.
    FindingSeverity {
        /// The file is refused.
        Error = "error",
        /// The file is accepted, but something is probably not as intended.
        Warning = "warning",
        /// For information.
        Note = "note",
    }
}

text_enum! {
    /// The kind of thing that a change is about.
    ChangeSubject {
        /// The system itself.
        System = "system",
        /// Another host.
        Host = "host",
        /// A frame that is fixed in another one.
        Frame = "frame",
        /// A component.
        Component = "component",
        /// A parameter.
        Parameter = "parameter",
        /// A link.
        Link = "link",
        /// The mission itself.
        Mission = "mission",
        /// A variable of the mission.
        Variable = "variable",
        /// A place.
        Place = "place",
        /// A set of exclusive components.
        Exclusive = "exclusive",
        /// A transition.
        Transition = "transition",
        /// A submission.
        Submission = "submission",
    }
}

impl ChangeSubject {
    /// Whether it is part of the mission, of which the executive decides when to take a change.
    pub fn is_of_mission(self) -> bool {
        match self {
            Self::System
            | Self::Host
            | Self::Frame
            | Self::Component
            | Self::Parameter
            | Self::Link => false,
            Self::Mission
            | Self::Variable
            | Self::Place
            | Self::Exclusive
            | Self::Transition
            | Self::Submission => true,
        }
    }
}

text_enum! {
    /// What happened to the subject of a change.
    ChangeKind {
        /// It is new.
        Added = "added",
        /// It is gone.
        Removed = "removed",
        /// One of its attributes differs.
        Changed = "changed",
    }
}

/// The type of a listed parameter, sent as a text: empty if the component's kind does not declare
/// the parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ListedType(pub Option<ParameterType>);

impl fmt::Display for ListedType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.map_or(Ok(()), |kind| kind.fmt(f))
    }
}

impl FromStr for ListedType {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text.is_empty() {
            return Ok(Self(None));
        }
        let known = ParameterType::ALL.into_iter().find(|kind| kind.to_string() == text);
        known.map(|kind| Self(Some(kind))).ok_or("an unknown type of parameter")
    }
}

/// A parameter of a component of the system.
#[derive(Clone, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct ListedParameter {
    /// The component.
    pub component: String,
    /// The parameter.
    pub name: String,
    /// The type of its value.
    #[message(text)]
    pub kind: ListedType,
    /// The value as written, or the default.
    pub value: String,
    /// The unit of a bare number; empty without.
    pub unit: String,
    /// Origin of the value: `file:line:column`, `--set`, or `default`.
    pub origin: String,
    /// Whether a change reaches the running component.
    pub live: bool,
    /// Its allowed values, such as `0.1 to 500`, in the unit, or the choices; empty if it is free.
    pub range: String,
    /// What it does, in one line; may be empty.
    pub doc: String,
    /// The places of the mission that give it another value while they are marked, as
    /// `PLACE=VALUE; PLACE=VALUE`; mostly empty.
    pub places: String,
}

/// A problem in a file. Lines and columns count from 1, columns in characters, ends
/// exclusive; all 0 if it is about no text.
#[derive(Clone, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire", name = "Finding")]
pub struct FindingRecord {
    /// How severe it is.
    #[message(text)]
    pub severity: FindingSeverity,
    /// The stable code, such as `E0113`.
    pub code: String,
    /// What is wrong, in one sentence.
    pub message: String,
    /// What to do; may be empty.
    pub remedy: String,
    /// The file; empty if it is about no text.
    pub file: String,
    /// First line.
    pub line: u32,
    /// First column.
    pub column: u32,
    /// Last line.
    pub end_line: u32,
    /// Column after the last.
    pub end_column: u32,
    /// The piece of text that it is about.
    pub text: String,
    /// The first line in whole, for showing the piece in it.
    pub source_line: String,
}

/// A difference from an earlier version.
#[derive(Clone, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire", name = "Change")]
pub struct ChangeRecord {
    /// The kind of thing that changed.
    #[message(text)]
    pub subject: ChangeSubject,
    /// Which one: `driver`, `driver.speed`, `laser.scan -> slam.scan`; empty for system and
    /// mission.
    pub name: String,
    /// What happened to it.
    #[message(text)]
    pub change: ChangeKind,
    /// Which attribute of it changed; empty for a parameter's value.
    pub aspect: String,
    /// Its value before; empty if it had none.
    pub before: String,
    /// Its value now; empty if it has none.
    pub after: String,
    /// A sentence that describes the change.
    pub text: String,
    /// When it takes effect, in words; empty if there is nothing to take effect.
    pub effect: String,
}

/// The state of a running system's configuration: the latched data `configuration.state`.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct ConfigurationState {
    /// System time of the change of state, in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// The version in force; counts the accepted versions from 1.
    pub version: u64,
    /// The files of that version, the one that was asked for first.
    pub files: Vec<String>,
    /// Whether the files on the disk differ from that version and are refused.
    pub refused: bool,
    /// What is wrong with the files on the disk; of an accepted version its warnings and notes.
    pub findings: Vec<FindingRecord>,
    /// Number of further findings.
    pub findings_left_out: u32,
    /// What changed with the version in force; empty for the first.
    pub changes: Vec<ChangeRecord>,
    /// Number of further changes.
    pub changes_left_out: u32,
    /// The client that has set the changed parameter, or the holder of its key; empty if the file was
    /// edited.
    pub set_by: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_type_of_a_listed_parameter_is_sent_as_its_word() {
        for kind in ParameterType::ALL.map(Some).into_iter().chain([None]) {
            let text = ListedType(kind).to_string();
            assert_eq!(text.parse(), Ok(ListedType(kind)));
            assert_eq!(text.is_empty(), kind.is_none());
        }
        assert!("tensor".parse::<ListedType>().is_err());
    }

    #[test]
    fn a_long_text_is_cut_at_a_character() {
        assert_eq!(cut_text("short"), "short");
        let text = cut_text("ä".repeat(MAX_RECORD_TEXT_LEN));
        assert!(text.len() <= MAX_RECORD_TEXT_LEN && text.ends_with("ä…"), "{}", text.len());
    }
}
