//! The control connections to the components. The hub keeps a connection to each component that the
//! registry lists, turns its messages into events, and checks whether the process ended when it
//! breaks.

use crate::event::ControllerEvent;
use crate::process::ProcessStart;
use crate::roster::Doing;
use crate::terms::ComponentReport;
use armor_plan::{ComponentId, Plan, WatchId};
use armor_sdk::control::{
    Answer, Command, ControlConnection, ControlEvent, ReportKind, Role, RunState,
};
use armor_sdk::directory::DirectoryChange;
use armor_sdk::orders::OrderEvent;
use armor_sdk::wire::registry::ComponentEntry;
use std::sync::Arc;
use std::sync::mpsc::{self, Sender};
use std::time::{Duration, Instant};

/// Time between two attempts to connect to a component that the registry knows.
const RETRY: Duration = Duration::from_millis(200);

/// Inputs from other threads.
pub(crate) enum ExecutiveInput {
    Registry(DirectoryChange),
    /// A watch has a new value, or lost its link.
    News(WatchId),
    Connected {
        attempt: u64,
        component: ComponentId,
        made: Option<ControlConnection>,
    },
    Control {
        attempt: u64,
        component: ComponentId,
        event: ControlEvent,
    },
    Operator(OrderEvent),
    /// An event that is passed to the controller unchanged.
    Event(ControllerEvent),
    /// Mission time has passed, by the data that it follows.
    Time,
}

/// One component's process, and the connection to it.
#[derive(Default)]
struct Peer {
    /// Its entry in the registry; `None` while it is not listed.
    entry: Option<ComponentEntry>,
    /// The process start that the connection was made to, and its process if it runs on this host.
    instance: u64,
    process: Option<ProcessStart>,
    /// The attempt that made the connection, or is making it. Inputs of earlier attempts are
    /// ignored.
    attempt: u64,
    connecting: bool,
    connection: Option<ControlConnection>,
    retry_at: Option<Instant>,
    /// Its connection broke or it was killed, and the end of the process is not certain yet.
    doubtful: bool,
}

pub(crate) struct Hub {
    plan: Arc<Plan>,
    peers: Vec<Peer>,
    inputs: Sender<ExecutiveInput>,
    host: String,
    attempts: u64,
    /// Whether the registry can be asked.
    registry: bool,
}

impl Hub {
    pub(crate) fn new(plan: Arc<Plan>, inputs: Sender<ExecutiveInput>) -> Self {
        let peers = plan.components().iter().map(|_| Peer::default()).collect();
        let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
        Self { plan, peers, inputs, host, attempts: 0, registry: false }
    }

    /// Takes an input from another thread; returns the events for the controller.
    pub(crate) fn take_in(&mut self, input: ExecutiveInput) -> Vec<ControllerEvent> {
        match input {
            ExecutiveInput::Registry(change) => self.follow_registry(change),
            // The caller handles these.
            ExecutiveInput::News(_) | ExecutiveInput::Time => Vec::new(),
            ExecutiveInput::Connected { attempt, component, made } => {
                self.take_connection(attempt, component, made).into_iter().collect()
            }
            ExecutiveInput::Control { attempt, component, event } => {
                self.take_control_event(attempt, component, event).into_iter().collect()
            }
            ExecutiveInput::Event(event) => vec![event],
            ExecutiveInput::Operator(OrderEvent::Given(given)) => {
                vec![ControllerEvent::Ordered(given.into())]
            }
            ExecutiveInput::Operator(OrderEvent::Closed { connection }) => {
                vec![ControllerEvent::OperatorLeft { connection }]
            }
        }
    }

    /// Reconnects where the time has come, and checks the processes that may have ended.
    pub(crate) fn look_around(&mut self) -> Vec<ControllerEvent> {
        let mut events = Vec::new();
        for component in self.plan.component_ids() {
            let peer = &mut self.peers[component.index()];
            if peer.retry_at.is_some_and(|at| at <= Instant::now()) {
                peer.retry_at = None;
                self.begin_connecting(component);
            }
            events.extend(self.take_ended(component));
        }
        events
    }

