//! Memory that processes share: anonymous files (memfd) and their mappings.
//!
//! # Safety argument
//! This is the only file with `unsafe` code. A mapping is a pointer and a length from `mmap`, owned
//! by one `Mapping` and unmapped when that is dropped, so every slice that borrows from it is of
//! mapped memory. Three more things must be true for a slice to be sound.
//!
//! * *The memory stays.* A file that became shorter would turn reads into SIGBUS. Before a file is
//!   given away, the publisher seals its size (`F_SEAL_SHRINK`, `F_SEAL_GROW`) and the seals
//!   themselves; a subscriber maps a file only if it is sealed and long enough.
//! * *A slot does not change while it is read.* Subscribers cannot write it: their mapping is
//!   read-only, and `F_SEAL_FUTURE_WRITE` refuses every other one. The publisher writes a slot only
//!   through [`SlotMemory::bytes_mut`] after the table of every link has shown that no subscriber
//!   holds it ([`crate::pool`]); that protocol is checked by loom in `tests/interleavings.rs`. Both
//!   processes belong to one user and run this code; against a process of the same user that breaks
//!   it on purpose no memory of it is safe (it could use ptrace).
//! * *The words of a page are atomics*, which may change at any time. Nothing else is read from a
//!   page, and each word read from it is checked before it is used.

#![allow(unsafe_code)]

use std::ffi::c_void;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::ptr::NonNull;
use std::sync::atomic::AtomicU64;

use rustix::fs::{
    FallocateFlags, MemfdFlags, SealFlags, fallocate, fcntl_add_seals, fcntl_get_seals, fstat,
    memfd_create,
};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use thiserror::Error;

use crate::page::{PageLayout, PageWords};

/// Longest slot in bytes: the longest message and its header.
pub const MAX_SLOT_LEN: usize = (64 << 20) + (1 << 20);

/// The size of a file that was given away is fixed.
const SIZE_SEALS: SealFlags = SealFlags::SHRINK.union(SealFlags::GROW);

/// Why memory cannot be shared.
#[derive(Debug, Error)]
pub enum MemoryError {
    /// The system refuses it: no memory, no file descriptors.
    #[error("the system gives no shared memory: {0}")]
    System(#[from] io::Error),
    /// A length outside the limits.
    #[error("a shared memory of {0} bytes; it has 1 to {MAX_SLOT_LEN}")]
    Length(usize),
    /// The sender can still change the size of a file.
    #[error("the size of a shared memory is not sealed")]
    NotSealed,
    /// The file is shorter than was announced.
    #[error("a shared memory of {len} bytes was announced, and has {found}")]
    TooShort {
        /// As announced.
        len: usize,
        /// As found.
        found: u64,
    },
}

impl From<rustix::io::Errno> for MemoryError {
    fn from(error: rustix::io::Errno) -> Self {
        Self::System(error.into())
    }
}

/// A mapped file.
#[derive(Debug)]
struct Mapping {
    start: NonNull<c_void>,
    len: usize,
}

// SAFETY: the memory belongs to no thread; `Mapping` hands out no access of its own.
unsafe impl Send for Mapping {}
// SAFETY: as above.
unsafe impl Sync for Mapping {}

impl Mapping {
    fn new(file: BorrowedFd<'_>, len: usize, access: ProtFlags) -> io::Result<Self> {
        // SAFETY: no address is asked for, so no memory of this process is replaced.
        let start = unsafe { mmap(std::ptr::null_mut(), len, access, MapFlags::SHARED, file, 0) }?;
        let start = NonNull::new(start).ok_or_else(|| io::Error::other("mapped at address 0"))?;
        Ok(Self { start, len })
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: this is the only owner, and no slice outlives it.
        let _ = unsafe { munmap(self.start.as_ptr(), self.len) };
    }
}

/// A new file of `len` bytes, all of which the system has: a later write cannot fail.
fn create_file(name: &str, len: usize) -> Result<OwnedFd, MemoryError> {
    if !(1..=MAX_SLOT_LEN).contains(&len) {
        return Err(MemoryError::Length(len));
    }
    let file = memfd_create(name, MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?;
    fallocate(&file, FallocateFlags::empty(), 0, len as u64)?;
    Ok(file)
}

/// Checks that a received file has `len` bytes and will keep them.
fn check_file(file: BorrowedFd<'_>, len: usize) -> Result<(), MemoryError> {
    if !(1..=MAX_SLOT_LEN).contains(&len) {
        return Err(MemoryError::Length(len));
    }
    if !fcntl_get_seals(file)?.contains(SIZE_SEALS) {
        return Err(MemoryError::NotSealed);
    }
    let found = u64::try_from(fstat(file)?.st_size).unwrap_or_default();
    if found < len as u64 {
        return Err(MemoryError::TooShort { len, found });
    }
    Ok(())
}

/// A slot, at the publisher.
#[derive(Debug)]
pub struct SlotMemory {
    mapping: Mapping,
    file: OwnedFd,
}

impl SlotMemory {
    /// Creates a slot of `len` bytes that other processes can only read.
    ///
    /// # Errors
    /// [`MemoryError`] if the system refuses it.
    pub fn create(len: usize) -> Result<Self, MemoryError> {
        let file = create_file("armor-slot", len)?;
        let mapping = Mapping::new(file.as_fd(), len, ProtFlags::READ | ProtFlags::WRITE)?;
        fcntl_add_seals(&file, SIZE_SEALS | SealFlags::FUTURE_WRITE | SealFlags::SEAL)?;
        Ok(Self { mapping, file })
    }

    /// Its bytes, to be written while no subscriber holds it.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        // SAFETY: mapped for writing, `len` bytes long; `&mut self` excludes other slices of this
        // process, the protocol those of others (see the module).
        unsafe {
            std::slice::from_raw_parts_mut(self.mapping.start.as_ptr().cast(), self.mapping.len)
        }
    }

    /// What a subscriber gets.
    pub fn file(&self) -> BorrowedFd<'_> {
        self.file.as_fd()
    }
}

