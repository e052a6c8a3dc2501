//! `armor-designer --check`: what the panel with the problems would say of a file, as text.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use armor_robotfile::Findings;

use crate::kinds::{Kinds, KindsError, find_armor};
use crate::project::{OpenError, Project};

/// Why a file was not checked.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// It cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Without the kinds almost nothing can be checked.
    #[error(transparent)]
    Kinds(#[from] KindsError),
}

/// What was found in a file.
pub struct Found {
    /// The findings, sorted.
    pub findings: Arc<Findings>,
    /// What went wrong with component directories; empty if nothing did.
    pub troubles: String,
}

/// Opens the file and waits until all has been found, the proof of its mission too.
///
/// # Errors
/// If it cannot be opened, or no program can be asked for the kinds.
pub fn check(file: &Path, components: &[PathBuf]) -> Result<Found, CheckError> {
    let armor = find_armor().ok_or(KindsError::NoArmor)?;
    let mut project = Project::open(file, Arc::default())?;
    let kinds = Kinds::ask(&armor, &project.folder(), components)?;
    let troubles = kinds.troubles().to_owned();
    project.set_kinds(Arc::new(kinds));
    project.settle();
    Ok(Found { findings: Arc::clone(&project.checked().findings), troubles })
}
