//! Reading a journal and its state file, without IO: every damage is noticed.
//!
//! All records up to the committed one must be as they were written. After it there may be one more
//! batch, whose commit a crash prevented, or the remains of one; nothing of it was acted on.

use super::commit::CommitState;
use super::fault::JournalFault;
use super::line::{ChainEnd, DecodedLine, JournalLine, decode_line, foreign_format, parse_fields};
use super::story::Story;
use crate::record::{JournalEntry, JournalRecord};

/// What a journal holds, up to its first fault.
#[derive(Clone, Debug, Default)]
pub struct JournalVerification {
    /// The records.
    pub story: Story,
    /// The number of the first record, 0 if there is none.
    pub first: u64,
    /// The last record.
    pub end: ChainEnd,
    /// The last committed record, if the state file holds it.
    pub committed: Option<u64>,
    /// How many bytes follow the last record: the remains of a write that a crash interrupted.
    pub torn_len: u64,
    /// The first fault.
    pub fault: Option<JournalFault>,
    /// The length of the journal up to the end of the last record, in bytes.
    pub(super) whole_len: u64,
    pub(super) state: Option<CommitState>,
}

/// The format of a journal that another version wrote.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ForeignFormat(pub u32);

/// Verifies the bytes of a journal and of its state file; `None` stands for a missing file.
///
/// # Errors
/// If the journal was written by another version.
pub fn verify_bytes(
    journal: Option<&[u8]>,
    state: Option<&[u8]>,
) -> Result<JournalVerification, ForeignFormat> {
    let bytes = journal.unwrap_or_default();
    let first = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
    if let Some(format) = foreign_format(first) {
        return Err(ForeignFormat(format));
    }
    let state_read = state.map(CommitState::decode);
    let state = state_read.flatten();
    let committed = state.map(|state| state.newest.end);
    let mut reader = JournalReader { bytes, committed, ..JournalReader::default() };
    let fault = reader.read_lines().err();
    let mut read = reader.read;
    read.torn_len = bytes.len() as u64 - read.whole_len;
    read.committed = committed.map(|end| end.number);
    read.state = state;
    let is_blank = bytes.is_empty() && state_read.is_none();
    let last_line = reader.line;
    let pair_fault = || match (state_read, committed) {
        _ if is_blank => None,
        // A cut leaves two records at least.
        _ if read.first > 1 && last_line < 2 => {
            Some(JournalFault::Beginning { record: read.first })
        }
        (None, _) => Some(JournalFault::StateMissing),
        (Some(None), _) | (_, None) => Some(JournalFault::StateDamaged),
        (_, Some(end)) if end.number > read.end.number => Some(match journal {
            None => JournalFault::Missing { committed: end.number },
            Some([]) => JournalFault::Emptied { committed: end.number },
            Some(_) => JournalFault::End {
                last: read.end.number,
                line: last_line + 1,
                committed: end.number,
            },
        }),
        // A slot is unreadable while it is being written, which is after the journal.
        (_, Some(end)) if state.is_some_and(|it| it.is_half) && end.number == read.end.number => {
            Some(JournalFault::StateDamaged)
        }
        _ => None,
    };
    read.fault = fault.or_else(pair_fault);
    Ok(read)
}

#[derive(Default)]
struct JournalReader<'a> {
    bytes: &'a [u8],
    committed: Option<ChainEnd>,
    read: JournalVerification,
    /// The records of a batch whose last record has not been read yet.
    pending: Vec<JournalLine>,
    /// The last record that has been read, pending ones included.
    end: ChainEnd,
    /// How many lines are complete and valid.
    line: usize,
    /// How many whole batches follow the committed record.
    ahead: usize,
}

