//! Room on the disk: a recorder must not fill the one that the mission needs.

use std::path::Path;

use rustix::fs::statvfs;

use super::fault::RecorderError;

/// Returns how many bytes a user may still write to the disk of `folder`.
pub(crate) fn count_free_bytes(folder: &Path) -> Result<u64, RecorderError> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let disk = statvfs(folder)
        .map_err(|error| RecorderError::Folder { path: folder.into(), reason: error.into() })?;
    Ok(disk.f_bavail.saturating_mul(disk.f_frsize))
}
