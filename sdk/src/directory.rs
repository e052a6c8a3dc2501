//! The connection to the registry: what this process provides, what it looks for, and the time.
//!
//! The registry may die and come back: everything is then declared and asked again, after a delay
//! that differs from process to process. Links do not notice.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::{Duration, Instant};

use armor_wire::backoff::Backoff;
use armor_wire::clock::Exchange;
use armor_wire::codec;
use armor_wire::frame::{Frame, FrameKind};
use armor_wire::hello::{HandshakeError, Hello, Purpose, Refusal, RefusalCode};
use armor_wire::registry::{ComponentEntry, DataEntry, Reply, Request};
use thiserror::Error;

use crate::clock::Clock;
use crate::session::{self, Writer};
use crate::socket::{self, ConnectError, Dialled, fresh_instance};

/// The first questions for the time come this quickly, until the filter has enough.
const FIRST_TIMES: u32 = 8;
const FIRST_TIME_PERIOD: Duration = Duration::from_millis(25);
/// Then this often: a clock drifts less than 100 µs in it.
const TIME_PERIOD: Duration = Duration::from_secs(2);

/// A refusal stands when it still does after this long: the holder of a name may just have died.
const REFUSED_LIMIT: Duration = Duration::from_secs(3);

/// Why the registry has no answer.
#[derive(Debug, Error)]
pub enum DirectoryError {
    /// The registry refuses, with its reason.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// No answer in time.
    #[error("no answer from the registry at {address} within {waited:?}: {problem}")]
    Timeout {
        /// Where the registry should be.
        address: String,
        /// How long was waited.
        waited: Duration,
        /// What is known about why.
        problem: String,
    },
}

/// Somebody who provides data.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The data.
    pub entry: DataEntry,
    /// Who provides it.
    pub provider: ComponentEntry,
}

/// All that is registered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Listing {
    /// The processes, by name.
    pub components: Vec<ComponentEntry>,
    /// Their outputs, by name.
    pub data: Vec<DataEntry>,
}

/// What a watcher is told.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// A process has registered; also told of all present ones, at first and after a restart of the
    /// registry.
    Appeared(ComponentEntry),
    /// A process has gone.
    Gone(ComponentEntry),
    /// The registry cannot be reached; who is there is not known for now.
    RegistryLost,
    /// The registry can be reached (again).
    RegistryFound,
}

type LookupAnswer = mpsc::Sender<Result<Found, Refusal>>;

struct Lookup {
    request: Request,
    answer: LookupAnswer,
}

#[derive(Default)]
struct State {
    writer: Option<Writer>,
    problem: String,
    refusal: Option<Refusal>,
    next_request: u64,
    provided: Vec<DataEntry>,
    lookups: HashMap<u64, Lookup>,
    lists: HashMap<u64, mpsc::Sender<Listing>>,
    watchers: Vec<mpsc::Sender<Change>>,
    /// Who is there, as far as the registry has told; kept once somebody watches.
    present: Option<Vec<ComponentEntry>>,
}

struct Inner {
    address: String,
    hello: Hello,
    clock: Arc<Clock>,
    state: Mutex<State>,
    changed: Condvar,
    closing: AtomicBool,
}

/// A connection to the registry that comes back by itself. Cheap to clone.
#[derive(Clone)]
pub struct Directory {
    inner: Arc<Inner>,
}

impl Directory {
    /// Connects in the background, only to ask; `name` says who asks.
    pub fn observer(address: &str, name: &str) -> Self {
        Self::start(address, name, fresh_instance(), None, Arc::default())
    }

    /// Connects in the background and registers `entry`.
    pub(crate) fn register(address: &str, entry: ComponentEntry, clock: Arc<Clock>) -> Self {
        let name = entry.name.clone();
        Self::start(address, &name, entry.instance, Some(entry), clock)
    }

    fn start(
        address: &str,
        name: &str,
        instance: u64,
        entry: Option<ComponentEntry>,
        clock: Arc<Clock>,
    ) -> Self {
        let hello = Hello::new(name, instance, Purpose::Registry { entry });
        let inner = Arc::new(Inner {
            address: address.into(),
            hello,
            clock,
            state: Mutex::default(),
            changed: Condvar::new(),
            closing: AtomicBool::new(false),
        });
        let background = Arc::clone(&inner);
        let spawned = std::thread::Builder::new()
            .name("registry".into())
            .stack_size(256 << 10)
            .spawn(move || background.run());
        if let Err(error) = spawned {
            inner.lock().problem = format!("no thread for the registry connection: {error}");
        }
        Self { inner }
    }

