//! Lines into files: one per process, and `all.log`. A file that grows too large is renamed to
//! `NAME.log.1`, and the oldest of those is removed. So are the oldest of all processes, if together
//! they take too much of the disk.

use std::collections::HashMap;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
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
    file: Option<BufWriter<File>>,
    /// Its length, with what is not flushed yet.
    len: u64,
    max_len: u64,
    /// Its failure was reported; it is reported once.
    reported: bool,
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
    open_own_file(path, OpenOptions::new().write(true).truncate(true))
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
        Ok(Self { path, file: Some(BufWriter::new(file)), len, max_len, reported: false })
    }

    fn unusable(path: PathBuf) -> Self {
        Self { path, file: None, len: 0, max_len: MAX_FILE_LEN, reported: false }
    }

    /// Writes a line. Returns whether the file was renamed before.
    fn write(&mut self, line: &str) -> bool {
        let len = line.len() as u64 + 1;
        let is_full = self.len > 0 && self.len + len > self.max_len;
        if is_full {
            self.rotate();
        }
        // An error stays in the file's state and shows at the flush.
        if let Some(file) = &mut self.file {
            let _ = writeln!(file, "{line}");
            self.len += len;
        }
        is_full
    }

    /// Renames the file and begins another one. A file that cannot be renamed grows on.
    fn rotate(&mut self) {
        if let Some(file) = &mut self.file {
            let _ = file.flush();
        }
        for number in (1..KEPT_FILES).rev() {
            let _ = fs::rename(numbered(&self.path, number), numbered(&self.path, number + 1));
        }
        let begun =
            fs::rename(&self.path, numbered(&self.path, 1)).and_then(|()| create_log(&self.path));
        match begun {
            Ok(file) => (self.file, self.len) = (Some(BufWriter::new(file)), 0),
            Err(_) => self.max_len = u64::MAX,
        }
    }

    fn flush(&mut self, log: &RunLog) {
        let failure = match &mut self.file {
            Some(file) => file.flush().err().map(|error| error.to_string()),
            None => Some("it could not be opened".into()),
        };
        if let Some(failure) = failure
            && !std::mem::replace(&mut self.reported, true)
        {
            let text = format!("lines are lost: {}: {failure}", self.path.display());
            log.report("launcher", LogLevel::Error, text);
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
        drop(target);
        assert_eq!(read(&path), "line 010\n");
        assert_eq!(read(&numbered(&path, 1)), "line 008\nline 009\n");
        assert_eq!(read(&numbered(&path, 3)), "line 004\nline 005\n");
        assert!(!numbered(&path, 4).exists());
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
            Target::open(path.clone(), earlier, 1000).expect("a file").write(text);
        }
        assert_eq!(read(&path), "first\nsecond\nthird\n");
        fs::write(numbered(&path, 1), "old").expect("writable");
        Target::open(path.clone(), EarlierLogs::Replace, 1000).expect("a file").write("other");
        assert_eq!(read(&path), "other\n");
        assert!(!numbered(&path, 1).exists());
    }
}
