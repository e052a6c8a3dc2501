//! A registered process that publishes data without being a component: the executive, configd, and
//! tools that other processes must find.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Receiver;
use std::time::Duration;

use armor_socket::{ComponentListeners, host_name, random_id};
use armor_wire::control::{Answer, OutputStatus, RunState};
use armor_wire::message::Message;
use armor_wire::registry::{ComponentEntry, DEFAULT_PORT};

use crate::armor::Armor;
use crate::call::Fault;
use crate::directory::{Directory, DirectoryError};
use crate::following;
use crate::identity::ProcessIdentity;
use crate::message_type::MessageType;
use crate::orders::OrderEvent;
use crate::participant::{Declarations, Participant};
use crate::playback_orders::GivenPlaybackOrder;
use crate::port_table::SendError;
use crate::service;
use crate::timeline::{ClockReading, Passage};

/// Time without an answer of the registry after which a process reports that it waits for it.
const NOTICE_AFTER: Duration = Duration::from_millis(1500);

/// The name of a [`SystemNode`] and where it registers.
#[derive(Clone, Debug)]
pub struct NodeOptions {
    /// Its name in the system.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// The registry, `host:port`.
    pub registry: String,
}

impl Default for NodeOptions {
    fn default() -> Self {
        let registry = format!("127.0.0.1:{DEFAULT_PORT}");
        Self { name: "node".into(), kind: "node".into(), registry }
    }
}

/// A registered process with outputs. Dropping it leaves the registry.
pub struct SystemNode {
    participant: Arc<Participant>,
}

impl SystemNode {
    /// Registers a process; `declare` declares its outputs.
    ///
    /// # Errors
    /// If the registry does not answer within `limit`, refuses the name, or `declare` fails.
    pub fn start(
        options: &NodeOptions,
        limit: Duration,
        declare: impl FnOnce(&Armor) -> Result<(), Fault>,
    ) -> Result<Self, Fault> {
        let (name, kind) = (options.name.clone(), options.kind.clone());
        let identity = ProcessIdentity { name, kind, instance: random_id() };
        let participant = Arc::new(Participant::new(identity, Declarations::default(), false)?);
        participant.lifecycle.set_non_controllable();
        declare(&Armor { participant: Arc::clone(&participant) })?;
        let started = join_system(&participant, &options.registry, limit);
        // One that is refused leaves: its threads would try again, and take the name later.
        let node = Self { participant };
        started?;
        provide_outputs(&node.participant);
        node.participant.lifecycle.enter_state(RunState::Active, 0);
        Ok(node)
    }

    /// The functions of a component, of which those that publish and return the time are useful
    /// here.
    pub fn armor(&self) -> Armor {
        Armor { participant: Arc::clone(&self.participant) }
    }

    /// Gives the outputs that were declared with [`AnyMessage`](crate::AnyMessage) the type with this
    /// schema, and declares them to the registry.
    pub fn give_outputs_type(&self, type_name: &str, schema: &str) {
        self.participant.give_outputs_type(&MessageType::of_schema(type_name, schema));
    }

    /// Its outputs with their links.
    pub fn outputs(&self) -> Vec<OutputStatus> {
        self.participant.ports.outputs().iter().map(|output| output.status()).collect()
    }

    /// Its connection to the registry.
    pub fn directory(&self) -> &Directory {
        self.participant.directory()
    }

    /// Lets the time of this process follow `data` from now on. Calls `on_reading`, on a thread of
    /// its own, for every reading by which time begins, passes or jumps.
    ///
    /// # Errors
    /// If no thread can be started for it.
    pub fn follow_time(
        &self,
        data: &str,
        on_reading: impl FnMut(ClockReading, Passage) + Send + 'static,
    ) -> std::io::Result<()> {
        following::start_following(&self.participant, data, on_reading)
    }

    /// Accepts orders of operators from now on; without it they are refused. Returns where they
    /// arrive, in order. Each order needs an [`Self::answer`].
    pub fn orders(&self) -> Receiver<OrderEvent> {
        self.participant.operator_orders.accept_orders()
    }

    /// Accepts orders to a player of recordings from now on; without it they are refused. Returns
    /// where they arrive. Each needs an [`Self::answer`].
    pub fn playback_orders(&self) -> Receiver<GivenPlaybackOrder> {
        self.participant.playback_orders.accept_orders()
    }

    /// Answers order number `request` on the connection on which it came, if that still exists.
    pub fn answer(&self, connection: u64, request: u64, accepted: bool, text: String) {
        self.participant.answer_order(connection, Answer::Ordered { request, accepted, text });
    }

