//! Lines into files: one per process, and `all.log`. A file that grows too large is renamed to
//! `NAME.log.1`, and the oldest of those is removed. So are the oldest of all processes, if together
//! they take too much of the disk.

use std::collections::HashMap;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use armor_files::{create_unlinked_folder, open_own_file};

use super::render::Dated;
use super::{LogLevel, RunLog};

/// Length at which a file is renamed and another one begins, in bytes: what an editor still opens.
const MAX_FILE_LEN: u64 = 32 << 20;
/// Number of renamed files that are kept of each.
const KEPT_FILES: u32 = 3;
/// Bytes that are written together.
const WRITE_LEN: usize = 32 << 10;
/// Most bytes of all renamed files of a run. The journal and the maps are on the same disk.
const MAX_RENAMED_LEN: u64 = 1 << 30;

/// What happens to the files of an earlier run in the same folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EarlierLogs {
    /// They are replaced: this is another run.
    Replace,
    /// They continue: this run continues the earlier one.
    Append,
}

/// The files that are open.
pub struct LogFiles {
    directory: PathBuf,
    earlier: EarlierLogs,
    all: Target,
    of: HashMap<Arc<str>, Target>,
}

/// A file, or the one that could not be opened.
struct Target {
    path: PathBuf,
    file: Option<File>,
    /// Whole lines that are not written yet, and their number.
    waiting: String,
    waiting_lines: u64,
    /// Its length, with what waits.
    len: u64,
    max_len: u64,
    /// Lines that could not be written since the last one that could, and why.
    lost: u64,
    failure: Option<String>,
    /// The failure was reported.
    is_reported: bool,
}

impl LogFiles {
    /// Makes the folder and `all.log`.
    ///
    /// # Errors
    /// If either cannot be made, or the folder is a symbolic link.
    pub fn create(directory: &Path, earlier: EarlierLogs) -> Result<Self> {
        create_unlinked_folder(directory).with_context(|| {
            format!("the folder {} cannot be used for logs", directory.display())
        })?;
        let all = directory.join("all.log");
        let all = Target::open(all.clone(), earlier, MAX_FILE_LEN)
            .with_context(|| format!("the file {} cannot be written", all.display()))?;
        Ok(Self { directory: directory.into(), earlier, all, of: HashMap::new() })
    }

    /// Writes what comes until the end; what waits is on disk before waiting for more.
    pub fn write_all(mut self, log: &RunLog) {
        while let Some((lines, left_out)) = log.files.take_lines() {
            let mut has_renamed = false;
            for line in &lines {
                let text = Dated(line).to_string();
                has_renamed |= self.all.write(&text);
                let (directory, earlier) = (&self.directory, self.earlier);
                has_renamed |= self
                    .of
                    .entry(line.name.clone())
                    .or_insert_with(|| {
                        let path = directory.join(format!("{}.log", line.name));
                        Target::open(path.clone(), earlier, MAX_FILE_LEN)
                            .unwrap_or_else(|_| Target::unusable(path))
                    })
                    .write(&text);
            }
            if left_out > 0 {
                self.all.write(&format!("{left_out} lines were left out: the disk is too slow"));
            }
            for target in self.of.values_mut().chain([&mut self.all]) {
                target.flush(log);
            }
            if has_renamed {
                let removed = remove_oldest(&self.directory, MAX_RENAMED_LEN);
                if !removed.is_empty() {
                    let text = format!(
                        "{} removed: the renamed logs of this run took more than {} MiB",
                        removed.join(", "),
                        MAX_RENAMED_LEN >> 20
                    );
                    log.report("launcher", LogLevel::Info, text);
                }
            }
        }
    }
}

/// Removes renamed logs, the oldest first, until those that are left take at most `max_len` bytes.
/// Returns the names of the removed ones.
fn remove_oldest(directory: &Path, max_len: u64) -> Vec<String> {
    let Ok(entries) = fs::read_dir(directory) else { return Vec::new() };
    let is_renamed = |name: &str| {
        let number = name.rsplit_once(".log.").map(|(_, number)| number);
        number.is_some_and(|number| number.parse::<u32>().is_ok())
    };
    let mut renamed: Vec<_> = entries
        .filter_map(|entry| {
            let entry = entry.ok()?;
            let name = entry.file_name().into_string().ok().filter(|name| is_renamed(name))?;
            let metadata = entry.metadata().ok()?;
            Some((metadata.modified().ok()?, name, metadata.len()))
        })
        .collect();
    // Equally old ones of one process: the higher number is older.
    renamed.sort_by(|a, b| (a.0, &b.1).cmp(&(b.0, &a.1)));
    let mut len: u64 = renamed.iter().map(|(_, _, len)| len).sum();
    let mut removed = Vec::new();
    for (_, name, own_len) in renamed {
        if len <= max_len {
            break;
        }
        if fs::remove_file(directory.join(&name)).is_ok() {
            len -= own_len;
            removed.push(name);
        }
    }
    removed
}