    /// Waits until the registry has welcomed this process.
    ///
    /// # Errors
    /// The registry's refusal, such as a name that is taken, or the timeout.
    pub fn wait_connected(&self, timeout: Duration) -> Result<(), DirectoryError> {
        let start = Instant::now();
        let mut state = self.inner.lock();
        while state.writer.is_none() {
            let limit = if state.refusal.is_some() { timeout.min(REFUSED_LIMIT) } else { timeout };
            let left = limit.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Err(match state.refusal.take() {
                    Some(refusal) => refusal.into(),
                    None => self.timeout(timeout, &state),
                });
            }
            state = wait(&self.inner.changed, state, left);
        }
        Ok(())
    }

    /// Declares an output, now and after every restart of the registry.
    pub(crate) fn provide(&self, entry: DataEntry) {
        let mut state = self.inner.lock();
        let request = state.fresh_request();
        state.send(&Request::Provide { request, entry: entry.clone() });
        state.provided.push(entry);
    }

    /// Asks who provides `data` of the given schema (empty: any). The answer comes when there is one.
    pub(crate) fn look(&self, data: &str, schema: &str) -> mpsc::Receiver<Result<Found, Refusal>> {
        let (answer, receiver) = mpsc::channel();
        self.ask(data, schema, true, answer);
        receiver
    }

    fn ask(&self, data: &str, schema: &str, wait: bool, answer: LookupAnswer) -> u64 {
        let mut state = self.inner.lock();
        let id = state.fresh_request();
        let request =
            Request::Lookup { request: id, data: data.into(), schema: schema.into(), wait };
        state.send(&request);
        state.lookups.insert(id, Lookup { request, answer });
        id
    }

    /// Who provides `data`? Waits for a provider until `timeout`.
    ///
    /// # Errors
    /// The registry's refusal, or the timeout.
    pub fn lookup(&self, data: &str, timeout: Duration) -> Result<Found, DirectoryError> {
        self.find(data, timeout, "provides")
    }

    /// The registered process `name`. Waits for it until `timeout`.
    ///
    /// # Errors
    /// The registry's refusal, or the timeout.
    pub fn component(
        &self,
        name: &str,
        timeout: Duration,
    ) -> Result<ComponentEntry, DirectoryError> {
        // Not by watching: it would be told of everybody, and only a few may watch.
        Ok(self.find(name, timeout, "is called")?.provider)
    }

    fn find(&self, name: &str, timeout: Duration, verb: &str) -> Result<Found, DirectoryError> {
        let (answer, receiver) = mpsc::channel();
        let id = self.ask(name, "", true, answer);
        match receiver.recv_timeout(timeout) {
            Ok(found) => Ok(found?),
            Err(_) => {
                let mut state = self.inner.lock();
                state.lookups.remove(&id);
                state.send(&Request::Cancel { request: id });
                if state.writer.is_some() {
                    let text = format!("nobody {verb} `{name}`; `armor ps` shows who is there");
                    return Err(Refusal::new(RefusalCode::UnknownData, text).into());
                }
                Err(self.timeout(timeout, &state))
            }
        }
    }

    /// Everything that is registered.
    ///
    /// # Errors
    /// The timeout.
    pub fn list(&self, timeout: Duration) -> Result<Listing, DirectoryError> {
        let (answer, receiver) = mpsc::channel();
        let mut state = self.inner.lock();
        let request = state.fresh_request();
        state.send(&Request::List { request });
        state.lists.insert(request, answer);
        drop(state);
        receiver.recv_timeout(timeout).map_err(|_| {
            let mut state = self.inner.lock();
            state.lists.remove(&request);
            self.timeout(timeout, &state)
        })
    }

    /// Tells of every process that comes and goes, beginning with those that are there.
    pub fn watch(&self) -> mpsc::Receiver<Change> {
        let (sender, receiver) = mpsc::channel();
        let mut state = self.inner.lock();
        if let Some(present) = &state.present {
            for entry in present {
                let _ = sender.send(Change::Appeared(entry.clone()));
            }
        } else {
            state.present = Some(Vec::new());
            state.send(&Request::Watch);
        }
        state.watchers.push(sender);
        receiver
    }

    /// How far the registry's clock is from this process's, if it is known.
    pub fn clock(&self) -> &Arc<Clock> {
        &self.inner.clock
    }

    /// Leaves the registry. What was provided is withdrawn by that.
    pub(crate) fn close(&self) {
        self.inner.closing.store(true, Ordering::Relaxed);
        if let Some(writer) = self.inner.lock().writer.take() {
            writer.close();
        }
        self.inner.changed.notify_all();
    }

    fn timeout(&self, waited: Duration, state: &State) -> DirectoryError {
        let problem = if state.problem.is_empty() {
            "is a system running? (`armor run FILE`)".into()
        } else {
            state.problem.clone()
        };
        DirectoryError::Timeout { address: self.inner.address.clone(), waited, problem }
    }
}

fn wait<'a>(
    changed: &Condvar,
    state: MutexGuard<'a, State>,
    timeout: Duration,
) -> MutexGuard<'a, State> {
    changed.wait_timeout(state, timeout).unwrap_or_else(PoisonError::into_inner).0
}

impl State {
    fn fresh_request(&mut self) -> u64 {
        self.next_request += 1;
        self.next_request
    }

