//! An input: the data that wait for the component, the state of its link, and its counters. Its
//! thread is in `input_reader.rs`.

use std::net::Shutdown;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use armor_socket::Stream;
use armor_wire::config::InputSettings;
use armor_wire::control::InputStatus;
use armor_wire::frame::{self, DataHeader, FrameKind, PREFIX_LEN};
use armor_wire::hello::Welcome;
use armor_wire::keep::Keep;
use armor_wire::liveness::{BEAT, LOOK, MISSED_BEATS};
use armor_wire::message::Message;
use armor_wire::schema;
use parking_lot::{Condvar, Mutex, MutexGuard};

use super::arrivals::ArrivedSequence;
use super::inbox::{Inbox, InboxItem};
use super::payload::StoredPayload;
use super::pull::{PullDeadline, PullState, PulledMessage};
use crate::counter::SingleWriterCounter;
use crate::declared::DeclaredType;
use crate::message_type::{LearnedType, MessageType};

/// Looks in a row without any byte after which a publisher is taken for dead: those of as many
/// beats as may be missed. The last byte came up to one look before the first of them, so this
/// is noticed after 1.6 to 1.8 s.
const MAX_QUIET_LOOKS: u32 = (BEAT.as_millis() * MISSED_BEATS as u128 / LOOK.as_millis()) as u32;

/// An input of this process.
pub(crate) struct InputPort {
    pub id: String,
    pub required: bool,
    /// Any number of links may feed it: each is a port of its own, of the same id.
    pub many: bool,
    pub type_name: String,
    pub schema: String,
    pub schema_hash: u64,
    /// Of an input that takes any type; shared by all its sources.
    pub learned: Option<Arc<LearnedType>>,
    state: Mutex<InputState>,
    inbox: Mutex<Inbox>,
    /// Whether the inbox holds data. Only the reader adds some, so if it reads `false` while it is
    /// in the component, there are no older data to deliver first.
    pub(super) waiting: AtomicBool,
    /// Notified when a full inbox has room again.
    pub(super) room: Condvar,
    /// Whether the reader waits for bytes, and how many times it has received some, or a message by
    /// shared memory. The reader keeps both without reading a clock; the service thread judges them
    /// at every look.
    pub(super) listening: AtomicBool,
    pub(super) reads: SingleWriterCounter,
    /// The component has been frozen since the last data: what was published meanwhile is not lost.
    pub(super) was_paused: AtomicBool,
    /// Counted by the thread inside the component.
    pub(super) received: SingleWriterCounter,
    pub(super) lost: AtomicU64,
    pub(super) dropped: AtomicU64,
    pub(super) skipped: AtomicU64,
    history_dropped: AtomicU64,
    /// Of an input that pulls.
    pub(super) pull: PullState,
}

/// The state of an input's link.
#[derive(Default)]
pub(super) struct InputState {
    settings: Option<InputSettings>,
    pub stream: Option<Arc<Stream>>,
    pub connections: u64,
    pub problem: String,
    /// Reads up to the last look, and for how many looks there was none.
    reads_before: u64,
    pub quiet_looks: u32,
}

impl InputState {
    fn signal_paused(&self, pause: bool) {
        let kind = if pause { FrameKind::Pause } else { FrameKind::Resume };
        send_signal(self.stream.as_deref(), kind);
    }
}

impl InputPort {
    pub fn new<T: Message>(id: &str, required: bool, many: bool) -> Self {
        let (schema, learned) = (T::schema().to_string(), LearnedType::of_input::<T>());
        Self::unconnected(id, (required, many), T::NAME, (schema, T::schema_hash()), learned)
    }

    /// An input whose messages are taken encoded, by their schema.
    pub fn of_schema(id: &str, required: bool, many: bool, message_type: &MessageType) -> Self {
        let schema = (message_type.schema.clone(), message_type.schema_hash);
        Self::unconnected(id, (required, many), &message_type.name, schema, None)
    }

