//! The thread of an input: finds the provider of its data, links to it, reads, and comes back when
//! the link is lost.
//!
//! It also runs the component's code whenever the component is free: no hand-over between threads
//! on a message's path.

mod datagram_visits;
mod ring_visits;

use std::collections::VecDeque;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use armor_socket::{Stream, is_temporary};
use armor_wire::backoff::Backoff;
use armor_wire::config::InputSettings;
use armor_wire::frame::{
    self, DataHeader, FLAG_FOLLOWS, Frame, FrameKind, FrameReader, PREFIX_LEN,
};
use armor_wire::hello::{Hello, LinkRequest, Purpose};
use armor_wire::keep::{Keep, Wake};
use armor_wire::schema;
use armor_wire::shared_memory::MemoryUse;
use armor_wire::transport::Transport;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::arrivals::ArrivedSequence;
use super::catch_up::{CatchUp, NewestFrame};
use super::datagrams_in::{DatagramReader, is_about_datagrams};
use super::inbox::InboxItem;
use super::input::InputPort;
use super::memory_in::{MemoryReader, NO_MEMORY};
use super::payload::{Payload, StoredPayload};
use crate::dial::{self, Dialled};
use crate::message_type::MessageType;
use crate::participant::Participant;
use crate::runtime::{EnteredComponent, Runtime};

/// First and longest delay between two attempts to link. After a cut a link needs the registry, then
/// its provider: two of these delays, and a second for both.
const RETRY: (Duration, Duration) = (Duration::from_millis(10), Duration::from_millis(400));
/// A link that lasted this long was a good one: the next attempt is made after the first delay.
const GOOD_LINK: Duration = Duration::from_secs(2);
/// How long a `keep="all"` reader waits for room in the inbox before it looks whether the component
/// is still active.
const ROOM_LOOK: Duration = Duration::from_millis(100);

/// A component that was busy for longer than this asks for the newest data if any have come
/// meanwhile. The answer takes a tenth of it.
const BUSY: Duration = Duration::from_millis(1);
/// A publisher that sends nothing for this long does not run: the newest that has come is delivered.
const ANSWER_WITHIN: Duration = Duration::from_millis(100);

/// Header, how many are missing before it, and payload.
type ArrivedData<'a> = (DataHeader, u64, &'a [u8]);

/// How far one link has been read.
struct ReadState<'a> {
    arrived: &'a mut ArrivedSequence,
    stream: &'a Stream,
    /// The process start that publishes.
    instance: u64,
    catch_up: CatchUp,
    /// Came with bytes that have been received.
    files: VecDeque<OwnedFd>,
    /// Once the publisher has offered it.
    memory: Option<MemoryReader>,
    /// Messages taken from it since the socket was read.
    taken_from_ring: usize,
    /// Once the publisher has offered them.
    datagrams: Option<DatagramReader>,
}

/// See the module.
pub(crate) struct InputReader {
    input: Arc<InputPort>,
    /// Index of the input among the component's.
    index: usize,
    settings: InputSettings,
    runtime: Arc<Runtime>,
}

impl ReadState<'_> {
    /// Whether the newest data arrive without a question to the publisher.
    fn brings_newest(&self) -> bool {
        let by_datagrams = |it: &DatagramReader| it.is_in_datagrams() || it.is_ordered();
        self.memory.is_some() || self.datagrams.as_ref().is_some_and(by_datagrams)
    }
}

impl InputReader {
    /// The reader of input `index`; `None` if nothing feeds it.
    pub fn new(input: Arc<InputPort>, index: usize, runtime: Arc<Runtime>) -> Option<Self> {
        let mut settings = input.settings()?;
        if settings.keep == Keep::Pull {
            // Data come when the component asks, so polling would only cost a core.
            settings.wake = Wake::Sleep;
        }
        Some(Self { input, index, settings, runtime })
    }

    fn participant(&self) -> &Participant {
        &self.runtime.participant
    }

