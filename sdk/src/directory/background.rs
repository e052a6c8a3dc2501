//! The registry connection's background: connects, declares everything again after a loss, hands out
//! answers, and asks for the time.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::{Duration, Instant};

use armor_wire::backoff::Backoff;
use armor_wire::clock::Exchange;
use armor_wire::codec;
use armor_wire::frame::{Frame, FrameKind};
use armor_wire::hello::{HandshakeError, Hello, Refusal};
use armor_wire::registry::{ComponentEntry, DataEntry, RegistryReply, RegistryRequest};

use super::{Change, Found, Listing};
use crate::clock::Clock;
use crate::dial::{self, ConnectError, Dialled};
use crate::session::{self, Writer};

/// The first questions for the time come this quickly, until the filter has enough.
const FIRST_TIMES: u32 = 8;
const FIRST_TIME_PERIOD: Duration = Duration::from_millis(25);
/// Then this often: a clock drifts less than 100 µs in it.
const TIME_PERIOD: Duration = Duration::from_secs(2);

pub(super) type LookupAnswer = mpsc::Sender<Result<Found, Refusal>>;

pub(super) struct Lookup {
    pub(super) request: RegistryRequest,
    pub(super) answer: LookupAnswer,
}

#[derive(Default)]
pub(super) struct State {
    pub(super) writer: Option<Writer>,
    pub(super) problem: String,
    pub(super) refusal: Option<Refusal>,
    pub(super) next_request: u64,
    pub(super) provided: Vec<DataEntry>,
    pub(super) lookups: HashMap<u64, Lookup>,
    pub(super) lists: HashMap<u64, mpsc::Sender<Listing>>,
    pub(super) watchers: Vec<mpsc::Sender<Change>>,
    /// Who is there, as far as the registry has told; kept once somebody watches.
    pub(super) present: Option<Vec<ComponentEntry>>,
}

pub(super) struct Inner {
    pub(super) address: String,
    pub(super) hello: Hello,
    pub(super) clock: Arc<Clock>,
    pub(super) state: Mutex<State>,
    pub(super) changed: Condvar,
    pub(super) closing: AtomicBool,
}

pub(super) fn wait<'a>(
    changed: &Condvar,
    state: MutexGuard<'a, State>,
    timeout: Duration,
) -> MutexGuard<'a, State> {
    changed.wait_timeout(state, timeout).unwrap_or_else(PoisonError::into_inner).0
}

impl State {
    pub(super) fn fresh_request(&mut self) -> u64 {
        self.next_request += 1;
        self.next_request
    }

    /// Sends if connected; what matters is sent again after a reconnect.
    pub(super) fn send(&self, request: &RegistryRequest) {
        if let Some(writer) = &self.writer {
            // A failure ends the connection, and its reader starts a new one.
            let _ = writer.send(request);
        }
    }

    pub(super) fn declare_again(&mut self) {
        for entry in self.provided.clone() {
            let request = self.fresh_request();
            self.send(&RegistryRequest::Provide { request, entry });
        }
        for lookup in self.lookups.values() {
            self.send(&lookup.request);
        }
        for request in self.lists.keys() {
            self.send(&RegistryRequest::List { request: *request });
        }
        if let Some(present) = &mut self.present {
            present.clear();
            self.send(&RegistryRequest::Watch);
        }
    }

    pub(super) fn tell(&mut self, change: &Change) {
        self.watchers.retain(|watcher| watcher.send(change.clone()).is_ok());
    }

    pub(super) fn handle(&mut self, reply: RegistryReply) {
        match reply {
            RegistryReply::Found { request, entry, provider } => {
                if let Some(lookup) = self.lookups.remove(&request) {
                    let _ = lookup.answer.send(Ok(Found { entry, provider }));
                }
            }
            RegistryReply::Refused { request, refusal } => match self.lookups.remove(&request) {
                Some(lookup) => {
                    let _ = lookup.answer.send(Err(refusal));
                }
                None => tracing::error!("{refusal}"),
            },
            RegistryReply::Listing { request, components, data } => {
                if let Some(list) = self.lists.remove(&request) {
                    let _ = list.send(Listing { components, data });
                }
            }
            RegistryReply::Appeared { entry } => {
                let present = self.present.get_or_insert_default();
                present.retain(|other| other.name != entry.name);
                present.push(entry.clone());
                self.tell(&Change::Appeared(entry));
            }
            RegistryReply::Gone { entry } => {
                let present = self.present.get_or_insert_default();
                present.retain(|other| other.instance != entry.instance);
                self.tell(&Change::Gone(entry));
            }
            RegistryReply::Provided { .. } | RegistryReply::Time { .. } | RegistryReply::Beat => {}
        }
    }
}

impl Inner {
    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn run(&self) {
        let seed = self.hello.instance;
        let mut backoff = Backoff::new(Duration::from_millis(20), Duration::from_secs(1), seed);
        let mut registry = 0;
        while !self.closing.load(Ordering::Relaxed) {
            match dial::dial(&self.address, &self.hello) {
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

    pub(super) fn failed(&self, error: ConnectError) {
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

    pub(super) fn converse(&self, dialled: Dialled) {
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
                let _ = writer.send(&RegistryRequest::Time { asked_s });
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

    pub(super) fn receive(&self, frame: &Frame<'_>) -> Result<(), String> {
        if frame.kind != FrameKind::Control {
            return Err(format!("a {:?} frame from the registry", frame.kind));
        }
        let answered_s = self.clock.monotonic_s();
        let reply: RegistryReply = codec::decode_control(frame.body).map_err(|e| e.to_string())?;
        if let RegistryReply::Time { asked_s, received_s, sent_s } = reply {
            self.clock.add(Exchange { asked_s, received_s, sent_s, answered_s });
        } else {
            self.lock().handle(reply);
        }
        Ok(())
    }
}
