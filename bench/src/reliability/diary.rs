//! Reads the diaries of the components while they are written: which process of a component lives,
//! what it has received, and what is missing.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;

use anyhow::Result;

/// A message that arrived.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    pub at_ns: u64,
    /// The process that sent it.
    pub source: u32,
}

/// What is known of one process of a component.
#[derive(Debug, Default)]
pub struct PartLife {
    pub component: String,
    pub pid: u32,
    /// When its constructor was called.
    pub new_ns: u64,
    /// When it was activated last, if it is active.
    pub active_ns: Option<u64>,
    /// The first message at each input that was sent at the awaited moment or later.
    pub first: HashMap<String, Arrival>,
    /// When the base began to move, or came to rest.
    pub motions: Vec<(u64, bool)>,
    read: u64,
    incomplete: String,
    /// The last number from each process at each input.
    numbers: HashMap<(String, u32), u64>,
}

/// What was counted over all links.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinkAccount {
    pub received: u64,
    /// Missing messages that the receiver's counter has counted.
    pub counted: u64,
    /// Differences between missing numbers and that counter.
    pub uncounted: u64,
    /// Messages that had arrived before.
    pub repeated: u64,
    /// Processes that ran, or were active, next to one that they exclude.
    pub twice: u64,
}

/// The diaries of all processes.
pub struct DiaryReader {
    folder: PathBuf,
    lives: HashMap<(String, u32), PartLife>,
    awaited_ns: u64,
    pub account: LinkAccount,
}

impl DiaryReader {
    /// Those in a folder.
    pub fn new(folder: PathBuf) -> Self {
        let (lives, account) = (HashMap::new(), LinkAccount::default());
        Self { folder, lives, awaited_ns: 0, account }
    }

    /// From now on, the first message that was sent at this moment or later is awaited.
    pub fn await_messages(&mut self, from_ns: u64) {
        self.awaited_ns = from_ns;
        self.lives.values_mut().for_each(|life| life.first.clear());
    }

    /// Reads what was written since the last call.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn read_on(&mut self) -> Result<()> {
        for entry in fs::read_dir(&self.folder)? {
            let entry = entry?;
            let name = entry.file_name().into_string().unwrap_or_default();
            let Some((component, pid)) = name.split_once('.') else { continue };
            let Ok(pid) = pid.parse::<u32>() else { continue };
            let life = self.lives.entry((component.to_owned(), pid)).or_insert_with(|| PartLife {
                component: component.to_owned(),
                pid,
                ..PartLife::default()
            });
            if entry.metadata()?.len() <= life.read {
                continue;
            }
            let mut file = File::open(entry.path())?;
            file.seek(SeekFrom::Start(life.read))?;
            let mut text = std::mem::take(&mut life.incomplete);
            life.read += file.read_to_string(&mut text)? as u64;
            let end = text.rfind('\n').map_or(0, |at| at + 1);
            life.incomplete = text.split_off(end);
            for line in text.lines() {
                life.note(line, self.awaited_ns, &mut self.account);
            }
        }
        Ok(())
    }

    /// The last process of a component.
    pub fn find_life(&self, component: &str) -> Option<&PartLife> {
        let own = self.lives.values().filter(|life| life.component == component);
        own.max_by_key(|life| life.new_ns)
    }
}

impl PartLife {
    fn note(&mut self, line: &str, awaited_ns: u64, account: &mut LinkAccount) {
        let words: Vec<_> = line.split(' ').collect();
        let number = |index: usize| words.get(index).and_then(|word| word.parse::<u64>().ok());
        let Some(at_ns) = number(0) else { return };
        match words.get(1).copied() {
            Some("new") => self.new_ns = at_ns,
            Some("on") => self.active_ns = Some(at_ns),
            Some("off") => self.active_ns = None,
            Some("moves") => self.motions.push((at_ns, true)),
            Some("rests") => self.motions.push((at_ns, false)),
            Some("twice") => {
                eprintln!("{} {}: {line}", self.component, self.pid);
                account.twice += 1;
            }
            Some("got") => {
                let (Some(source), Some(count), Some(lost), Some(sent_ns)) =
                    (number(3), number(4), number(5), number(6))
                else {
                    return;
                };
                let (input, source) = (words[2].to_owned(), source as u32);
                self.count_message(&input, source, count, lost, account);
                let arrival = Arrival { at_ns, source };
                if sent_ns >= awaited_ns {
                    self.first.entry(input).or_insert(arrival);
                }
            }
            _ => {}
        }
    }

    fn count_message(
        &mut self,
        input: &str,
        source: u32,
        number: u64,
        lost: u64,
        account: &mut LinkAccount,
    ) {
        account.received += 1;
        let before = self.numbers.insert((input.to_owned(), source), number);
        let Some(before) = before else { return };
        if number <= before {
            account.repeated += 1;
            eprintln!("{} {}: {number} after {before} at {input}", self.component, self.pid);
            return;
        }
        let missing = number - before - 1;
        account.counted += lost;
        account.uncounted += missing.abs_diff(lost);
        if missing != lost {
            let name = &self.component;
            eprintln!("{name}: {missing} missing before {number} at {input}, counted {lost}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_twice_or_uncounted_is_found() {
        let (mut life, mut account) = (PartLife::default(), LinkAccount::default());
        let lines = [
            "5 new",
            "6 on",
            "7 got far 40 3 0 7",
            "8 got far 40 4 0 8",
            "9 got far 40 7 2 9",
            "10 got far 40 7 0 9",
            "11 got far 40 9 0 11",
            "12 got far 41 100 0 12",
            "13 twice x",
        ];
        lines.iter().for_each(|line| life.note(line, 9, &mut account));
        assert_eq!((account.received, account.counted), (6, 2));
        assert_eq!((account.uncounted, account.repeated, account.twice), (1, 1, 1));
        assert_eq!((life.new_ns, life.active_ns), (5, Some(6)));
        assert_eq!((life.first["far"].at_ns, life.first["far"].source), (9, 40));
        life.note("14 off", 9, &mut account);
        assert_eq!(life.active_ns, None);
    }
}
