//! The thread behind the connection to the registry: connects, declares everything again after a
//! loss, delivers answers, and asks for the time.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use armor_socket::OwnerError;
use armor_wire::backoff::Backoff;
use armor_wire::clock::Exchange;
use armor_wire::codec;
use armor_wire::frame::{Frame, FrameKind};
use armor_wire::hello::{HandshakeError, Hello, Refusal, RefusalCode};
use armor_wire::registry::{ComponentEntry, DataEntry, DataReader, RegistryReply, RegistryRequest};
use armor_wire::run_key::LinkKey;
use parking_lot::{Condvar, Mutex, MutexGuard};

use super::answers::{DirectoryChange, FoundProvider, Listing};
use crate::clock::SystemClock;
use crate::dial::{self, ConnectError, Dialled};
use crate::session::{self, FrameWriter};

/// First and longest delay between two attempts to connect. After a cut a link needs the registry, then
/// its provider: two of these delays, and a second for both.
const RETRY: (Duration, Duration) = (Duration::from_millis(20), Duration::from_millis(400));
/// The first requests for the time have this short period, until the filter has enough exchanges.
const FIRST_TIMES: u32 = 8;
const FIRST_TIME_PERIOD: Duration = Duration::from_millis(25);
/// The period of later requests: a clock drifts less than 100 µs in it.
const TIME_PERIOD: Duration = Duration::from_secs(2);

pub(super) type LookupAnswer = mpsc::Sender<Result<FoundProvider, Refusal>>;
pub(super) type ListAnswer = mpsc::Sender<Result<Listing, Refusal>>;

/// How long a lookup waits while the registry's port belongs to another user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LookupPatience {
    /// For ever: a component's own registry may have died, and comes back.
    UntilFound,
    /// Not at all: a tool reports the refusal.
    UntilTimeout,
}

pub(super) struct PendingLookup {
    pub(super) request: RegistryRequest,
    pub(super) patience: LookupPatience,
    pub(super) answer: LookupAnswer,
}

#[derive(Default)]
pub(super) struct RegistryState {
    pub(super) writer: Option<FrameWriter>,
    /// When the present connection began.
    pub(super) connected_at: Option<Instant>,
    pub(super) problem: String,
    pub(super) refusal: Option<Refusal>,
    /// Set while the process at the registry's address is of another user.
    pub(super) stranger: Option<Refusal>,
    pub(super) next_request: u64,
    pub(super) provided: Vec<DataEntry>,
    /// What the launcher reserves.
    pub(super) reserved: Option<Vec<String>>,
    /// What configd reports of the links.
    pub(super) readers: Option<Vec<DataReader>>,
    pub(super) lookups: HashMap<u64, PendingLookup>,
    pub(super) lists: HashMap<u64, ListAnswer>,
    pub(super) watchers: Vec<mpsc::Sender<DirectoryChange>>,
    /// The registered processes, as far as the registry has reported; kept from the first watcher
    /// on.
    pub(super) present: Option<Vec<ComponentEntry>>,
}

pub(super) struct RegistryLink {
    pub(super) address: String,
    pub(super) hello: Hello,
    pub(super) clock: Arc<SystemClock>,
    pub(super) state: Mutex<RegistryState>,
    pub(super) changed: Condvar,
    pub(super) closing: AtomicBool,
}

impl RegistryState {
    pub(super) fn fresh_request(&mut self) -> u64 {
        self.next_request += 1;
        self.next_request
    }

    /// Sends if connected; what must not be lost is sent again after a reconnect.
    pub(super) fn send_request(&self, request: &RegistryRequest) {
        if let Some(writer) = &self.writer {
            // A failure ends the connection, and its reader starts a new one.
            let _ = writer.send(request);
        }
    }

    pub(super) fn declare_again(&mut self) {
        if let Some(names) = self.reserved.clone() {
            self.send_request(&RegistryRequest::Reserve { names });
        }
        if let Some(readers) = self.readers.clone() {
            self.send_request(&RegistryRequest::Readers { readers });
        }
        for entry in self.provided.clone() {
            let request = self.fresh_request();
            self.send_request(&RegistryRequest::Provide { request, entry });
        }
        for lookup in self.lookups.values() {
            self.send_request(&lookup.request);
        }
        for request in self.lists.keys() {
            self.send_request(&RegistryRequest::List { request: *request });
        }
        if let Some(present) = &mut self.present {
            // The new registry reports all processes again; those that left meanwhile are not among
            // them.
            present.clear();
            self.send_request(&RegistryRequest::Watch);
        }
    }

