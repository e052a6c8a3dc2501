//! A component whose data come from a recording: registered under its name, activated and frozen as
//! itself, with its outputs, and without code and inputs.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use armor_socket::random_id;
use armor_wire::control::{OutputStatus, ReportKind};

use crate::any_message::AnyMessage;
use crate::call::{Call, Fault, Outcome};
use crate::data::{Data, Header};
use crate::identity::ProcessIdentity;
use crate::lifecycle::LifecycleOrder;
use crate::message_type::MessageType;
use crate::node::{NodeOptions, join_system, provide_outputs};
use crate::orders::OrderInbox;
use crate::parameter::Value;
use crate::participant::{Declarations, Participant};
use crate::port_table::SendError;
use crate::runtime::Runtime;
use crate::user_code::UserCode;

/// It has nothing to do at its ticks, so they are rare.
const TICK_RATE_HZ: f64 = 1e-3;

/// Time between two looks at whether it has started.
const STARTED_EVERY: Duration = Duration::from_millis(1);

/// An output of a [`StandIn`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StandInOutput {
    /// Its name in the component.
    pub id: String,
    /// The name of its type.
    pub type_name: String,
    /// The schema of its messages.
    pub schema: String,
    /// Whether it keeps its last values for later subscribers.
    pub latched: bool,
}

/// Takes the place of a component. Dropping it leaves the system.
pub struct StandIn {
    participant: Arc<Participant>,
    outputs: Vec<(String, Arc<MessageType>)>,
    main_loop: Option<JoinHandle<()>>,
}

impl StandIn {
    /// Registers it. `controlled`: the mission activates and freezes it; otherwise it is always active.
    ///
    /// # Errors
    /// If the registry does not answer within `limit`, refuses the name, or two outputs have the same
    /// one.
    pub fn start(
        options: &NodeOptions,
        outputs: &[StandInOutput],
        controlled: bool,
        limit: Duration,
    ) -> Result<Self, Fault> {
        let (name, kind) = (options.name.clone(), options.kind.clone());
        let identity = ProcessIdentity { name: name.clone(), kind, instance: random_id() };
        let mut participant = Participant::new(identity, Declarations::default(), false)?;
        // A recorded executive takes no orders.
        participant.operator_orders = OrderInbox::default();
        let participant = Arc::new(participant);
        let mut types = Vec::new();
        for output in outputs {
            let message_type = MessageType::of_schema(&output.type_name, &output.schema);
            participant.ports.add_typed_output(&output.id, &message_type, output.latched)?;
            types.push((output.id.clone(), Arc::new(message_type)));
        }
        participant.lifecycle.set_controlled(controlled);
        join_system(&participant, &options.registry, limit)?;
        provide_outputs(&participant);
        let runtime = Runtime::new(Box::new(NoCode), Arc::clone(&participant), Some(TICK_RATE_HZ));
        let run = move || {
            runtime.run_main_loop();
        };
        let main_loop = std::thread::Builder::new().name(name).spawn(run)?;
        // What it publishes before it is active or frozen would be lost.
        let begun = Instant::now();
        while participant.lifecycle.is_starting() && begun.elapsed() < limit {
            std::thread::sleep(STARTED_EVERY);
        }
        Ok(Self { participant, outputs: types, main_loop: Some(main_loop) })
    }

    /// Publishes a message on an output, in its encoded form. Returns `false` without publishing it
    /// while the component is frozen.
    ///
    /// # Errors
    /// [`SendError`] if there is no such output, or the message is too long.
    pub fn publish(&self, id: &str, stamp_s: f64, bytes: Vec<u8>) -> Result<bool, SendError> {
        let Some(_right) = self.participant.lifecycle.try_publish_quietly() else {
            return Ok(false);
        };
        let known = self.outputs.iter().find(|(known, _)| known == id);
        let any = MessageType::of_message::<AnyMessage>("");
        let message_type = known.map_or_else(|| Arc::new(any), |(_, known)| Arc::clone(known));
        let message = AnyMessage::from_bytes(&message_type, stamp_s, bytes);
        self.participant.ports.publish(id, &message, stamp_s)?;
        Ok(true)
    }

    /// Reports to the executive, as the component has done. Returns `false` without reporting it while
    /// the component is not active.
    pub fn report(&self, kind: ReportKind) -> bool {
        if !self.participant.lifecycle.is_active() {
            return false;
        }
        let outcome = match kind {
            ReportKind::Done => Outcome::Done,
            ReportKind::Failed { reason } => Outcome::Failed(reason),
            ReportKind::Event { name, value } => Outcome::Event { name, value },
        };
        self.participant.lifecycle.push_order(LifecycleOrder::Report(outcome));
        true
    }

    /// Whether the executive has taken all of its reports, or there is none.
    pub fn is_settled(&self) -> bool {
        self.participant.reports.is_empty() && !self.participant.lifecycle.has_orders()
    }

    /// Its outputs and their links.
    pub fn outputs(&self) -> Vec<OutputStatus> {
        self.participant.ports.outputs().iter().map(|output| output.status()).collect()
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        self.participant.lifecycle.request_end();
        if let Some(main_loop) = self.main_loop.take() {
            // A loop without code does not panic.
            let _ = main_loop.join();
        }
        self.participant.leave_system();
    }
}

struct NoCode;

impl UserCode for NoCode {
    fn receive_parameter(&mut self, _: &str, _: &Value) -> Result<(), Fault> {
        Ok(())
    }

    fn receive_data(&mut self, _: &Header<'_>, _: &Data<'_>) -> Result<(), Fault> {
        Ok(())
    }

    fn execute(&mut self, _: Call) -> Result<Outcome, Fault> {
        Ok(Outcome::CarryOn)
    }
}
