//! Accepts connections on loopback and serves them: STOP on a thread of its own, which also accepts,
//! and everything else on other threads.
//!
//! The first bytes of a connection decide: one that begins with a request for `/api/stop` stays on
//! the thread for STOP, which waits for nothing else. So STOP works when all other threads hang.

use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use armor_socket::{FaultTable, explain_bind_error, own_connection};
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};

use crate::commands::RobotCommands;
use crate::endpoints::{make_router, make_stop_router};
use crate::stall_guard::StallGuard;
use crate::web_options::WebOptions;
use crate::web_state::WebState;

/// Connections of browsers and programs: fifty pages with three each, and room for scripts.
const MAX_CONNECTIONS: u64 = 256;
/// Connections on the thread for STOP, and those that have sent nothing yet. A newcomer takes the
/// place of the oldest, if possible of one that has sent nothing, so that STOP always gets through.
const MAX_STOP_CONNECTIONS: usize = 128;
/// Connections that the other threads have not taken yet.
const MAX_HANDED_OVER: usize = 64;
/// Time within which a connection sends its first bytes, and each request its headers.
const HEADERS_WITHIN: Duration = Duration::from_secs(10);
/// Time after which a client that reads nothing is disconnected.
const WRITE_STALL: Duration = Duration::from_secs(20);
/// Longest request head, in bytes.
const MAX_HEAD_LEN: usize = 32 << 10;
/// Most headers of a request.
const MAX_HEADERS: usize = 64;
/// Threads for everything but STOP.
const WORKERS: usize = 2;
/// Threads for work that waits for a process or takes long, such as the painting of maps.
const MAX_BLOCKING: usize = 16;
/// Time between two looks at a first line that has arrived in part.
const LOOK_AGAIN: Duration = Duration::from_millis(5);
/// What the path of every request for STOP begins with.
const STOP_PATH: &[u8] = b"/api/stop";

/// Why a server cannot start.
#[derive(Debug, Error)]
pub enum WebStartError {
    /// Its address is open to other hosts.
    #[error(
        "{0} can be reached from other hosts, and this server asks for no key: listen on 127.0.0.1. \
         On another computer run `armor connect HOST --key FILE -- armor web`, which asks the robot \
         with a key, or forward the port with ssh -L"
    )]
    NotLoopback(SocketAddr),
    /// It cannot listen there.
    #[error("cannot listen on {0}: {1}; choose another port with --listen 127.0.0.1:PORT")]
    Listen(SocketAddr, String),
    /// A thread or its event loop cannot be started.
    #[error("the server cannot be started: {0}")]
    Io(#[from] io::Error),
}

/// A running server. Dropping it closes all its connections.
pub struct WebServer {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
    workers: Option<Runtime>,
}

impl WebServer {
    /// Starts a server; `commands` publishes to the robot, if this process can.
    ///
    /// # Errors
    /// If it cannot listen, would listen beyond loopback, or no thread can be started.
    pub fn start(
        options: &WebOptions,
        commands: Option<Arc<dyn RobotCommands>>,
    ) -> Result<Self, WebStartError> {
        if !options.listen.ip().is_loopback() {
            return Err(WebStartError::NotLoopback(options.listen));
        }
        let explain = |error: io::Error| {
            WebStartError::Listen(options.listen, explain_bind_error(options.listen, &error))
        };
        let listener = std::net::TcpListener::bind(options.listen).map_err(explain)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let web = WebState::begin(options, commands)?;
        let workers = Builder::new_multi_thread()
            .worker_threads(WORKERS)
            .max_blocking_threads(MAX_BLOCKING)
            .thread_name("web")
            .enable_all()
            .build()?;
        let (hand_over, handed_over) = mpsc::channel(MAX_HANDED_OVER);
        workers.spawn(serve_handed_over(Arc::clone(&web), handed_over));
        let (stop, stopped) = oneshot::channel::<()>();
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let thread = thread::Builder::new().name("web-stop".into()).spawn(move || {
            runtime.block_on(async {
                tokio::select! {
                    () = accept_connections(web, listener, hand_over) => {}
                    _ = stopped => {}
                }
            });
        })?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread), workers: Some(workers) })
    }

    /// Returns the address on which it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Makes every thread but that of STOP hang until the returned sender is dropped.
    #[cfg(test)]
    pub(crate) fn hang_workers(&self) -> std::sync::mpsc::Sender<()> {
        let (release, released) = std::sync::mpsc::channel::<()>();
        let released = Arc::new(parking_lot::Mutex::new(released));
        let workers = self.workers.as_ref().expect("it runs");
        for _ in 0..WORKERS {
            let released = Arc::clone(&released);
            workers.spawn(async move {
                let _ = released.lock().recv();
            });
        }
        release
    }
}