    /// Sets whether this process has something to finish, for those who ask for its status.
    pub fn set_busy(&self, is_busy: bool) {
        self.participant.is_busy.store(is_busy, Ordering::Relaxed);
    }

    /// Marks from another thread that this process has something to finish.
    pub fn busy_marker(&self) -> BusyMarker {
        BusyMarker(Arc::clone(&self.participant))
    }

    /// Declares that this process has done what it is for; it continues until it is ended.
    pub fn set_done(&self) {
        self.participant.lifecycle.enter_state(RunState::Done, 0);
    }

    /// Publishes a message with this stamp, in system time.
    ///
    /// # Errors
    /// [`SendError`] if there is no such output, it has another type, or the message is too large.
    pub fn publish_at<T: Message>(
        &self,
        id: &str,
        message: &T,
        stamp_s: f64,
    ) -> Result<(), SendError> {
        self.participant.ports.publish(id, message, stamp_s).map(|_| ())
    }

    /// Whether this process has been ordered to end.
    pub fn is_ending(&self) -> bool {
        self.participant.lifecycle.is_ending()
    }
}

/// See [`SystemNode::busy_marker`].
pub struct BusyMarker(Arc<Participant>);

impl BusyMarker {
    /// Marks it, until [`SystemNode::set_busy`] changes that.
    pub fn mark(&self) {
        self.0.is_busy.store(true, Ordering::Relaxed);
    }
}

impl Drop for SystemNode {
    fn drop(&mut self) {
        self.participant.leave_system();
    }
}

/// Listens, registers and serves; returns without the registry if the process is to end meanwhile.
pub(crate) fn join_system(
    participant: &Arc<Participant>,
    registry: &str,
    limit: Duration,
) -> Result<(), Fault> {
    let identity = &participant.identity;
    let listeners = ComponentListeners::open(identity.instance)?;
    let entry = ComponentEntry {
        name: identity.name.clone(),
        kind: identity.kind.clone(),
        instance: identity.instance,
        pid: std::process::id(),
        host: host_name(),
        endpoint: listeners.endpoint()?,
    };
    let directory = Directory::register(registry, entry, Arc::clone(&participant.clock));
    participant.set_directory(directory.clone());
    service::start_thread(participant, listeners)?;
    wait_for_registry(&directory, registry, limit, || participant.lifecycle.is_ending())?;
    Ok(())
}

/// Waits, and reports soon what it waits for: a component that was started by hand often has no
/// registry.
fn wait_for_registry(
    directory: &Directory,
    registry: &str,
    limit: Duration,
    is_ending: impl Fn() -> bool,
) -> Result<(), DirectoryError> {
    let soon = NOTICE_AFTER.min(limit);
    match directory.wait_connected_unless(soon, &is_ending) {
        Err(DirectoryError::Timeout { problem, .. }) if soon < limit => {
            tracing::warn!(
                "no registry answers at {registry} ({problem}); waiting {} s for it; `armor run \
                 FILE` or `armor registry` starts one, --registry names another",
                limit.as_secs()
            );
            directory.wait_connected_unless(limit - soon, is_ending)
        }
        other => other,
    }
}

/// Declares every output to the registry; one without a type is declared when it gets one.
pub(crate) fn provide_outputs(participant: &Participant) {
    for output in participant.ports.outputs().iter().filter(|output| !output.lacks_type()) {
        participant.directory().declare_output(output.entry.clone());
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    /// Longer than any test may take: only an end of the wait ends it.
    const FOR_EVER: Duration = Duration::from_secs(3600);

    #[test]
    fn a_process_that_is_to_end_no_longer_waits_for_its_registry() {
        let identity = ProcessIdentity { name: "a".into(), kind: "a".into(), instance: 1 };
        let participant = Participant::new(identity, Declarations::default(), false);
        let participant = Arc::new(participant.expect("a process"));
        let (sender, joined) = mpsc::channel();
        let joining = Arc::clone(&participant);
        std::thread::spawn(move || {
            let result = join_system(&joining, "127.0.0.1:1", FOR_EVER);
            sender.send(result.map_err(|fault| fault.to_string()))
        });
        assert!(joined.recv_timeout(Duration::from_millis(100)).is_err(), "it waits");
        participant.lifecycle.request_end();
        assert_eq!(joined.recv_timeout(Duration::from_secs(60)), Ok(Ok(())));
        participant.leave_system();
    }
}
