//! A component at work: its code, its state and its activation. Only the thread inside the call
//! gate touches it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_wire::control::{ReportKind, RunState};
use armor_wire::frame::DataHeader;
use tracing::Level;

use crate::call::{Call, Outcome};
use crate::call_trace::TracedInput;
use crate::calls::CalledFunction;
use crate::data::{Data, Header};
use crate::fed_input::FedInput;
use crate::lifecycle::{ActivationOrder, LifecycleOrder};
use crate::link::input::InputPort;
use crate::link::payload::Payload;
use crate::link::pull::PullDeadline;
use crate::parameter::Value;
use crate::participant::Participant;
use crate::user_code::{UserCode, check_outcome, run_user_code};

/// The longest wait for the answers to a pull; of a fast component, a quarter of its period.
const LONGEST_PULL: Duration = Duration::from_millis(20);

/// Under which pulls are traced: `armor log NAME armor_sdk::pulls=trace,info`.
const PULLS: &str = "armor_sdk::pulls";

/// See the module.
pub(crate) struct RunningComponent {
    code: Box<dyn UserCode>,
    participant: Arc<Participant>,
    inputs: Vec<FedInput>,
    state: RunState,
    activation: u64,
    /// `exec` follows each data.
    executes_on_data: bool,
    /// An input asks for its data before each call of `exec`.
    pulls: bool,
    /// The activation that begins as soon as the time is known.
    awaits_time: Option<ActivationOrder>,
    /// The last value of each parameter that the code has accepted.
    accepted: BTreeMap<String, Value>,
    /// Parameters of which the code has accepted no value yet, but refused one, and why.
    refused: BTreeMap<String, String>,
}

impl RunningComponent {
    pub fn new(
        code: Box<dyn UserCode>,
        participant: Arc<Participant>,
        executes_on_data: bool,
    ) -> Self {
        let inputs: Vec<_> = participant.ports.inputs().into_iter().map(FedInput::new).collect();
        let pulls = inputs.iter().any(|input| input.port.is_pulling());
        Self {
            code,
            participant,
            inputs,
            state: RunState::Starting,
            activation: 0,
            executes_on_data,
            pulls,
            awaits_time: None,
            accepted: BTreeMap::new(),
            refused: BTreeMap::new(),
        }
    }

    /// Takes the input at `place` of the port table, which has been connected: a source that was added
    /// there, or one that is fed by other data now.
    pub fn take_input(&mut self, place: usize) {
        let input = FedInput::new(self.participant.ports.inputs().remove(place));
        match self.inputs.get_mut(place) {
            Some(known) if Arc::ptr_eq(&known.port, &input.port) => *known = input,
            _ => self.inputs.insert(place, input),
        }
    }

    pub fn is_active(&self) -> bool {
        self.state == RunState::Active
    }

    /// From now on `exec` follows each data, or no longer does.
    pub fn set_executes_on_data(&mut self, executes_on_data: bool) {
        self.executes_on_data = executes_on_data;
    }

    /// Hands data of input `index` to the component, if it is active; `exec` follows if it has no
    /// rate.
    pub fn deliver_data(
        &mut self,
        index: usize,
        header: DataHeader,
        lost: u64,
        arrived_s: f64,
        payload: Payload<'_>,
    ) {
        if self.executes_on_data {
            self.pull_inputs();
        }
        self.hand_over_data(index, header, (lost, arrived_s), payload, self.executes_on_data);
    }

    /// Asks the publishers of all inputs that pull together, and hands over what comes in time. What
    /// comes later is handed over with the next pull, unless newer data have arrived before it. How long
    /// that took is traced, and how much of it without the component's own code.
    pub fn pull_inputs(&mut self) {
        if !self.pulls || !self.is_active() {
            return;
        }
        let begun = tracing::enabled!(target: PULLS, Level::TRACE).then(Instant::now);
        self.pulled_inputs().for_each(InputPort::ask_newest);
        let period = self.participant.period().unwrap_or(Duration::MAX);
        let deadline = PullDeadline::after(LONGEST_PULL.min(period / 4));
        let mut handing_over = Duration::ZERO;
        for index in 0..self.inputs.len() {
            let port = &self.inputs[index].port;
            if port.is_pulling()
                && let Some(item) = port.take_pulled(&deadline)
            {
                let taken = begun.map(|_| Instant::now());
                let payload = item.payload.as_payload();
                self.hand_over_data(
                    index,
                    item.header,
                    (item.lost, item.arrived_s),
                    payload,
                    false,
                );
                handing_over += taken.map_or(Duration::ZERO, |taken| taken.elapsed());
            }
        }
        if let Some(begun) = begun {
            let took = begun.elapsed();
            let (took_ns, taking_ns) =
                (took.as_nanos() as u64, took.saturating_sub(handing_over).as_nanos() as u64);
            tracing::trace!(target: PULLS, took_ns, taking_ns, "inputs pulled");
        }
    }

    fn pulled_inputs(&self) -> impl Iterator<Item = &InputPort> {
        self.inputs.iter().map(|input| &*input.port).filter(|port| port.is_pulling())
    }

