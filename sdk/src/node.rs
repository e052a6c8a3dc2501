//! A process that is in the registry and publishes data without being a component: the executive,
//! and whatever tool wants to be seen.

use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;

use armor_wire::control::Answer;
use armor_wire::registry::{ComponentEntry, DEFAULT_PORT};

use crate::armor::Armor;
use crate::component::Fault;
use crate::directory::Directory;
use crate::following;
use crate::orders::OrderEvent;
use crate::service;
use crate::shared::Shared;
use crate::socket::{self, fresh_instance};
use crate::timeline::{Passage, Reading};

/// Who a [`Node`] is and where it registers.
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
pub struct Node {
    shared: Arc<Shared>,
}

impl Node {
    /// Registers; `declare` declares the outputs.
    ///
    /// # Errors
    /// If the registry does not answer within `limit`, refuses the name, or `declare` fails.
    pub fn start(
        options: &NodeOptions,
        limit: Duration,
        declare: impl FnOnce(&Armor) -> Result<(), Fault>,
    ) -> Result<Self, Fault> {
        let instance = fresh_instance();
        let shared =
            Arc::new(Shared::new(&options.name, &options.kind, instance, Vec::new(), false)?);
        shared.set_non_controllable();
        declare(&Armor { shared: Arc::clone(&shared) })?;
        connect(&shared, options, limit)?;
        serve_outputs(&shared);
        shared.publish_state(armor_wire::control::RunState::Active, 0);
        Ok(Self { shared })
    }

    /// The functions of a component; those that publish and tell the time are of use here.
    pub fn armor(&self) -> Armor {
        Armor { shared: Arc::clone(&self.shared) }
    }

    /// Its connection to the registry.
    pub fn directory(&self) -> &Directory {
        self.shared.directory()
    }

    /// From now on the time of this process follows `data`; `hear` is told, on a thread of its own, of
    /// every reading by which time begins, passes or jumps.
    ///
    /// # Errors
    /// If there is no thread for it.
    pub fn follow_time(
        &self,
        data: &str,
        hear: impl FnMut(Reading, Passage) + Send + 'static,
    ) -> std::io::Result<()> {
        following::start(&self.shared, data, hear)
    }

    /// From now on operators may give orders to this process, in the order they arrive; without it
    /// they are refused. Each wants [`Self::answer`].
    pub fn orders(&self) -> Receiver<OrderEvent> {
        self.shared.desk.take()
    }

    /// Answers order number `request` on the connection it came on. Who has left does not hear it.
    pub fn answer(&self, connection: u64, request: u64, accepted: bool, text: String) {
        self.shared.answer_order(connection, Answer::Ordered { request, accepted, text });
    }

    /// Whether somebody has ordered this process to end.
    pub fn is_ending(&self) -> bool {
        self.shared.is_ending()
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.shared.leave();
    }
}

/// Listens, registers and serves.
pub(crate) fn connect(
    shared: &Arc<Shared>,
    options: &NodeOptions,
    limit: Duration,
) -> Result<(), Fault> {
    let listener = socket::listen(shared.instance)?;
    let entry = ComponentEntry {
        name: shared.name.clone(),
        kind: shared.kind.clone(),
        instance: shared.instance,
        pid: std::process::id(),
        host: socket::host_name(),
        endpoint: listener.local_addr()?.to_string(),
    };
    let directory = Directory::register(&options.registry, entry, Arc::clone(&shared.clock));
    shared.set_directory(directory.clone());
    service::start(shared, listener)?;
    directory.wait_connected(limit)?;
    Ok(())
}

/// Tells the registry of every output.
pub(crate) fn serve_outputs(shared: &Arc<Shared>) {
    for output in shared.outputs() {
        shared.directory().provide(output.entry.clone());
    }
}
