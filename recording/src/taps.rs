//! Reads the outputs of a running system, each on a thread of its own, into one queue.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use armor_sdk::control::{Answer, ControlConnection, ControlEvent, Role};
use armor_sdk::directory::{Directory, DirectoryError};
use armor_sdk::tap::{Tap, TapError};
use armor_wire::clock::Clock;
use armor_wire::codec;
use armor_wire::keep::Keep;
use armor_wire::message::Message;
use armor_wire::name::is_name;
use armor_wire::registry::{ComponentEntry, DataEntry};
use parking_lot::{Condvar, Mutex};

use crate::head::MessageHead;
use crate::reports::{REPORTS, RecordedReport};
use crate::stamping::Stamper;
use crate::writer::OutputType;

/// What a publisher keeps for the recorder while that is slow; further messages are dropped there and
/// counted.
const KEEP: Keep = Keep::Last { count: 1000 };
/// Most bytes that wait to be written. A tap beyond it waits, and its publisher drops.
const MAX_WAITING: usize = 64 << 20;
/// How long a provider may take to appear before the outputs are listed again.
const PROVIDER_WITHIN: Duration = Duration::from_secs(1);
/// Time after which a waiting thread checks whether it must end.
const LOOK: Duration = Duration::from_millis(100);
/// How the recorder names itself to components.
const RECORDER: &str = "tool-record";
/// The kind of the one process that has no reports.
const CONFIGD: &str = "configd";
/// Within this time the registry has to list the outputs.
const LISTED_WITHIN: Duration = Duration::from_secs(2);

/// Which outputs are read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OutputSelection {
    /// These, and with `component.*` all of a component; all outputs if there are none.
    pub include: Vec<String>,
    /// All but these, written the same way.
    pub exclude: Vec<String>,
}

impl OutputSelection {
    /// Whether an output is read.
    pub fn holds(&self, data: &str) -> bool {
        let is_included = self.include.iter().any(|name| matches_name(name, data));
        (self.include.is_empty() || is_included) && !self.excludes(data)
    }

    /// Checks a name of a selection: `component.output`, or `component.*` for all of a component.
    ///
    /// # Errors
    /// How it is written.
    pub fn check_name(name: &str) -> Result<(), String> {
        let is_one = name.split_once('.').is_some_and(|(component, output)| {
            is_name(component) && (output == "*" || is_name(output))
        });
        is_one
            .then_some(())
            .ok_or_else(|| "write COMPONENT.OUTPUT, or COMPONENT.* for all of a component".into())
    }

    /// Whether an output is left out by its name.
    pub fn excludes(&self, data: &str) -> bool {
        self.exclude.iter().any(|name| matches_name(name, data))
    }

    /// The names in it, included or excluded, that none of these outputs has.
    pub fn find_missing<'a>(
        names: &'a [String],
        outputs: impl Iterator<Item = &'a str> + Clone,
    ) -> Vec<&'a str> {
        let is_missing = |name: &&String| !outputs.clone().any(|output| matches_name(name, output));
        names.iter().filter(is_missing).map(String::as_str).collect()
    }
}

/// Whether a name, which may end with `*`, is that of the data.
fn matches_name(name: &str, data: &str) -> bool {
    name.strip_suffix('*').map_or(name == data, |beginning| data.starts_with(beginning))
}

/// A message of an output.
#[derive(Clone, Debug, PartialEq)]
pub struct TappedMessage {
    /// The output.
    pub data: String,
    /// Its type.
    pub output_type: Arc<OutputType>,
    /// Sequence, stamp and publisher.
    pub head: MessageHead,
    /// Its bytes.
    pub payload: Vec<u8>,
}

/// The outputs of a system, as they are published, and the reports of its components. Dropping it ends
/// its threads.
pub struct OutputTaps {
    directory: Directory,
    /// By the instance of each component.
    observed: BTreeMap<u64, ControlConnection>,
    selection: OutputSelection,
    queue: Arc<MessageQueue>,
    tapped: BTreeSet<String>,
    stamper: Stamper,
}

#[derive(Default)]
struct MessageQueue {
    /// The data that system time follows.
    clock: Option<String>,
    state: Mutex<QueueState>,
    arrived: Condvar,
    room: Condvar,
    is_ended: AtomicBool,
}

