//! The connections to configd: a component's, for how it is connected and its parameters; and a
//! tool's.

mod connection;
mod given;
mod questions;

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::{Duration, Instant};

use armor_wire::backoff::Backoff;
use armor_wire::codec;
use armor_wire::config::{Assigned, Reply, Request, Settings};
use armor_wire::frame::{Frame, FrameKind};
use armor_wire::hello::{Hello, Purpose};
use armor_wire::manifest::{ParameterManifest, ParameterValue};

use crate::component::Fault;
use crate::parameter::Value;
use crate::session::{self, Writer};
use crate::shared::Shared;
use crate::socket;

pub use connection::{ConfigdConnection, ConfigdError};
pub use questions::{Differences, Parameters, Questions, SetOutcome};

/// Name under which configd is found.
pub(crate) const CONFIGD: &str = "configd";

/// Parameters asked for and arrived.
#[derive(Default)]
pub(crate) struct Asking {
    state: Mutex<State>,
    changed: Condvar,
    /// Some have arrived and are not handed over yet.
    arrived: AtomicBool,
}

#[derive(Default)]
struct State {
    /// Asked for, not answered. ArMoR's counter, with names.
    asked: Vec<String>,
    arrived: VecDeque<(String, Value)>,
    /// What is wrong with a parameter, by its name, until a good value comes.
    faults: BTreeMap<String, String>,
    /// What configd has answered last, by the parameter's name.
    own: BTreeMap<String, Option<Assigned>>,
    /// What the mission gives for as long as the activation lasts, over what configd answers.
    given: BTreeMap<String, Assigned>,
    writer: Option<Writer>,
    problem: String,
    next_request: u64,
    /// What the requests of this connection are about: a parameter, or the settings.
    requests: BTreeMap<u64, Option<String>>,
    settings: Option<mpsc::Sender<Result<Settings, String>>>,
}

impl Asking {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks for a parameter.
    pub fn ask(&self, name: &str) {
        let mut state = self.lock();
        if !state.asked.iter().any(|asked| asked == name) {
            state.asked.push(name.into());
        }
        state.send_parameter(name);
    }

    /// The names asked for so far that have no answer.
    pub fn asked(&self) -> Vec<String> {
        self.lock().asked.clone()
    }

