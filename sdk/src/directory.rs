//! The connection to the registry: what this process provides, what it looks for, and the time.
//!
//! The registry may die and come back: everything is then declared and asked again, after a delay
//! that differs from process to process. Links do not notice.

mod background;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::time::{Duration, Instant};

use armor_socket::random_id;
use armor_wire::hello::{Hello, Purpose, Refusal, RefusalCode};
use armor_wire::registry::{ComponentEntry, DataEntry, RegistryRequest};
use thiserror::Error;

use crate::clock::Clock;
use background::{Inner, Lookup, LookupAnswer, State, wait};

/// A refusal stands when it still does after this long: the holder of a name may just have died.
const REFUSED_LIMIT: Duration = Duration::from_secs(3);

/// Why the registry has no answer.
#[derive(Debug, Error)]
pub enum DirectoryError {
    /// The registry refuses, with its reason.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// No answer in time.
    #[error("no answer from the registry at {address} within {waited:.1?}: {problem}")]
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

/// A connection to the registry that comes back by itself. Cheap to clone.
#[derive(Clone)]
pub struct Directory {
    inner: Arc<Inner>,
}

impl Directory {
    /// Connects in the background, only to ask; `name` says who asks.
    pub fn observer(address: &str, name: &str) -> Self {
        Self::start(address, name, random_id(), None, Arc::default())
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
        state.send(&RegistryRequest::Provide { request, entry: entry.clone() });
        state.provided.push(entry);
    }

    /// Asks who provides `data` of the given schema (empty: any). The answer comes when there is one.
    pub(crate) fn request_provider(
        &self,
        data: &str,
        schema: &str,
    ) -> mpsc::Receiver<Result<Found, Refusal>> {
        let (answer, receiver) = mpsc::channel();
        self.ask(data, schema, true, answer);
        receiver
    }

    fn ask(&self, data: &str, schema: &str, wait: bool, answer: LookupAnswer) -> u64 {
        let mut state = self.inner.lock();
        let id = state.fresh_request();
        let request =
            RegistryRequest::Lookup { request: id, data: data.into(), schema: schema.into(), wait };
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
                state.send(&RegistryRequest::Cancel { request: id });
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
        state.send(&RegistryRequest::List { request });
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
            state.send(&RegistryRequest::Watch);
        }
        state.watchers.push(sender);
        receiver
    }

    /// How far the registry's clock is from this process's, if it is known.
    pub fn clock(&self) -> &Arc<Clock> {
        &self.inner.clock
    }

    /// Leaves the registry, for all clones of this. What was provided is withdrawn by that.
    pub fn close(&self) {
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