/// Creates a log in place of the one there.
fn create_log(path: &Path) -> io::Result<File> {
    let file = open_own_file(path, OpenOptions::new().append(true))?;
    file.set_len(0)?;
    Ok(file)
}

impl Target {
    fn open(path: PathBuf, earlier: EarlierLogs, max_len: u64) -> io::Result<Self> {
        let file = match earlier {
            EarlierLogs::Replace => {
                for number in 1..=KEPT_FILES {
                    // Of an earlier run; there is rarely one.
                    let _ = fs::remove_file(numbered(&path, number));
                }
                create_log(&path)?
            }
            EarlierLogs::Append => open_own_file(&path, OpenOptions::new().append(true))?,
        };
        let len = file.metadata()?.len();
        Ok(Self { file: Some(file), len, max_len, ..Self::unusable(path) })
    }

    fn unusable(path: PathBuf) -> Self {
        Self {
            path,
            file: None,
            waiting: String::new(),
            waiting_lines: 0,
            len: 0,
            max_len: MAX_FILE_LEN,
            lost: 0,
            failure: None,
            is_reported: false,
        }
    }

    /// Writes a line. Returns whether the file was renamed before.
    fn write(&mut self, line: &str) -> bool {
        let len = line.len() as u64 + 1;
        let is_full = self.len > 0 && self.len + len > self.max_len;
        if is_full {
            self.rotate();
        }
        self.waiting.push_str(line);
        self.waiting.push('\n');
        self.waiting_lines += 1;
        self.len += len;
        if self.waiting.len() >= WRITE_LEN {
            self.write_waiting();
        }
        is_full
    }

    /// Writes what waits, all of it or nothing: lines stay whole, and those that are lost are counted.
    fn write_waiting(&mut self) {
        let (waiting, lines) = (std::mem::take(&mut self.waiting), self.waiting_lines);
        self.waiting_lines = 0;
        if lines == 0 {
            return;
        }
        let note = match (&self.failure, self.lost) {
            (Some(failure), 1..) => format!("{} lines are lost: {failure}\n", self.lost),
            _ => String::new(),
        };
        let before = self.len - waiting.len() as u64;
        let written = match &mut self.file {
            Some(file) => file.write_all(format!("{note}{waiting}").as_bytes()).inspect_err(|_| {
                let _ = file.set_len(before);
            }),
            None => Err(io::Error::other("it could not be opened")),
        };
        match written {
            Ok(()) => self.len += note.len() as u64,
            Err(error) => {
                self.len = before;
                self.lost += lines;
                self.failure = Some(error.to_string());
                return;
            }
        }
        if self.lost > 0 {
            self.failure = None;
        }
    }

    /// Renames the file and begins another one. A file that cannot be renamed grows on.
    fn rotate(&mut self) {
        self.write_waiting();
        for number in (1..KEPT_FILES).rev() {
            let _ = fs::rename(numbered(&self.path, number), numbered(&self.path, number + 1));
        }
        let begun =
            fs::rename(&self.path, numbered(&self.path, 1)).and_then(|()| create_log(&self.path));
        match begun {
            Ok(file) => (self.file, self.len) = (Some(file), 0),
            Err(_) => self.max_len = u64::MAX,
        }
    }

    /// Writes what waits, and reports when lines begin to be lost, and when they are written again.
    fn flush(&mut self, log: &RunLog) {
        self.write_waiting();
        let path = self.path.display();
        match &self.failure {
            Some(failure) if !self.is_reported => {
                let text = format!("lines are lost: {path}: {failure}");
                log.report("launcher", LogLevel::Error, text);
                self.is_reported = true;
            }
            None if self.lost > 0 => {
                let text = format!("{path} is written again; {} lines are lost", self.lost);
                log.report("launcher", LogLevel::Info, text);
                (self.lost, self.is_reported) = (0, false);
            }
            _ => {}
        }
    }
}

