//! Reads the outputs of a running system into one queue.

mod collector;
mod message_queue;
mod selection;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_sdk::control::{Answer, ControlConnection, ControlEvent, Role};
use armor_sdk::directory::{Directory, DirectoryError};
use armor_sdk::tap::{Tap, TapError};
use armor_wire::codec;
use armor_wire::keep::Keep;
use armor_wire::message::Message;
use armor_wire::registry::{ComponentEntry, DataEntry};
use armor_wire::schema::Schema;

use crate::head::MessageHead;
use crate::reports::{REPORTS, RecordedReport};
use crate::stamping::Stamper;
use crate::writer::OutputType;
use collector::{CollectorInbox, OpenTap};
use message_queue::MessageQueue;
pub use message_queue::TappedMessage;
pub use selection::OutputSelection;

/// What a publisher keeps for the recorder while that is slow; further messages are dropped there and
/// counted.
const KEEP: Keep = Keep::Last { count: 1000 };
/// The same of outputs with bulk arrays, such as images, which come by shared memory: as many as that
/// allows.
const KEEP_IN_MEMORY: Keep = Keep::Last { count: 32 };
/// How long a provider may take to appear before the outputs are listed again.
const PROVIDER_WITHIN: Duration = Duration::from_secs(1);
/// How the recorder names itself to components.
const RECORDER: &str = "tool-record";
/// The kind of the one process that has no reports.
const CONFIGD: &str = "configd";
/// Within this time the registry has to list the outputs.
const LISTED_WITHIN: Duration = Duration::from_secs(2);

/// The outputs of a system, as they are published, and the reports of its components. Dropping it ends
/// its threads.
pub struct OutputTaps {
    directory: Directory,
    /// By the instance of each component.
    observed: BTreeMap<u64, ControlConnection>,
    selection: OutputSelection,
    queue: Arc<MessageQueue>,
    inbox: CollectorInbox,
    tapped: BTreeSet<String>,
    stamper: Stamper,
}

impl OutputTaps {
    /// Begins without an output; see [`Self::follow_outputs`]. `clock` is the data that system time
    /// follows, if it follows any.
    ///
    /// # Errors
    /// If the system has no thread or file descriptor for it.
    pub fn new(
        directory: Directory,
        selection: OutputSelection,
        clock: Option<String>,
    ) -> io::Result<Self> {
        let queue = Arc::new(MessageQueue::new(clock.clone()));
        Ok(Self {
            directory,
            observed: BTreeMap::new(),
            selection,
            inbox: CollectorInbox::start(Arc::clone(&queue))?,
            queue,
            tapped: BTreeSet::new(),
            stamper: Stamper::new(clock),
        })
    }

    /// Reads the outputs that have appeared since the last call, too. Returns all that are listed.
    ///
    /// # Errors
    /// If the registry does not answer.
    pub fn follow_outputs(&mut self) -> Result<Vec<DataEntry>, DirectoryError> {
        let listing = self.directory.fetch_listing(LISTED_WITHIN)?;
        if !self.selection.excludes(REPORTS) {
            self.observe_reports(&listing.components);
        }
        let listed = listing.data;
        for ended in self.queue.take_ended() {
            self.tapped.remove(&ended);
        }
        for entry in listed.iter().filter(|entry| self.selection.holds(&entry.data)) {
            if self.tapped.insert(entry.data.clone()) {
                self.start_tap(entry.clone());
            }
        }
        Ok(listed)
    }

    /// What the recorder itself adds to the messages.
    pub(crate) fn own_outputs(&self) -> OwnOutputs {
        OwnOutputs {
            queue: Arc::clone(&self.queue),
            inbox: self.inbox.clone(),
            directory: self.directory.clone(),
            selection: self.selection.clone(),
        }
    }

    /// Reads no more: what has arrived by now can still be taken.
    pub fn stop(&self) {
        self.queue.end();
    }

    /// Returns the next message; `None` if none comes within `timeout`.
    pub fn next_message(&mut self, timeout: Duration) -> Option<TappedMessage> {
        let deadline = Instant::now() + timeout;
        loop {
            if let Some(message) = self.stamper.take() {
                return Some(message);
            }
            match self.queue.take(deadline) {
                Some(message) => self.stamper.push(message),
                None if self.queue.is_ended() => {
                    let reports = self.inbox.take_reports();
                    if reports.is_empty() {
                        return self.stamper.take_waiting();
                    }
                    reports.into_iter().for_each(|report| self.stamper.push(report));
                }
                None => return None,
            }
        }
    }

