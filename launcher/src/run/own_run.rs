//! Which run this is, for components whose files continue after their own death: a resumed run is
//! the one that it continues, any other start is a new one, also in the same folder.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use armor_files::save_private_file;
use armor_socket::run_keys::draw_secret;
use armor_wire::run_key::RunSecret;

/// The file with the number of the run, in its folder.
pub const FILE: &str = ".run";
/// The file with its secret, next to it.
const SECRET_FILE: &str = ".run-secret";
/// The folder in which components keep their state, next to it.
pub const STATES: &str = "states";
/// Names the run to its processes.
const RUN_VARIABLE: &str = "ARMOR_RUN";
/// Informs a process whether it is the `first` of its component in this run, or a `later` one.
pub const START_VARIABLE: &str = "ARMOR_START";
/// Hexadecimal digits of a number.
const DIGITS: usize = 16;

/// The number and the secret of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnRun {
    number: String,
    secret: RunSecret,
}

impl OwnRun {
    /// Draws a number and a secret and writes them into the folder; a run that resumes has those of the
    /// run before, whose components on other hosts may still run.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn begin(out: &Path, resumes: bool) -> Result<Self> {
        let known = |file| if resumes { fs::read_to_string(out.join(file)).ok() } else { None };
        let save = |file: &str, text: &str| {
            let path = out.join(file);
            save_private_file(&path, text.as_bytes())
                .with_context(|| format!("{} cannot be written", path.display()))
        };
        let number = match known(FILE).filter(|number| is_number(number)) {
            Some(number) => number,
            None => {
                let number = format!("{:0DIGITS$x}", armor_socket::random_id());
                save(FILE, &number)?;
                number
            }
        };
        let secret = match known(SECRET_FILE).and_then(|text| text.parse().ok()) {
            Some(secret) => secret,
            None => {
                let secret = draw_secret();
                save(SECRET_FILE, &secret.to_string())?;
                secret
            }
        };
        Ok(Self { number, secret })
    }

    /// By which its processes prove that this launcher has started them.
    pub fn secret(&self) -> RunSecret {
        self.secret
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
    use std::os::unix::fs::PermissionsExt;

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
        assert_ne!(second.secret, first.secret);
        for file in [FILE, SECRET_FILE] {
            let path = scratch.path().join(file);
            let mode = fs::metadata(&path).expect("a file").permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{file}");
            fs::write(path, "damaged").expect("a file");
        }
        let third = begin(true);
        assert_ne!(third.number, "damaged", "what it names is not known");
        assert_ne!(third.secret, second.secret);
    }
}
