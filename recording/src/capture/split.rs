//! The files of a recording: one, or several in turn, each complete in itself.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::time::{Duration, Instant};

use super::fault::RecorderError;
use super::file_sink::FileSink;
use super::repeated_values::RepeatedValues;
use crate::summary::BEGIN_KEY;
use crate::taps::TappedMessage;
use crate::writer::{Compression, RecordingWriter, WriteError};

/// Most names that are tried for a recording of its own.
const MAX_NUMBER: usize = 1_000_000;
const XML: &str = "application/xml";

/// When the next file begins.
#[derive(Clone, Copy, Debug, Default)]
pub struct SplitLimits {
    /// When the present one has so many bytes.
    pub len: Option<u64>,
    /// After this time.
    pub time: Option<Duration>,
}

/// Where a recording is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RecordingPath {
    /// Here, where nothing may be yet. Further files have a number.
    New(PathBuf),
    /// Here, or under the next number that is free: `drive.mcap`, `drive-2.mcap`, …
    NextFree(PathBuf),
}

/// What is the same in each file.
pub(crate) struct FileContents {
    /// What is known of the recording.
    pub about: BTreeMap<String, String>,
    /// The files in it, by name.
    pub files: Vec<(String, Vec<u8>)>,
    /// How it is compressed.
    pub compression: Compression,
}

/// Writes messages to the present file.
pub(crate) struct SplitWriter {
    path: RecordingPath,
    contents: FileContents,
    limits: SplitLimits,
    present: PresentFile,
    /// The files that are complete.
    finished: Vec<PathBuf>,
    finished_len: u64,
    repeated: RepeatedValues,
    /// Messages that do not have the layout of their type.
    pub unreadable: u64,
    pub written: u64,
}

struct PresentFile {
    path: PathBuf,
    /// The same file, to measure and to sync it.
    file: File,
    writer: RecordingWriter<FileSink>,
    begun: Instant,
    syncs: BackgroundSyncs,
}

impl SplitWriter {
    /// Begins the first file.
    ///
    /// # Errors
    /// If it cannot be written, or is there already.
    pub fn begin(
        path: RecordingPath,
        contents: FileContents,
        limits: SplitLimits,
    ) -> Result<Self, RecorderError> {
        let present = PresentFile::create(path.create_next(0)?, &contents)?;
        Ok(Self {
            path,
            contents,
            limits,
            present,
            finished: Vec::new(),
            finished_len: 0,
            repeated: RepeatedValues::default(),
            unreadable: 0,
            written: 0,
        })
    }

    /// The present file.
    pub fn path(&self) -> &Path {
        &self.present.path
    }

    /// Writes a message.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self, message: &TappedMessage) -> Result<(), RecorderError> {
        match self.present.write(message) {
            Ok(()) => {
                self.written += 1;
                if self.limits.can_split() {
                    self.repeated.take(message);
                }
            }
            Err(error @ WriteError::File(_)) => return Err(self.present.fail(error)),
            Err(_) => self.unreadable += 1,
        }
        Ok(())
    }

    /// Adds the files of a version of the system's file that is in force since `stamp_s`. Further
    /// files of the recording begin with them.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add_version(
        &mut self,
        stamp_s: f64,
        number: u64,
        files: Vec<(String, Vec<u8>)>,
    ) -> Result<(), RecorderError> {
        for (name, bytes) in &files {
            let name = format!("versions/{number}/{name}");
            let added = self.present.writer.add_file_at(stamp_s, &name, XML, bytes);
            added.map_err(|error| self.present.fail(error))?;
        }
        self.contents.files = files;
        Ok(())
    }

    /// Passes on what waits to the file, lets it be synced, and begins the next file if it is due:
    /// at the system time `now_s`, with the values that hold then.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn flush(&mut self, now_s: f64) -> Result<(), RecorderError> {
        self.present.flush()?;
        let is_long = self.limits.len.is_some_and(|most| self.present.len() >= most);
        let is_old = self.limits.time.is_some_and(|most| self.present.begun.elapsed() >= most);
        if is_long || is_old {
            let created = self.path.create_next(self.finished.len() + 1)?;
            self.contents.about.insert(BEGIN_KEY.into(), now_s.to_string());
            let mut next = PresentFile::create(created, &self.contents)?;
            for message in self.repeated.messages() {
                next.write(message).map_err(|error| next.fail(error))?;
            }
            let last = std::mem::replace(&mut self.present, next);
            let (path, len) = last.finish()?;
            self.finished.push(path);
            self.finished_len += len;
        }
        Ok(())
    }

    /// Completes the last file. Returns all of them, and their length.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(self) -> Result<(Vec<PathBuf>, u64), RecorderError> {
        let (mut files, len) = (self.finished, self.finished_len);
        let (path, last_len) = self.present.finish()?;
        files.push(path);
        Ok((files, len + last_len))
    }
}

