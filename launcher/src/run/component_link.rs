//! The control connection to a component: it receives beats, and asks the component to end.

use std::sync::Arc;
use std::time::Duration;

use armor_sdk::control::{ControlConnection, ControlEvent};
use armor_wire::control::{Answer, Command, Role};
use armor_wire::registry::ComponentEntry;
use parking_lot::Mutex;
use tokio::sync::Notify;
use tokio::task::JoinHandle;

use super::descriptors::has_free_descriptor;

/// Pause between two attempts to connect.
const RETRY: Duration = Duration::from_millis(200);

/// A connection to one process start of a component, made again when it breaks. Dropped when the
/// process ends.
pub struct ComponentLink {
    /// The process start.
    pub instance: u64,
    /// Its process, as registered.
    pub pid: u32,
    connection: Arc<Mutex<Option<ControlConnection>>>,
    task: JoinHandle<()>,
}

impl ComponentLink {
    /// Connects, and calls `heard` with every answer of the component, and without one when there
    /// is no descriptor left to connect.
    pub fn begin(
        entry: ComponentEntry,
        heard: impl Fn(Option<&Answer>) + Clone + Send + 'static,
    ) -> Self {
        let connection = Arc::new(Mutex::new(None));
        let (instance, pid) = (entry.instance, entry.pid);
        let task = tokio::spawn(stay_connected(entry, connection.clone(), heard));
        Self { instance, pid, connection, task }
    }

    /// Asks the component to come to rest and end, and returns whether the request was sent.
    pub fn terminate(&self) -> bool {
        let connection = self.connection.lock();
        connection.as_ref().is_some_and(|connection| connection.send(&Command::Terminate).is_ok())
    }
}

impl Drop for ComponentLink {
    fn drop(&mut self) {
        self.task.abort();
        self.connection.lock().take();
    }
}

async fn stay_connected(
    entry: ComponentEntry,
    slot: Arc<Mutex<Option<ControlConnection>>>,
    heard: impl Fn(Option<&Answer>) + Clone + Send + 'static,
) {
    let from = format!("launcher-{}", std::process::id());
    loop {
        let closed = Arc::new(Notify::new());
        let sink = {
            let (closed, heard) = (closed.clone(), heard.clone());
            move |event| match event {
                ControlEvent::Answer(answer) => heard(Some(&answer)),
                ControlEvent::Closed(_) => closed.notify_one(),
            }
        };
        let (entry, from) = (entry.clone(), from.clone());
        let connecting = move || ControlConnection::connect(&entry, Role::Launcher, &from, sink);
        match tokio::task::spawn_blocking(connecting).await {
            Ok(Ok(connection)) => {
                *slot.lock() = Some(connection);
                closed.notified().await;
                slot.lock().take();
            }
            // Any other failure does not matter here: a component that stays silent is killed.
            _ if !has_free_descriptor() => heard(None),
            _ => {}
        }
        tokio::time::sleep(RETRY).await;
    }
}
