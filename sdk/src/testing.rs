//! Tests of a component without a system: built from its type, called with time by hand, its outputs
//! and reports read. No socket, no thread, no waiting.
//!
//! ```
//! use std::time::Duration;
//!
//! use armor_sdk::prelude::*;
//! use armor_sdk::testing::TestedComponent;
//!
//! /// Publishes twice what it receives.
//! struct Doubler(Armor);
//!
//! impl Component for Doubler {
//!     const KIND: &'static str = "doubler";
//!     const SUMMARY: &'static str = "Doubles numbers.";
//!
//!     fn new(armor: Armor) -> Result<Self, Fault> {
//!         armor.subscribe::<Number>("half")?;
//!         armor.provide::<Number>("whole")?;
//!         Ok(Self(armor))
//!     }
//!
//!     fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
//!         let Number { data: half } = data.decode()?;
//!         self.0.send_data("whole", &Number { data: 2.0 * half })?;
//!         Ok(())
//!     }
//! }
//!
//! let mut doubler = TestedComponent::build::<Doubler>(&[])?;
//! doubler.start()?;
//! doubler.send("half", &Number { data: 1.5 })?;
//! doubler.tick_after(Duration::from_millis(100))?;
//! assert_eq!(doubler.outputs::<Number>("whole")?, [Number { data: 3.0 }]);
//! assert_eq!(doubler.reports(), []);
//! # Ok::<(), armor_sdk::testing::TestError>(())
//! ```
//!
//! A step in which the component fails is an error of the test, with the reason: a function that
//! returns an error or panics, an [`Outcome::Failed`](crate::Outcome::Failed). A test that expects the
//! failure takes the error (`let error = doubler.send(…).unwrap_err();`), or continues and reads
//! [`TestedComponent::reports`].

mod error;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use armor_wire::codec;
use armor_wire::config::{Assigned, InputSettings};
use armor_wire::frame::DataHeader;
use armor_wire::keep::{Keep, Wake};
use armor_wire::message::Message;
use armor_wire::transport::Transport;

pub use armor_wire::control::{ReportKind, RunState};
pub use error::TestError;

use crate::armor::Armor;
use crate::call::{Call, Fault};
use crate::calls::CalledFunction;
use crate::component::Component;
use crate::describe::{construct, manifest_after_construction};
use crate::identity::ProcessIdentity;
use crate::kind_declaration::KindDeclaration;
use crate::lifecycle::{ActivationOrder, LifecycleOrder};
use crate::link::input::InputPort;
use crate::link::output::OutputPort;
use crate::link::payload::Payload;
use crate::message_type::MessageType;
use crate::participant::Participant;
use crate::running_component::RunningComponent;
use crate::thread_panics::{ThreadMark, report_thread_panics};
use crate::timeline::ClockReading;
use crate::user_code::UserCode;

/// System time when a component is built.
pub const START_S: f64 = 1000.0;
/// Where the values come from, for messages about them.
const ORIGIN: &str = "the test";

/// The last messages that each input of a component under test stores.
pub const TESTED_HISTORY: u32 = 100;

/// A component under test. Time begins at [`START_S`] and passes only in
/// [`tick_after`](Self::tick_after) and [`pass_time`](Self::pass_time).
///
/// Each input counts as fed, by data named `test.INPUT`, with a history of [`TESTED_HISTORY`].
///
/// A panic of a thread that the component has started is a failure of the component, as in a system;
/// the next step finds it.
pub struct TestedComponent {
    kind: String,
    participant: Arc<Participant>,
    component: RunningComponent,
    /// By which the threads that the component starts are its own.
    mark: ThreadMark,
    passed: Duration,
    activations: u64,
    reports: Vec<ReportKind>,
    /// The number of messages sent by each source to each input.
    sent: BTreeMap<(String, String), u64>,
}

