//! The log files of a run: one per process, with those that were renamed because they had grown too
//! large. Read to their end and merged by date; then what is added to them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use anyhow::Result;

use super::entry::LogEntry;

/// The file with the lines of all processes, which are in the others, too.
const ALL: &str = "all";
/// Most renamed files of one process.
const MAX_RENAMED: u32 = 16;
/// Longest part of a line that is kept.
const MAX_LINE_LEN: u64 = 1 << 20;

/// The logs of a run, as far as they were read.
pub struct FollowedLog {
    folder: PathBuf,
    /// Only these processes; all if it is empty.
    names: Vec<String>,
    open: BTreeMap<String, OpenLog>,
}

/// The file to which a process writes now.
struct OpenLog {
    file: File,
    read_len: u64,
    /// A line whose end has not been written yet.
    begun: Vec<u8>,
    date: String,
}

/// Returns the processes that have a log in the folder.
pub fn list_logs(folder: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        Some(name.strip_suffix(".log")?.to_owned())
    });
    names.filter(|name| name != ALL).collect()
}

impl FollowedLog {
    /// Reads nothing yet.
    pub fn open(folder: &Path, names: &[String]) -> Self {
        Self { folder: folder.into(), names: names.to_vec(), open: BTreeMap::new() }
    }

    fn wanted_names(&self) -> BTreeSet<String> {
        let mut names = list_logs(&self.folder);
        names.retain(|name| self.names.is_empty() || self.names.contains(name));
        names
    }

    /// Calls `take` with every line that is in the files, in the order of their dates.
    ///
    /// # Errors
    /// That of `take`.
    pub fn read_written(&mut self, mut take: impl FnMut(LogEntry) -> Result<()>) -> Result<()> {
        let mut sources = Vec::new();
        for name in self.wanted_names() {
            let current = self.folder.join(format!("{name}.log"));
            let Ok(file) = File::open(&current) else { continue };
            let end = file.metadata().map_or(0, |about| about.len());
            // The oldest has the largest number.
            let renamed = (1..=MAX_RENAMED).rev();
            let renamed = renamed.map(|number| self.folder.join(format!("{name}.log.{number}")));
            let mut files: Vec<File> = renamed.filter_map(|path| File::open(path).ok()).collect();
            let Ok(copy) = file.try_clone() else { continue };
            files.push(copy);
            sources.push(LogSource::new(&name, files, end));
            let open = OpenLog { file, read_len: end, begun: Vec::new(), date: String::new() };
            self.open.insert(name, open);
        }
        let mut next: Vec<Option<LogEntry>> = sources.iter_mut().map(LogSource::next).collect();
        loop {
            let dates =
                next.iter().enumerate().filter_map(|(at, entry)| Some((&entry.as_ref()?.date, at)));
            let Some((_, first)) = dates.min() else { break };
            let entry = std::mem::replace(&mut next[first], sources[first].next());
            entry.map_or(Ok(()), &mut take)?;
        }
        for source in sources {
            // What is left of it is a line that is being written.
            if let Some(open) = self.open.get_mut(&source.name) {
                open.read_len -= source.begun.len() as u64;
                open.date = source.date;
            }
        }
        Ok(())
    }

    /// Calls `take` with every line that was added since the last call, in the order of their dates.
    ///
    /// # Errors
    /// That of `take`.
    pub fn read_new(&mut self, take: impl FnMut(LogEntry) -> Result<()>) -> Result<()> {
        let mut entries = Vec::new();
        for name in self.wanted_names() {
            let path = self.folder.join(format!("{name}.log"));
            if let Some(open) = self.open.get_mut(&name) {
                open.read_added(&name, &mut entries);
                if !open.is_replaced(&path) {
                    continue;
                }
            }
            // A new process, or the file was renamed: what came before that has been read above.
            let Ok(file) = File::open(&path) else { continue };
            let mut open = OpenLog { file, read_len: 0, begun: Vec::new(), date: String::new() };
            open.read_added(&name, &mut entries);
            self.open.insert(name, open);
        }
        entries.sort_by(|a, b| a.date.cmp(&b.date));
        entries.into_iter().try_for_each(take)
    }
}

impl OpenLog {
    fn is_replaced(&self, path: &Path) -> bool {
        let (Ok(open), Ok(now)) = (self.file.metadata(), path.metadata()) else { return false };
        (open.dev(), open.ino()) != (now.dev(), now.ino())
    }

    fn read_added(&mut self, name: &str, entries: &mut Vec<LogEntry>) {
        let len = self.file.metadata().map_or(0, |about| about.len());
        if len < self.read_len {
            // Another run has begun the file again.
            (self.read_len, self.begun) = (0, Vec::new());
        }
        let mut bytes = std::mem::take(&mut self.begun);
        let read = self.file.seek(SeekFrom::Start(self.read_len)).and_then(|_| {
            // What is written meanwhile is read the next time.
            (&self.file).take(len - self.read_len).read_to_end(&mut bytes)
        });
        self.read_len += read.unwrap_or(0) as u64;
        let mut lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').collect();
        let begun = lines.pop().unwrap_or_default().to_vec();
        for line in lines {
            let entry = LogEntry::parse(name, &String::from_utf8_lossy(line), &self.date);
            self.date.clone_from(&entry.date);
            entries.push(entry);
        }
        self.begun = begun;
    }
}

