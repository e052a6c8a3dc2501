//! Asks the launcher of the run whether an executive can take an order, for STOP.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use armor_inspect::run_control::{self, RunReply, RunRequest};
use armor_inspect::systems;
use armor_socket::has_proxy;
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;
use tokio::time::timeout;

/// Longest delay of an order by the question. A launcher answers within a millisecond; one that hangs
/// must not keep the order from an executive that is being started.
const ANSWER_WITHIN: Duration = Duration::from_millis(500);
/// Most questions at the same time: each has a thread, for 5 s if the launcher hangs.
const MAX_ASKING: usize = 4;

/// Where the launcher of the run is found.
pub(crate) struct LauncherQuestion {
    /// By which its record is found; none if that is no address.
    registry: Option<SocketAddr>,
    asking: Arc<Semaphore>,
}

impl LauncherQuestion {
    /// For the run whose registry listens at `registry`.
    pub(crate) fn new(registry: &str) -> Self {
        Self { registry: registry.parse().ok(), asking: Arc::new(Semaphore::new(MAX_ASKING)) }
    }

    /// Returns whether the launcher states that no executive runs and none is going to be started. False
    /// if that is unknown, such as in a system without a launcher or on another host.
    pub(crate) async fn rules_out_executive(&self) -> bool {
        let Some(registry) = self.registry else { return false };
        let Ok(place) = Arc::clone(&self.asking).try_acquire_owned() else { return false };
        let asked = spawn_blocking(move || {
            let reply = ask_launcher(registry);
            drop(place);
            reply
        });
        let reply = timeout(ANSWER_WITHIN, asked).await;
        matches!(reply, Ok(Ok(Some(RunReply { has_executive: Some(false), .. }))))
    }
}

/// Returns the launcher's reply; none if it cannot be asked.
fn ask_launcher(registry: SocketAddr) -> Option<RunReply> {
    // A run of this host at the same address is another one.
    if has_proxy() {
        return None;
    }
    let running = systems::list_running(&systems::record_directory().ok()?).ok()?;
    let record = running.into_iter().find(|record| record.registry == registry)?;
    run_control::request(&record, &RunRequest::List).ok()
}