impl TestedComponent {
    /// Builds a component of type `C`. `parameters` have their values as in a file, with units; the
    /// others have their defaults. It is frozen until [`start`](Self::start).
    ///
    /// # Errors
    /// If its constructor fails, or a parameter is not declared, malformed, missing, given twice, or
    /// given and never requested.
    pub fn build<C: Component>(parameters: &[(&str, &str)]) -> Result<Self, TestError> {
        Self::build_kind(&KindDeclaration::of::<C>(), construct::<C>, parameters)
    }

    /// As [`build`](Self::build), for a kind that is declared while it runs.
    pub(crate) fn build_kind(
        kind: &KindDeclaration,
        constructor: impl FnOnce(Armor) -> Result<Box<dyn UserCode>, Fault>,
        parameters: &[(&str, &str)],
    ) -> Result<Self, TestError> {
        Self::try_build(kind, constructor, parameters)
            .map_err(|fault| TestError::NotBuilt { kind: kind.kind.clone(), fault })
    }

    fn try_build(
        kind: &KindDeclaration,
        constructor: impl FnOnce(Armor) -> Result<Box<dyn UserCode>, Fault>,
        parameters: &[(&str, &str)],
    ) -> Result<Self, Fault> {
        let name = kind.kind.clone();
        let identity = ProcessIdentity { name: name.clone(), kind: name, instance: 1 };
        let participant = Arc::new(Participant::new(identity, kind.declarations(), false)?);
        participant.clock.follow_readings();
        participant.clock.apply_reading(ClockReading { stamp_s: START_S, instance: 1 });
        participant.ports.start_recording();
        let own = |(name, text): &(&str, &str)| ((*name).to_owned(), (*text).to_owned());
        let values = parameters.iter().map(own).collect();
        for (index, (name, _)) in parameters.iter().enumerate() {
            if parameters[..index].iter().any(|(earlier, _)| earlier == name) {
                return Err(format!("parameter `{name}`: the test gives it twice").into());
            }
        }
        participant.parameters.answer_locally(values, ORIGIN)?;
        report_thread_panics(&participant);
        let mark = participant.thread_panics.mark();
        let marked = mark.mark_thread();
        let running = participant.calls.begin_call(CalledFunction::New);
        let code = constructor(Armor { participant: Arc::clone(&participant) })?;
        drop(running);
        participant.parameters.wait_for_all(Duration::ZERO)?;
        // What no process could run is refused here too.
        manifest_after_construction(kind, &participant)?;
        let unrequested = participant.parameters.list_unrequested();
        let is_given = |name: &str| parameters.iter().any(|(given, _)| *given == name);
        if let Some(ignored) = unrequested.iter().find(|declared| is_given(&declared.name)) {
            let name = &ignored.name;
            return Err(format!(
                "parameter `{name}`: the test gives it, but the component does not request it; call \
                 get_parameter({name:?}) in `new`"
            )
            .into());
        }
        let inputs = participant.ports.inputs();
        for input in &inputs {
            participant.ports.connect_input(&tested_link(&input.id, default_source(&input.id)));
        }
        let mut component = RunningComponent::new(code, Arc::clone(&participant), false);
        component.deliver_parameters();
        component.begin_life(false);
        drop(marked);
        let mut tested = Self {
            kind: kind.kind.clone(),
            participant,
            component,
            mark,
            passed: Duration::ZERO,
            activations: 0,
            reports: Vec::new(),
            sent: BTreeMap::new(),
        };
        tested.take_reports();
        Ok(tested)
    }

    /// Calls `exec` after each message from now on, as in a file that gives the component no rate.
    pub fn execute_on_data(&mut self) {
        self.component.set_executes_on_data(true);
    }

    /// Activates the component: `exec(Call::Started)`.
    ///
    /// # Errors
    /// If it is active already, or fails.
    pub fn start(&mut self) -> Result<(), TestError> {
        if self.component.is_active() {
            return Err(self.not_active("it is active already; stop it first"));
        }
        self.activations += 1;
        let order = ActivationOrder { activation: self.activations, parameters: Vec::new() };
        self.give_order(LifecycleOrder::Activate(order))
    }

