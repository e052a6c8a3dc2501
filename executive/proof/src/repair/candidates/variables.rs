//! Other first values of variables.

use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;

const INITIAL: i32 = 22;

impl MissionElements<'_> {
    /// The least value as the first one.
    pub(super) fn variables(&self, edits: &mut Vec<FileEdit>) {
        for variable in self.element.elements().filter(|it| it.name == "variable") {
            let (Some(initial), Some(least)) =
                (variable.attribute("initial"), value(variable, "min"))
            else {
                continue;
            };
            if initial.value != least {
                edits.push(self.with_value(variable, initial, least).ranked(INITIAL));
            }
        }
    }
}