    /// Reads for the life of the process.
    pub fn read_links(self) {
        let mut arrived = ArrivedSequence::default();
        let seed = self.participant().identity.instance ^ self.index as u64;
        let mut backoff = Backoff::new(RETRY.0, RETRY.1, seed);
        while !self.participant().lifecycle.has_left() {
            let start = Instant::now();
            let reason = match self.open_link() {
                Ok(dialled) => {
                    let reason = self.read_link(dialled, &mut arrived);
                    self.input.lock_state().stream = None;
                    self.input.pull.forget(&mut arrived);
                    tracing::info!("link from {} closed: {reason}", self.settings.data);
                    reason
                }
                Err(reason) => {
                    if self.input.lock_state().problem != reason {
                        tracing::warn!("no link from {} yet: {reason}", self.settings.data);
                    }
                    reason
                }
            };
            self.input.lock_state().problem = reason;
            // A provider that accepts and closes immediately is no success: the delay keeps
            // growing.
            if start.elapsed() > GOOD_LINK {
                backoff.reset();
            }
            std::thread::sleep(backoff.delay());
        }
    }

    /// Finds the provider and links to it.
    fn open_link(&self) -> Result<Dialled, String> {
        let (input, settings) = (&self.input, &self.settings);
        let participant = self.participant();
        // Asked for each link: a restarted provider has another endpoint and another instance.
        let answer =
            participant.directory().request_provider(&settings.data, input.wanted_schema());
        let found =
            answer.recv().map_err(|e| e.to_string())?.map_err(|refusal| refusal.to_string())?;
        // An input that takes any type expects the one that the registry knows.
        let expected = if let Some(learned) = &input.learned {
            learned.check(&MessageType::of_entry(&found.entry), &input.id)?;
            &found.entry.schema
        } else {
            &input.schema
        };
        let paused = !participant.lifecycle.is_active();
        let link = LinkRequest {
            data: settings.data.clone(),
            instance: found.provider.instance,
            schema: expected.clone(),
            schema_hash: schema::hash_text(expected),
            keep: settings.keep,
            wake: settings.wake,
            paused,
            history: settings.history,
            memory: match settings.transport {
                // A pull takes what is there; over the socket it asks, and waits.
                Transport::Auto if settings.keep == Keep::Pull => MemoryUse::Always,
                Transport::Auto => MemoryUse::Large,
                Transport::Shm => MemoryUse::Always,
                Transport::Tcp | Transport::Udp => MemoryUse::Never,
            },
            datagrams: settings.transport == Transport::Udp,
        };
        let identity = &participant.identity;
        let mut hello = Hello::new(&identity.name, identity.instance, Purpose::Link { link });
        found.prove_link(&mut hello);
        let dialled = dial::dial_component(&found.provider, &hello, settings.transport)
            .map_err(|error| error.to_string())?;
        InputPort::check_type(&dialled.welcome, expected)?;
        if let Some(learned) = &input.learned
            && let Some(message_type) =
                learned.learn(MessageType::of_entry(&found.entry), &input.id)?
        {
            participant.give_outputs_type(&message_type);
        }
        let stream = dialled.stream.try_clone().map_err(|error| error.to_string())?;
        input.begin_link(Arc::new(stream), paused, || participant.lifecycle.is_active());
        Ok(dialled)
    }