    pub(super) fn notify_watchers(&mut self, change: &DirectoryChange) {
        self.watchers.retain(|watcher| watcher.send(change.clone()).is_ok());
    }

    /// Answers the requests of tools with the refusal, if the registry is another user's.
    pub(super) fn answer_impatient(&mut self) {
        let Some(refusal) = self.stranger.clone() else { return };
        for list in std::mem::take(&mut self.lists).into_values() {
            let _ = list.send(Err(refusal.clone()));
        }
        let impatient =
            self.lookups.extract_if(|_, it| it.patience == LookupPatience::UntilTimeout);
        for (_, lookup) in impatient {
            let _ = lookup.answer.send(Err(refusal.clone()));
        }
    }

    pub(super) fn handle_reply(&mut self, reply: RegistryReply) {
        match reply {
            RegistryReply::Found { request, entry, provider, key } => {
                if let Some(lookup) = self.lookups.remove(&request) {
                    let _ = lookup.answer.send(Ok(FoundProvider {
                        entry,
                        provider,
                        key: key.map(LinkKey::new),
                    }));
                }
            }
            RegistryReply::Refused { request, refusal } => {
                if let Some(lookup) = self.lookups.remove(&request) {
                    let _ = lookup.answer.send(Err(refusal));
                } else if let Some(list) = self.lists.remove(&request) {
                    let _ = list.send(Err(refusal));
                } else {
                    tracing::error!("{refusal}");
                }
            }
            RegistryReply::Listing { request, components, data } => {
                if let Some(list) = self.lists.remove(&request) {
                    let _ = list.send(Ok(Listing { components, data }));
                }
            }
            RegistryReply::Appeared { entry } => {
                let present = self.present.get_or_insert_default();
                present.retain(|other| other.name != entry.name);
                present.push(entry.clone());
                self.notify_watchers(&DirectoryChange::Appeared(entry));
            }
            RegistryReply::Gone { entry } => {
                let present = self.present.get_or_insert_default();
                present.retain(|other| other.instance != entry.instance);
                self.notify_watchers(&DirectoryChange::Gone(entry));
            }
            RegistryReply::Provided { .. } | RegistryReply::Time { .. } | RegistryReply::Beat => {}
        }
    }
}

impl RegistryLink {
    pub(super) fn lock_state(&self) -> MutexGuard<'_, RegistryState> {
        self.state.lock()
    }

    pub(super) fn stay_connected(&self) {
        let seed = self.hello.instance;
        let mut backoff = Backoff::new(RETRY.0, RETRY.1, seed);
        let mut registry = 0;
        while !self.closing.load(Ordering::Relaxed) {
            match dial::dial(&self.address, &self.hello) {
                Ok(dialled) => {
                    backoff.reset();
                    if registry != 0 && registry != dialled.welcome.instance {
                        self.clock.registry_changed();
                    }
                    registry = dialled.welcome.instance;
                    self.serve_connection(dialled);
                }
                Err(error) => self.record_failure(error),
            }
            let mut state = self.lock_state();
            if !self.closing.load(Ordering::Relaxed) {
                self.changed.wait_for(&mut state, backoff.delay());
            }
        }
    }

    pub(super) fn record_failure(&self, error: ConnectError) {
        let mut state = self.lock_state();
        // The message that contains this names the address.
        state.problem = match &error {
            ConnectError::Unreachable { error, .. } => format!("cannot connect: {error}"),
            ConnectError::Handshake { error, .. } => format!("the handshake failed: {error}"),
        };
        state.stranger = find_stranger(&error);
        state.answer_impatient();
        if let ConnectError::Handshake { error: HandshakeError::Refused(refusal), .. } = error {
            if state.refusal.as_ref() != Some(&refusal) {
                tracing::warn!("the registry refuses: {refusal}");
            }
            state.refusal = Some(refusal);
            self.changed.notify_all();
        }
    }

    pub(super) fn serve_connection(&self, dialled: Dialled) {
        let Ok(writer) = FrameWriter::new(&dialled.stream) else { return };
        {
            // Under one lock: a request of another thread is either in the lists that are declared
            // again or sent on the new connection, never both and never neither.
            let mut state = self.lock_state();
            state.writer = Some(writer.clone());
            state.connected_at = Some(Instant::now());
            (state.refusal, state.stranger) = (None, None);
            state.notify_watchers(&DirectoryChange::RegistryFound);
            state.declare_again();
        }
        self.changed.notify_all();
        let (mut asked, mut next) = (0, Instant::now());
        let ask_time = || {
            let now = Instant::now();
            if now >= next {
                let asked_s = self.clock.monotonic_s();
                let _ = writer.send(&RegistryRequest::Time { asked_s });
                asked += 1;
                next = now + if asked < FIRST_TIMES { FIRST_TIME_PERIOD } else { TIME_PERIOD };
            }
            next.saturating_duration_since(now)
        };
        let reason =
            session::serve_frames(dialled, &writer, |frame| self.receive_reply(frame), ask_time);
        let mut state = self.lock_state();
        (state.writer, state.connected_at) = (None, None);
        state.problem = format!("the connection ended: {reason}");
        state.notify_watchers(&DirectoryChange::RegistryLost);
        if !self.closing.load(Ordering::Relaxed) {
            tracing::warn!("lost the registry at {}: {reason}", self.address);
        }
    }

    pub(super) fn receive_reply(&self, frame: &Frame<'_>) -> Result<(), String> {
        if frame.kind != FrameKind::Control {
            return Err(format!("a {:?} frame from the registry", frame.kind));
        }
        let answered_s = self.clock.monotonic_s();
        let reply: RegistryReply = codec::decode_control(frame.body).map_err(|e| e.to_string())?;
        if let RegistryReply::Time { asked_s, received_s, sent_s } = reply {
            self.clock.add_exchange(Exchange { asked_s, received_s, sent_s, answered_s });
        } else {
            self.lock_state().handle_reply(reply);
        }
        Ok(())
    }
}

