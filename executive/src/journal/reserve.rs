//! Space on the disk that is reserved ahead of the end of a journal, so that a mission still
//! reaches its safe place when the disk is full.

use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;
use std::fs::File;
use std::io;

/// How much is reserved, in bytes: some thousand records. It is filled up at half of this.
const RESERVED: u64 = 1 << 20;

/// The reserved space of one file.
#[derive(Debug)]
pub(super) struct ReservedSpace {
    /// Reserves a range of the file without changing its length.
    allocate: fn(&File, u64, u64) -> io::Result<()>,
    /// The offset up to which space is reserved.
    up_to: u64,
    shortage: Option<String>,
}

impl Default for ReservedSpace {
    fn default() -> Self {
        Self::with(allocate_ahead)
    }
}

fn allocate_ahead(file: &File, from: u64, len: u64) -> io::Result<()> {
    Ok(fallocate(file, FallocateFlags::KEEP_SIZE, from, len)?)
}

impl ReservedSpace {
    pub(super) fn with(allocate: fn(&File, u64, u64) -> io::Result<()>) -> Self {
        Self { allocate, up_to: 0, shortage: None }
    }

    /// Reserves space after `len`, the end of the file, if too little is left.
    pub(super) fn fill_up(&mut self, file: &File, len: u64) {
        if self.up_to >= len.saturating_add(RESERVED / 2) {
            return;
        }
        match (self.allocate)(file, len, RESERVED) {
            Ok(()) => (self.up_to, self.shortage) = (len + RESERVED, None),
            Err(error) if is_full(&error) => self.shortage = Some(error.to_string()),
            // This file system reserves nothing; the journal is written as long as there is space.
            Err(_) => self.up_to = u64::MAX,
        }
    }

    /// Notes that the disk is full.
    pub(super) fn note_shortage(&mut self, error: &io::Error) {
        self.shortage = Some(error.to_string());
    }

    /// Why no more space could be reserved.
    pub(super) fn shortage(&self) -> Option<&str> {
        self.shortage.as_deref()
    }
}

/// Whether the disk, or the user's share of it, is full.
pub(super) fn is_full(error: &io::Error) -> bool {
    let code = error.raw_os_error();
    [Errno::NOSPC, Errno::DQUOT].iter().any(|full| code == Some(full.raw_os_error()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(answer: fn(&File, u64, u64) -> io::Result<()>, ends: &[u64], is_short: bool) {
        let file = File::open("/dev/null").unwrap();
        let mut space = ReservedSpace::with(answer);
        ends.iter().for_each(|end| space.fill_up(&file, *end));
        assert_eq!(space.shortage().is_some(), is_short, "{space:?}");
    }

    #[test]
    fn a_full_disk_is_noticed_while_half_of_the_reserve_is_left() {
        let full = |_: &File, from: u64, _: u64| match from {
            0 => Ok(()),
            _ => Err(io::Error::from_raw_os_error(Errno::NOSPC.raw_os_error())),
        };
        check(full, &[0, RESERVED / 2], false);
        check(full, &[0, RESERVED / 2 + 1], true);
        let unable = |_: &File, _: u64, _: u64| {
            Err(io::Error::from_raw_os_error(Errno::OPNOTSUPP.raw_os_error()))
        };
        check(unable, &[0, RESERVED, 100 * RESERVED], false);
    }

    #[test]
    fn space_that_is_free_again_ends_the_shortage() {
        let once = |_: &File, from: u64, _: u64| match from {
            5 => Err(io::Error::from_raw_os_error(Errno::DQUOT.raw_os_error())),
            _ => Ok(()),
        };
        check(once, &[5], true);
        check(once, &[5, 6], false);
    }
}
