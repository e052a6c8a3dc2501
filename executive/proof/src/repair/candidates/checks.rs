//! The checks of a mission, which can be wrong as well.

use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;

/// Before the places of the mission: only a check that fails is changed.
const SIDES: i32 = 14;
/// Between the sides of a check about what follows.
const LEADS_TO: &str = " leads to ";

impl MissionElements<'_> {
    /// The sides of a check that fails, exchanged.
    pub(super) fn checks(&self, edits: &mut Vec<FileEdit>) {
        for check in self.element.elements().filter(|it| it.name == "check") {
            let (text, Some(span)) = check.text() else { continue };
            let at = self.at(span);
            let is_in = |place: &armor_robotfile::Location| {
                place.source.path() == at.source.path()
                    && check.span.start() <= place.span.start()
                    && place.span.end() <= check.span.end()
            };
            let fails = self.faults.iter().any(|fault| {
                fault.at.iter().chain(fault.related.iter().map(|it| &it.0)).any(is_in)
            });
            if let Some((from, to)) = text.split_once(LEADS_TO)
                && fails
                && !at.text().contains('&')
            {
                // What leads to the goal may fail.
                let ends = value(self.element, "safe").map(|safe| format!("{from} or {safe}"));
                let ends = ends.filter(|_| value(self.element, "goal") == Some(from));
                for (more, after) in [Some(from.to_owned()), ends].into_iter().flatten().enumerate()
                {
                    let result = format!("{to}{LEADS_TO}{after}");
                    let edit = FileEdit::new(
                        vec![(span, result.clone())],
                        at.clone(),
                        format!("<check>{result}</check>"),
                        None,
                    );
                    edits.push(edit.ranked(SIDES + more as i32));
                }
            }
        }
    }
}