/// Returns the path of a renamed file: `NAME.log.1`.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(format!(".{number}"));
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;

    fn read(path: &Path) -> String {
        fs::read_to_string(path).unwrap_or_default()
    }

    #[test]
    fn logs_are_not_written_into_a_linked_folder() {
        let scratch = ScratchFolder::new("linked-logs");
        let (logs, there) = (scratch.path().join("logs"), scratch.path().join("there"));
        fs::create_dir(&there).expect("writable");
        std::os::unix::fs::symlink(&there, &logs).expect("a link");
        let error = LogFiles::create(&logs, EarlierLogs::Replace).err().expect("refused");
        let text = format!("{error:#}");
        assert!(text.contains("logs cannot be used") && text.contains("remove the link"), "{text}");
        assert_eq!(fs::read_dir(&there).expect("readable").count(), 0);
        fs::remove_file(&logs).expect("removable");
        assert!(LogFiles::create(&logs, EarlierLogs::Replace).is_ok());
        assert!(logs.join("all.log").is_file());
    }

    #[test]
    fn a_file_that_grows_is_renamed_and_the_oldest_is_removed() {
        let scratch = ScratchFolder::new("rotation");
        let path = scratch.path().join("laser.log");
        let mut target = Target::open(path.clone(), EarlierLogs::Replace, 20).expect("a file");
        for number in 0..11 {
            target.write(&format!("line {number:03}"));
        }
        target.write_waiting();
        assert_eq!(read(&path), "line 010\n");
        assert_eq!(read(&numbered(&path, 1)), "line 008\nline 009\n");
        assert_eq!(read(&numbered(&path, 3)), "line 004\nline 005\n");
        assert!(!numbered(&path, 4).exists());
    }

    #[test]
    fn lines_that_cannot_be_written_are_counted_and_the_others_stay_whole() {
        let scratch = ScratchFolder::new("lost-lines");
        let path = scratch.path().join("laser.log");
        let mut target = Target::open(path.clone(), EarlierLogs::Replace, 1000).expect("a file");
        target.write("first");
        target.write_waiting();
        // Cannot be written, as on a full disk.
        let good = target.file.replace(File::open(&path).expect("readable"));
        for line in ["second", "third", "fourth"] {
            target.write(line);
            target.write_waiting();
        }
        assert_eq!((target.lost, target.len), (3, 6));
        target.file = good;
        target.write("fifth");
        target.write_waiting();
        let text = read(&path);
        assert!(text.starts_with("first\n3 lines are lost: "), "{text}");
        assert!(text.ends_with("\nfifth\n") && target.failure.is_none(), "{text}");
        assert_eq!(target.len, text.len() as u64);
    }

    #[test]
    fn the_oldest_renamed_files_make_room() {
        let scratch = ScratchFolder::new("make-room");
        let logs = ["laser.log", "laser.log.2", "laser.log.1", "all.log.1", "all.log", "notes.txt"];
        for (age, name) in logs.into_iter().enumerate() {
            let path = scratch.path().join(name);
            fs::write(&path, "0123456789").expect("writable");
            let time = std::time::UNIX_EPOCH + std::time::Duration::from_secs(1000 + age as u64);
            File::options()
                .write(true)
                .open(path)
                .and_then(|file| file.set_modified(time))
                .expect("ours");
        }
        assert!(remove_oldest(scratch.path(), 30).is_empty(), "they are just short enough");
        assert_eq!(remove_oldest(scratch.path(), 19), ["laser.log.2", "laser.log.1"]);
        for name in ["laser.log", "all.log.1", "all.log", "notes.txt"] {
            assert!(scratch.path().join(name).exists(), "{name}");
        }
    }

    #[test]
    fn a_run_that_continues_appends_and_another_run_replaces() {
        let scratch = ScratchFolder::new("append");
        let path = scratch.path().join("all.log");
        for (earlier, text) in [
            (EarlierLogs::Replace, "first"),
            (EarlierLogs::Append, "second"),
            (EarlierLogs::Append, "third"),
        ] {
            let mut target = Target::open(path.clone(), earlier, 1000).expect("a file");
            target.write(text);
            target.write_waiting();
        }
        assert_eq!(read(&path), "first\nsecond\nthird\n");
        fs::write(numbered(&path, 1), "old").expect("writable");
        let mut target = Target::open(path.clone(), EarlierLogs::Replace, 1000).expect("a file");
        target.write("other");
        target.write_waiting();
        assert_eq!(read(&path), "other\n");
        assert!(!numbered(&path, 1).exists());
    }
}