impl JournalReader<'_> {
    fn read_lines(&mut self) -> Result<(), JournalFault> {
        let mut at = 0;
        while at < self.bytes.len() {
            let rest = &self.bytes[at..];
            let Some(len) = rest.iter().position(|byte| *byte == b'\n') else {
                // The line is incomplete. If it was committed, the end is found to be missing.
                return if self.ahead > 0 { Err(self.state_old()) } else { Ok(()) };
            };
            let line = &rest[..len];
            at += len + 1;
            match decode_line(line) {
                Ok(decoded) => self.take_line(line, decoded, at)?,
                Err(_) if self.is_past_commit() && self.ahead == 0 => return Ok(()),
                Err(_) if self.is_past_commit() => return Err(self.state_old()),
                Err(damage) => {
                    let (record, line) = (self.end.number + 1, self.line + 1);
                    return Err(JournalFault::Line { record, line, damage });
                }
            }
        }
        Ok(())
    }

    fn take_line(
        &mut self,
        line: &[u8],
        decoded: DecodedLine,
        to: usize,
    ) -> Result<(), JournalFault> {
        let here = self.line + 1;
        let begins = self.line == 0;
        if begins && decoded.end.number > 1 {
            self.begin_at(decoded)?;
        }
        let (expected, found) = (self.end.number + 1, decoded.end.number);
        if found < expected {
            return Err(JournalFault::Repeated { record: found, line: here });
        }
        if found > expected {
            return Err(self.explain_gap(expected, found, to));
        }
        if decoded.previous != self.end.hash {
            return Err(JournalFault::Chain { record: found, line: here });
        }
        if self.ahead > 0 {
            return Err(self.state_old());
        }
        let content = parse_fields(line, decoded.fields_at);
        let content = content.map_err(|error| JournalFault::Content {
            record: found,
            line: here,
            error: error.to_string(),
        })?;
        if self.read.first > 1 && !is_cut_at(here, &content) {
            return Err(JournalFault::Beginning { record: self.read.first });
        }
        if begins {
            self.read.first = found;
        }
        (self.line, self.end) = (here, decoded.end);
        self.pending.push(content);
        if let Some(commit) = self.committed
            && commit.number == found
            && commit.hash != decoded.end.hash
        {
            return Err(JournalFault::StateOfOther { committed: found });
        }
        if decoded.more == 0 {
            self.take_batch(to);
        }
        Ok(())
    }

    /// Begins with the first record of a journal that was cut: the records before it are not kept.
    fn begin_at(&mut self, decoded: DecodedLine) -> Result<(), JournalFault> {
        self.read.first = decoded.end.number;
        self.end = ChainEnd { number: decoded.end.number - 1, hash: decoded.previous };
        match self.committed {
            Some(commit) if commit.number < self.end.number => Err(self.state_old()),
            Some(commit) if commit.number == self.end.number && commit != self.end => {
                Err(JournalFault::StateOfOther { committed: commit.number })
            }
            _ => Ok(()),
        }
    }

    fn take_batch(&mut self, to: usize) {
        if self.is_past_commit() && self.committed.is_some_and(|it| it.number < self.end.number) {
            self.ahead += 1;
        }
        for content in self.pending.drain(..) {
            match content {
                JournalLine::Life { life } => self.read.story.life = Some(life),
                JournalLine::Record(record) => self.read.story.records.push(record),
            }
        }
        (self.read.end, self.read.whole_len) = (self.end, to as u64);
    }

    /// Whether every record that was committed has been read.
    fn is_past_commit(&self) -> bool {
        self.committed.is_some_and(|commit| self.end.number >= commit.number)
    }

    fn state_old(&self) -> JournalFault {
        let committed = self.committed.map_or(0, |commit| commit.number);
        JournalFault::StateOld { committed, line: self.line + 1 }
    }

    /// Distinguishes records in another order from missing ones.
    fn explain_gap(&self, record: u64, found: u64, to: usize) -> JournalFault {
        let line = self.line + 1;
        let later = self.bytes[to..].split(|byte| *byte == b'\n').zip(line + 1..);
        let is_it = |text: &[u8]| decode_line(text).is_ok_and(|it| it.end.number == record);
        match later.into_iter().find(|(text, _)| is_it(text)) {
            Some((_, found_in)) => JournalFault::Order { record, line, found_in },
            None => JournalFault::Gap { record, line, found },
        }
    }
}

/// Whether a line is as in a journal that was cut, which begins with a life and a snapshot.
fn is_cut_at(line: usize, content: &JournalLine) -> bool {
    match (line, content) {
        (1, JournalLine::Life { .. }) => true,
        (1, _) => false,
        (2, JournalLine::Record(JournalRecord { entry: JournalEntry::Snapshot(_), .. })) => true,
        (2, _) => false,
        _ => true,
    }
}
