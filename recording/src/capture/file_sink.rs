//! The file behind a writer of MCAP. That changes the head of a chunk when the chunk is complete, and asks
//! for its position all the time, which would be a system call each for a buffered file.
//!
//! At a high rate the bytes go from memory to the disk directly (`O_DIRECT`), where the file system can
//! do that: a page cache takes twice the processor time, and the memory that the mission needs.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, IoSlice, Seek, SeekFrom, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::{FileExt, OpenOptionsExt};

use rustix::fs::{OFlags, fstatfs};
use rustix::io::{pwritev, retry_on_intr};

/// So many bytes are written at a time.
const BLOCK_LEN: usize = 1 << 20;
/// Without direct writes, so many bytes go to the file without a copy.
const LARGE_LEN: usize = 32 << 10;
/// What a disk takes directly begins and ends at multiples of this, in memory and in the file.
const ALIGNMENT: usize = 4096;
/// So many whole blocks wait: the head of a chunk of 1 MiB is changed while it is in memory, where the
/// message that completes the chunk is no longer than the rest of them.
const HELD_BLOCKS: usize = 2;
/// The type of a file system in memory, which has nothing but its page cache.
const TMPFS: u32 = 0x0102_1994;

/// See the module. What is gathered is in the file after [`Write::flush`].
pub(super) struct FileSink {
    file: File,
    /// The same file past the page cache, where that is possible.
    direct: Option<File>,
    /// What is gathered: whole blocks, and at the end one that is not full.
    blocks: VecDeque<Block>,
    /// Where the first block begins in the file; with direct writes at a multiple of [`ALIGNMENT`].
    begin: u64,
    /// Where the last block ends.
    end: u64,
    /// Everything before this is in the file; it lies in the first block.
    written: u64,
    /// A change of bytes before the end, and where it begins.
    patch: Option<(u64, Vec<u8>)>,
    /// Blocks to be used again.
    spare: Vec<Block>,
}

impl FileSink {
    /// Writes to an empty file.
    pub fn new(file: File) -> Self {
        Self {
            direct: open_direct(&file),
            file,
            blocks: VecDeque::new(),
            begin: 0,
            end: 0,
            written: 0,
            patch: None,
            spare: Vec::new(),
        }
    }

    /// Appends, and writes the blocks that need not wait.
    fn append(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            if self.blocks.back().is_none_or(Block::is_full) {
                self.blocks.push_back(self.spare.pop().unwrap_or_else(Block::new));
            }
            if let Some(last) = self.blocks.back_mut() {
                let taken = last.append(bytes);
                self.end += taken as u64;
                bytes = &bytes[taken..];
            }
            // A change of what only the page cache has is cheap: then none waits.
            let held = if self.direct.is_some() { HELD_BLOCKS } else { 0 };
            while self.blocks.len() > held && self.blocks.front().is_some_and(Block::is_full) {
                self.write_first()?;
            }
        }
        Ok(())
    }

    /// Writes what is gathered and `bytes` behind it, together where the system takes both.
    fn write_large(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.write_full()?;
        let unwritten = (self.written - self.begin) as usize;
        let gathered = self.blocks.front().map_or(&[][..], |block| &block.bytes()[unwritten..]);
        let pieces = [IoSlice::new(gathered), IoSlice::new(bytes)];
        let mut taken = retry_on_intr(|| pwritev(&self.file, &pieces, self.written))?;
        let mut at = self.written + taken as u64;
        for piece in [gathered, bytes] {
            let rest = &piece[taken.min(piece.len())..];
            self.file.write_all_at(rest, at)?;
            at += rest.len() as u64;
            taken = taken.saturating_sub(piece.len());
        }
        (self.begin, self.end, self.written) = (at, at, at);
        self.spare.extend(self.blocks.drain(..).map(Block::emptied));
        Ok(())
    }

    /// Writes the first block, which is full.
    fn write_first(&mut self) -> io::Result<()> {
        let Some(block) = self.blocks.pop_front() else { return Ok(()) };
        let mut is_written = false;
        if let Some(direct) = &self.direct {
            match direct.write_all_at(block.bytes(), self.begin) {
                Ok(()) => is_written = true,
                // The file system takes it only otherwise aligned, or not at all.
                Err(error) if error.kind() == io::ErrorKind::InvalidInput => self.direct = None,
                Err(error) => return Err(error),
            }
        }
        if !is_written {
            let before = (self.written - self.begin) as usize;
            self.file.write_all_at(&block.bytes()[before..], self.written)?;
        }
        self.begin += BLOCK_LEN as u64;
        self.written = self.begin;
        self.spare.push(block.emptied());
        Ok(())
    }

    fn write_full(&mut self) -> io::Result<()> {
        while self.blocks.front().is_some_and(Block::is_full) {
            self.write_first()?;
        }
        Ok(())
    }

    /// Writes all that is gathered. The end that a direct write cannot take stays in memory, too.
    fn write_gathered(&mut self) -> io::Result<()> {
        self.write_full()?;
        if let Some(last) = self.blocks.front_mut() {
            let before = (self.written - self.begin) as usize;
            self.file.write_all_at(&last.bytes()[before..], self.written)?;
            self.written = self.end;
            self.begin += last.drop_aligned() as u64;
        }
        Ok(())
    }

    /// Carries out the change, in the file and in what is gathered.
    fn apply_patch(&mut self) -> io::Result<()> {
        let Some((at, bytes)) = self.patch.take() else { return Ok(()) };
        if at + bytes.len() as u64 > self.end {
            let reason = "a change that is longer than the file";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
        }
        let in_file = usize::try_from(self.written.saturating_sub(at)).unwrap_or(usize::MAX);
        self.file.write_all_at(&bytes[..in_file.min(bytes.len())], at)?;
        // What is in both is written again with its block.
        let before = usize::try_from(self.begin.saturating_sub(at)).unwrap_or(usize::MAX);
        let mut rest = &bytes[before.min(bytes.len())..];
        let mut from = at.saturating_sub(self.begin) as usize;
        while !rest.is_empty() {
            let Some(block) = self.blocks.get_mut(from / BLOCK_LEN) else { break };
            let changed = block.change(from % BLOCK_LEN, rest);
            rest = &rest[changed..];
            from += changed;
        }
        Ok(())
    }
}