    /// The same input for one more source.
    pub fn new_source(&self) -> Self {
        let schema = (self.schema.clone(), self.schema_hash);
        let (nature, learned) = ((self.required, self.many), self.learned.clone());
        Self::unconnected(&self.id, nature, &self.type_name, schema, learned)
    }

    fn unconnected(
        id: &str,
        (required, many): (bool, bool),
        type_name: &str,
        (schema, schema_hash): (String, u64),
        learned: Option<Arc<LearnedType>>,
    ) -> Self {
        Self {
            id: id.into(),
            required,
            many,
            type_name: type_name.into(),
            schema,
            schema_hash,
            learned,
            state: Mutex::default(),
            inbox: Mutex::new(Inbox::new(Keep::Latest)),
            waiting: AtomicBool::new(false),
            room: Condvar::new(),
            listening: AtomicBool::new(false),
            reads: SingleWriterCounter::default(),
            was_paused: AtomicBool::new(false),
            received: SingleWriterCounter::default(),
            lost: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
            skipped: AtomicU64::new(0),
            history_dropped: AtomicU64::new(0),
            pull: PullState::default(),
        }
    }

    pub(super) fn lock_state(&self) -> MutexGuard<'_, InputState> {
        self.state.lock()
    }

    pub(super) fn lock_inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock()
    }

    /// The type it was declared with, or that it has learned.
    pub fn declared(&self) -> DeclaredType<'_> {
        let learned = self.learned.as_ref().and_then(|learned| learned.known());
        let (name, schema_hash) = match learned {
            Some(known) => (known.name.as_str(), known.schema_hash),
            None => (self.type_name.as_str(), self.schema_hash),
        };
        DeclaredType { input: &self.id, name, schema_hash, learned }
    }

    /// Sets what feeds this input, as the file specifies.
    pub fn connect(&self, settings: InputSettings) {
        self.lock_inbox().set_keep(settings.keep);
        self.pull.set_pulling(settings.keep == Keep::Pull);
        self.lock_state().settings = Some(settings);
    }

    /// What feeds this input; `None` if nothing does.
    pub fn settings(&self) -> Option<InputSettings> {
        self.lock_state().settings.clone()
    }

    /// System-wide name of the data that feeds it.
    pub fn data(&self) -> Option<String> {
        self.lock_state().settings.as_ref().map(|settings| settings.data.clone())
    }

    pub fn status(&self) -> InputStatus {
        let waiting = self.lock_inbox().count() as u64;
        let state = self.lock_state();
        let settings = state.settings.as_ref();
        InputStatus {
            id: self.id.clone(),
            data: settings.map(|s| s.data.clone()).unwrap_or_default(),
            connected: state.stream.is_some(),
            received: self.received.count(),
            waiting,
            lost: self.lost.load(Ordering::Relaxed),
            dropped: self.dropped.load(Ordering::Relaxed),
            skipped: self.skipped.load(Ordering::Relaxed),
            history_dropped: self.history_dropped.load(Ordering::Relaxed),
            connections: state.connections,
            problem: state.problem.clone(),
        }
    }

    /// Takes the stream of a new link, on which the request has asked for `paused`. The component may
    /// have been activated or frozen since then: the publisher is sent what has changed.
    pub(super) fn begin_link(
        &self,
        stream: Arc<Stream>,
        paused: bool,
        is_active: impl FnOnce() -> bool,
    ) {
        let mut state = self.lock_state();
        state.stream = Some(stream);
        state.connections += 1;
        state.quiet_looks = 0;
        state.problem.clear();
        // Read and sent under the lock: a change that comes later is signalled by `set_paused`, behind
        // this signal. In the other order an active component would stay paused.
        let pause = !is_active();
        if pause != paused {
            state.signal_paused(pause);
        }
    }

    /// Asks the publisher to pause, or to continue, after the component has changed.
    pub fn set_paused(&self, pause: bool) {
        let state = self.lock_state();
        if pause {
            self.was_paused.store(true, Ordering::Relaxed);
        }
        state.signal_paused(pause);
        drop(state);
        if pause {
            // The data that still wait belong to the activation that has ended.
            let mut inbox = self.lock_inbox();
            inbox.clear();
            self.waiting.store(false, Ordering::Relaxed);
            drop(inbox);
            self.room.notify_all();
        }
    }

    /// Counts messages of its history that were dropped before their time.
    pub fn count_dropped_history(&self, dropped: u64) {
        if dropped > 0 {
            self.history_dropped.fetch_add(dropped, Ordering::Relaxed);
        }
    }

    /// Whether it asks for its data before each call of `exec`.
    pub fn is_pulling(&self) -> bool {
        self.pull.is_pulling()
    }

    /// Asks the publisher for data that are newer than the last, unless the link has memory, which
    /// holds them already.
    pub fn ask_newest(&self) {
        if self.pull.has_memory() {
            return;
        }
        let state = self.lock_state();
        let Some(stream) = state.stream.as_deref() else { return };
        self.pull
            .ask(|| matches!(stream.try_send(&frame::signal(FrameKind::Sync)), Ok(PREFIX_LEN)));
    }

    /// Takes the newest data: from the memory of the link, or when the publisher has answered, but
    /// not beyond `deadline`. `None` if there are none that are newer than the last.
    pub fn take_pulled(&self, deadline: &PullDeadline) -> Option<InboxItem> {
        self.pull.wait_until(deadline);
        let answer = self.lock_inbox().pop();
        let item = match self.take_from_memory(deadline) {
            Some(newer) => {
                self.skipped.fetch_add(u64::from(answer.is_some()), Ordering::Relaxed);
                newer
            }
            None => answer?,
        };
        self.received.increment();
        Some(item)
    }

    fn take_from_memory(&self, deadline: &PullDeadline) -> Option<InboxItem> {
        let taken = self
            .pull
            .take_from_memory(deadline, |arrived, header| self.follow_sequence(arrived, header));
        let PulledMessage { header, lost, slot, passed_over } = match taken {
            Ok(message) => message?,
            Err(reason) => {
                tracing::warn!("a pull of `{}` ends its link: {reason}", self.id);
                self.close_link();
                return None;
            }
        };
        self.skipped.fetch_add(passed_over, Ordering::Relaxed);
        // It waits in no inbox, so no other data come before it.
        Some(InboxItem {
            arrival: 0,
            header,
            lost,
            arrived_s: 0.0,
            payload: StoredPayload::Slot(slot),
        })
    }

    /// Compares with the data so far: how many are missing before these, or `None` if they have been
    /// received before. Counts the losses.
    pub(super) fn follow_sequence(
        &self,
        arrived: &mut ArrivedSequence,
        header: &DataHeader,
    ) -> Option<u64> {
        let was_paused = self.was_paused.load(Ordering::Relaxed);
        let lost = arrived.follow(header, was_paused)?;
        if was_paused {
            self.was_paused.store(false, Ordering::Relaxed);
        }
        if lost > 0 && self.is_pulling() {
            // No pull has asked for what was published between two pulls.
            self.skipped.fetch_add(lost, Ordering::Relaxed);
            return Some(0);
        }
        if lost > 0 {
            self.lost.fetch_add(lost, Ordering::Relaxed);
        }
        Some(lost)
    }

    /// Sends the publisher a beat.
    pub fn send_beat(&self) {
        send_signal(self.lock_state().stream.as_deref(), FrameKind::Beat);
    }

    /// Ends the link if nothing has come from the publisher for too long; called by the service
    /// thread every [`LOOK`].
    pub fn check_silence(&self) {
        let mut state = self.lock_state();
        let reads = self.reads.count();
        // A reader that is busy in the component's code does not listen: that is not the
        // publisher's silence.
        let is_quiet = self.listening.load(Ordering::Relaxed) && reads == state.reads_before;
        state.quiet_looks = if is_quiet { state.quiet_looks + 1 } else { 0 };
        state.reads_before = reads;
        if state.quiet_looks > MAX_QUIET_LOOKS
            && let Some(stream) = state.stream.take()
        {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Ends its link.
    pub fn close_link(&self) {
        if let Some(stream) = &self.lock_state().stream {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// The arrival of the data that have waited longest; `None` if none wait.
    pub fn oldest_arrival(&self) -> Option<u64> {
        if self.waiting.load(Ordering::Relaxed) { self.lock_inbox().oldest_arrival() } else { None }
    }

    /// Hands waiting data that arrived before `end` to `deliver` until there are none or it returns
    /// `true` because it must stop. Returns whether it did.
    pub fn deliver_waiting(&self, end: u64, mut deliver: impl FnMut(&InboxItem) -> bool) -> bool {
        loop {
            let mut inbox = self.lock_inbox();
            if inbox.oldest_arrival().is_some_and(|arrival| arrival >= end) {
                return false;
            }
            let item = inbox.pop();
            self.waiting.store(!inbox.is_empty(), Ordering::Relaxed);
            drop(inbox);
            let Some(item) = item else { return false };
            self.room.notify_all();
            let must_stop = deliver(&item);
            self.received.increment();
            if must_stop {
                return true;
            }
        }
    }

    /// The schema to look up; empty if it takes any.
    pub(super) fn wanted_schema(&self) -> &str {
        if self.learned.is_some() { "" } else { &self.schema }
    }

    /// Compares the schema of the provider that has answered with the one that is expected: another
    /// build of it may publish another type by the same name.
    pub(super) fn check_type(welcome: &Welcome, expected: &str) -> Result<(), String> {
        let Welcome { name, schema, .. } = welcome;
        if schema == expected {
            return Ok(());
        }
        let how = schema::difference((name, schema), ("this input", expected));
        Err(format!("`{name}` sends another type than it has registered\n{how}"))
    }
}

fn send_signal(stream: Option<&Stream>, kind: FrameKind) {
    if let Some(stream) = stream {
        // Eight bytes: they fit, or the connection is as good as dead and its reader will notice.
        let _ = stream.try_send(&frame::signal(kind));
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixStream;

    use armor_wire::frame::FrameReader;

    use super::*;
    use crate::messages::Flag;

    /// The signals that the publisher has been sent.
    fn read_signals(publisher: &Stream) -> Vec<FrameKind> {
        let mut reader = FrameReader::with_limit(0);
        let len = publisher.try_receive(reader.space()).unwrap_or(0);
        reader.filled(len);
        std::iter::from_fn(|| reader.next_frame().expect("whole frames").map(|frame| frame.kind))
            .collect()
    }

    fn stream_pair() -> (Arc<Stream>, Stream) {
        let (near, far) = UnixStream::pair().expect("two sockets");
        (Arc::new(Stream::Unix(near)), Stream::Unix(far))
    }

    #[test]
    fn a_new_link_sends_what_has_changed_since_its_request() {
        for (paused, active, expected) in [
            (false, true, None),
            (true, false, None),
            (true, true, Some(FrameKind::Resume)),
            (false, false, Some(FrameKind::Pause)),
        ] {
            let input = InputPort::new::<Flag>("in", false, false);
            let (near, publisher) = stream_pair();
            input.begin_link(near, paused, || active);
            assert_eq!(read_signals(&publisher), Vec::from_iter(expected));
            let status = input.status();
            assert_eq!((status.connected, status.connections), (true, 1));
        }
    }

    #[test]
    fn an_activation_while_a_link_begins_is_the_last_that_its_publisher_hears() {
        let input = InputPort::new::<Flag>("in", false, false);
        let (near, publisher) = stream_pair();
        std::thread::scope(|scope| {
            input.begin_link(near, false, || {
                // The component has been frozen since the request; now it is activated.
                scope.spawn(|| input.set_paused(false));
                assert!(input.state.try_lock().is_none(), "the activation must wait for the link");
                false
            });
        });
        assert_eq!(read_signals(&publisher), [FrameKind::Pause, FrameKind::Resume]);
    }
}