impl Drop for WebServer {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        if let Some(workers) = self.workers.take() {
            workers.shutdown_background();
        }
    }
}

/// The loop of the thread for STOP.
async fn accept_connections(
    web: Arc<WebState>,
    listener: std::net::TcpListener,
    hand_over: mpsc::Sender<std::net::TcpStream>,
) {
    let listener = match TcpListener::from_std(listener) {
        Ok(listener) => listener,
        Err(error) => return tracing::error!("the server does not listen: {error}"),
    };
    let router = make_stop_router(Arc::clone(&web));
    let faults = FaultTable::default();
    let mut open: VecDeque<OpenStop> = VecDeque::new();
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(error) => {
                if faults.is_new(None, error.to_string()) {
                    tracing::warn!("no connection can be accepted: {error}");
                }
                // Without free file descriptors the next attempt fails immediately.
                sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let stream = match check_stranger(stream) {
            Ok(stream) => stream,
            Err(reason) => {
                web.counters.count_refusal();
                if faults.is_new(None, reason.clone()) {
                    tracing::warn!("a client is refused: {reason}");
                }
                continue;
            }
        };
        open.retain(|connection| !connection.task.is_finished());
        if open.len() >= MAX_STOP_CONNECTIONS {
            // One that has sent nothing goes first: a page keeps its connection for STOP.
            let silent = open.iter().position(|it| !it.is_served.load(Ordering::Relaxed));
            if let Some(given_up) = open.remove(silent.unwrap_or(0)) {
                given_up.task.abort();
            }
        }
        let is_served = Arc::new(AtomicBool::new(false));
        let lane = StopLane { web: Arc::clone(&web), router: router.clone(), is_served };
        let is_served = Arc::clone(&lane.is_served);
        let task = tokio::spawn(lane.sort_connection(stream, hand_over.clone()));
        open.push_back(OpenStop { task, is_served });
    }
}

/// A connection on the thread for STOP.
struct OpenStop {
    task: JoinHandle<()>,
    /// Whether it has asked for STOP.
    is_served: Arc<AtomicBool>,
}

/// What a new connection needs.
struct StopLane {
    web: Arc<WebState>,
    router: Router,
    is_served: Arc<AtomicBool>,
}

/// Refuses the client of another user before a byte of it is read.
fn check_stranger(stream: TcpStream) -> Result<TcpStream, String> {
    let own = stream.into_std().and_then(own_connection);
    own.and_then(TcpStream::from_std).map_err(|error| error.to_string())
}

impl StopLane {
    /// Serves a connection that asks for STOP, and hands over every other.
    async fn sort_connection(
        self,
        stream: TcpStream,
        hand_over: mpsc::Sender<std::net::TcpStream>,
    ) {
        match timeout(HEADERS_WITHIN, asks_for_stop(&stream)).await {
            Ok(Ok(true)) => {
                self.is_served.store(true, Ordering::Relaxed);
                serve_connection(stream, (), self.router).await;
            }
            Ok(Ok(false)) => {
                let handed = stream.into_std().ok().map(|stream| hand_over.try_send(stream));
                if !matches!(handed, Some(Ok(()))) {
                    self.web.counters.count_refusal();
                }
            }
            // It has sent nothing, or is gone.
            Ok(Err(_)) | Err(_) => {}
        }
    }
}