/// Opens a file a second time, to write it past the page cache.
fn open_direct(file: &File) -> Option<File> {
    if fstatfs(file).is_ok_and(|disk| disk.f_type as u32 == TMPFS) {
        return None;
    }
    let path = format!("/proc/self/fd/{}", file.as_raw_fd());
    let flags = OFlags::DIRECT.bits().cast_signed();
    OpenOptions::new().write(true).custom_flags(flags).open(path).ok()
}

/// Up to [`BLOCK_LEN`] bytes that begin at a multiple of [`ALIGNMENT`] in memory.
struct Block {
    memory: Vec<u8>,
    start: usize,
    len: usize,
}

impl Block {
    fn new() -> Self {
        let memory = vec![0; BLOCK_LEN + ALIGNMENT];
        let start = memory.as_ptr().addr().next_multiple_of(ALIGNMENT) - memory.as_ptr().addr();
        Self { memory, start, len: 0 }
    }

    fn emptied(self) -> Self {
        Self { len: 0, ..self }
    }

    fn is_full(&self) -> bool {
        self.len == BLOCK_LEN
    }

    fn bytes(&self) -> &[u8] {
        &self.memory[self.start..self.start + self.len]
    }

    /// Appends as much as there is room for; returns how much.
    fn append(&mut self, bytes: &[u8]) -> usize {
        let taken = bytes.len().min(BLOCK_LEN - self.len);
        let end = self.start + self.len;
        self.memory[end..end + taken].copy_from_slice(&bytes[..taken]);
        self.len += taken;
        taken
    }

    /// Changes bytes from `from` on, up to the end of the block; returns how many.
    fn change(&mut self, from: usize, bytes: &[u8]) -> usize {
        let changed = bytes.len().min(self.len - from);
        let from = self.start + from;
        self.memory[from..from + changed].copy_from_slice(&bytes[..changed]);
        changed
    }

    /// Drops all but what comes after the last multiple of [`ALIGNMENT`]; returns how much.
    fn drop_aligned(&mut self) -> usize {
        let dropped = self.len - self.len % ALIGNMENT;
        let from = self.start + dropped;
        self.memory.copy_within(from..self.start + self.len, self.start);
        self.len -= dropped;
        dropped
    }
}

impl Write for FileSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.patch {
            Some((_, patch)) => patch.extend_from_slice(bytes),
            None if self.direct.is_none() && bytes.len() >= LARGE_LEN => self.write_large(bytes)?,
            None => self.append(bytes)?,
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.apply_patch()?;
        self.write_gathered()
    }
}