    /// Freezes the component: `exec(Call::Stopping)`.
    ///
    /// # Errors
    /// If it has not been started, or fails.
    pub fn stop(&mut self) -> Result<(), TestError> {
        if self.state() == RunState::Frozen {
            return Err(self.not_active("it is frozen; start it first"));
        }
        self.give_order(LifecycleOrder::Freeze(self.activations))
    }

    fn give_order(&mut self, order: LifecycleOrder) -> Result<(), TestError> {
        self.participant.lifecycle.push_order(order);
        self.take_step(RunningComponent::obey_orders)
    }

    /// Runs code of the component and takes what it reports.
    fn take_step(&mut self, step: impl FnOnce(&mut RunningComponent)) -> Result<(), TestError> {
        let known = self.reports.len();
        let marked = self.mark.mark_thread();
        step(&mut self.component);
        drop(marked);
        self.take_reports();
        match find_failure(&self.reports[known..]) {
            None => Ok(()),
            Some(reason) => {
                Err(TestError::Failed { kind: self.kind.clone(), reason: reason.into() })
            }
        }
    }

    /// Lets time pass, then calls `exec(Call::Tick)`.
    ///
    /// # Errors
    /// If the component is not active, or fails.
    pub fn tick_after(&mut self, period: Duration) -> Result<(), TestError> {
        self.check_active()?;
        self.pass_time(period);
        self.take_step(|component| component.execute_call(Call::Tick))
    }

    /// Lets time pass without a call.
    pub fn pass_time(&mut self, time: Duration) {
        self.passed += time;
        let stamp_s = START_S + self.passed.as_secs_f64();
        self.participant.clock.apply_reading(ClockReading { stamp_s, instance: 1 });
    }

    /// System time, in seconds.
    pub fn timestamp(&self) -> f64 {
        self.participant.clock.timestamp()
    }

    /// Adds a link from the data `source`, `component.output`, to an input that takes several. The first
    /// one takes the place of `test.INPUT`. Call it before [`start`](Self::start): a system has all its
    /// links before the first call of `exec`.
    ///
    /// # Errors
    /// If there is no such input, or it takes one source only.
    pub fn link_from(&mut self, input: &str, source: &str) -> Result<(), TestError> {
        let inputs = self.participant.ports.inputs();
        let Some(port) = inputs.iter().find(|port| port.id == input) else {
            return Err(self.no_port("input", input, inputs.iter().map(|port| port.id.as_str())));
        };
        if !port.many {
            return Err(TestError::OneSource { kind: self.kind.clone(), input: input.into() });
        }
        let settings = tested_link(input, source.into());
        let place = match inputs.iter().position(|port| port.data() == Some(default_source(input)))
        {
            Some(place) => {
                inputs[place].connect(settings);
                Some(place)
            }
            None => self.participant.ports.connect_input(&settings),
        };
        if let Some(place) = place {
            self.component.take_input(place);
        }
        Ok(())
    }

    /// Hands `message`, created now, to the component as data of `input`; of an input that takes
    /// several sources as that of `test.INPUT`.
    ///
    /// # Errors
    /// If there is no such input, it has another type, or the component is not active or fails.
    pub fn send<T: Message>(&mut self, input: &str, message: &T) -> Result<(), TestError> {
        self.send_from(input, &default_source(input), message)
    }

    /// Hands `message`, created now, to the component as data of one source of an input.
    ///
    /// # Errors
    /// As [`send`](Self::send), or if the source does not feed the input
    /// ([`link_from`](Self::link_from)).
    pub fn send_from<T: Message>(
        &mut self,
        input: &str,
        source: &str,
        message: &T,
    ) -> Result<(), TestError> {
        self.check_input_type(input, &MessageType::of_message::<T>(source))?;
        let bytes = codec::encode(message)?;
        self.send_payload(input, source, &bytes)
    }