    /// Connects to the components that have appeared.
    fn observe_reports(&mut self, components: &[ComponentEntry]) {
        let is_there = |instance| components.iter().any(|entry| entry.instance == instance);
        self.observed.retain(|instance, _| is_there(*instance));
        for entry in components.iter().filter(|entry| entry.kind != CONFIGD) {
            if self.observed.contains_key(&entry.instance) {
                continue;
            }
            let outputs = self.own_outputs();
            let (name, instance) = (entry.name.clone(), entry.instance);
            let sink = move |event| {
                if let ControlEvent::Answer(Answer::Report { report, activation, outcome }) = event
                {
                    let now_s = outputs.timestamp();
                    let recorded = RecordedReport::new(now_s, &name, activation, &outcome);
                    let head = MessageHead { sequence: report, stamp_s: now_s, instance, lost: 0 };
                    let message = encode_own(REPORTS, &recorded, head);
                    message.into_iter().for_each(|message| outputs.inbox.add_report(message));
                }
            };
            // One that cannot be reached is tried again at the next listing.
            if let Ok(connection) =
                ControlConnection::connect(entry, Role::Observer, RECORDER, sink)
            {
                self.observed.insert(instance, connection);
            }
        }
    }

    fn start_tap(&self, entry: DataEntry) {
        let (directory, queue) = (self.directory.clone(), Arc::clone(&self.queue));
        let (inbox, failed) = (self.inbox.clone(), entry.data.clone());
        // Connecting may take a second, in which no other output has to wait.
        let run = move || match open_tap(&directory, &entry) {
            Ok(opened) => inbox.add(opened),
            Err(_) => queue.add_ended(entry.data),
        };
        let name = format!("tap {failed}");
        if std::thread::Builder::new().name(name).spawn(run).is_err() {
            self.queue.add_ended(failed);
        }
    }
}

/// Links to an output.
fn open_tap(directory: &Directory, entry: &DataEntry) -> Result<OpenTap, TapError> {
    let data = &entry.data;
    let is_bulk = armor_wire::schema::parse(&entry.schema).is_ok_and(|schema| has_bulk(&schema));
    let tap = if is_bulk {
        Tap::open_in_memory(directory, data, KEEP_IN_MEMORY, PROVIDER_WITHIN)?
    } else {
        Tap::open(directory, data, KEEP, PROVIDER_WITHIN)?
    };
    let (name, schema) = (tap.type_name().to_owned(), tap.schema().to_string());
    let output_type = Arc::new(OutputType { name, schema, latched: entry.latched });
    Ok(OpenTap { data: data.clone(), output_type, tap })
}

/// Whether messages of a type have a list of numbers: those that are large nearly always do.
fn has_bulk(schema: &Schema) -> bool {
    match schema {
        Schema::List(item) => is_number(item) || has_bulk(item),
        Schema::Option(item) | Schema::Fixed(item, _) => has_bulk(item),
        Schema::Struct { fields, .. } => fields.iter().any(|field| has_bulk(&field.schema)),
        Schema::Enum { variants, .. } => variants
            .iter()
            .any(|variant| variant.fields.iter().any(|field| has_bulk(&field.schema))),
        _ => false,
    }
}

fn is_number(schema: &Schema) -> bool {
    !matches!(
        schema,
        Schema::Text
            | Schema::Option(_)
            | Schema::List(_)
            | Schema::Fixed(..)
            | Schema::Struct { .. }
            | Schema::Enum { .. }
    )
}

impl Drop for OutputTaps {
    fn drop(&mut self) {
        self.stop();
    }
}

/// The outputs that the recorder itself has in the file, such as the reports. Clones are the same.
#[derive(Clone)]
pub(crate) struct OwnOutputs {
    queue: Arc<MessageQueue>,
    inbox: CollectorInbox,
    directory: Directory,
    selection: OutputSelection,
}

impl OwnOutputs {
    /// System time, as far as it is known: the recorder's own clock does not follow data.
    pub fn timestamp(&self) -> f64 {
        self.queue.clock_s().unwrap_or_else(|| self.directory.clock().timestamp())
    }

    /// Whether an output is recorded: only names that are excluded count.
    pub fn is_recorded(&self, data: &str) -> bool {
        !self.selection.excludes(data)
    }

    /// Whether nothing more is taken.
    pub fn are_over(&self) -> bool {
        self.queue.is_ended()
    }

    /// Adds a message, waiting for room. `lost` counts those that are missing before it.
    pub fn push<T: Message>(
        &self,
        data: &str,
        message: &T,
        stamp_s: f64,
        sequence: u64,
        lost: u64,
    ) {
        self.queue.await_room();
        if self.is_recorded(data) {
            let head = MessageHead { sequence, stamp_s, instance: 0, lost };
            encode_own(data, message, head).into_iter().for_each(|it| self.queue.push_own(it));
        }
    }
}

/// A message of the recorder itself; `None` if it cannot be encoded.
fn encode_own<T: Message>(data: &str, message: &T, head: MessageHead) -> Option<TappedMessage> {
    let payload = codec::encode(message).ok()?.into();
    let output_type = Arc::new(OutputType {
        name: T::NAME.into(),
        schema: T::schema().to_string(),
        latched: false,
    });
    Some(TappedMessage { data: data.into(), output_type, head, payload })
}
