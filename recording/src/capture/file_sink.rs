//! The file behind a writer of MCAP. That changes the head of a chunk when the chunk is complete, and asks
//! for its position all the time, which would be a system call each for a buffered file.

use std::fs::File;
use std::io::{self, IoSlice, Seek, SeekFrom, Write};
use std::os::unix::fs::FileExt;

/// A write of so many bytes goes to the file without a copy; shorter ones are gathered.
const LARGE_LEN: usize = 32 << 10;
/// So many gathered bytes are written.
const GATHERED_LEN: usize = 512 << 10;

/// See the module. What is gathered is in the file after [`Write::flush`].
pub(super) struct FileSink {
    file: File,
    /// How long the file is.
    written: u64,
    /// What follows that.
    gathered: Vec<u8>,
    /// A change of bytes before the end, and where it begins.
    patch: Option<(u64, Vec<u8>)>,
}

impl FileSink {
    /// Writes to an empty file.
    pub fn new(file: File) -> Self {
        Self { file, written: 0, gathered: Vec::new(), patch: None }
    }

    fn end(&self) -> u64 {
        self.written + self.gathered.len() as u64
    }

    fn write_gathered(&mut self) -> io::Result<()> {
        self.file.write_all(&self.gathered)?;
        self.written += self.gathered.len() as u64;
        self.gathered.clear();
        Ok(())
    }

    /// Writes what is gathered and `bytes` behind it, together where the system takes both.
    fn write_large(&mut self, bytes: &[u8]) -> io::Result<()> {
        let pieces = [IoSlice::new(&self.gathered), IoSlice::new(bytes)];
        let taken = loop {
            match self.file.write_vectored(&pieces) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                taken => break taken?,
            }
        };
        let of_gathered = taken.min(self.gathered.len());
        self.gathered.drain(..of_gathered);
        self.written += of_gathered as u64;
        self.write_gathered()?;
        let rest = &bytes[taken - of_gathered..];
        self.file.write_all(rest)?;
        self.written += bytes.len() as u64;
        Ok(())
    }

    /// Carries out the change, in the file and in what is gathered.
    fn apply_patch(&mut self) -> io::Result<()> {
        let Some((at, bytes)) = self.patch.take() else { return Ok(()) };
        if at + bytes.len() as u64 > self.end() {
            let reason = "a change that is longer than the file";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
        }
        let in_file = usize::try_from(self.written.saturating_sub(at)).unwrap_or(usize::MAX);
        let (in_file, in_gathered) = bytes.split_at(in_file.min(bytes.len()));
        self.file.write_all_at(in_file, at)?;
        let from = at.saturating_sub(self.written) as usize;
        self.gathered[from..from + in_gathered.len()].copy_from_slice(in_gathered);
        Ok(())
    }
}

impl Write for FileSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some((_, patch)) = &mut self.patch {
            patch.extend_from_slice(bytes);
        } else if bytes.len() >= LARGE_LEN {
            self.write_large(bytes)?;
        } else {
            self.gathered.extend_from_slice(bytes);
            if self.gathered.len() >= GATHERED_LEN {
                self.write_gathered()?;
            }
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
        let (here, end) = (self.stream_position()?, self.end());
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
            None => self.end(),
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
        let lens = prop_oneof![0..200_usize, 30_000..40_000_usize, 500_000..600_000_usize];
        prop_oneof![
            4 => lens.prop_map(Step::Write),
            2 => (any::<prop::sample::Index>(), 0..100_usize)
                .prop_map(|(at, len)| Step::Change(at, len)),
            1 => Just(Step::Flush),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn it_is_a_file_of_which_parts_are_changed(steps in prop::collection::vec(step(), 0..30)) {
            let file = tempfile::NamedTempFile::new().unwrap();
            let mut sink = FileSink::new(file.reopen().unwrap());
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
}
