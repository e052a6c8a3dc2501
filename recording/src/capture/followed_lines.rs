//! The lines that are added to a file of a run, which may be renamed or replaced meanwhile.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;

/// Longest part of a line that is kept.
const MAX_LINE_LEN: usize = 64 << 10;
/// What is read at a time.
const READ_LEN: usize = 64 << 10;

/// A file of lines, as far as it was read.
pub(crate) struct FollowedLines {
    path: PathBuf,
    open: Option<File>,
    /// A line whose end has not been written yet.
    begun: Vec<u8>,
    /// Of the file that is there first, so many bytes at its end are read.
    tail_len: u64,
    has_begun: bool,
}

impl FollowedLines {
    /// Follows a file, which may not be there yet. Of what is in it, the last `tail_len` bytes are
    /// read.
    pub fn new(path: PathBuf, tail_len: u64) -> Self {
        Self { path, open: None, begun: Vec::new(), tail_len, has_begun: false }
    }

    /// Calls `take` with each line that was added, up to about `most` bytes of them. Returns how many
    /// further ones were passed over.
    pub fn read_added(&mut self, most: usize, mut take: impl FnMut(&str)) -> u64 {
        let (mut read, mut passed_over) = (0, 0);
        loop {
            if self.open.is_none() && !self.open_file() {
                return passed_over;
            }
            passed_over += self.read_open(most, &mut read, &mut take).unwrap_or_default();
            if !self.was_replaced() {
                return passed_over;
            }
            // What was written to it before it was renamed has been read.
            (self.open, self.begun) = (None, Vec::new());
        }
    }

    fn open_file(&mut self) -> bool {
        let Ok(mut file) = File::open(&self.path) else {
            // The next one is read from its beginning.
            self.has_begun = true;
            return false;
        };
        if !std::mem::replace(&mut self.has_begun, true) {
            let len = file.metadata().map_or(0, |about| about.len());
            let from = len.saturating_sub(self.tail_len);
            if from > 0 && file.seek(SeekFrom::Start(from - 1)).is_ok() {
                // The rest of the line before.
                let mut byte = [0];
                while matches!(file.read(&mut byte), Ok(1)) && byte != *b"\n" {}
            }
        }
        self.open = Some(file);
        true
    }

    fn was_replaced(&self) -> bool {
        let (Some(file), Ok(there)) = (&self.open, std::fs::metadata(&self.path)) else {
            return false;
        };
        file.metadata().is_ok_and(|open| (open.dev(), open.ino()) != (there.dev(), there.ino()))
    }

    fn read_open(
        &mut self,
        most: usize,
        read: &mut usize,
        take: &mut impl FnMut(&str),
    ) -> io::Result<u64> {
        let Some(file) = &mut self.open else { return Ok(0) };
        let len = file.metadata()?.len();
        if len < file.stream_position()? {
            file.seek(SeekFrom::Start(0))?;
            self.begun.clear();
        }
        let mut passed_over = 0;
        let mut bytes = vec![0; READ_LEN];
        loop {
            let count = file.read(&mut bytes)?;
            if count == 0 {
                return Ok(passed_over);
            }
            for part in bytes[..count].split_inclusive(|byte| *byte == b'\n') {
                let room = MAX_LINE_LEN.saturating_sub(self.begun.len());
                self.begun.extend(part.iter().take(room));
                if part.last() != Some(&b'\n') {
                    continue;
                }
                let line = String::from_utf8_lossy(&self.begun);
                let line = line.trim_end_matches('\n');
                *read += line.len();
                if *read > most {
                    passed_over += 1;
                } else {
                    take(line);
                }
                self.begun.clear();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Write;

    use super::*;

    fn read(lines: &mut FollowedLines, most: usize) -> (Vec<String>, u64) {
        let mut taken = Vec::new();
        let passed_over = lines.read_added(most, |line| taken.push(line.to_owned()));
        (taken, passed_over)
    }

    #[test]
    fn lines_are_read_once_also_across_a_renamed_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("all.log");
        fs::write(&path, "one\ntwo\nthr").unwrap();
        // The last line that is whole within the last bytes.
        let mut lines = FollowedLines::new(path.clone(), 8);
        assert_eq!(read(&mut lines, 100), (vec!["two".into()], 0));
        let append = |text: &str| {
            let mut file = fs::OpenOptions::new().append(true).open(&path).unwrap();
            file.write_all(text.as_bytes()).unwrap();
        };
        append("ee\nfour\n");
        fs::rename(&path, folder.path().join("all.log.1")).unwrap();
        fs::write(&path, "five\nsix\nseven\n").unwrap();
        let (taken, passed_over) = read(&mut lines, 14);
        assert_eq!((taken.join(" "), passed_over), ("three four five".into(), 2));
        append("eight\n");
        assert_eq!(read(&mut lines, 100), (vec!["eight".into()], 0));
    }

    #[test]
    fn a_file_that_appears_later_is_read_from_its_beginning() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("executive.journal");
        let mut lines = FollowedLines::new(path.clone(), 0);
        assert_eq!(read(&mut lines, 100), (vec![], 0));
        fs::write(&path, "first\n").unwrap();
        assert_eq!(read(&mut lines, 100), (vec!["first".into()], 0));
    }
}