    /// Sends if connected; what matters is sent again after a reconnect.
    fn send(&self, request: &Request) {
        if let Some(writer) = &self.writer {
            // A failure ends the connection, and its reader starts a new one.
            let _ = writer.send(request);
        }
    }

    fn declare_again(&mut self) {
        for entry in self.provided.clone() {
            let request = self.fresh_request();
            self.send(&Request::Provide { request, entry });
        }
        for lookup in self.lookups.values() {
            self.send(&lookup.request);
        }
        for request in self.lists.keys() {
            self.send(&Request::List { request: *request });
        }
        if let Some(present) = &mut self.present {
            present.clear();
            self.send(&Request::Watch);
        }
    }

    fn tell(&mut self, change: &Change) {
        self.watchers.retain(|watcher| watcher.send(change.clone()).is_ok());
    }

    fn handle(&mut self, reply: Reply) {
        match reply {
            Reply::Found { request, entry, provider } => {
                if let Some(lookup) = self.lookups.remove(&request) {
                    let _ = lookup.answer.send(Ok(Found { entry, provider }));
                }
            }
            Reply::Refused { request, refusal } => match self.lookups.remove(&request) {
                Some(lookup) => {
                    let _ = lookup.answer.send(Err(refusal));
                }
                None => tracing::error!("{refusal}"),
            },
            Reply::Listing { request, components, data } => {
                if let Some(list) = self.lists.remove(&request) {
                    let _ = list.send(Listing { components, data });
                }
            }
            Reply::Appeared { entry } => {
                let present = self.present.get_or_insert_default();
                present.retain(|other| other.name != entry.name);
                present.push(entry.clone());
                self.tell(&Change::Appeared(entry));
            }
            Reply::Gone { entry } => {
                let present = self.present.get_or_insert_default();
                present.retain(|other| other.instance != entry.instance);
                self.tell(&Change::Gone(entry));
            }
            Reply::Provided { .. } | Reply::Time { .. } | Reply::Beat => {}
        }
    }
}

impl Inner {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self) {
        let seed = self.hello.instance;
        let mut backoff = Backoff::new(Duration::from_millis(20), Duration::from_secs(1), seed);
        let mut registry = 0;
        while !self.closing.load(Ordering::Relaxed) {
            match socket::dial(&self.address, &self.hello, false) {
                Ok(dialled) => {
                    backoff.reset();
                    if registry != 0 && registry != dialled.welcome.instance {
                        self.clock.registry_changed();
                    }
                    registry = dialled.welcome.instance;
                    self.converse(dialled);
                }
                Err(error) => self.failed(error),
            }
            let state = self.lock();
            if !self.closing.load(Ordering::Relaxed) {
                drop(wait(&self.changed, state, backoff.delay()));
            }
        }
    }

    fn failed(&self, error: ConnectError) {
        let mut state = self.lock();
        state.problem = error.to_string();
        if let ConnectError::Handshake { error: HandshakeError::Refused(refusal), .. } = error {
            if state.refusal.as_ref() != Some(&refusal) {
                tracing::warn!("the registry refuses: {refusal}");
            }
            state.refusal = Some(refusal);
            self.changed.notify_all();
        }
    }

    fn converse(&self, dialled: Dialled) {
        let Ok(writer) = Writer::new(&dialled.stream) else { return };
        {
            let mut state = self.lock();
            state.writer = Some(writer.clone());
            state.refusal = None;
            state.tell(&Change::RegistryFound);
            state.declare_again();
        }
        self.changed.notify_all();
        let (mut asked, mut next) = (0, Instant::now());
        let ask_time = || {
            let now = Instant::now();
            if now >= next {
                let asked_s = self.clock.monotonic_s();
                let _ = writer.send(&Request::Time { asked_s });
                asked += 1;
                next = now + if asked < FIRST_TIMES { FIRST_TIME_PERIOD } else { TIME_PERIOD };
            }
            next.saturating_duration_since(now)
        };
        let reason = session::converse(dialled, &writer, |frame| self.receive(frame), ask_time);
        let mut state = self.lock();
        state.writer = None;
        state.problem = format!("the connection ended: {reason}");
        state.tell(&Change::RegistryLost);
        if !self.closing.load(Ordering::Relaxed) {
            tracing::warn!("lost the registry at {}: {reason}", self.address);
        }
    }

    fn receive(&self, frame: &Frame<'_>) -> Result<(), String> {
        if frame.kind != FrameKind::Control {
            return Err(format!("a {:?} frame from the registry", frame.kind));
        }
        let answered_s = self.clock.monotonic_s();
        let reply: Reply = codec::decode_control(frame.body).map_err(|e| e.to_string())?;
        if let Reply::Time { asked_s, received_s, sent_s } = reply {
            self.clock.add(Exchange { asked_s, received_s, sent_s, answered_s });
        } else {
            self.lock().handle(reply);
        }
        Ok(())
    }
}