/// Looks at the first bytes of a connection without taking them.
async fn asks_for_stop(stream: &TcpStream) -> io::Result<bool> {
    let mut bytes = [0; 32];
    loop {
        let len = stream.peek(&mut bytes).await?;
        if len == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        if let Some(answer) = is_stop_request(&bytes[..len]) {
            return Ok(answer);
        }
        // Bytes that have been looked at stay ready, so the rest of the line cannot be waited for.
        sleep(LOOK_AGAIN).await;
    }
}

/// Returns whether a request that begins with these bytes asks for STOP; `None` if more are needed.
fn is_stop_request(bytes: &[u8]) -> Option<bool> {
    /// Longest method of HTTP.
    const METHOD_LEN: usize = 7;
    let Some(space) = bytes.iter().position(|byte| *byte == b' ') else {
        return (bytes.len() > METHOD_LEN).then_some(false);
    };
    let path = &bytes[space + 1..];
    let common = path.len().min(STOP_PATH.len());
    if path[..common] != STOP_PATH[..common] {
        return Some(false);
    }
    (path.len() >= STOP_PATH.len()).then_some(true)
}

/// The loop of the other threads.
async fn serve_handed_over(
    web: Arc<WebState>,
    mut handed_over: mpsc::Receiver<std::net::TcpStream>,
) {
    let router = make_router(Arc::clone(&web));
    while let Some(stream) = handed_over.recv().await {
        let Ok(stream) = TcpStream::from_std(stream) else { continue };
        if web.counters.connections.fetch_add(1, Ordering::Relaxed) >= MAX_CONNECTIONS {
            web.counters.connections.fetch_sub(1, Ordering::Relaxed);
            web.counters.count_refusal();
            continue;
        }
        let place = OpenConnection(Arc::clone(&web));
        tokio::spawn(serve_connection(stream, place, router.clone()));
    }
}

/// One place of [`MAX_CONNECTIONS`].
struct OpenConnection(Arc<WebState>);

impl Drop for OpenConnection {
    fn drop(&mut self) {
        self.0.counters.connections.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Serves a connection to its end; `place` is held for as long, also by a WebSocket.
async fn serve_connection(
    stream: TcpStream,
    place: impl Unpin + Send + Sync + 'static,
    router: Router,
) {
    let stream = TokioIo::new(StallGuard::new(stream, WRITE_STALL, place));
    let serving = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADERS_WITHIN)
        .max_buf_size(MAX_HEAD_LEN)
        .max_headers(MAX_HEADERS)
        .serve_connection(stream, TowerToHyperService::new(router))
        .with_upgrades()
        .await;
    if let Err(error) = serving {
        tracing::debug!("a connection has ended: {error}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bytes_decide_which_thread_serves_a_connection() {
        for (bytes, expected) in [
            ("POST /api/stop HTTP/1.1", Some(true)),
            ("GET /api/stop/live HTTP/1.1", Some(true)),
            ("GET /api/system HTTP/1.1", Some(false)),
            ("GET / HTTP/1.1", Some(false)),
            ("GET /api/s", None),
            ("GET", None),
            ("DELETE /api/stop", Some(true)),
            ("BREWINGS", Some(false)),
            ("\u{16}\u{3}\u{1}\u{2}\u{0}\u{1}\u{0}\u{1}", Some(false)),
        ] {
            assert_eq!(is_stop_request(bytes.as_bytes()), expected, "{bytes:?}");
        }
    }

    #[test]
    fn an_address_beyond_loopback_is_refused_with_the_remedy() {
        let options = WebOptions {
            listen: "0.0.0.0:0".parse().unwrap(),
            registry: "127.0.0.1:1".into(),
            author: "ruth".into(),
        };
        let error = WebServer::start(&options, None).err().expect("refused").to_string();
        assert!(error.contains("armor connect") && error.contains("127.0.0.1"), "{error}");
    }
}
