//! The parameters that a component has asked for: which of them wait for an answer, and which have
//! arrived and wait to be handed over. The connection that carries the questions is in `client.rs`.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use armor_wire::config::{Assigned, ComponentSettings, ConfigRequest};
use armor_wire::manifest::{ParameterManifest, ParameterValue};
use parking_lot::{Condvar, Mutex, MutexGuard};

use crate::call::Fault;
use crate::identity::ProcessIdentity;
use crate::parameter::Value;
use crate::session::FrameWriter;
use crate::wake::Wakers;

/// Names the run's folder.
const OUT_VARIABLE: &str = "ARMOR_OUT";

/// Parameters asked for and arrived.
pub(crate) struct ParameterRequests {
    pub(super) identity: Arc<ProcessIdentity>,
    /// What the component's code declares.
    declared: Vec<ParameterManifest>,
    state: Mutex<RequestState>,
    changed: Condvar,
    /// Some have arrived and are not handed over yet: read for every message, so without the lock.
    pub(super) arrived: AtomicBool,
    wakers: Arc<Wakers>,
}

#[derive(Default)]
pub(super) struct RequestState {
    /// Asked for, not answered. ArMoR's counter, with names.
    pub asked: Vec<String>,
    pub arrived: VecDeque<(String, Value)>,
    /// What is wrong with a parameter, by its name, until a good value comes.
    faults: BTreeMap<String, String>,
    /// configd's last answer, by the parameter's name.
    pub own: BTreeMap<String, Option<Assigned>>,
    /// Values that the mission gives for the duration of the activation. They go before configd's.
    pub given: BTreeMap<String, Assigned>,
    pub writer: Option<FrameWriter>,
    /// Why there is no connection; part of a timeout's message.
    pub problem: String,
    next_request: u64,
    /// The subject of each request on this connection: a parameter, or the settings.
    pub requests: BTreeMap<u64, Option<String>>,
    pub settings: Option<mpsc::Sender<Result<ComponentSettings, String>>>,
    /// Without configd: the values that requests are answered with, by the parameter's name.
    local: Option<HashMap<String, Assigned>>,
}

impl ParameterRequests {
    pub fn new(
        identity: Arc<ProcessIdentity>,
        declared: Vec<ParameterManifest>,
        wakers: Arc<Wakers>,
    ) -> Self {
        Self {
            identity,
            declared,
            state: Mutex::default(),
            changed: Condvar::new(),
            arrived: AtomicBool::new(false),
            wakers,
        }
    }

