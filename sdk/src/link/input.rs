//! An input: finds who provides its data, links to it, reads, and comes back when it is lost.
//!
//! One thread per input reads and, when the component is free, runs its code then and there: no hand
//! over between threads on the way of a message.

use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use armor_wire::backoff::Backoff;
use armor_wire::config::InputSettings;
use armor_wire::control::InputStatus;
use armor_wire::frame::{self, DataHeader, FrameKind};
use armor_wire::hello::{Hello, LinkRequest, Purpose, Welcome};
use armor_wire::keep::{Keep, Wake};
use armor_wire::liveness::MISSED_BEATS;
use armor_wire::message::Message;
use armor_wire::schema;
use rustix::net::{RecvFlags, SendFlags, recv, send};

use super::inbox::{Inbox, Item};
use crate::runtime::Runtime;
use crate::session::is_timeout;
use crate::shared::increment;
use crate::socket::{self, Dialled};

/// How often a spinning reader looks whether the component is still active, in polls.
const SPINS_PER_LOOK: u32 = 1 << 12;

/// An input of this process.
pub(crate) struct Input {
    pub id: String,
    pub required: bool,
    pub type_name: &'static str,
    pub schema: String,
    state: Mutex<State>,
    inbox: Mutex<Inbox>,
    /// Whether the inbox holds data. Only the reader puts some in, so if it reads `false` while it
    /// is in the component, nothing older is left to deliver.
    waiting: AtomicBool,
    room: Condvar,
    /// The reader waits for the publisher, and how often it has heard it: kept by the reader without
    /// a clock, judged by the service thread at every beat.
    listening: AtomicBool,
    reads: AtomicU64,
    /// The component has been frozen since the last data: what was published meanwhile is not lost.
    was_paused: AtomicBool,
    received: AtomicU64,
    lost: AtomicU64,
    dropped: AtomicU64,
}

#[derive(Default)]
struct State {
    settings: Option<InputSettings>,
    stream: Option<Arc<TcpStream>>,
    connections: u64,
    problem: String,
    /// How often the publisher had been heard at the last beat, and for how many beats no more.
    reads_before: u64,
    quiet_beats: u32,
}

/// The last data that arrived.
#[derive(Clone, Copy)]
struct Last {
    instance: u64,
    sequence: u64,
}

