//! The connection to the registry: what this process provides, what it looks for, and the time.
//!
//! When the registry has died and is back, everything is declared and asked again, after a delay
//! that differs from process to process. Links are not affected.

mod answers;
mod background;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

pub use armor_socket::{HostPlace, adopt_place};
use armor_socket::{own_key, random_id};
use armor_wire::hello::{Hello, Purpose, Refusal, RefusalCode};
use armor_wire::registry::{ComponentEntry, DataEntry, DataReader, RegistryRequest};
use parking_lot::{Condvar, Mutex};
use thiserror::Error;

use crate::background_thread::spawn_background;
use crate::clock::SystemClock;
pub use answers::{DirectoryChange, FoundProvider, Listing};
use background::{LookupAnswer, LookupPatience, PendingLookup, RegistryLink, RegistryState};

/// A refusal counts only after this long: the process that held a name may just have died.
const REFUSED_LIMIT: Duration = Duration::from_secs(3);

/// Time between two looks at whether the wait for the registry is over.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

/// Why the registry has no answer.
#[derive(Debug, Error)]
pub enum DirectoryError {
    /// The registry refuses, with its reason.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The registry belongs to another user of the host, who is not answered. No wait changes that.
    #[error("the registry at {address} belongs to another user: {refusal}")]
    OtherUser {
        /// Where the registry is.
        address: String,
        /// Why it refuses this process, or this process refuses it.
        refusal: Refusal,
    },
    /// No answer in time.
    #[error("no answer from the registry at {address} within {waited:.1?}: {problem}")]
    Timeout {
        /// Where the registry should be.
        address: String,
        /// The time waited.
        waited: Duration,
        /// The last problem of the connection.
        problem: String,
    },
}

/// A connection to the registry that is restored by itself. Cheap to clone.
#[derive(Clone)]
pub struct Directory {
    inner: Arc<RegistryLink>,
}

impl Directory {
    /// Connects in the background, only to ask; `name` is the name of the asking process.
    pub fn observer(address: &str, name: &str) -> Self {
        Self::start_background(address, name, random_id(), None, Arc::default())
    }

    /// Connects in the background and registers `entry`.
    pub(crate) fn register(address: &str, entry: ComponentEntry, clock: Arc<SystemClock>) -> Self {
        let name = entry.name.clone();
        Self::start_background(address, &name, entry.instance, Some(entry), clock)
    }

    fn start_background(
        address: &str,
        name: &str,
        instance: u64,
        entry: Option<ComponentEntry>,
        clock: Arc<SystemClock>,
    ) -> Self {
        let mut hello = Hello::new(name, instance, Purpose::Registry { entry });
        if let Some(key) = own_key(name) {
            key.prove(&mut hello);
        }
        let inner = Arc::new(RegistryLink {
            address: address.into(),
            hello,
            clock,
            state: Mutex::default(),
            changed: Condvar::new(),
            closing: AtomicBool::new(false),
        });
        let background = Arc::clone(&inner);
        if let Err(error) = spawn_background("registry", move || background.stay_connected()) {
            inner.lock_state().problem = format!("no thread for the registry connection: {error}");
        }
        Self { inner }
    }

    /// Waits until the registry has welcomed this process.
    ///
    /// # Errors
    /// The registry's refusal, such as a name that is taken, or the timeout.
    pub fn wait_connected(&self, timeout: Duration) -> Result<(), DirectoryError> {
        self.wait_connected_unless(timeout, || false)
    }