/// A slot, at a subscriber.
#[derive(Debug)]
pub struct SlotView(Mapping);

impl SlotView {
    /// Maps a slot of `len` bytes.
    ///
    /// # Errors
    /// [`MemoryError`] if the file is not what was announced, or cannot be mapped.
    pub fn map(file: &OwnedFd, len: usize) -> Result<Self, MemoryError> {
        check_file(file.as_fd(), len)?;
        Ok(Self(Mapping::new(file.as_fd(), len, ProtFlags::READ)?))
    }

    /// Its bytes. They do not change while this subscriber holds the slot.
    pub fn bytes(&self) -> &[u8] {
        // SAFETY: mapped for reading, `len` bytes long, and not written meanwhile (see the module).
        unsafe { std::slice::from_raw_parts(self.0.start.as_ptr().cast(), self.0.len) }
    }
}

/// The page of a link.
#[derive(Debug)]
pub struct LinkPage {
    mapping: Mapping,
    layout: PageLayout,
}

impl LinkPage {
    /// Creates a page. Returns it with the file for the other end.
    ///
    /// # Errors
    /// [`MemoryError`] if the layout is not valid or the system refuses it.
    pub fn create(layout: PageLayout) -> Result<(Self, OwnedFd), MemoryError> {
        let len = Self::check_len(layout)?;
        let file = create_file("armor-link", len)?;
        let page = Self::map_file(file.as_fd(), len, layout)?;
        fcntl_add_seals(&file, SIZE_SEALS | SealFlags::SEAL)?;
        Ok((page, file))
    }

    /// Maps a page that the other end has created.
    ///
    /// # Errors
    /// [`MemoryError`] if the file is not what was announced, or cannot be mapped.
    pub fn map(file: &OwnedFd, layout: PageLayout) -> Result<Self, MemoryError> {
        let len = Self::check_len(layout)?;
        check_file(file.as_fd(), len)?;
        Self::map_file(file.as_fd(), len, layout)
    }

    fn check_len(layout: PageLayout) -> Result<usize, MemoryError> {
        let len = layout.count_words() * size_of::<AtomicU64>();
        if layout.is_valid() { Ok(len) } else { Err(MemoryError::Length(len)) }
    }

    fn map_file(file: BorrowedFd<'_>, len: usize, layout: PageLayout) -> Result<Self, MemoryError> {
        let mapping = Mapping::new(file, len, ProtFlags::READ | ProtFlags::WRITE)?;
        Ok(Self { mapping, layout })
    }

    /// Its words.
    pub fn words(&self) -> PageWords<'_, AtomicU64> {
        // SAFETY: mapped for reading and writing, aligned to a page, `count_words` words long; atomics
        // may be changed by the other end at any time.
        let words = unsafe {
            std::slice::from_raw_parts(
                self.mapping.start.as_ptr().cast::<AtomicU64>(),
                self.layout.count_words(),
            )
        };
        PageWords::of(words, self.layout)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_publisher_writes_is_read_at_the_other_end_which_cannot_write_it() {
        let mut slot = SlotMemory::create(10_000).unwrap();
        let file = slot.file().try_clone_to_owned().unwrap();
        let view = SlotView::map(&file, 10_000).unwrap();
        slot.bytes_mut()[9_999] = 7;
        assert_eq!((view.bytes()[9_999], view.bytes().len()), (7, 10_000));
        let writable = Mapping::new(file.as_fd(), 10_000, ProtFlags::READ | ProtFlags::WRITE);
        assert_eq!(writable.unwrap_err().kind(), io::ErrorKind::PermissionDenied);
        assert!(rustix::fs::ftruncate(&file, 0).is_err(), "its size is sealed");
        drop((slot, file));
        assert_eq!(view.bytes()[9_999], 7, "the kernel keeps it while it is mapped");
    }

    #[test]
    fn both_ends_write_the_page_of_a_link() {
        let layout = PageLayout { cells: 3, slots: 5 };
        let (near, file) = LinkPage::create(layout).unwrap();
        let far = LinkPage::map(&file, layout).unwrap();
        near.words().lend(4);
        assert!(far.words().is_held(4));
        far.words().release(4);
        assert_eq!(near.words().count_held(0..5), 0);
    }

    #[test]
    fn a_file_that_is_not_as_announced_is_refused() {
        let slot = SlotMemory::create(100).unwrap();
        let file = slot.file().try_clone_to_owned().unwrap();
        let error = SlotView::map(&file, 101).unwrap_err().to_string();
        assert_eq!(error, "a shared memory of 101 bytes was announced, and has 100");
        assert!(matches!(SlotView::map(&file, 0), Err(MemoryError::Length(0))));
        assert!(matches!(SlotView::map(&file, usize::MAX), Err(MemoryError::Length(_))));
        let plain = memfd_create("plain", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING).unwrap();
        fallocate(&plain, FallocateFlags::empty(), 0, 100).unwrap();
        assert!(matches!(SlotView::map(&plain, 100), Err(MemoryError::NotSealed)));
        let no_memory = OwnedFd::from(std::fs::File::open("/dev/null").unwrap());
        assert!(matches!(SlotView::map(&no_memory, 100), Err(MemoryError::System(_))));
        let layout = PageLayout { cells: 0, slots: 1 };
        assert!(matches!(LinkPage::map(&plain, layout), Err(MemoryError::Length(_))));
        assert!(matches!(SlotMemory::create(MAX_SLOT_LEN + 1), Err(MemoryError::Length(_))));
    }
}