    fn hand_over_data(
        &mut self,
        index: usize,
        header: DataHeader,
        (lost, arrived_s): (u64, f64),
        payload: Payload<'_>,
        executes: bool,
    ) {
        if self.participant.parameters.has_arrived() {
            self.deliver_parameters();
        }
        if !self.is_active() {
            return;
        }
        let history = &mut self.inputs[index].history;
        if history.is_kept() {
            let dropped = history.push(header, lost, payload);
            self.inputs[index].port.count_dropped_history(dropped);
        }
        let input = &self.inputs[index];
        let header = Header {
            id: &input.port.id,
            data: &input.data,
            sequence: header.sequence,
            stamp_s: header.stamp_s,
            instance: header.instance,
            lost,
        };
        let data = Data::of_input(payload, &self.inputs, index);
        let (code, participant) = (&mut self.code, &self.participant);
        let result = run_user_code(participant, CalledFunction::DataReceived, || {
            participant.ports.trace.note_input(|| TracedInput {
                input: header.id.into(),
                data: header.data.into(),
                instance: header.instance,
                sequence: header.sequence,
                stamp_s: header.stamp_s,
                arrived_s,
                lost,
            });
            if executes {
                let enter_exec = || participant.calls.enter_exec();
                code.receive_data_then_execute(&header, &data, &enter_exec)
            } else {
                code.receive_data(&header, &data).map(|()| Outcome::CarryOn)
            }
        });
        self.report_result(result);
    }

    /// Hands the parameters that have arrived to the component. A value that the code refuses is
    /// reported, and its last good value stays in force; without one the component has failed until
    /// a good value arrives. Returns what is wrong with the values that were refused.
    pub fn deliver_parameters(&mut self) -> Vec<String> {
        let mut problems = Vec::new();
        let was_refused = !self.refused.is_empty();
        while let Some((name, value)) = self.participant.parameters.take_arrived() {
            match self.hand_over(&name, &value) {
                Ok(()) => {
                    self.refused.remove(&name);
                    self.participant.reports.resolve_error(&name);
                    self.accepted.insert(name, value);
                }
                Err(problem) => {
                    problems.push(problem.clone());
                    self.keep_last_value(name, problem);
                }
            }
        }
        let is_complete = was_refused && self.refused.is_empty();
        if is_complete
            && self.state == RunState::Failed
            && self.participant.lifecycle.starts_active()
        {
            // Without an executive it is activated by no other process.
            let order = ActivationOrder { activation: self.activation, parameters: Vec::new() };
            self.awaits_time = Some(order);
            self.activate_when_time_is_known();
        }
        problems
    }

    fn hand_over(&mut self, name: &str, value: &Value) -> Result<(), String> {
        let (code, parameters) = (&mut self.code, &self.participant.parameters);
        let result = run_user_code(&self.participant, CalledFunction::ParameterReceived, || {
            code.receive_parameter(name, value).map(|()| Outcome::CarryOn).map_err(|fault| {
                let (subject, why) = (format!("parameter `{name}`: "), fault.to_string());
                // The fault of a derived struct begins with it already.
                let why = why.strip_prefix(&subject).unwrap_or(&why);
                match parameters.text_in_force(name) {
                    Some(text) if !why.contains(&text) => {
                        format!("{subject}{why} (its value: `{text}`)").into()
                    }
                    _ => format!("{subject}{why}").into(),
                }
            })
        });
        result.map(|_| ())
    }

    fn keep_last_value(&mut self, name: String, problem: String) {
        let last = self.accepted.get(&name).cloned();
        let Some(last) = last.filter(|_| !self.participant.lifecycle.has_crashed()) else {
            self.refused.insert(name, problem.clone());
            return self.report_result(Err(problem));
        };
        let reason = format!("{problem}; its last good value stays in force");
        self.participant.reports.record_standing_error(&name, &reason);
        // The code may have taken a part of the refused value.
        if let Err(problem) = self.hand_over(&name, &last) {
            self.accepted.remove(&name);
            self.participant.reports.resolve_error(&name);
            self.refused.insert(name, problem.clone());
            self.report_result(Err(problem));
        }
    }

    /// Calls `exec`.
    pub fn execute_call(&mut self, why: Call) {
        let (code, participant) = (&mut self.code, &self.participant);
        let result = run_user_code(participant, CalledFunction::Exec, || {
            participant.calls.enter_exec();
            code.execute(why)
        });
        if why == Call::Stopping {
            self.report_last_call(result);
        } else {
            self.report_result(result);
        }
    }

    /// Reports what the last call of an activation returned; the state that follows is another's to
    /// enter. A failure that is known already is only logged.
    fn report_last_call(&mut self, result: Result<Outcome, String>) {
        let reports = &self.participant.reports;
        match result.and_then(|outcome| check_outcome(outcome, &self.participant)) {
            Ok(Outcome::CarryOn | Outcome::Done) => {}
            Ok(Outcome::Event { name, value }) => {
                tracing::warn!(
                    "the event `{name}` of the last call: its activation is over, so no \
                     transition may wait for it any more"
                );
                reports.add_report(self.activation, ReportKind::Event { name, value });
            }
            Ok(Outcome::Failed(reason)) | Err(reason) => {
                reports.record_error(&reason);
                if self.state != RunState::Failed {
                    reports.add_report(self.activation, ReportKind::Failed { reason });
                }
            }
        }
    }