    /// Whether [`Self::look_around`] has to be called even without an input.
    pub(crate) fn is_uneasy(&self) -> bool {
        self.peers.iter().any(|peer| peer.retry_at.is_some() || peer.doubtful)
    }

    pub(crate) fn send_command(&self, component: ComponentId, command: &Command) {
        if let Some(connection) = &self.peers[component.index()].connection
            && let Err(error) = connection.send(command)
        {
            // The reading side reports the end of the connection. After a reconnect, the controller
            // compares states and sends the commands that are still needed.
            let name = &self.plan.component(component).name;
            tracing::debug!(component = name.as_str(), "a command is lost: {error}");
        }
    }

    pub(crate) fn kill_process(&mut self, component: ComponentId) {
        let registry = self.registry;
        let peer = &mut self.peers[component.index()];
        peer.doubtful = true;
        match peer.process {
            Some(process) => process.kill(),
            // A process on another host cannot be killed, only asked to end. Without an entry in a
            // registry that answers there is no process.
            None if peer.entry.is_some() || !registry => {
                self.send_command(component, &Command::Terminate);
            }
            None => {}
        }
    }

    fn follow_registry(&mut self, change: DirectoryChange) -> Vec<ControllerEvent> {
        match change {
            DirectoryChange::Appeared(entry) => {
                if let Some(component) = self.plan.component_named(&entry.name) {
                    let peer = &mut self.peers[component.index()];
                    let same =
                        peer.entry.as_ref().is_some_and(|old| old.instance == entry.instance);
                    if let Some(old) = peer.process.filter(|_| peer.instance != entry.instance)
                        && self.plan.component(component).is_controlled()
                        && old.lives()
                    {
                        // Another process took its name over, so no command can reach it any
                        // more: two processes of one name must not run at the same time.
                        tracing::warn!(component = entry.name.as_str(), "killing its predecessor");
                        old.kill();
                    }
                    peer.entry = Some(entry);
                    if !(same && (peer.connecting || peer.connection.is_some())) {
                        self.begin_connecting(component);
                    }
                }
            }
            DirectoryChange::Gone(entry) => {
                if let Some(component) = self.plan.component_named(&entry.name) {
                    let peer = &mut self.peers[component.index()];
                    if peer.entry.as_ref().is_some_and(|old| old.instance == entry.instance) {
                        (peer.entry, peer.retry_at) = (None, None);
                    }
                    return self.take_ended(component).into_iter().collect();
                }
            }
            DirectoryChange::RegistryLost => self.registry = false,
            DirectoryChange::RegistryFound => self.registry = true,
        }
        Vec::new()
    }

    /// Connects on a thread of its own, since a suspended process never answers.
    fn begin_connecting(&mut self, component: ComponentId) {
        self.attempts += 1;
        let (attempt, inputs) = (self.attempts, self.inputs.clone());
        let peer = &mut self.peers[component.index()];
        let Some(entry) = peer.entry.clone() else {
            return;
        };
        (peer.attempt, peer.connecting, peer.connection) = (attempt, true, None);
        let connecting = move || {
            // The sink waits until the connection was announced: its first report must not arrive
            // before that.
            let (announce, announced) = mpsc::channel::<()>();
            let answers = inputs.clone();
            let sink = move |event| {
                let _ = announced.recv();
                let _ = answers.send(ExecutiveInput::Control { attempt, component, event });
            };
            let made = ControlConnection::connect(&entry, Role::Executive, "executive", sink);
            if let Err(error) = &made {
                tracing::debug!(component = entry.name.as_str(), "not reached: {error}");
            }
            let _ = inputs.send(ExecutiveInput::Connected { attempt, component, made: made.ok() });
            drop(announce);
        };
        let spawned = std::thread::Builder::new().name("connect".into()).spawn(connecting);
        if let Err(error) = spawned {
            tracing::error!("no thread for a connection: {error}");
            let peer = &mut self.peers[component.index()];
            (peer.connecting, peer.retry_at) = (false, Some(Instant::now() + RETRY));
        }
    }

