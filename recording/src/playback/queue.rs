//! The messages of a recording in the order of their stamps. A recorder writes them as they arrive,
//! which is nearly that order.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;

use armor_wire::name;

use crate::held_values::keep_newest;
use crate::message_stream::{ReadError, RecordedMessage};
use crate::reader::Recording;
use crate::reports::REPORTS;
use crate::summary::RecordingSummary;
use crate::taps::OutputSelection;

/// So far ahead is read: no message arrives at the recorder this much later than another one that was
/// published after it.
const LOOKAHEAD_S: f64 = 1.0;
/// What was published so shortly before a moment is shown at it.
const RECENT_S: f64 = 1.0;
/// Most bytes that are read ahead.
const MAX_AHEAD: usize = 64 << 20;

/// Plays an output under another name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DataRename {
    /// `component.output` in the recording.
    pub recorded: String,
    /// `component.output` in the system.
    pub played: String,
}

impl std::str::FromStr for DataRename {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_data = |text: &str| {
            text.split_once('.').is_some_and(|(a, b)| name::is_name(a) && name::is_name(b))
        };
        let (recorded, played) = text.split_once('=').unwrap_or_default();
        if !is_data(recorded) || !is_data(played) {
            return Err("write RECORDED=PLAYED, both as COMPONENT.OUTPUT".into());
        }
        Ok(Self { recorded: recorded.into(), played: played.into() })
    }
}

/// A message and the time at which it is played.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct QueuedMessage {
    pub due_s: f64,
    pub message: RecordedMessage,
}

/// Where messages come from.
pub(crate) trait MessageSource {
    /// Damaged parts that were left out.
    fn damaged_chunks(&self) -> u64 {
        0
    }
    fn next_message(&mut self) -> Result<Option<RecordedMessage>, ReadError>;
    /// Continues at the latest at the first message with this stamp or a later one. Returns what these
    /// latched outputs held before, as far as it is not among what comes next.
    fn seek(
        &mut self,
        stamp_s: f64,
        latched: &BTreeSet<String>,
    ) -> Result<BTreeMap<String, RecordedMessage>, ReadError>;
}

impl MessageSource for Recording {
    fn damaged_chunks(&self) -> u64 {
        Self::damaged_chunks(self)
    }

    fn next_message(&mut self) -> Result<Option<RecordedMessage>, ReadError> {
        Self::next_message(self)
    }

    fn seek(
        &mut self,
        stamp_s: f64,
        latched: &BTreeSet<String>,
    ) -> Result<BTreeMap<String, RecordedMessage>, ReadError> {
        self.seek_with_held(stamp_s, latched)
    }
}

/// See the module.
pub(crate) struct PlaybackQueue<S> {
    source: S,
    selection: OutputSelection,
    renames: Vec<DataRename>,
    /// The latched outputs that are played, by their recorded names: what they held before the
    /// beginning is sought.
    latched: BTreeSet<String>,
    /// In the order in which they are played.
    ahead: VecDeque<QueuedMessage>,
    ahead_bytes: usize,
    /// The newest stamp that was read.
    newest_s: f64,
    has_ended: bool,
    /// Messages that cannot be read.
    pub unreadable: u64,
}

impl PlaybackQueue<Recording> {
    /// Opens a recording.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn open(
        path: &Path,
        selection: OutputSelection,
        renames: Vec<DataRename>,
    ) -> Result<(Self, RecordingSummary), ReadError> {
        let recording = Recording::open(path)?;
        let summary = recording.summary().clone();
        let is_played = |data: &str| selection.holds(&find_played(&renames, data));
        let latched = summary.outputs.iter().filter(|it| it.latched && is_played(&it.data));
        let latched = latched.map(|output| output.data.clone()).collect();
        Ok((Self::new(recording, selection, renames, latched), summary))
    }
}

/// The name under which an output is played.
pub(crate) fn find_played(renames: &[DataRename], recorded: &str) -> String {
    let rename = renames.iter().find(|rename| rename.recorded == recorded);
    rename.map_or(recorded, |rename| &rename.played).into()
}