/// Returns the refusal if one end of the connection refuses the user of the other.
fn find_stranger(error: &ConnectError) -> Option<Refusal> {
    match error {
        ConnectError::Handshake { error: HandshakeError::Refused(refusal), .. } => {
            Some(refusal).filter(|refusal| refusal.code == RefusalCode::OtherUser).cloned()
        }
        ConnectError::Unreachable { error, .. } => {
            let owner = error.get_ref()?.downcast_ref::<OwnerError>()?;
            owner.is_stranger().then(|| Refusal::new(RefusalCode::OtherUser, owner.to_string()))
        }
        ConnectError::Handshake { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_registry_of_another_user_is_reported_to_tools_and_waited_out_by_components() {
        let mut state = RegistryState::default();
        let look_up = |state: &mut RegistryState, patience| {
            let (answer, receiver) = mpsc::channel();
            let request = state.fresh_request();
            let lookup = RegistryRequest::Cancel { request };
            state.lookups.insert(request, PendingLookup { request: lookup, patience, answer });
            receiver
        };
        let tool = look_up(&mut state, LookupPatience::UntilTimeout);
        let component = look_up(&mut state, LookupPatience::UntilFound);
        let (answer, list) = mpsc::channel();
        state.lists.insert(7, answer);
        let owner = OwnerError::OtherUser { user: 1, own: 2 };
        let denied = std::io::Error::new(std::io::ErrorKind::PermissionDenied, owner);
        let address = "127.0.0.1:1".to_owned();
        state.stranger = find_stranger(&ConnectError::Unreachable { address, error: denied });
        state.answer_impatient();
        let refusal = tool.try_recv().expect("an answer").expect_err("a refusal");
        assert_eq!(refusal.code, RefusalCode::OtherUser);
        assert!(refusal.text.contains("belongs to user 1"), "{refusal}");
        assert!(matches!(list.try_recv(), Ok(Err(reason)) if reason == refusal));
        assert!(component.try_recv().is_err(), "its own registry may come back");
        let refused = std::io::ErrorKind::ConnectionRefused.into();
        let address = "127.0.0.1:1".to_owned();
        let absent = ConnectError::Unreachable { address, error: refused };
        assert!(find_stranger(&absent).is_none(), "a registry may start");
    }

    #[test]
    fn a_listing_that_is_refused_does_not_wait_for_the_timeout() {
        let (answer, receiver) = mpsc::channel();
        let mut state = RegistryState::default();
        state.lists.insert(7, answer);
        let refusal = Refusal::new(RefusalCode::Limit, "the listing is too long");
        state.handle_reply(RegistryReply::Refused { request: 7, refusal: refusal.clone() });
        assert!(matches!(receiver.try_recv(), Ok(Err(reason)) if reason == refusal));
        assert!(state.lists.is_empty());
    }
}