    fn check_input_type(&self, input: &str, given: &MessageType) -> Result<(), TestError> {
        let inputs = self.participant.ports.inputs();
        let Some(declared) = inputs.iter().find(|port| port.id == input) else {
            return Err(self.no_port("input", input, inputs.iter().map(|port| port.id.as_str())));
        };
        if let Some(learned) = &declared.learned {
            let known = learned.learn(given.clone(), input);
            let known = known.map_err(|problem| TestError::Refused { problem })?;
            known.map(|message_type| self.participant.ports.give_type(&message_type));
        } else if declared.schema_hash != given.schema_hash {
            return Err(other_type("input", input, &declared.type_name, &given.name));
        }
        Ok(())
    }

    /// Hands an encoded message, which has the type of the input, to the component.
    fn send_payload(&mut self, input: &str, source: &str, bytes: &[u8]) -> Result<(), TestError> {
        let inputs = self.participant.ports.inputs();
        let is_it =
            |port: &Arc<InputPort>| port.id == input && port.data().as_deref() == Some(source);
        let Some(index) = inputs.iter().position(is_it) else {
            let (input, source) = (input.into(), source.into());
            return Err(TestError::UnknownSource { input, source_data: source });
        };
        self.check_active()?;
        let sent = self.sent.entry((input.into(), source.into())).or_default();
        let sequence = *sent;
        *sent += 1;
        let header = DataHeader { sequence, stamp_s: self.timestamp(), instance: 1, fresh: false };
        self.take_step(|component| {
            component.deliver_data(index, header, 0, 0.0, Payload::Buffer(bytes));
        })
    }

    /// Changes a live parameter, as an edit of the file does in a running system.
    ///
    /// # Errors
    /// If it is not declared, not live or not requested, `text` is no value of it, the component
    /// refuses the value, or it fails. A value that it refuses leaves the last good one in force, and
    /// the component is active as before.
    pub fn set_parameter(&mut self, name: &str, text: &str) -> Result<(), TestError> {
        let parameters = &self.participant.parameters;
        let fails = |problem: &str| {
            Err(TestError::Parameter { name: name.into(), problem: problem.into() })
        };
        let Some(declared) = parameters.declaration(name) else {
            return fails(&format!("`{}` declares no such parameter", self.kind));
        };
        if let Err(problem) = declared.parse(text) {
            return fails(&problem);
        }
        if !declared.live {
            return fails(
                "it is not live: in a system it changes with the next start; build it again",
            );
        }
        if parameters.list_unrequested().iter().any(|one| one.name == name) {
            return fails("the component has not requested it; call `get_parameter` in `new`");
        }
        let assigned = Assigned { text: text.into(), base: String::new(), origin: ORIGIN.into() };
        parameters.accept_answer(name, Some(&assigned));
        self.take_step(|component| drop(component.deliver_parameters()))?;
        match self.participant.reports.find_standing_error(name) {
            None => Ok(()),
            Some(problem) => Err(TestError::Refused { problem }),
        }
    }

    /// Returns all messages that have been published on `output`, in order.
    ///
    /// # Errors
    /// If there is no such output, or it has another type.
    pub fn outputs<T: Message>(&self, output: &str) -> Result<Vec<T>, TestError> {
        let port = self.find_output(output)?;
        if port.schema_hash() != T::schema_hash() {
            return Err(other_type("output", output, &port.entry.type_name, T::NAME));
        }
        let messages = port.recorded();
        Ok(messages.iter().map(|bytes| codec::decode(bytes)).collect::<Result<_, _>>()?)
    }

    fn find_output(&self, output: &str) -> Result<Arc<OutputPort>, TestError> {
        let outputs = self.participant.ports.outputs();
        let found = outputs.iter().find(|port| port.id == output).cloned();
        found.ok_or_else(|| {
            let existing = outputs.iter().map(|port| port.id.as_str());
            self.no_port("output", output, existing)
        })
    }

