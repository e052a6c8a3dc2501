//! What every command of the command line does.

use std::process::ExitCode;

use anyhow::Result;

use crate::arguments::OutputFormat;

/// A command, made from its arguments.
pub trait Verb {
    /// Carries it out, and returns the exit code.
    ///
    /// # Errors
    /// If it fails; the error is printed, and the exit code is 1.
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode>;
}