    /// Reads until the link ends; returns why it did.
    fn read_link(&self, mut dialled: Dialled, arrived: &mut ArrivedSequence) -> String {
        let Dialled { stream, reader, files, welcome } = &mut dialled;
        if let Err(error) = stream.set_read_timeout(None) {
            return error.to_string();
        }
        arrived.begin_link();
        let mut state = ReadState {
            arrived,
            stream,
            instance: welcome.instance,
            catch_up: CatchUp::default(),
            files: std::mem::take(files),
            memory: None,
            taken_from_ring: 0,
            datagrams: None,
        };
        let stream = &*stream;
        let wants_newest = self.settings.keep == Keep::Latest;
        let mut newest: Option<NewestFrame> = None;
        loop {
            let start = wants_newest.then(Instant::now);
            if let Some(NewestFrame { header, lost, payload }) = newest.take() {
                let payload = Payload::Buffer(&payload);
                self.hand_over(&mut self.runtime.try_enter(), header, lost, payload);
            }
            if let Err(reason) = self.process_frames(reader, &mut state) {
                return reason;
            }
            if let Err(reason) = self.process_ring(stream, reader, &mut state) {
                return reason;
            }
            self.process_datagrams(&mut state);
            // A reader that only brings answers to pulls has not been inside the component, and must not
            // begin a pull whose answer it would have to bring itself.
            if self.settings.keep != Keep::Pull {
                self.runtime.after_release();
            }
            // Ring and datagrams bring the newest, and are emptied before each wait.
            if !state.brings_newest() && start.is_some_and(|start| start.elapsed() > BUSY) {
                match self.catch_up(stream, reader, &mut state) {
                    Ok(None) => {}
                    Ok(found) => {
                        newest = found;
                        continue;
                    }
                    Err(reason) => return reason,
                }
            }
            self.input.listening.store(true, Ordering::Relaxed);
            let received = self.receive_bytes(stream, reader, &mut state);
            self.input.listening.store(false, Ordering::Relaxed);
            match received {
                // The service thread takes the stream of a link that it ends.
                Ok(0) if self.input.lock_state().stream.is_none() => {
                    return "the publisher fell silent".into();
                }
                Ok(0) => return "the publisher closed it".into(),
                Ok(len) => {
                    reader.filled(len);
                    self.input.reads.increment();
                }
                Err(error) if is_temporary(&error) => {}
                Err(error) => return error.to_string(),
            }
        }
    }

    /// Reads what was published while the component was busy, and returns the newest of it.
    fn catch_up(
        &self,
        stream: &Stream,
        reader: &mut FrameReader,
        state: &mut ReadState<'_>,
    ) -> Result<Option<NewestFrame>, String> {
        let mut newest: Option<NewestFrame> = None;
        let mut has_asked = false;
        loop {
            match stream.try_receive_with_files(reader.space(), &mut state.files) {
                Ok(0) => return Ok(newest),
                Ok(len) => {
                    reader.filled(len);
                    self.input.reads.increment();
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    // Nothing has come meanwhile: what has been delivered is the newest.
                    let is_done = !has_asked || state.catch_up.is_done();
                    if is_done || !wait_for_bytes(stream, ANSWER_WITHIN) {
                        return Ok(newest);
                    }
                    continue;
                }
                Err(error) if is_temporary(&error) => continue,
                Err(error) => return Err(error.to_string()),
            }
            if !has_asked {
                if !matches!(stream.try_send(&frame::signal(FrameKind::Sync)), Ok(PREFIX_LEN)) {
                    return Ok(newest);
                }
                state.catch_up.asked();
                has_asked = true;
            }
            while let Some(frame) = reader.next_frame().map_err(|error| error.to_string())? {
                let Some((header, lost, payload)) = self.take_data(&frame, state)? else {
                    continue;
                };
                let mut buffer = match newest.take() {
                    Some(older) => {
                        self.input.dropped.fetch_add(1, Ordering::Relaxed);
                        older.payload
                    }
                    None => Vec::new(),
                };
                buffer.clear();
                buffer.extend_from_slice(payload);
                newest = Some(NewestFrame { header, lost, payload: buffer });
            }
        }
    }