    /// Hands an encoded message of this type, created now, to the component as data of one source of an
    /// input.
    ///
    /// # Errors
    /// As [`send_from`](Self::send_from).
    pub(crate) fn send_bytes(
        &mut self,
        input: &str,
        source: Option<&str>,
        message_type: &MessageType,
        bytes: &[u8],
    ) -> Result<(), TestError> {
        let source = source.map_or_else(|| default_source(input), Into::into);
        self.check_input_type(
            input,
            &MessageType { data: source.clone(), ..message_type.clone() },
        )?;
        self.send_payload(input, &source, bytes)
    }

    /// Returns all messages that have been published on `output`, encoded, and their schema.
    ///
    /// # Errors
    /// If there is no such output.
    pub(crate) fn list_encoded(&self, output: &str) -> Result<(String, Vec<Vec<u8>>), TestError> {
        let port = self.find_output(output)?;
        Ok((port.entry.schema.clone(), port.recorded()))
    }

    /// Returns the message that was published last on `output`.
    ///
    /// # Errors
    /// As [`outputs`](Self::outputs), or if nothing was published.
    pub fn last_output<T: Message>(&self, output: &str) -> Result<T, TestError> {
        let last = self.outputs(output)?.pop();
        last.ok_or_else(|| {
            let failure = (self.state() == RunState::Failed).then(|| find_failure(&self.reports));
            let why = failure.flatten().map(|reason| format!(": it has failed: {reason}"));
            TestError::NothingPublished { output: output.into(), why: why.unwrap_or_default() }
        })
    }

    /// Everything that the component has reported, in order.
    pub fn reports(&self) -> &[ReportKind] {
        &self.reports
    }

    /// The state that the component is in.
    pub fn state(&self) -> RunState {
        self.participant.lifecycle.state().state
    }

    fn take_reports(&mut self) {
        self.component.report_thread_panics();
        let new = self.participant.reports.list_after(0);
        if let Some(last) = new.last() {
            self.participant.reports.remove_acknowledged(last.number);
        }
        self.reports.extend(new.into_iter().map(|report| report.outcome));
    }

    fn check_active(&mut self) -> Result<(), TestError> {
        self.take_reports();
        match (self.state(), find_failure(&self.reports)) {
            (RunState::Active, _) => Ok(()),
            (RunState::Failed, Some(reason)) => {
                Err(self.not_active(&format!("it has failed: {reason}")))
            }
            (RunState::Done, _) => Err(self.not_active("it has reported that it is done")),
            _ => Err(self.not_active("it is frozen; start it first")),
        }
    }

    fn not_active(&self, why: &str) -> TestError {
        TestError::NotActive { kind: self.kind.clone(), why: why.into() }
    }

    fn no_port<'a>(
        &self,
        noun: &'static str,
        id: &str,
        existing: impl Iterator<Item = &'a str>,
    ) -> TestError {
        let existing = existing.map(str::to_owned).collect();
        TestError::NoPort { kind: self.kind.clone(), noun, id: id.into(), existing }
    }
}

/// The data that feed an input in a test.
fn default_source(input: &str) -> String {
    format!("test.{input}")
}

/// A link of a test.
fn tested_link(input: &str, data: String) -> InputSettings {
    let (keep, wake, transport) = (Keep::ALL, Wake::Sleep, Transport::Auto);
    InputSettings { id: input.into(), data, keep, wake, transport, history: TESTED_HISTORY }
}

/// The reason of the last failure.
fn find_failure(reports: &[ReportKind]) -> Option<&str> {
    reports.iter().rev().find_map(|report| match report {
        ReportKind::Failed { reason } => Some(reason.as_str()),
        _ => None,
    })
}

fn other_type(noun: &'static str, id: &str, declared: &str, given: &str) -> TestError {
    TestError::OtherType { noun, id: id.into(), declared: declared.into(), given: given.into() }
}

#[cfg(test)]
mod many;
#[cfg(test)]
mod tests;