impl Input {
    pub fn new<T: Message>(id: &str, required: bool) -> Self {
        Self {
            id: id.into(),
            required,
            type_name: T::NAME,
            schema: T::schema().to_string(),
            state: Mutex::default(),
            inbox: Mutex::new(Inbox::new(Keep::Latest)),
            waiting: AtomicBool::new(false),
            room: Condvar::new(),
            listening: AtomicBool::new(false),
            reads: AtomicU64::new(0),
            was_paused: AtomicBool::new(false),
            received: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How the file feeds this input.
    pub fn connect(&self, settings: InputSettings) {
        self.inbox().set_keep(settings.keep);
        self.lock().settings = Some(settings);
    }

    /// System-wide name of the data that feeds it.
    pub fn data(&self) -> Option<String> {
        self.lock().settings.as_ref().map(|settings| settings.data.clone())
    }

    pub fn status(&self) -> InputStatus {
        let waiting = self.inbox().count() as u64;
        let state = self.lock();
        let settings = state.settings.as_ref();
        InputStatus {
            id: self.id.clone(),
            data: settings.map(|s| s.data.clone()).unwrap_or_default(),
            connected: state.stream.is_some(),
            received: self.received.load(Ordering::Relaxed),
            waiting,
            lost: self.lost.load(Ordering::Relaxed),
            dropped: self.dropped.load(Ordering::Relaxed),
            connections: state.connections,
            problem: state.problem.clone(),
        }
    }

    /// Tells the publisher to stop or to go on sending.
    pub fn pause(&self, pause: bool) {
        let state = self.lock();
        if pause {
            self.was_paused.store(true, Ordering::Relaxed);
        }
        let kind = if pause { FrameKind::Pause } else { FrameKind::Resume };
        signal(state.stream.as_deref(), kind);
        drop(state);
        if pause {
            // Whatever still waits belongs to the activation that has ended.
            let mut inbox = self.inbox();
            inbox.clear();
            self.waiting.store(false, Ordering::Relaxed);
            drop(inbox);
            self.room.notify_all();
        }
    }

    /// Says to the publisher that this process is alive, and ends the link if the publisher has not
    /// said so for too long; called by the service thread at every beat.
    pub fn beat(&self) {
        let mut state = self.lock();
        signal(state.stream.as_deref(), FrameKind::Beat);
        let reads = self.reads.load(Ordering::Relaxed);
        // A reader that is busy in the component's code does not listen: that is no silence.
        let is_quiet = self.listening.load(Ordering::Relaxed) && reads == state.reads_before;
        state.quiet_beats = if is_quiet { state.quiet_beats + 1 } else { 0 };
        state.reads_before = reads;
        if state.quiet_beats >= MISSED_BEATS
            && let Some(stream) = state.stream.take()
        {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Ends its link.
    pub fn close(&self) {
        if let Some(stream) = &self.lock().stream {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// The arrival of the data that have waited longest.
    pub fn oldest(&self) -> Option<u64> {
        if self.waiting.load(Ordering::Relaxed) { self.inbox().oldest() } else { None }
    }

    /// Hands waiting data that arrived before `end` to `deliver` until there are none or it says
    /// that it has enough; whether it does.
    pub fn drain(&self, end: u64, mut deliver: impl FnMut(&Item) -> bool) -> bool {
        loop {
            let mut inbox = self.inbox();
            if inbox.oldest().is_some_and(|arrival| arrival >= end) {
                return false;
            }
            let item = inbox.pop();
            self.waiting.store(!inbox.is_empty(), Ordering::Relaxed);
            drop(inbox);
            let Some(item) = item else { return false };
            self.room.notify_all();
            let enough = deliver(&item);
            increment(&self.received);
            if enough {
                return true;
            }
        }
    }

    /// Reads for the life of the process.
    pub fn run(self: &Arc<Self>, index: usize, runtime: &Arc<Runtime>) {
        let Some(settings) = self.lock().settings.clone() else { return };
        let seed = runtime.shared.instance ^ index as u64;
        let mut backoff = Backoff::new(Duration::from_millis(10), Duration::from_secs(1), seed);
        let mut last = None;
        while !runtime.shared.is_gone() {
            let start = Instant::now();
            let reason = match self.link(&settings, runtime) {
                Ok(dialled) => {
                    let reason = self.read(dialled, &mut last, index, &settings, runtime);
                    self.lock().stream = None;
                    tracing::info!("link from {} closed: {reason}", settings.data);
                    reason
                }
                Err(reason) => {
                    if self.lock().problem != reason {
                        tracing::warn!("no link from {} yet: {reason}", settings.data);
                    }
                    reason
                }
            };
            self.lock().problem = reason;
            if start.elapsed() > Duration::from_secs(2) {
                backoff.reset();
            }
            std::thread::sleep(backoff.delay());
        }
    }

    fn link(&self, settings: &InputSettings, runtime: &Runtime) -> Result<Dialled, String> {
        let answer = runtime.shared.directory().look(&settings.data, &self.schema);
        let found =
            answer.recv().map_err(|e| e.to_string())?.map_err(|refusal| refusal.to_string())?;
        let link = LinkRequest {
            data: settings.data.clone(),
            instance: found.provider.instance,
            schema: self.schema.clone(),
            schema_hash: schema::hash_text(&self.schema),
            keep: settings.keep,
            wake: settings.wake,
            paused: !runtime.shared.is_active(),
        };
        let hello = Hello::new(
            &runtime.shared.name,
            runtime.shared.instance,
            Purpose::Link { link: link.clone() },
        );
        let dialled = socket::dial_component(&found.provider, &hello, settings.transport)
            .map_err(|error| error.to_string())?;
        self.check_type(&dialled.welcome)?;
        let stream = dialled.stream.try_clone().map_err(|error| error.to_string())?;
        let mut state = self.lock();
        state.stream = Some(Arc::new(stream));
        state.connections += 1;
        state.quiet_beats = 0;
        state.problem.clear();
        drop(state);
        // The state may have changed since the request was written.
        if runtime.shared.is_active() == link.paused {
            self.pause(!link.paused);
        }
        Ok(dialled)
    }

    /// Another build may mean another type by the same name.
    fn check_type(&self, welcome: &Welcome) -> Result<(), String> {
        let Welcome { name, schema, .. } = welcome;
        if *schema == self.schema {
            return Ok(());
        }
        let how = schema::difference((name, schema), ("this input", &self.schema));
        Err(format!("`{name}` sends another type than it has registered\n{how}"))
    }

    fn read(
        &self,
        mut dialled: Dialled,
        last: &mut Option<Last>,
        index: usize,
        settings: &InputSettings,
        runtime: &Arc<Runtime>,
    ) -> String {
        let Dialled { stream, reader, .. } = &mut dialled;
        if let Err(error) = stream.set_read_timeout(None) {
            return error.to_string();
        }
        let mut first = true;
        loop {
            let mut guard = None;
            loop {
                let superseded = settings.keep == Keep::Latest && reader.is_superseded();
                let frame = match reader.next_frame() {
                    Ok(Some(frame)) => frame,
                    Ok(None) => break,
                    Err(error) => return error.to_string(),
                };
                if frame.kind == FrameKind::Beat {
                    continue;
                }
                let (header, payload) = match frame.data() {
                    Ok(data) => data,
                    Err(error) => return error.to_string(),
                };
                let Some(lost) = self.follow(last, &header, std::mem::take(&mut first)) else {
                    continue;
                };
                if superseded {
                    self.dropped.fetch_add(1, Ordering::Relaxed);
                    continue;
                }
                if guard.is_none() {
                    guard = runtime.try_enter();
                }
                self.hand_over(&mut guard, index, header, lost, payload, runtime);
            }
            drop(guard);
            runtime.after_release();
            self.listening.store(true, Ordering::Relaxed);
            let received = receive(stream, reader, settings.wake, runtime);
            self.listening.store(false, Ordering::Relaxed);
            match received {
                Ok(0) if self.lock().stream.is_none() => return "the publisher fell silent".into(),
                Ok(0) => return "the publisher closed it".into(),
                Ok(len) => {
                    reader.filled(len);
                    increment(&self.reads);
                }
                Err(error) if is_timeout(&error) => {}
                Err(error) => return error.to_string(),
            }
        }
    }

    /// Runs the component's code on the data, or keeps it until the component is free.
    fn hand_over(
        &self,
        guard: &mut Option<crate::runtime::Guard<'_>>,
        index: usize,
        header: DataHeader,
        lost: u64,
        payload: &[u8],
        runtime: &Runtime,
    ) {
        if let Some(core) = guard
            && !self.waiting.load(Ordering::Relaxed)
        {
            core.data(index, header, lost, payload);
            increment(&self.received);
            if runtime.main_waits() {
                *guard = None;
                runtime.after_release();
            }
            return;
        }
        let mut inbox = self.inbox();
        while inbox.is_full() && runtime.shared.is_active() {
            runtime.nudge();
            inbox = self
                .room
                .wait_timeout(inbox, Duration::from_millis(100))
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
        let arrival = runtime.arrival();
        let dropped = inbox.push(Item { arrival, header, lost, bytes: payload.to_vec() });
        // Counted before anybody can take what is left.
        self.dropped.fetch_add(dropped, Ordering::Relaxed);
        self.waiting.store(true, Ordering::Relaxed);
        drop(inbox);
        runtime.backlog_grew();
    }

    /// Follows the sequence: how many are missing before this one, or `None` if it was seen before.
    fn follow(&self, last: &mut Option<Last>, header: &DataHeader, first: bool) -> Option<u64> {
        let paused = self.was_paused.load(Ordering::Relaxed);
        let lost = match last {
            Some(last) if last.instance == header.instance => {
                if header.sequence <= last.sequence {
                    return None;
                }
                // After a reconnect the publisher marks a new start, but to us it is a gap.
                let meant = paused || (header.fresh && !first);
                if meant { 0 } else { header.sequence - last.sequence - 1 }
            }
            _ => 0,
        };
        if paused {
            self.was_paused.store(false, Ordering::Relaxed);
        }
        *last = Some(Last { instance: header.instance, sequence: header.sequence });
        if lost > 0 {
            self.lost.fetch_add(lost, Ordering::Relaxed);
        }
        Some(lost)
    }
}

/// Waits for bytes: asleep in the kernel, or polling while the component is active.
fn receive(
    stream: &TcpStream,
    reader: &mut frame::FrameReader,
    wake: Wake,
    runtime: &Runtime,
) -> std::io::Result<usize> {
    while wake == Wake::Spin && runtime.shared.is_active() {
        for _ in 0..SPINS_PER_LOOK {
            match recv(stream, reader.space(), RecvFlags::DONTWAIT) {
                Err(rustix::io::Errno::AGAIN) => std::hint::spin_loop(),
                result => return Ok(result?.1),
            }
        }
    }
    Ok(recv(stream, reader.space(), RecvFlags::empty())?.1)
}

fn signal(stream: Option<&TcpStream>, kind: FrameKind) {
    if let Some(stream) = stream {
        // Eight bytes: they fit, or the connection is as good as dead and its reader will notice.
        let _ = send(stream, &frame::signal(kind), SendFlags::DONTWAIT | SendFlags::NOSIGNAL);
    }
}