impl SplitLimits {
    fn can_split(&self) -> bool {
        self.len.is_some() || self.time.is_some()
    }
}

impl RecordingPath {
    /// The path as it was given.
    pub fn as_path(&self) -> &Path {
        let (Self::New(path) | Self::NextFree(path)) = self;
        path
    }

    /// Creates the next file, after so many others of this recording.
    fn create_next(&self, before: usize) -> Result<(PathBuf, File), RecorderError> {
        let first = self.as_path();
        let fail = |path: &Path, reason| RecorderError::Create { path: path.into(), reason };
        let numbers = match self {
            Self::New(_) => before + 1..=before + 1,
            Self::NextFree(_) => before + 1..=MAX_NUMBER,
        };
        for number in numbers {
            let path = if number == 1 { first.into() } else { number_path(first, number) };
            match File::create_new(&path) {
                Ok(file) => return Ok((path, file)),
                Err(error)
                    if matches!(self, Self::NextFree(_))
                        && error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(fail(&path, error)),
            }
        }
        Err(fail(first, io::ErrorKind::AlreadyExists.into()))
    }
}

impl PresentFile {
    fn create(
        (path, file): (PathBuf, File),
        contents: &FileContents,
    ) -> Result<Self, RecorderError> {
        let fail = |error: WriteError| RecorderError::Write { path: path.clone(), reason: error };
        let io_fail =
            |error: io::Error| RecorderError::Create { path: path.clone(), reason: error };
        let sink = FileSink::new(file.try_clone().map_err(io_fail)?);
        let mut writer = RecordingWriter::new(sink, contents.compression, contents.about.clone())
            .map_err(fail)?;
        for (name, bytes) in &contents.files {
            writer.add_file(name, XML, bytes).map_err(fail)?;
        }
        writer.flush().map_err(fail)?;
        let syncs = BackgroundSyncs::start(file.try_clone().map_err(io_fail)?).map_err(io_fail)?;
        Ok(Self { path, file, writer, begun: Instant::now(), syncs })
    }

    fn write(&mut self, message: &TappedMessage) -> Result<(), WriteError> {
        let output = self.writer.add_output(&message.data, &message.output_type)?;
        self.writer.write(output, &message.head, &message.payload)
    }

    fn flush(&mut self) -> Result<(), RecorderError> {
        let flushed = self.writer.flush();
        flushed.map_err(|error| self.fail(error))?;
        self.syncs.request().map_err(|error| self.fail(WriteError::File(error.into())))
    }

    /// Completes it. Returns its path and its length.
    fn finish(self) -> Result<(PathBuf, u64), RecorderError> {
        let path = self.path;
        let fail = |reason| RecorderError::Write { path: path.clone(), reason };
        self.writer.finish().map_err(fail)?;
        self.file.sync_all().map_err(|error| fail(WriteError::File(error.into())))?;
        let len = self.file.metadata().map_or(0, |it| it.len());
        Ok((path, len))
    }

    fn fail(&self, reason: WriteError) -> RecorderError {
        RecorderError::Write { path: self.path.clone(), reason }
    }

    fn len(&self) -> u64 {
        self.file.metadata().map_or(0, |it| it.len())
    }
}

/// Syncs a file on a thread of its own: a disk that takes a second for it must not keep the recorder
/// from taking messages.
struct BackgroundSyncs {
    requests: SyncSender<()>,
    results: Receiver<io::Result<()>>,
}