impl Seek for FileSink {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let (here, end) = (self.stream_position()?, self.end);
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => end.checked_add_signed(by),
            SeekFrom::Current(by) => here.checked_add_signed(by),
        };
        let at = at.filter(|at| *at <= end).ok_or(io::ErrorKind::InvalidInput)?;
        if at == here && at < end {
            return Ok(at);
        }
        self.apply_patch()?;
        if at < end {
            self.patch = Some((at, Vec::new()));
        }
        Ok(at)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        Ok(match &self.patch {
            Some((at, bytes)) => at + bytes.len() as u64,
            None => self.end,
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[derive(Clone, Debug)]
    enum Step {
        Write(usize),
        Change(prop::sample::Index, usize),
        Flush,
    }

    fn step() -> impl Strategy<Value = Step> {
        let lens = prop_oneof![
            0..200_usize,
            30_000..40_000_usize,
            500_000..600_000_usize,
            2_000_000..3_000_000_usize
        ];
        prop_oneof![
            4 => lens.prop_map(Step::Write),
            2 => (any::<prop::sample::Index>(), 0..100_usize)
                .prop_map(|(at, len)| Step::Change(at, len)),
            1 => Just(Step::Flush),
        ]
    }

    /// A file on the disk of the sources: that for temporary files may be in memory.
    fn create_file() -> tempfile::NamedTempFile {
        tempfile::NamedTempFile::new_in(env!("CARGO_MANIFEST_DIR")).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn it_is_a_file_of_which_parts_are_changed(
            steps in prop::collection::vec(step(), 0..30),
            is_direct in any::<bool>(),
        ) {
            let file = create_file();
            let mut sink = FileSink::new(file.reopen().unwrap());
            if !is_direct {
                sink.direct = None;
            }
            let mut model: Vec<u8> = Vec::new();
            for (number, step) in steps.into_iter().enumerate() {
                let byte = number as u8 + 1;
                match step {
                    Step::Write(len) => {
                        sink.write_all(&vec![byte; len]).unwrap();
                        model.resize(model.len() + len, byte);
                    }
                    Step::Change(at, len) => {
                        let at = at.index(model.len() + 1);
                        let len = len.min(model.len() - at);
                        prop_assert_eq!(sink.seek(SeekFrom::Start(at as u64)).unwrap(), at as u64);
                        sink.write_all(&vec![byte; len]).unwrap();
                        prop_assert_eq!(sink.stream_position().unwrap(), (at + len) as u64);
                        prop_assert_eq!(sink.seek(SeekFrom::End(0)).unwrap(), model.len() as u64);
                        model[at..at + len].fill(byte);
                    }
                    Step::Flush => {
                        sink.flush().unwrap();
                        prop_assert!(std::fs::read(file.path()).unwrap() == model, "after a flush");
                    }
                }
                prop_assert_eq!(sink.stream_position().unwrap(), model.len() as u64);
            }
            sink.flush().unwrap();
            prop_assert!(std::fs::read(file.path()).unwrap() == model, "at the end");
        }
    }

    #[test]
    fn what_is_beyond_the_end_is_refused() {
        let mut sink = FileSink::new(tempfile::tempfile().unwrap());
        sink.write_all(b"abc").unwrap();
        assert!(sink.seek(SeekFrom::Start(4)).is_err());
        assert!(sink.seek(SeekFrom::End(-4)).is_err());
        sink.seek(SeekFrom::Start(2)).unwrap();
        sink.write_all(b"de").unwrap();
        assert!(sink.flush().is_err(), "a change that is longer than the file");
    }

    #[test]
    fn a_file_system_that_takes_no_direct_writes_gets_all_bytes() {
        let file = create_file();
        let mut sink = FileSink::new(file.reopen().unwrap());
        // Memory at odd addresses: where the disk of the sources is written directly, it refuses that.
        let misaligned = || {
            let block = Block::new();
            Block { start: block.start + 1, ..block }
        };
        sink.spare.extend(std::iter::repeat_with(misaligned).take(HELD_BLOCKS + 2));
        let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
        let bytes: Vec<u8> = (0..5 * BLOCK_LEN + 77).map(|at| at as u8).collect();
        sink.write_all(&bytes[..100]).unwrap();
        sink.flush().unwrap();
        sink.write_all(&bytes[100..]).unwrap();
        sink.flush().unwrap();
        assert!(std::fs::read(file.path()).unwrap() == bytes);
        // A disk that is full is an error, and no reason to write it otherwise.
        sink.direct = Some(full);
        assert!(sink.write_all(&bytes).is_err());
        assert!(sink.direct.is_some());
    }
}
