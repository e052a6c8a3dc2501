//! Room on the disk: a recorder must not fill the one that the mission needs.

use std::path::Path;

use anyhow::{Context, Result};
use rustix::fs::statvfs;

/// Below this, a recording ends in order.
pub const LEAST_FREE: u64 = 256 << 20;

/// Returns how many bytes a user may still write to the disk of `folder`.
pub fn count_free_bytes(folder: &Path) -> Result<u64> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let disk = statvfs(folder)
        .with_context(|| format!("nothing can be written to {}", folder.display()))?;
    Ok(disk.f_bavail.saturating_mul(disk.f_frsize))
}