    /// The data in a frame, if there are any that have not come before.
    fn take_data<'a>(
        &self,
        frame: &Frame<'a>,
        state: &mut ReadState<'_>,
    ) -> Result<Option<ArrivedData<'a>>, String> {
        match frame.kind {
            FrameKind::Beat => return Ok(None),
            FrameKind::Synced => {
                let follows = frame.flags & FLAG_FOLLOWS != 0;
                if self.settings.keep == Keep::Pull {
                    self.input.pull.answer(follows);
                } else {
                    state.catch_up.answered(follows);
                }
                return Ok(None);
            }
            FrameKind::Ready => return Ok(None),
            FrameKind::MemoryOffer => {
                let memory = MemoryReader::open(frame, &mut state.files)?;
                if self.settings.keep == Keep::Pull {
                    self.input.pull.open_memory(memory, *state.arrived);
                } else {
                    state.memory = Some(memory);
                }
                return Ok(None);
            }
            kind if is_about_datagrams(kind) => {
                return self.follow_datagrams(frame, state).map(|()| None);
            }
            FrameKind::SlotOffer | FrameKind::SlotEnd if self.settings.keep == Keep::Pull => {
                return self.input.pull.follow_slot(frame, &mut state.files).map(|()| None);
            }
            FrameKind::SlotOffer | FrameKind::SlotEnd => {
                let memory = state.memory.as_mut().ok_or(NO_MEMORY)?;
                return memory.follow(frame, &mut state.files).map(|()| None);
            }
            _ => {}
        }
        let (header, payload) = frame.data().map_err(|error| error.to_string())?;
        state.catch_up.received();
        if let Some(datagrams) = state.datagrams.as_mut().filter(|it| it.is_ordered()) {
            datagrams.receive_by_stream(&header, payload);
            return Ok(None);
        }
        let lost = self.input.follow_sequence(state.arrived, &header);
        Ok(lost.map(|lost| (header, lost, payload)))
    }

    /// Hands over all whole frames that have been received, in one visit to the component if it is
    /// free.
    fn process_frames(
        &self,
        reader: &mut FrameReader,
        state: &mut ReadState<'_>,
    ) -> Result<(), String> {
        let mut entered = None;
        loop {
            // A newer frame is complete behind this one, and `keep="latest"` asks for that alone.
            let is_superseded = self.settings.keep == Keep::Latest && reader.is_superseded();
            let Some(frame) = reader.next_frame().map_err(|error| error.to_string())? else {
                return Ok(());
            };
            let Some((header, lost, payload)) = self.take_data(&frame, state)? else { continue };
            if is_superseded {
                self.input.dropped.fetch_add(1, Ordering::Relaxed);
                continue;
            }
            if self.settings.keep == Keep::Pull {
                self.store_pulled(header, lost, payload);
                continue;
            }
            if entered.is_none() {
                entered = self.runtime.try_enter();
            }
            self.hand_over(&mut entered, header, lost, Payload::Buffer(payload));
        }
    }

    /// The present time, if calls are traced; otherwise 0.
    fn arrival_s(&self) -> f64 {
        self.participant().ports.trace.time_s().unwrap_or_default()
    }

    /// Stores the answer to a pull for the thread that waits for it, or for the next pull if it has
    /// come too late.
    fn store_pulled(&self, header: DataHeader, lost: u64, payload: &[u8]) {
        let payload = StoredPayload::Copied(payload.to_vec());
        let arrival = self.runtime.next_arrival();
        let arrived_s = self.arrival_s();
        let item = InboxItem { arrival, header, lost, arrived_s, payload };
        let unseen = self.input.lock_inbox().push(item);
        self.input.skipped.fetch_add(unseen, Ordering::Relaxed);
        self.input.pull.receive();
    }

    /// Runs the component's code on the data, or keeps the data until the component is free.
    fn hand_over(
        &self,
        entered: &mut Option<EnteredComponent<'_>>,
        header: DataHeader,
        lost: u64,
        payload: Payload<'_>,
    ) {
        let (input, runtime) = (&self.input, &self.runtime);
        // Older data that wait in the inbox go first.
        if let Some(component) = entered
            && !input.waiting.load(Ordering::Relaxed)
        {
            component.deliver_data(self.index, header, lost, self.arrival_s(), payload);
            input.received.increment();
            if runtime.main_waits() {
                *entered = None;
                runtime.after_release();
            }
            return;
        }
        // Left before waiting for room: only a thread inside the component makes room.
        *entered = None;
        let arrived_s = self.arrival_s();
        let mut inbox = input.lock_inbox();
        while inbox.is_full() && runtime.participant.lifecycle.is_active() {
            runtime.wake_main();
            input.room.wait_for(&mut inbox, ROOM_LOOK);
        }
        let arrival = runtime.next_arrival();
        let payload = payload.store(StoredPayload::default());
        let dropped = inbox.push(InboxItem { arrival, header, lost, arrived_s, payload });
        // Counted before the inbox is released: otherwise a status could miss a loss that has
        // happened.
        input.dropped.fetch_add(dropped, Ordering::Relaxed);
        input.waiting.store(true, Ordering::Relaxed);
        drop(inbox);
        runtime.add_backlog();
    }
}