impl BackgroundSyncs {
    fn start(file: File) -> io::Result<Self> {
        let (requests, requested) = mpsc::sync_channel::<()>(1);
        let (done, results) = mpsc::channel();
        let run = move || {
            while requested.recv().is_ok() {
                if done.send(file.sync_data()).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("record-sync".into()).spawn(run)?;
        Ok(Self { requests, results })
    }

    /// Requests a sync, if none waits already.
    ///
    /// # Errors
    /// That of an earlier one.
    fn request(&self) -> io::Result<()> {
        self.results.try_iter().collect::<io::Result<()>>()?;
        // One that waits covers this one, too.
        let _ = self.requests.try_send(());
        Ok(())
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
    use armor_sdk::messages::Number;
    use armor_wire::codec;
    use armor_wire::message::WireType;

    use super::*;
    use crate::copy::{CopiedPart, copy_recordings};
    use crate::head::MessageHead;
    use crate::reader::Recording;
    use crate::trail::{PARAMETERS, RecordedParameter};
    use crate::writer::{OutputType, RecordingForm};

    #[test]
    fn further_files_have_numbers_before_the_extension() {
        let path = |text: &str| number_path(Path::new(text), 3).display().to_string();
        assert_eq!([path("a/b.mcap"), path("b")], ["a/b-3.mcap", "b-3"]);
    }

    #[test]
    fn a_recording_replaces_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        let next = RecordingPath::NextFree(path.clone());
        let names: Vec<_> = (0..3)
            .map(|_| next.create_next(0).unwrap().0.file_name().unwrap().to_owned())
            .collect();
        assert_eq!(names, ["a.mcap", "a-2.mcap", "a-3.mcap"]);
        assert!(RecordingPath::New(path).create_next(0).is_err());
        assert_eq!(next.create_next(1).unwrap().0, folder.path().join("a-4.mcap"));
    }

    fn message(data: &str, latched: bool, sequence: u64, payload: Vec<u8>) -> TappedMessage {
        let schema = match data {
            PARAMETERS => RecordedParameter::schema(),
            _ => Number::schema(),
        };
        let output_type = OutputType { name: data.into(), schema: schema.to_string(), latched };
        let head = MessageHead { sequence, stamp_s: sequence as f64, instance: 1, lost: 0 };
        let payload = payload.into();
        TappedMessage { data: data.into(), output_type: output_type.into(), head, payload }
    }

    fn number(data: &str, latched: bool, sequence: u64) -> TappedMessage {
        let payload = codec::encode(&Number { data: sequence as f64 }).unwrap();
        message(data, latched, sequence, payload)
    }

    fn parameter(sequence: u64, name: &str, value: &str) -> TappedMessage {
        let (parameter, value) = (name.to_owned(), value.to_owned());
        let recorded = RecordedParameter { parameter, value, ..RecordedParameter::default() };
        message(PARAMETERS, false, sequence, codec::encode(&recorded).unwrap())
    }

    fn sequences(path: &Path) -> Vec<(String, u64)> {
        let mut recording = Recording::open(path).unwrap();
        let messages = std::iter::from_fn(|| recording.next_message().unwrap());
        messages.map(|message| (message.data, message.head.sequence)).collect()
    }

    #[test]
    fn each_file_begins_with_the_values_that_hold_and_together_they_have_each_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = RecordingPath::New(folder.path().join("a.mcap"));
        let compression = Compression::None;
        let contents = FileContents { about: BTreeMap::new(), files: Vec::new(), compression };
        let limits = SplitLimits { len: Some(1), time: None };
        let mut writer = SplitWriter::begin(path, contents, limits).unwrap();
        for message in [
            parameter(0, "speed", "1"),
            parameter(1, "turn", "2"),
            number("a.map", true, 2),
            number("a.map", true, 3),
            number("a.pose", false, 4),
            parameter(5, "speed", "3"),
        ] {
            writer.write(&message).unwrap();
        }
        writer.flush(6.0).unwrap();
        writer.write(&number("a.pose", false, 7)).unwrap();
        let (files, _) = writer.finish().unwrap();
        let [first, second] = &files[..] else { panic!("{files:?}") };
        let named = |it: &[(&str, u64)]| -> Vec<(String, u64)> {
            it.iter().map(|(data, sequence)| ((*data).to_owned(), *sequence)).collect()
        };
        let repeated = [(PARAMETERS, 1), ("a.map", 3), (PARAMETERS, 5), ("a.pose", 7)];
        assert_eq!(sequences(second), named(&repeated));
        assert_eq!(Recording::open(second).unwrap().summary().begin_s(), Some(6.0));

        let sink = File::create(folder.path().join("all.mcap")).unwrap();
        let (paths, all) = ([first.as_path(), second.as_path()], CopiedPart::default());
        copy_recordings(&paths, &all, sink, compression, RecordingForm::Armor).unwrap();
        let mut each = sequences(first);
        each.push(("a.pose".into(), 7));
        assert_eq!(sequences(&folder.path().join("all.mcap")), each);
    }
}