    fn take_connection(
        &mut self,
        attempt: u64,
        component: ComponentId,
        made: Option<ControlConnection>,
    ) -> Option<ControllerEvent> {
        let here = &self.host;
        let peer = &mut self.peers[component.index()];
        if peer.attempt != attempt {
            return None;
        }
        peer.connecting = false;
        let entry = peer.entry.as_ref()?;
        // A new process is not used before the old one has ended: it may still move the robot, and
        // its end could be mistaken for that of its successor.
        let predecessor = peer.process.filter(|_| peer.instance != entry.instance);
        let made = made.filter(|_| !predecessor.is_some_and(ProcessStart::lives));
        let Some(connection) = made else {
            peer.retry_at = Some(Instant::now() + RETRY);
            return None;
        };
        peer.connection = Some(connection);
        (peer.instance, peer.doubtful) = (entry.instance, false);
        peer.process = (entry.host == *here).then(|| ProcessStart::find(entry.pid)).flatten();
        Some(ControllerEvent::Appeared { component, instance: entry.instance })
    }

    fn take_control_event(
        &mut self,
        attempt: u64,
        component: ComponentId,
        event: ControlEvent,
    ) -> Option<ControllerEvent> {
        let peer = &mut self.peers[component.index()];
        if peer.attempt != attempt {
            return None;
        }
        let instance = peer.instance;
        match event {
            ControlEvent::Answer(answer) => event_of(component, instance, answer),
            ControlEvent::Closed(reason) => {
                let name = &self.plan.component(component).name;
                tracing::debug!(component = name.as_str(), "the connection has ended: {reason}");
                (peer.connection, peer.doubtful) = (None, true);
                peer.retry_at = peer.entry.is_some().then(|| Instant::now() + RETRY);
                self.take_ended(component).or(Some(ControllerEvent::Lost { component, instance }))
            }
        }
    }

    /// Returns the end of a process in doubt, once, as soon as it is certain.
    fn take_ended(&mut self, component: ComponentId) -> Option<ControllerEvent> {
        let registry = self.registry;
        let peer = &mut self.peers[component.index()];
        let certain = match peer.process {
            Some(process) => !process.lives(),
            // Never connected and not in the registry, which lists every running component.
            None => peer.instance == 0 && peer.entry.is_none() && registry,
        };
        if !peer.doubtful || !certain {
            return None;
        }
        (peer.doubtful, peer.connection) = (false, None);
        let instance = (peer.instance != 0).then_some(peer.instance);
        Some(ControllerEvent::Gone { component, instance })
    }
}

fn event_of(component: ComponentId, instance: u64, answer: Answer) -> Option<ControllerEvent> {
    Some(match answer {
        Answer::State { state, activation, controllable } => {
            let doing = match state {
                RunState::Starting => Doing::Starting,
                RunState::Frozen => Doing::Frozen,
                // A component that has finished still has to come to rest.
                RunState::Active | RunState::Done | RunState::Failed => Doing::Active,
            };
            ControllerEvent::StateReported { component, instance, doing, activation, controllable }
        }
        Answer::Report { report: serial, activation, outcome } => {
            let report = match outcome {
                ReportKind::Done => ComponentReport::Done,
                ReportKind::Failed { reason } => ComponentReport::Failed { reason },
                ReportKind::Event { name, value } => ComponentReport::Event { name, value },
            };
            ControllerEvent::Reported { component, instance, serial, activation, report }
        }
        Answer::Status { .. } | Answer::Beat { .. } | Answer::Ordered { .. } => return None,
    })
}