/// Returns whether bytes, or the end, have come within `limit`.
fn wait_for_bytes(stream: &Stream, limit: Duration) -> bool {
    let mut fds = [PollFd::new(stream, PollFlags::IN)];
    let limit = Timespec { tv_sec: 0, tv_nsec: i64::from(limit.subsec_nanos()) };
    poll(&mut fds, Some(&limit)).is_ok_and(|ready| ready > 0)
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use armor_wire::control::RunState;
    use armor_wire::transport::Transport;

    use super::*;
    use crate::call::{Call, Fault, Outcome};
    use crate::data::{Data, Header};
    use crate::identity::ProcessIdentity;
    use crate::messages::Flag;
    use crate::parameter::Value;
    use crate::participant::Declarations;
    use crate::user_code::UserCode;

    /// Only a hang takes this long.
    const DEADLINE: Duration = Duration::from_secs(20);

    struct NoCode;

    impl UserCode for NoCode {
        fn receive_parameter(&mut self, _: &str, _: &Value) -> Result<(), Fault> {
            Ok(())
        }
        fn receive_data(&mut self, _: &Header<'_>, _: &Data<'_>) -> Result<(), Fault> {
            Ok(())
        }
        fn execute(&mut self, _: Call) -> Result<Outcome, Fault> {
            Ok(Outcome::CarryOn)
        }
    }

    /// The reader of an input of an active component.
    pub(super) fn reader(keep: Keep, wake: Wake) -> InputReader {
        let identity = ProcessIdentity { name: "sink".into(), kind: "sink".into(), instance: 1 };
        let participant =
            Arc::new(Participant::new(identity, Declarations::default(), false).unwrap());
        participant.ports.add_input::<Flag>("in", true, false).unwrap();
        let input = participant.ports.inputs().remove(0);
        let (id, data, transport) = ("in".into(), "source.out".into(), Transport::Auto);
        input.connect(InputSettings { id, data, keep, wake, transport, history: 1 });
        participant.lifecycle.enter_state(RunState::Active, 0);
        let runtime = Arc::new(Runtime::new(Box::new(NoCode), participant, None));
        InputReader::new(input, 0, runtime).expect("it is fed")
    }

    #[test]
    fn a_reader_of_a_link_that_pulls_does_not_poll() {
        let wakes = [Keep::Latest, Keep::Pull].map(|keep| reader(keep, Wake::Spin).settings.wake);
        assert_eq!(wakes, [Wake::Spin, Wake::Sleep]);
    }

    #[test]
    fn a_reader_that_waits_for_room_does_not_stay_in_the_component() {
        let reader = reader(Keep::ALL, Wake::Sleep);
        let header = DataHeader { sequence: 0, stamp_s: 0.0, instance: 1, fresh: false };
        let payload = StoredPayload::Copied(vec![0; 2 << 20]);
        let full = InboxItem { arrival: 0, header, lost: 0, arrived_s: 0.0, payload };
        reader.input.lock_inbox().push(full);
        reader.input.waiting.store(true, Ordering::Relaxed);
        let (sender, entered) = channel();
        std::thread::scope(|scope| {
            let handed = scope.spawn(|| {
                let mut component = reader.runtime.try_enter();
                sender.send(component.is_some()).unwrap();
                reader.hand_over(&mut component, header, 0, Payload::Buffer(&[0; 10]));
            });
            assert_eq!(entered.recv(), Ok(true));
            let start = Instant::now();
            while reader.runtime.try_enter().is_none() {
                assert!(start.elapsed() < DEADLINE, "the component is never free");
                std::thread::yield_now();
            }
            reader.input.deliver_waiting(1, |_| false);
            handed.join().unwrap();
        });
        assert_eq!(reader.input.status().received, 2, "the second is delivered by its reader");
    }
}
