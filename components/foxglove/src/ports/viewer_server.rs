//! Accepts viewers on loopback, on one thread; another one follows the outputs of the system.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use armor_socket::{AcceptLog, FaultTable, explain_bind_error, is_closed_already, own_connection};
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::Builder;
use tokio::sync::oneshot;
use tokio::task::JoinSet;
use tokio::time::{interval, sleep, sleep_until};

use super::bridge::Bridge;
use super::session::serve_client;

/// Viewers at the same time, with those that have not sent their handshake.
const MAX_CONNECTIONS: usize = 32;
/// Threads for requests that wait for a process of the system.
const MAX_BLOCKING: usize = 8;
/// Time between two listings of the outputs.
const LIST_EVERY: Duration = Duration::from_millis(500);
/// Time between two looks at connections and parameters.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// Why a server cannot start.
#[derive(Debug, Error)]
pub(super) enum ViewerServerError {
    /// Its address is open to other hosts.
    #[error(
        "{0} can be reached from other hosts, and viewers have no key: listen on 127.0.0.1, and \
         forward the port from the other computer with ssh -L (docs/foxglove.md)"
    )]
    NotLoopback(SocketAddr),
    /// It cannot listen there.
    #[error("cannot listen on {0}: {1}; choose another port with the parameter `listen`")]
    Listen(SocketAddr, String),
    /// A thread or its event loop cannot be started.
    #[error("the server cannot be started: {0}")]
    Io(#[from] io::Error),
}

/// A running server. Dropping it closes all its connections.
pub(super) struct ViewerServer {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
    is_over: Arc<AtomicBool>,
}

impl ViewerServer {
    /// Starts a server; pages of `origins` may connect, besides programs.
    ///
    /// # Errors
    /// If it cannot listen, would listen beyond loopback, or no thread can be started.
    pub(super) fn start(
        listen: SocketAddr,
        origins: Arc<[String]>,
        bridge: Arc<Bridge>,
    ) -> Result<Self, ViewerServerError> {
        if !listen.ip().is_loopback() {
            return Err(ViewerServerError::NotLoopback(listen));
        }
        let explain = |error| ViewerServerError::Listen(listen, explain_bind_error(listen, &error));
        let listener = std::net::TcpListener::bind(listen).map_err(explain)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let is_over = Arc::new(AtomicBool::new(false));
        let (followed, is_followed) = (Arc::clone(&bridge), Arc::clone(&is_over));
        thread::Builder::new().name("foxglove-list".into()).spawn(move || {
            while !is_followed.load(Ordering::Relaxed) {
                followed.follow_outputs();
                thread::sleep(LIST_EVERY);
            }
        })?;
        let runtime = Builder::new_current_thread()
            .max_blocking_threads(MAX_BLOCKING)
            .enable_all()
            .build()?;
        let (stop, stopped) = oneshot::channel::<()>();
        let thread = thread::Builder::new().name("foxglove".into()).spawn(move || {
            runtime.block_on(async {
                tokio::select! {
                    () = accept_viewers(listener, origins, &bridge) => {}
                    () = halt_silent_drivers(&bridge) => {}
                    () = inform_viewers(&bridge) => {}
                    _ = stopped => {}
                }
            });
            // Work that waits for a process of the system ends by itself.
            runtime.shutdown_background();
        })?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread), is_over })
    }

    /// Returns the address on which it listens.
    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for ViewerServer {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

async fn accept_viewers(
    listener: std::net::TcpListener,
    origins: Arc<[String]>,
    bridge: &Arc<Bridge>,
) {
    let listener = match TcpListener::from_std(listener) {
        Ok(listener) => listener,
        Err(error) => return tracing::error!("the server does not listen: {error}"),
    };
    let faults = Arc::new(FaultTable::default());
    let mut accepting = AcceptLog::default();
    let mut clients = JoinSet::new();
    loop {
        let (stream, address) = match listener.accept().await {
            Ok(accepted) => {
                if accepting.note_success() {
                    tracing::info!("viewers are accepted again");
                }
                accepted
            }
            Err(error) => {
                if accepting.note_failure(Instant::now()) {
                    tracing::warn!("no viewer can be accepted: {error}");
                }
                // Without free file descriptors the next attempt fails immediately.
                sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        while clients.try_join_next().is_some() {}
        let refuse = |reason: String| {
            if faults.is_new(None, reason.clone()) {
                tracing::warn!("a viewer is refused: {reason}");
            }
        };
        let stream = match check_stranger(stream) {
            Ok(_) if clients.len() >= MAX_CONNECTIONS => {
                refuse(format!("{MAX_CONNECTIONS} are connected already"));
                continue;
            }
            Ok(stream) => stream,
            Err(error) if is_closed_already(&error) => {
                tracing::debug!("a viewer has left before it was served");
                continue;
            }
            Err(error) => {
                refuse(error.to_string());
                continue;
            }
        };
        let (bridge, origins) = (Arc::clone(bridge), Arc::clone(&origins));
        let faults = Arc::clone(&faults);
        clients.spawn(async move {
            if let Err(reason) = serve_client(bridge, stream, address.to_string(), origins).await
                && faults.is_new(None, reason.clone())
            {
                tracing::warn!("a viewer is refused: {reason}");
            }
        });
    }
}

/// Refuses the client of another user before a byte of it is read.
fn check_stranger(stream: TcpStream) -> io::Result<TcpStream> {
    stream.into_std().and_then(own_connection).and_then(TcpStream::from_std)
}

/// Publishes zero when the client that drives has sent nothing for too long. Waits for no client.
async fn halt_silent_drivers(bridge: &Arc<Bridge>) {
    loop {
        match bridge.commander.halt_if_silent() {
            Some(until) => sleep_until(until.into()).await,
            None => bridge.commander.drive_began.notified().await,
        }
    }
}

/// Informs the clients of connections and parameters that have changed.
async fn inform_viewers(bridge: &Arc<Bridge>) {
    let mut looks = interval(LOOK_EVERY);
    loop {
        looks.tick().await;
        bridge.update_graphs();
        let asked = Arc::clone(bridge);
        // Configd may take seconds to answer.
        let _ = tokio::task::spawn_blocking(move || asked.update_parameters()).await;
    }
}
