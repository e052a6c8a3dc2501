//! Values that places give parameters of their components.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;

/// A value that a place gives a parameter of one of its components.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GivenValue {
    /// The parameter.
    pub parameter: String,
    /// The value, as written.
    pub text: String,
    /// The folder that a relative path in it starts from.
    pub folder: PathBuf,
    /// Where it is written, `file:line:column`.
    pub origin: String,
}

impl GivenValue {
    /// Returns what is given, without where it is written.
    pub fn terms(&self) -> (&str, &str, &PathBuf) {
        (&self.parameter, &self.text, &self.folder)
    }
}

impl fmt::Display for GivenValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.parameter, self.text)
    }
}