#[derive(Default)]
struct QueueState {
    messages: VecDeque<TappedMessage>,
    waiting_bytes: usize,
    /// Outputs whose thread has ended: they are tapped again when the registry lists them.
    ended: Vec<String>,
    /// Of each output, the last message so far: its publisher and its number.
    last: BTreeMap<String, (u64, u64)>,
    /// The last reading of the data that system time follows.
    clock_s: f64,
}

impl OutputTaps {
    /// Begins without an output; see [`Self::follow_outputs`]. `clock` is the data that system time
    /// follows, if it follows any.
    pub fn new(directory: Directory, selection: OutputSelection, clock: Option<String>) -> Self {
        Self {
            directory,
            observed: BTreeMap::new(),
            selection,
            queue: Arc::new(MessageQueue { clock: clock.clone(), ..MessageQueue::default() }),
            tapped: BTreeSet::new(),
            stamper: Stamper::new(clock),
        }
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
        for ended in std::mem::take(&mut self.queue.state.lock().ended) {
            self.tapped.remove(&ended);
        }
        for entry in listed.iter().filter(|entry| self.selection.holds(&entry.data)) {
            if self.tapped.insert(entry.data.clone()) {
                self.start_tap(entry.data.clone(), entry.latched);
            }
        }
        Ok(listed)
    }

    /// What the recorder itself adds to the messages.
    pub(crate) fn own_outputs(&self) -> OwnOutputs {
        OwnOutputs {
            queue: Arc::clone(&self.queue),
            directory: self.directory.clone(),
            selection: self.selection.clone(),
        }
    }

