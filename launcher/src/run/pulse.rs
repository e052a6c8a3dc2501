//! The control connection to a component: its beats are heard here, and it is asked to end here.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use armor_sdk::control::{ControlConnection, ControlEvent};
use armor_wire::control::{Answer, Command, Role};
use armor_wire::registry::ComponentEntry;
use tokio::sync::Notify;
use tokio::task::JoinHandle;

/// Rest between two tries to connect.
const RETRY: Duration = Duration::from_millis(200);

/// Connected to one process start of a component, or trying to be. Dropped when the process ends.
pub struct Pulse {
    /// The process start.
    pub instance: u64,
    connection: Arc<Mutex<Option<ControlConnection>>>,
    task: JoinHandle<()>,
}

impl Pulse {
    /// Connects, and calls `heard` with everything that the component says.
    pub fn begin(entry: ComponentEntry, heard: impl Fn(&Answer) + Clone + Send + 'static) -> Self {
        let connection = Arc::new(Mutex::new(None));
        let instance = entry.instance;
        let task = tokio::spawn(stay_connected(entry, connection.clone(), heard));
        Self { instance, connection, task }
    }

    /// Asks the component to come to rest and end; whether that could be said.
    pub fn terminate(&self) -> bool {
        let connection = self.connection.lock().unwrap_or_else(PoisonError::into_inner);
        connection.as_ref().is_some_and(|connection| connection.send(&Command::Terminate).is_ok())
    }
}

impl Drop for Pulse {
    fn drop(&mut self) {
        self.task.abort();
        self.connection.lock().unwrap_or_else(PoisonError::into_inner).take();
    }
}

async fn stay_connected(
    entry: ComponentEntry,
    slot: Arc<Mutex<Option<ControlConnection>>>,
    heard: impl Fn(&Answer) + Clone + Send + 'static,
) {
    let from = format!("launcher-{}", std::process::id());
    loop {
        let closed = Arc::new(Notify::new());
        let sink = {
            let (closed, heard) = (closed.clone(), heard.clone());
            move |event| match event {
                ControlEvent::Answer(answer) => heard(&answer),
                ControlEvent::Closed(_) => closed.notify_one(),
            }
        };
        let (entry, from) = (entry.clone(), from.clone());
        let connecting = move || ControlConnection::connect(&entry, Role::Launcher, &from, sink);
        // Why it fails does not matter here: a component that stays silent is killed.
        if let Ok(Ok(connection)) = tokio::task::spawn_blocking(connecting).await {
            *slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(connection);
            closed.notified().await;
            slot.lock().unwrap_or_else(PoisonError::into_inner).take();
        }
        tokio::time::sleep(RETRY).await;
    }
}