    /// Becomes active, or frozen, for the first time; an activation waits until the time is known.
    /// Returns whether it has begun.
    pub fn begin_life(&mut self, active: bool) -> bool {
        if !self.refused.is_empty() {
            // Reported when its parameters were handed over.
            self.enter_state(RunState::Failed);
            return true;
        }
        if !active {
            self.enter_state(RunState::Frozen);
            return true;
        }
        let is_known = self.participant.clock.is_known();
        if is_known {
            self.carry_out_activation(ActivationOrder { activation: 0, parameters: Vec::new() });
        }
        is_known
    }

    /// Carries out the activation that has waited for the time, once the time is known.
    pub fn activate_when_time_is_known(&mut self) {
        if self.participant.clock.is_known()
            && let Some(order) = self.awaits_time.take()
        {
            self.carry_out_activation(order);
        }
    }

    /// Carries out what the executive has ordered.
    pub fn obey_orders(&mut self) {
        while let Some(order) = self.participant.lifecycle.take_order() {
            match order {
                LifecycleOrder::Activate(order) if self.participant.clock.is_known() => {
                    self.carry_out_activation(order);
                }
                LifecycleOrder::Activate(order) => self.awaits_time = Some(order),
                LifecycleOrder::Report(outcome) => {
                    if self.is_active() {
                        self.report_checked(Ok(outcome));
                    }
                }
                LifecycleOrder::Freeze(activation) => {
                    self.awaits_time = None;
                    self.call_stopping();
                    self.activation = activation.max(self.activation);
                    self.enter_state(RunState::Frozen);
                }
            }
        }
    }

    /// Reports the panics of threads that the code has started itself: to a mission only while the
    /// component is active.
    pub fn report_thread_panics(&mut self) {
        for reason in self.participant.thread_panics.take_waiting() {
            if self.is_active() {
                self.report_result(Err(reason));
            } else {
                self.participant.reports.record_error(&reason);
            }
        }
    }

    /// Brings the component to rest for the end of the process.
    pub fn end_life(&mut self) {
        self.call_stopping();
        // Links still bring data until they are closed; a frozen component does not take them.
        self.enter_state(RunState::Frozen);
    }

    /// The values of the activation come before its first call. A value that cannot be read fails
    /// the activation.
    fn carry_out_activation(&mut self, order: ActivationOrder) {
        self.activation = order.activation;
        let was_active = self.is_active();
        if !was_active {
            self.state = RunState::Frozen;
            self.inputs.iter_mut().for_each(|input| input.history.clear());
        }
        let given = self.participant.parameters.apply_given(order.parameters, !was_active);
        if let Err(problem) = given {
            self.report_result(Err(problem));
        }
        let mut problems = self.deliver_parameters();
        let known = self.refused.values().filter(|why| !problems.contains(why));
        problems.extend(known.cloned().collect::<Vec<_>>());
        if self.state != RunState::Failed && !problems.is_empty() {
            self.report_result(Err(problems.join("; ")));
        }
        if self.state == RunState::Failed {
            return;
        }
        if !was_active {
            self.participant.reports.forget_last_error();
        }
        self.enter_state(RunState::Active);
        if !was_active {
            self.execute_call(Call::Started);
        }
    }

    /// The last call before the component is frozen or ended.
    fn call_stopping(&mut self) {
        if matches!(self.state, RunState::Active | RunState::Done | RunState::Failed) {
            self.execute_call(Call::Stopping);
        }
    }

    fn enter_state(&mut self, state: RunState) {
        let was_active = self.is_active();
        self.state = state;
        self.participant.lifecycle.enter_state(state, self.activation);
        if was_active != self.is_active() {
            for input in &self.inputs {
                input.port.set_paused(!self.is_active());
            }
        }
    }

    /// Reports what a call returned, and leaves the active state if it was the last of its
    /// activation.
    fn report_result(&mut self, result: Result<Outcome, String>) {
        self.report_checked(result.and_then(|outcome| check_outcome(outcome, &self.participant)));
    }

    fn report_checked(&mut self, result: Result<Outcome, String>) {
        let (state, report) = match result {
            Ok(Outcome::CarryOn) => return,
            Ok(Outcome::Event { name, value }) => {
                let event = ReportKind::Event { name, value };
                self.participant.reports.add_report(self.activation, event);
                return;
            }
            Ok(Outcome::Done) => {
                tracing::info!("done");
                (RunState::Done, ReportKind::Done)
            }
            Ok(Outcome::Failed(reason)) | Err(reason) => {
                self.participant.reports.record_error(&reason);
                (RunState::Failed, ReportKind::Failed { reason })
            }
        };
        self.participant.reports.add_report(self.activation, report);
        self.enter_state(state);
    }
}