    /// Waits until all that was asked for has arrived.
    pub fn wait(&self, limit: Duration) -> Result<(), Fault> {
        let deadline = Instant::now() + limit;
        let mut state = self.lock();
        loop {
            if !state.faults.is_empty() {
                let faults: Vec<_> = state.faults.values().map(String::as_str).collect();
                return Err(faults.join("; ").into());
            }
            if state.asked.is_empty() {
                return Ok(());
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                let names = state.asked.join(", ");
                let problem = &state.problem;
                return Err(format!(
                    "configd has not answered within {limit:?} ({names}) {problem}"
                )
                .into());
            }
            state =
                self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    pub fn has_arrived(&self) -> bool {
        self.arrived.load(Ordering::Acquire)
    }

    pub fn take(&self) -> Option<(String, Value)> {
        let mut state = self.lock();
        let next = state.arrived.pop_front();
        self.arrived.store(!state.arrived.is_empty(), Ordering::Release);
        next
    }

    /// Takes in an answer, by the parameter's declaration.
    pub fn answer(&self, shared: &Shared, name: &str, assigned: Option<&Assigned>) {
        let mut guard = self.lock();
        let state = &mut *guard;
        let was_asked = state.answered(name);
        let before = state.own.insert(name.into(), assigned.cloned());
        let assigned = state.in_force(name, assigned).cloned();
        // Asked again on a new connection, or given by the mission: what the component has is no
        // news.
        if !was_asked
            && let Some(before) = before
            && is_same(state.in_force(name, before.as_ref()), assigned.as_ref())
        {
            return;
        }
        match value_of(shared.declaration(name), shared, assigned.as_ref()) {
            Ok(value) => {
                state.faults.remove(name);
                state.arrived.push_back((name.into(), value));
            }
            Err(problem) => state.fault(shared, name, &problem),
        }
        self.arrived.store(!state.arrived.is_empty(), Ordering::Release);
        drop(guard);
        self.changed.notify_all();
        shared.wake_main();
    }

    /// Takes in that there is no answer.
    fn refused(&self, shared: &Shared, name: &str, reason: &str) {
        let mut state = self.lock();
        if state.answered(name) {
            state.fault(shared, name, reason);
        } else {
            tracing::warn!("parameter `{name}`: {reason}; the last value holds");
        }
        drop(state);
        self.changed.notify_all();
        shared.wake_main();
    }
}

impl State {
    fn send_parameter(&mut self, name: &str) {
        self.send(Some(name), |request| Request::Parameter { request, name: name.into() });
    }

    fn send(&mut self, about: Option<&str>, request: impl FnOnce(u64) -> Request) {
        self.next_request += 1;
        if let Some(writer) = &self.writer {
            self.requests.insert(self.next_request, about.map(Into::into));
            // A failure ends the connection; what was asked is asked again on the next one.
            let _ = writer.send(&request(self.next_request));
        }
    }

    /// Crosses the parameter off; whether it was asked for.
    fn answered(&mut self, name: &str) -> bool {
        let waiting = self.asked.len();
        self.asked.retain(|asked| asked != name);
        self.asked.len() < waiting
    }

    fn fault(&mut self, shared: &Shared, name: &str, problem: &str) {
        let fault = format!("parameter `{name}` of component `{}`: {problem}", shared.name);
        if self.faults.get(name) != Some(&fault) {
            tracing::error!("{fault}");
        }
        self.faults.insert(name.into(), fault);
    }
}

/// Whether two answers give the same value; where it stands in the file does not matter.
fn is_same(a: Option<&Assigned>, b: Option<&Assigned>) -> bool {
    let value = |of: Option<&Assigned>| of.map(|of| (of.text.clone(), of.base.clone()));
    value(a) == value(b)
}

fn value_of(
    declaration: Option<&ParameterManifest>,
    shared: &Shared,
    assigned: Option<&Assigned>,
) -> Result<Value, String> {
    let (text, base, origin) = match (assigned, declaration) {
        (Some(assigned), _) => {
            (assigned.text.clone(), assigned.base.clone(), assigned.origin.clone())
        }
        (None, Some(parameter)) => {
            let text = parameter.default.clone();
            let text =
                text.ok_or("is not set and has no default; set it in the file or with --set")?;
            (text, String::new(), "its default".into())
        }
        (None, None) => {
            let names: Vec<_> = shared.declared.iter().map(|known| known.name.as_str()).collect();
            return Err(format!(
                "a {} declares no such parameter, only: {}",
                shared.kind,
                if names.is_empty() { "none".into() } else { names.join(", ") }
            ));
        }
    };
    let value = match declaration {
        Some(parameter) => {
            parameter.parse(&text).map_err(|problem| format!("{problem} ({origin})"))?
        }
        None => ParameterValue::Text(text),
    };
    Ok(Value::new(value, Path::new(&base)))
}

/// Answers from the command line instead of configd: for a component run by hand.
pub(crate) fn answer_alone(shared: &Shared, set: &HashMap<String, String>) {
    for name in shared.parameters.asked() {
        let assigned = set.get(&name).map(|text| Assigned {
            text: text.clone(),
            base: String::new(),
            origin: "--set".into(),
        });
        shared.parameters.answer(shared, &name, assigned.as_ref());
    }
}

/// Keeps a connection to configd, and returns the settings once they have come.
pub(crate) fn start(
    shared: &Arc<Shared>,
) -> std::io::Result<mpsc::Receiver<Result<Settings, String>>> {
    let (sender, receiver) = mpsc::channel();
    shared.parameters.lock().settings = Some(sender);
    let shared = Arc::clone(shared);
    std::thread::Builder::new()
        .name("configd".into())
        .stack_size(256 << 10)
        .spawn(move || run(&shared))?;
    Ok(receiver)
}

fn run(shared: &Arc<Shared>) {
    let mut backoff =
        Backoff::new(Duration::from_millis(20), Duration::from_secs(1), shared.instance ^ 1);
    while !shared.is_ending() {
        match connect(shared) {
            Ok(()) => backoff.reset(),
            Err(problem) => shared.parameters.lock().problem = problem,
        }
        std::thread::sleep(backoff.delay());
    }
}

fn connect(shared: &Arc<Shared>) -> Result<(), String> {
    let found = shared
        .directory()
        .component(CONFIGD, Duration::from_secs(5))
        .map_err(|error| error.to_string())?;
    let hello = Hello::new(&shared.name, shared.instance, Purpose::Config);
    let dialled = socket::dial(&found.endpoint, &hello).map_err(|error| error.to_string())?;
    let writer = Writer::new(&dialled.stream).map_err(|error| error.to_string())?;
    let parameters = &shared.parameters;
    {
        let mut state = parameters.lock();
        state.writer = Some(writer.clone());
        state.problem.clear();
        state.requests.clear();
        if state.settings.is_some() {
            state.send(None, |request| Request::Settings { request });
        }
        let asked = state.asked.clone();
        // A new configd does not know who wants to hear of the live ones.
        let is_live = |name: &&String| shared.declaration(name).is_some_and(|known| known.live);
        let again = state.own.keys().filter(is_live).filter(|name| !asked.contains(name)).cloned();
        for name in again.chain(asked.iter().cloned()).collect::<Vec<_>>() {
            state.send_parameter(&name);
        }
    }
    let reason =
        session::converse(dialled, &writer, |frame| receive(shared, frame), || Duration::MAX);
    let mut state = parameters.lock();
    state.writer = None;
    state.problem = format!("the connection to configd ended: {reason}");
    if !shared.is_ending() {
        tracing::warn!("{}", state.problem);
    }
    Ok(())
}

fn receive(shared: &Arc<Shared>, frame: &Frame<'_>) -> Result<(), String> {
    if frame.kind != FrameKind::Control {
        return Err(format!("a {:?} frame from configd", frame.kind));
    }
    match codec::decode_control(frame.body).map_err(|error| error.to_string())? {
        Reply::Settings { request, settings } => {
            let mut state = shared.parameters.lock();
            state.requests.remove(&request);
            if let Some(waiting) = state.settings.take() {
                let _ = waiting.send(Ok(settings));
            }
        }
        Reply::Parameter { request, name, assigned } => {
            shared.parameters.lock().requests.remove(&request);
            shared.parameters.answer(shared, &name, assigned.as_ref());
        }
        Reply::Refused { request, refusal } => {
            let mut state = shared.parameters.lock();
            match state.requests.remove(&request) {
                Some(Some(name)) => {
                    drop(state);
                    shared.parameters.refused(shared, &name, &refusal.text);
                }
                Some(None) => {
                    if let Some(waiting) = state.settings.take() {
                        let _ = waiting.send(Err(refusal.to_string()));
                    }
                }
                None => tracing::error!("configd refuses what was not asked: {refusal}"),
            }
        }
        Reply::Beat => {}
        _ => return Err("an answer to what only tools ask".into()),
    }
    Ok(())
}