    /// As [`wait_connected`](Self::wait_connected), but ends soon after `is_over` holds, connected or
    /// not.
    pub(crate) fn wait_connected_unless(
        &self,
        timeout: Duration,
        is_over: impl Fn() -> bool,
    ) -> Result<(), DirectoryError> {
        let start = Instant::now();
        let mut state = self.inner.lock_state();
        while state.writer.is_none() && !is_over() {
            let limit = if state.refusal.is_some() { timeout.min(REFUSED_LIMIT) } else { timeout };
            let left = limit.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Err(match state.refusal.take() {
                    Some(refusal) => refusal.into(),
                    None => self.timeout_error(timeout, &state),
                });
            }
            self.inner.changed.wait_for(&mut state, left.min(LOOK_PERIOD));
        }
        Ok(())
    }

    /// Declares an output, now and after every restart of the registry.
    pub(crate) fn declare_output(&self, entry: DataEntry) {
        let mut state = self.inner.lock_state();
        let request = state.fresh_request();
        state.send_request(&RegistryRequest::Provide { request, entry: entry.clone() });
        state.provided.push(entry);
    }

    /// Asks for the provider of `data` of the given schema (empty: any). The answer arrives when
    /// there is a provider.
    pub(crate) fn request_provider(
        &self,
        data: &str,
        schema: &str,
    ) -> mpsc::Receiver<Result<FoundProvider, Refusal>> {
        let (answer, receiver) = mpsc::channel();
        let patience = LookupPatience::UntilFound;
        self.send_lookup(data, schema, patience, answer);
        receiver
    }

    fn send_lookup(
        &self,
        data: &str,
        schema: &str,
        patience: LookupPatience,
        answer: LookupAnswer,
    ) -> u64 {
        let mut state = self.inner.lock_state();
        let id = state.fresh_request();
        let request = RegistryRequest::Lookup {
            request: id,
            data: data.into(),
            schema: schema.into(),
            wait: true,
        };
        state.send_request(&request);
        state.lookups.insert(id, PendingLookup { request, patience, answer });
        state.answer_impatient();
        id
    }

    /// Finds the provider of `data`; waits for one until `timeout`.
    ///
    /// # Errors
    /// The registry's refusal, or the timeout.
    pub fn find_provider(
        &self,
        data: &str,
        timeout: Duration,
    ) -> Result<FoundProvider, DirectoryError> {
        self.wait_for_answer(data, timeout, "no component provides")
    }

    /// Finds the registered process `name`; waits for it until `timeout`.
    ///
    /// # Errors
    /// The registry's refusal, or the timeout.
    pub fn find_process(
        &self,
        name: &str,
        timeout: Duration,
    ) -> Result<ComponentEntry, DirectoryError> {
        // Not by watching: a watcher is sent every process, and the number of watchers is limited.
        Ok(self.wait_for_answer(name, timeout, "no process is called")?.provider)
    }

    fn wait_for_answer(
        &self,
        name: &str,
        timeout: Duration,
        missing: &str,
    ) -> Result<FoundProvider, DirectoryError> {
        let (answer, receiver) = mpsc::channel();
        let id = self.send_lookup(name, "", LookupPatience::UntilTimeout, answer);
        match receiver.recv_timeout(timeout) {
            Ok(found) => found.map_err(|refusal| self.refusal_error(refusal)),
            Err(_) => {
                let mut state = self.inner.lock_state();
                state.lookups.remove(&id);
                state.send_request(&RegistryRequest::Cancel { request: id });
                if state.writer.is_some() {
                    let text = format!("{missing} `{name}`; `armor ps` lists the processes");
                    return Err(Refusal::new(RefusalCode::UnknownData, text).into());
                }
                Err(self.timeout_error(timeout, &state))
            }
        }
    }

    /// Lists everything that is registered.
    ///
    /// # Errors
    /// The registry's refusal, if the list is too long for a message, or the timeout.
    pub fn fetch_listing(&self, timeout: Duration) -> Result<Listing, DirectoryError> {
        let (answer, receiver) = mpsc::channel();
        let mut state = self.inner.lock_state();
        let request = state.fresh_request();
        state.send_request(&RegistryRequest::List { request });
        state.lists.insert(request, answer);
        state.answer_impatient();
        drop(state);
        match receiver.recv_timeout(timeout) {
            Ok(listing) => listing.map_err(|refusal| self.refusal_error(refusal)),
            Err(_) => {
                let mut state = self.inner.lock_state();
                state.lists.remove(&request);
                Err(self.timeout_error(timeout, &state))
            }
        }
    }

    /// How long the present connection to the registry has existed; zero without one.
    pub(crate) fn connected_for(&self) -> Duration {
        self.inner.lock_state().connected_at.map_or(Duration::ZERO, |at| at.elapsed())
    }

    /// Reports every process that registers or leaves, beginning with those that are registered.
    pub fn watch_changes(&self) -> mpsc::Receiver<DirectoryChange> {
        let (sender, receiver) = mpsc::channel();
        let mut state = self.inner.lock_state();
        if let Some(present) = &state.present {
            for entry in present {
                let _ = sender.send(DirectoryChange::Appeared(entry.clone()));
            }
        } else {
            state.present = Some(Vec::new());
            state.send_request(&RegistryRequest::Watch);
        }
        state.watchers.push(sender);
        receiver
    }

    /// Reserves names for processes that the launcher starts, in place of those before, now and after
    /// every restart of the registry. Only for the launcher.
    pub fn reserve_names(&self, names: Vec<String>) {
        let mut state = self.inner.lock_state();
        if state.reserved.as_ref() != Some(&names) {
            state.send_request(&RegistryRequest::Reserve { names: names.clone() });
            state.reserved = Some(names);
        }
    }

    /// Reports what the components may read on other hosts, in place of the report before, now and after
    /// every restart of the registry. Only for configd, whose connection has that name.
    pub fn report_readers(&self, readers: Vec<DataReader>) {
        let mut state = self.inner.lock_state();
        if state.readers.as_ref() != Some(&readers) {
            state.send_request(&RegistryRequest::Readers { readers: readers.clone() });
            state.readers = Some(readers);
        }
    }

    /// The clock of this process, with its estimate of the registry's clock.
    pub fn clock(&self) -> &Arc<SystemClock> {
        &self.inner.clock
    }

    /// Whether connections lead through a proxy, to a system on another host: it may be cut off for
    /// any time, and still run.
    pub fn is_remote(&self) -> bool {
        armor_socket::has_proxy()
    }

    /// Leaves the registry, for all clones of this. That withdraws the declared outputs.
    pub fn close(&self) {
        self.inner.closing.store(true, Ordering::Relaxed);
        if let Some(writer) = self.inner.lock_state().writer.take() {
            writer.close();
        }
        self.inner.changed.notify_all();
    }

    fn refusal_error(&self, refusal: Refusal) -> DirectoryError {
        match refusal.code {
            RefusalCode::OtherUser => {
                DirectoryError::OtherUser { address: self.inner.address.clone(), refusal }
            }
            _ => refusal.into(),
        }
    }

    fn timeout_error(&self, waited: Duration, state: &RegistryState) -> DirectoryError {
        let problem = if state.problem.is_empty() {
            "is a system running? (`armor run FILE`)".into()
        } else {
            state.problem.clone()
        };
        DirectoryError::Timeout { address: self.inner.address.clone(), waited, problem }
    }
}
