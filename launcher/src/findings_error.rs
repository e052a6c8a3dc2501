//! The findings of a file as the error of a command that needs the file without one.

use std::path::Path;

use armor_robotfile::{Colours, Findings};

/// The error of a command for a file with these findings: the file's name, then all of them.
pub fn refuse_file(file: &Path, findings: &Findings) -> anyhow::Error {
    let text = findings.render(Colours::No);
    anyhow::anyhow!("{} has errors:\n{}", file.display(), text.trim_end())
}