    /// Reads no more: what has arrived by now can still be taken.
    pub fn stop(&self) {
        self.queue.is_ended.store(true, Ordering::Relaxed);
        self.queue.room.notify_all();
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
                None if self.queue.is_ended.load(Ordering::Relaxed) => {
                    return self.stamper.take_waiting();
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
                    outputs.push_head(REPORTS, &recorded, head);
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

    fn start_tap(&self, data: String, latched: bool) {
        let (directory, queue) = (self.directory.clone(), Arc::clone(&self.queue));
        let name = format!("tap {data}");
        let failed = data.clone();
        let run = move || {
            // Whatever ends it, the next listing decides whether there is a provider again.
            let _ = read_output(&directory, &data, latched, &queue);
            queue.state.lock().ended.push(data);
        };
        if std::thread::Builder::new().name(name).spawn(run).is_err() {
            self.queue.state.lock().ended.push(failed);
        }
    }
}

impl Drop for OutputTaps {
    fn drop(&mut self) {
        self.stop();
    }
}

fn read_output(
    directory: &Directory,
    data: &str,
    latched: bool,
    queue: &MessageQueue,
) -> Result<(), TapError> {
    let mut tap = Tap::open(directory, data, KEEP, PROVIDER_WITHIN)?;
    let (name, schema) = (tap.type_name().to_owned(), tap.schema().to_string());
    let output_type = Arc::new(OutputType { name, schema, latched });
    while !queue.is_ended.load(Ordering::Relaxed) {
        let Some(message) = tap.next(LOOK)? else { continue };
        let head = MessageHead {
            sequence: message.header.sequence,
            stamp_s: message.header.stamp_s,
            instance: message.header.instance,
            lost: message.lost,
        };
        queue.push(TappedMessage {
            data: data.into(),
            output_type: Arc::clone(&output_type),
            head,
            payload: message.payload,
        });
    }
    Ok(())
}

impl MessageQueue {
    /// Takes a message, waiting for it until `deadline`.
    fn take(&self, deadline: Instant) -> Option<TappedMessage> {
        let mut state = self.state.lock();
        loop {
            if let Some(message) = state.messages.pop_front() {
                state.waiting_bytes -= message.payload.len();
                self.room.notify_one();
                return Some(message);
            }
            if self.arrived.wait_until(&mut state, deadline).timed_out() {
                return None;
            }
        }
    }

    fn push(&self, mut message: TappedMessage) {
        let mut state = self.state.lock();
        if self.is_ended.load(Ordering::Relaxed) {
            return;
        }
        let MessageHead { instance, sequence, .. } = message.head;
        let before = state.last.insert(message.data.clone(), (instance, sequence));
        match before {
            // A latched value is sent again at the start of each link.
            Some((same, last)) if same == instance && sequence <= last => return,
            // What was published between two links counts, too.
            Some((same, last)) if same == instance => message.head.lost = sequence - last - 1,
            _ => {}
        }
        while state.waiting_bytes > MAX_WAITING && !self.is_ended.load(Ordering::Relaxed) {
            self.room.wait_for(&mut state, LOOK);
        }
        state.waiting_bytes += message.payload.len();
        if self.clock.as_ref() == Some(&message.data)
            && let Ok(reading) = codec::decode::<Clock>(&message.payload)
        {
            state.clock_s = reading.clock;
        }
        state.messages.push_back(message);
        self.arrived.notify_one();
    }

    /// Adds a message of the recorder itself, without waiting.
    fn push_own(&self, message: TappedMessage) {
        let mut state = self.state.lock();
        if self.is_ended.load(Ordering::Relaxed) {
            return;
        }
        state.waiting_bytes += message.payload.len();
        state.messages.push_back(message);
        self.arrived.notify_one();
    }

    /// Waits until there is room, or nothing more is taken.
    fn await_room(&self) {
        let mut state = self.state.lock();
        while state.waiting_bytes > MAX_WAITING && !self.is_ended.load(Ordering::Relaxed) {
            self.room.wait_for(&mut state, LOOK);
        }
    }
}

/// The outputs that the recorder itself has in the file, such as the reports. Clones are the same.
#[derive(Clone)]
pub(crate) struct OwnOutputs {
    queue: Arc<MessageQueue>,
    directory: Directory,
    selection: OutputSelection,
}

impl OwnOutputs {
    /// System time, as far as it is known: the recorder's own clock does not follow data.
    pub fn timestamp(&self) -> f64 {
        match &self.queue.clock {
            Some(_) => self.queue.state.lock().clock_s,
            None => self.directory.clock().timestamp(),
        }
    }

    /// Whether an output is recorded: only names that are excluded count.
    pub fn is_recorded(&self, data: &str) -> bool {
        !self.selection.excludes(data)
    }

    /// Whether nothing more is taken.
    pub fn are_over(&self) -> bool {
        self.queue.is_ended.load(Ordering::Relaxed)
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
            self.push_head(data, message, head);
        }
    }

    /// Adds a message with its head, without waiting.
    fn push_head<T: Message>(&self, data: &str, message: &T, head: MessageHead) {
        let Ok(payload) = codec::encode(message) else { return };
        let output_type = Arc::new(OutputType {
            name: T::NAME.into(),
            schema: T::schema().to_string(),
            latched: false,
        });
        self.queue.push_own(TappedMessage { data: data.into(), output_type, head, payload });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_selected_by_name_and_by_component() {
        let all = OutputSelection::default();
        assert!(all.holds("a.x"));
        let some = OutputSelection {
            include: vec!["a.*".into(), "b.y".into()],
            exclude: vec!["a.map".into()],
        };
        let held = ["a.x", "b.y", "a.map", "b.x", "ab.x"].map(|data| some.holds(data));
        assert_eq!(held, [true, true, false, false, false]);
        let there = ["a.x", "b.x"];
        assert_eq!(OutputSelection::find_missing(&some.include, there.into_iter()), ["b.y"]);
        assert_eq!(OutputSelection::find_missing(&some.exclude, there.into_iter()), ["a.map"]);
    }

    #[test]
    fn what_is_missing_between_two_links_is_lost_and_what_comes_again_is_left_out() {
        let queue = MessageQueue::default();
        let push = |instance: u64, sequence: u64| {
            queue.push(TappedMessage {
                data: "a.x".into(),
                output_type: Arc::default(),
                head: MessageHead { instance, sequence, ..MessageHead::default() },
                payload: Vec::new(),
            });
        };
        for (instance, sequence) in [(1, 5), (1, 6), (1, 6), (1, 9), (2, 4), (2, 5)] {
            push(instance, sequence);
        }
        queue.is_ended.store(true, Ordering::Relaxed);
        push(2, 6);
        let heads = std::mem::take(&mut queue.state.lock().messages);
        let heads: Vec<_> = heads.iter().map(|it| (it.head.sequence, it.head.lost)).collect();
        assert_eq!(heads, [(5, 0), (6, 0), (9, 2), (4, 0), (5, 0)]);
    }
}