impl<S: MessageSource> PlaybackQueue<S> {
    pub fn new(
        source: S,
        selection: OutputSelection,
        renames: Vec<DataRename>,
        latched: BTreeSet<String>,
    ) -> Self {
        Self {
            source,
            selection,
            renames,
            latched,
            ahead: VecDeque::new(),
            ahead_bytes: 0,
            newest_s: f64::NEG_INFINITY,
            has_ended: false,
            unreadable: 0,
        }
    }

    /// Damaged parts of the file that were left out.
    pub fn damaged_chunks(&self) -> u64 {
        self.source.damaged_chunks()
    }

    /// Continues at `from_s`, with the values that latched outputs had then, and what the others have
    /// published last, if it was shortly before.
    ///
    /// # Errors
    /// If the recording cannot be read.
    pub fn seek(&mut self, from_s: f64) -> Result<(), ReadError> {
        self.ahead.clear();
        (self.ahead_bytes, self.newest_s, self.has_ended) = (0, f64::NEG_INFINITY, false);
        let recent_s = from_s - RECENT_S;
        let mut before = BTreeMap::new();
        for mut message in self.source.seek(recent_s, &self.latched)?.into_values() {
            match message.payload {
                Ok(_) => {
                    message.data = find_played(&self.renames, &message.data);
                    before.insert(message.data.clone(), message);
                }
                Err(_) => self.unreadable += 1,
            }
        }
        while let Some(message) = self.read_selected()? {
            let is_before = message.head.stamp_s < from_s;
            if is_before {
                let is_shown = message.output_type.latched || message.head.stamp_s >= recent_s;
                if is_shown && message.data != REPORTS {
                    keep_newest(&mut before, message);
                }
                // What comes later in the file may have been published earlier.
                continue;
            }
            self.insert(message);
            if self.newest_s > from_s + LOOKAHEAD_S {
                break;
            }
        }
        for message in before.into_values().rev() {
            self.ahead_bytes += payload_len(&message);
            self.ahead.push_front(QueuedMessage { due_s: from_s, message });
        }
        Ok(())
    }

    /// The message that is played next; `None` at the end.
    ///
    /// # Errors
    /// If the recording cannot be read.
    pub fn peek(&mut self) -> Result<Option<&QueuedMessage>, ReadError> {
        let is_short = |queue: &Self| {
            let first = queue.ahead.front().map_or(f64::NEG_INFINITY, |first| first.due_s);
            queue.newest_s <= first + LOOKAHEAD_S && queue.ahead_bytes < MAX_AHEAD
        };
        while !self.has_ended && (self.ahead.is_empty() || is_short(self)) {
            if let Some(message) = self.read_selected()? {
                self.insert(message);
            }
        }
        Ok(self.ahead.front())
    }

    /// Takes the message that [`Self::peek`] has shown.
    pub fn take(&mut self) -> Option<QueuedMessage> {
        let taken = self.ahead.pop_front()?;
        self.ahead_bytes -= payload_len(&taken.message);
        Some(taken)
    }

    fn insert(&mut self, message: RecordedMessage) {
        let due_s = message.head.stamp_s;
        // The order of the file among those of the same stamp.
        let later = self.ahead.iter().rev().take_while(|queued| queued.due_s > due_s).count();
        self.ahead_bytes += payload_len(&message);
        self.ahead.insert(self.ahead.len() - later, QueuedMessage { due_s, message });
    }

    fn read_selected(&mut self) -> Result<Option<RecordedMessage>, ReadError> {
        while let Some(mut message) = self.source.next_message()? {
            let played = find_played(&self.renames, &message.data);
            let is_played = self.selection.holds(&played) || played == REPORTS;
            if !is_played || !message.head.stamp_s.is_finite() {
                continue;
            }
            if message.payload.is_err() {
                self.unreadable += 1;
                continue;
            }
            message.data = played;
            self.newest_s = self.newest_s.max(message.head.stamp_s);
            return Ok(Some(message));
        }
        self.has_ended = true;
        Ok(None)
    }
}

fn payload_len(message: &RecordedMessage) -> usize {
    message.payload.as_ref().map_or(0, Vec::len)
}