/// The files of one process, read from the oldest line on.
struct LogSource {
    name: String,
    files: std::vec::IntoIter<File>,
    reader: Option<BufReader<io::Take<File>>>,
    /// The last file is read up to here: what is added later comes with [`FollowedLog::read_new`].
    end: u64,
    begun: Vec<u8>,
    date: String,
}

impl LogSource {
    fn new(name: &str, files: Vec<File>, end: u64) -> Self {
        let files = files.into_iter();
        let (reader, begun) = (None, Vec::new());
        Self { name: name.into(), files, reader, end, begun, date: String::new() }
    }

    fn next(&mut self) -> Option<LogEntry> {
        loop {
            let Some(reader) = &mut self.reader else {
                let file = self.files.next()?;
                let len = if self.files.len() == 0 { self.end } else { u64::MAX };
                self.reader = Some(BufReader::new(file.take(len)));
                continue;
            };
            let mut line = Vec::new();
            let read = reader.by_ref().take(MAX_LINE_LEN).read_until(b'\n', &mut line);
            match read {
                Ok(0) | Err(_) => self.reader = None,
                Ok(_) if line.last() == Some(&b'\n') || line.len() as u64 == MAX_LINE_LEN => {
                    let text = String::from_utf8_lossy(&line);
                    let entry =
                        LogEntry::parse(&self.name, text.trim_end_matches('\n'), &self.date);
                    self.date.clone_from(&entry.date);
                    return Some(entry);
                }
                Ok(_) => self.begun = line,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs::OpenOptions;
    use std::io::Write;

    use super::*;
    use crate::scratch::ScratchFolder;

    fn line(second: u32, name: &str, text: &str) -> String {
        format!("2026-11-21T14:30:{second:02}.000Z {second:8}.000 {name}  INFO {text}\n")
    }

    fn texts(entries: &[LogEntry]) -> Vec<String> {
        entries
            .iter()
            .map(|entry| entry.to_json()["message"].as_str().unwrap_or("").to_owned())
            .collect()
    }

    fn written(log: &mut FollowedLog) -> Vec<String> {
        let mut entries = Vec::new();
        log.read_written(|entry| {
            entries.push(entry);
            Ok(())
        })
        .expect("nothing fails");
        texts(&entries)
    }

    fn added(log: &mut FollowedLog) -> Vec<String> {
        let mut entries = Vec::new();
        log.read_new(|entry| {
            entries.push(entry);
            Ok(())
        })
        .expect("nothing fails");
        texts(&entries)
    }

    #[test]
    fn lines_are_merged_by_date_and_followed_through_a_renaming() {
        let folder = ScratchFolder::new("followed-log");
        let path = |name: &str| folder.path().join(name);
        let append = |name: &str, text: &str| {
            let mut file =
                OpenOptions::new().create(true).append(true).open(path(name)).expect("a file");
            file.write_all(text.as_bytes()).expect("written");
        };
        append("all.log", &line(0, "arm", "not twice"));
        append("arm.log.2", &line(1, "arm", "one"));
        append("arm.log.1", &line(3, "arm", "three"));
        append("arm.log", &(line(5, "arm", "five") + &line(6, "arm", "six")[..30]));
        append("leg.log", &(line(2, "leg", "two") + &line(4, "leg", "four")));
        assert_eq!(list_logs(folder.path()).into_iter().collect::<Vec<_>>(), ["arm", "leg"]);
        let mut log = FollowedLog::open(folder.path(), &[]);
        assert_eq!(written(&mut log), ["one", "two", "three", "four", "five"]);
        assert_eq!(added(&mut log), Vec::<String>::new(), "a line without its end");
        append("arm.log", &line(6, "arm", "six")[30..]);
        assert_eq!(added(&mut log), ["six"]);
        // Lines before and after a renaming, and a new process.
        append("arm.log", &line(7, "arm", "seven"));
        std::fs::rename(path("arm.log"), path("arm.log.1")).expect("renamed");
        append("arm.log", &line(9, "arm", "nine"));
        append("eye.log", &line(8, "eye", "eight"));
        assert_eq!(added(&mut log), ["seven", "eight", "nine"]);
        let mut one = FollowedLog::open(folder.path(), &["leg".into()]);
        assert_eq!(written(&mut one), ["two", "four"]);
        append("eye.log", &line(10, "eye", "ten"));
        assert_eq!(added(&mut one), Vec::<String>::new());
    }
}
