//! The files of a recording: one, or several in turn, each complete in itself.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Seek};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_recording::{Compression, RecordingWriter, TappedMessage, WriteError};

/// When the next file begins.
#[derive(Clone, Copy, Debug, Default)]
pub struct SplitLimits {
    /// When the present one has so many bytes.
    pub len: Option<u64>,
    /// After this time.
    pub time: Option<Duration>,
}

/// What is the same in each file.
pub struct FileContents {
    /// What is known of the recording.
    pub about: BTreeMap<String, String>,
    /// The files in it, by name.
    pub files: Vec<(String, Vec<u8>)>,
    /// How it is compressed.
    pub compression: Compression,
}

/// Writes messages to the present file.
pub struct SplitWriter {
    path: PathBuf,
    contents: FileContents,
    limits: SplitLimits,
    present: PresentFile,
    /// The files that are complete.
    finished: Vec<PathBuf>,
    finished_len: u64,
    /// Messages that do not have the layout of their type.
    pub unreadable: u64,
    written: u64,
}

struct PresentFile {
    path: PathBuf,
    /// The same file, to measure and to sync it.
    file: File,
    writer: RecordingWriter<BufWriter<File>>,
    begun: Instant,
}

impl SplitWriter {
    /// Begins the first file, which must not be there yet.
    pub fn begin(path: PathBuf, contents: FileContents, limits: SplitLimits) -> Result<Self> {
        let present = PresentFile::create(&path, &contents)?;
        Ok(Self {
            path,
            contents,
            limits,
            present,
            finished: Vec::new(),
            finished_len: 0,
            unreadable: 0,
            written: 0,
        })
    }

    /// Writes a message.
    pub fn write(&mut self, message: &TappedMessage) -> Result<()> {
        let writer = &mut self.present.writer;
        let written = writer
            .add_output(&message.data, &message.output_type)
            .and_then(|output| writer.write(output, &message.head, &message.payload));
        match written {
            Ok(()) => self.written += 1,
            Err(WriteError::File(error)) => {
                return Err(error).context(self.present.path.display().to_string());
            }
            Err(_) => self.unreadable += 1,
        }
        Ok(())
    }

    /// Writes what waits to the disk, and begins the next file if it is due.
    pub fn flush(&mut self) -> Result<()> {
        let name = self.present.path.display().to_string();
        self.present.writer.flush().context(name.clone())?;
        self.present.file.sync_data().context(name)?;
        let is_long = self.limits.len.is_some_and(|most| self.present.len() >= most);
        let is_old = self.limits.time.is_some_and(|most| self.present.begun.elapsed() >= most);
        if is_long || is_old {
            let path = number_path(&self.path, self.finished.len() + 2);
            let next = PresentFile::create(&path, &self.contents)?;
            let last = std::mem::replace(&mut self.present, next);
            let (path, len) = last.finish()?;
            self.finished.push(path);
            self.finished_len += len;
        }
        Ok(())
    }

    /// How many messages have been written, and how many bytes.
    pub fn count_written(&self) -> (u64, u64) {
        (self.written, self.finished_len + self.present.len())
    }

    /// Completes the last file. Returns all of them, and their length.
    pub fn finish(self) -> Result<(Vec<PathBuf>, u64)> {
        let (mut files, len) = (self.finished, self.finished_len);
        let (path, last_len) = self.present.finish()?;
        files.push(path);
        Ok((files, len + last_len))
    }
}

impl PresentFile {
    fn create(path: &Path, contents: &FileContents) -> Result<Self> {
        let file = File::create_new(path)
            .with_context(|| format!("{} cannot be created", path.display()))?;
        let sink = BufWriter::with_capacity(1 << 20, file.try_clone()?);
        let mut writer = RecordingWriter::new(sink, contents.compression, contents.about.clone())?;
        for (name, bytes) in &contents.files {
            writer.add_file(name, "application/xml", bytes)?;
        }
        writer.flush()?;
        Ok(Self { path: path.into(), file, writer, begun: Instant::now() })
    }

    /// Completes it. Returns its path and its length.
    fn finish(self) -> Result<(PathBuf, u64)> {
        let name = self.path.display().to_string();
        self.writer.finish().context(name.clone())?;
        self.file.sync_all().context(name)?;
        Ok((self.path, self.file.metadata().map_or(0, |it| it.len())))
    }

    fn len(&self) -> u64 {
        (&self.file).stream_position().unwrap_or_default()
    }
}

/// `office.mcap` becomes `office-2.mcap`.
fn number_path(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let point = if extension.is_empty() { "" } else { "." };
    path.with_file_name(format!("{stem}-{number}{point}{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn further_files_have_numbers_before_the_extension() {
        let path = |text: &str| number_path(Path::new(text), 3).display().to_string();
        assert_eq!([path("a/b.mcap"), path("b")], ["a/b-3.mcap", "b-3"]);
    }
}
