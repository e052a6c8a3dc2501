//! What an edit makes wrong in the files: it is refused before it is made.

use armor_robotfile::{Code, Finding, Reading};

use crate::window_words::in_window_words;

/// What is malformed in the reading `after` and was not in the one `before`.
pub(super) fn find_added_fault(before: &Reading, after: &Reading) -> Option<String> {
    let count = |reading: &Reading, fault: &Finding| {
        let is_it = |found: &&Finding| found.code == fault.code && found.message == fault.message;
        reading.findings.iter().filter(is_it).count()
    };
    let mut faults =
        after.findings.iter().filter(|found| matches!(found.code, Code::BadValue | Code::BadName));
    let added = faults.find(|fault| count(after, fault) > count(before, fault))?;
    match added.remedy.is_empty() {
        true => Some(added.message.to_string()),
        false => Some(format!("{}: {}", added.message, in_window_words(&added.remedy))),
    }
}