    pub(super) fn lock_state(&self) -> MutexGuard<'_, RequestState> {
        self.state.lock()
    }

    /// The declaration of a parameter, if the component's code has one.
    pub fn declaration(&self, name: &str) -> Option<&ParameterManifest> {
        self.declared.iter().find(|parameter| parameter.name == name)
    }

    /// Asks for a parameter.
    pub fn ask_for(&self, name: &str) {
        let mut state = self.lock_state();
        if !state.asked.iter().any(|asked| asked == name) {
            state.asked.push(name.into());
        }
        state.send_parameter(name);
        let local = state.local.as_ref().map(|values| values.get(name).cloned());
        drop(state);
        if let Some(assigned) = local {
            self.accept_answer(name, assigned.as_ref());
        }
    }

    /// The names asked for so far that have no answer.
    pub fn unanswered(&self) -> Vec<String> {
        self.lock_state().asked.clone()
    }

    /// The parameters that are declared but were never asked for, in the order of the declaration.
    pub fn list_unrequested(&self) -> Vec<&ParameterManifest> {
        let state = self.lock_state();
        let is_unrequested =
            |name: &String| !state.own.contains_key(name) && !state.asked.contains(name);
        self.declared.iter().filter(|declared| is_unrequested(&declared.name)).collect()
    }

    /// Waits until all that was asked for has arrived.
    ///
    /// # Errors
    /// What is wrong with a parameter, or which have no answer within `limit`.
    pub fn wait_for_all(&self, limit: Duration) -> Result<(), Fault> {
        let deadline = Instant::now() + limit;
        let mut state = self.lock_state();
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
            self.changed.wait_for(&mut state, left);
        }
    }

    /// Whether a parameter waits to be handed over.
    pub fn has_arrived(&self) -> bool {
        self.arrived.load(Ordering::Acquire)
    }

    /// Takes the parameter that has arrived first.
    pub fn take_arrived(&self) -> Option<(String, Value)> {
        let mut state = self.lock_state();
        let next = state.arrived.pop_front();
        self.note_arrived(&state);
        next
    }

    /// The newest value of a parameter that has arrived and was not handed over.
    pub fn find_arrived(&self, name: &str) -> Option<Value> {
        let state = self.lock_state();
        let newest = state.arrived.iter().rev().find(|(arrived, _)| arrived == name);
        newest.map(|(_, value)| value.clone())
    }

    /// Keeps `has_arrived` in step with the queue; called with the lock held.
    pub(super) fn note_arrived(&self, state: &RequestState) {
        self.arrived.store(!state.arrived.is_empty(), Ordering::Release);
    }

    /// Processes configd's answer, by the parameter's declaration.
    pub fn accept_answer(&self, name: &str, assigned: Option<&Assigned>) {
        let mut guard = self.lock_state();
        let state = &mut *guard;
        let was_asked = state.remove_asked(name);
        let before = state.own.insert(name.into(), assigned.cloned());
        let assigned = state.effective_value(name, assigned).cloned();
        // The answer to a question that was repeated on a new connection, or one that the mission's
        // value hides: the component has this value already.
        if !was_asked
            && let Some(before) = before
            && is_same(state.effective_value(name, before.as_ref()), assigned.as_ref())
        {
            return;
        }
        match self.read_value(name, assigned.as_ref()) {
            Ok(value) => {
                state.faults.remove(name);
                state.arrived.push_back((name.into(), value));
            }
            Err(problem) => state.record_fault(&self.identity.name, name, &problem),
        }
        self.note_arrived(state);
        drop(guard);
        self.changed.notify_all();
        self.wakers.wake_main();
    }

    /// Processes configd's refusal to answer.
    pub(super) fn accept_refusal(&self, name: &str, reason: &str) {
        let mut state = self.lock_state();
        if state.remove_asked(name) {
            state.record_fault(&self.identity.name, name, reason);
        } else {
            tracing::warn!("parameter `{name}`: {reason}; it keeps its last value");
        }
        drop(state);
        self.changed.notify_all();
        self.wakers.wake_main();
    }

    /// Answers every request immediately with one of `values`, or else with the default: for a
    /// component without configd. `origin` is where the values are from.
    ///
    /// # Errors
    /// In words, if the component declares no parameter of one of the names.
    pub fn answer_locally(
        &self,
        values: HashMap<String, String>,
        origin: &str,
    ) -> Result<(), String> {
        if let Some(unknown) = values.keys().find(|name| self.declaration(name).is_none()) {
            return Err(format!("parameter `{unknown}`: {}", self.describe_undeclared()));
        }
        let assign = |text| Assigned { text, base: String::new(), origin: origin.into() };
        let values = values.into_iter().map(|(name, text)| (name, assign(text))).collect();
        self.lock_state().local = Some(values);
        Ok(())
    }

    /// The text of a parameter's value, as it is assigned or declared.
    pub fn text_in_force(&self, name: &str) -> Option<String> {
        let state = self.lock_state();
        let own = state.own.get(name).and_then(Option::as_ref);
        let assigned = state.effective_value(name, own).map(|assigned| assigned.text.clone());
        assigned.or_else(|| self.declaration(name)?.default.clone())
    }

    fn describe_undeclared(&self) -> String {
        let names: Vec<_> = self.declared.iter().map(|known| known.name.as_str()).collect();
        let names = if names.is_empty() { "none".into() } else { names.join(", ") };
        format!("a {} declares no such parameter, only: {names}", self.identity.kind)
    }

    /// The value of a parameter: what is assigned, or its default.
    ///
    /// # Errors
    /// In words, why the text is not a value of the declared type, or there is none.
    pub(super) fn read_value(
        &self,
        name: &str,
        assigned: Option<&Assigned>,
    ) -> Result<Value, String> {
        let declaration = self.declaration(name);
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
            (None, None) => return Err(self.describe_undeclared()),
        };
        let value = match declaration {
            Some(parameter) => {
                parameter.parse(&text).map_err(|problem| format!("{problem} ({origin})"))?
            }
            None => ParameterValue::Text(text),
        };
        if declaration.is_some_and(|parameter| parameter.written) {
            return Ok(Value::new(value, &run_folder()));
        }
        Ok(Value::new(value, Path::new(&base)))
    }
}

/// The folder of the files that this run writes; outside of a system, `out`.
fn run_folder() -> PathBuf {
    std::env::var_os(OUT_VARIABLE).map_or_else(|| "out".into(), PathBuf::from)
}

impl RequestState {
    pub fn send_parameter(&mut self, name: &str) {
        self.send_request(Some(name), |request| ConfigRequest::Parameter {
            request,
            name: name.into(),
        });
    }

    pub fn send_request(
        &mut self,
        subject: Option<&str>,
        request: impl FnOnce(u64) -> ConfigRequest,
    ) {
        self.next_request += 1;
        if let Some(writer) = &self.writer {
            self.requests.insert(self.next_request, subject.map(Into::into));
            // A failure ends the connection; what was asked is asked again on the next one.
            let _ = writer.send(&request(self.next_request));
        }
    }

    /// Removes the parameter from those asked for; whether it was among them.
    fn remove_asked(&mut self, name: &str) -> bool {
        let waiting = self.asked.len();
        self.asked.retain(|asked| asked != name);
        self.asked.len() < waiting
    }

    fn record_fault(&mut self, component: &str, name: &str, problem: &str) {
        let fault = format!("parameter `{name}` of component `{component}`: {problem}");
        if self.faults.get(name) != Some(&fault) {
            tracing::error!("{fault}");
        }
        self.faults.insert(name.into(), fault);
    }
}

/// Whether two answers give the same value; where it stands in the file does not matter.
pub(super) fn is_same(a: Option<&Assigned>, b: Option<&Assigned>) -> bool {
    let value = |of: Option<&Assigned>| of.map(|of| (of.text.clone(), of.base.clone()));
    value(a) == value(b)
}
