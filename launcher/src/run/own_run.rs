//! Which run this is, for components whose files continue after their own death: a resumed run is
//! the one that it continues, any other start is a new one, also in the same folder.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use armor_files::save_private_file;

/// The file with the number of the run, in its folder.
pub const FILE: &str = ".run";
/// The folder in which components keep their state, next to it.
pub const STATES: &str = "states";
/// Names the run to its processes.
const RUN_VARIABLE: &str = "ARMOR_RUN";
/// Tells a process whether it is the `first` of its component in this run, or a `later` one.
pub const START_VARIABLE: &str = "ARMOR_START";
/// Hexadecimal digits of a number.
const DIGITS: usize = 16;

/// The number of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnRun {
    number: String,
}

impl OwnRun {
    /// Draws a number and writes it into the folder; a run that resumes has that of the run before.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn begin(out: &Path, resumes: bool) -> Result<Self> {
        let path = out.join(FILE);
        let known = if resumes { fs::read_to_string(&path).ok() } else { None };
        if let Some(number) = known.filter(|number| is_number(number)) {
            return Ok(Self { number });
        }
        let number = format!("{:0DIGITS$x}", armor_socket::random_id());
        save_private_file(&path, number.as_bytes())
            .with_context(|| format!("{} cannot be written", path.display()))?;
        Ok(Self { number })
    }

    /// The variable that names it to a process.
    pub fn variable(&self) -> (&'static str, &str) {
        (RUN_VARIABLE, &self.number)
    }
}

/// The value of [`START_VARIABLE`].
pub fn name_start(is_first: bool) -> &'static str {
    if is_first { "first" } else { "later" }
}

fn is_number(text: &str) -> bool {
    text.len() == DIGITS && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;

    #[test]
    fn only_a_resumed_run_has_the_number_of_the_run_before() {
        let scratch = ScratchFolder::new("own-run");
        let begin = |resumes| OwnRun::begin(scratch.path(), resumes).expect("a number");
        let first = begin(false);
        assert_eq!(begin(true), first);
        let second = begin(false);
        assert_ne!(second, first);
        fs::write(scratch.path().join(FILE), "damaged").expect("a file");
        assert_ne!(begin(true).number, "damaged", "what it names is not known");
    }
}
