//! Accepts connections and serves them: STOP on a thread of its own, which also accepts, and everything
//! else on other threads. On loopback it speaks HTTP, to the user of the system; beyond, HTTPS.
//!
//! The first bytes of a connection decide, after the handshake if there is one: one that begins with a request for `/api/stop` stays on
//! the thread for STOP, which waits for nothing else. So STOP works when all other threads hang.

use std::collections::VecDeque;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use armor_socket::{
    AcceptLog, FaultTable, explain_bind_error, has_proxy, is_closed_already, own_connection,
};
use axum::Router;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use thiserror::Error;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};

use crate::commands::RobotCommands;
use crate::endpoints::{make_router, make_stop_router};
use crate::first_bytes::{asks_for_stop, is_stop_request};
use crate::remote::acceptance::begin_connection;
use crate::remote::connection::RemoteConnection;
use crate::remote::stream::RemoteStream;
use crate::remote::{RemoteAccess, RemoteError};
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

/// Why a server cannot start.
#[derive(Debug, Error)]
pub enum WebStartError {
    /// Its address is open to other hosts, and there is no key for that.
    #[error(
        "{address} can be reached from other hosts, and pages are served to them with keys only: \
         {reason}. Without keys listen on 127.0.0.1; from another computer that has a key: `armor \
         connect HOST --key FILE -- armor web`, or forward the port with ssh -L"
    )]
    NoKeys {
        /// Where it should listen.
        address: SocketAddr,
        /// Why it cannot, and what to do.
        reason: String,
    },
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
    remote: Option<Arc<RemoteAccess>>,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
    workers: Option<Runtime>,
    /// Ends the thread that keeps `remote` current.
    _current: Option<std::sync::mpsc::Sender<()>>,
    #[cfg(test)]
    asking: Arc<tokio::sync::Semaphore>,
}

/// What a person needs to know about a server for other hosts.
#[derive(Clone, Debug)]
pub struct RemoteFacts {
    /// The addresses of its page; at least one.
    pub urls: Vec<String>,
    /// The fingerprint of its certificate, as browsers show it.
    pub fingerprint: String,
    /// The fingerprint of the certificate of the authority.
    pub authority_fingerprint: String,
}

impl WebServer {
    /// Starts a server; `commands` publishes to the robot, if this process can.
    ///
    /// # Errors
    /// If it cannot listen, would listen beyond loopback without keys, or no thread can be started.
    pub fn start(
        options: &WebOptions,
        commands: Option<Arc<dyn RobotCommands>>,
    ) -> Result<Self, WebStartError> {
        let explain = |error: io::Error| {
            WebStartError::Listen(options.listen, explain_bind_error(options.listen, &error))
        };
        let remote_error = |error| match error {
            RemoteError::Keys(reason) => WebStartError::NoKeys { address: options.listen, reason },
            RemoteError::Io(error) => error.into(),
        };
        let is_remote = !options.listen.ip().is_loopback();
        if is_remote {
            check_remote(options).map_err(remote_error)?;
        }
        let listener = std::net::TcpListener::bind(options.listen).map_err(explain)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let remote = match options.keys.as_deref().filter(|_| is_remote) {
            Some(folder) => {
                let remote = RemoteAccess::open(folder, address).map_err(remote_error)?;
                remote.note_port(folder, address.port());
                Some(Arc::new(remote))
            }
            None => None,
        };
        let current = remote.as_ref().map(RemoteAccess::keep_current).transpose()?;
        let web = WebState::begin(options, commands, remote.clone())?;
        #[cfg(test)]
        let asking = Arc::clone(&web.asking);
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
            // A question to a launcher that hangs does not delay the end.
            runtime.shutdown_background();
        })?;
        Ok(Self {
            address,
            remote,
            stop: Some(stop),
            thread: Some(thread),
            workers: Some(workers),
            _current: current,
            #[cfg(test)]
            asking,
        })
    }

    /// Returns what a person needs to know about it; `None` on loopback.
    pub fn remote(&self) -> Option<RemoteFacts> {
        let remote = self.remote.as_ref()?;
        Some(RemoteFacts {
            urls: remote.urls(self.address.port()),
            fingerprint: remote.fingerprint(),
            authority_fingerprint: remote.authority_fingerprint(),
        })
    }

    /// Returns the address on which it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Takes all places of requests that wait for a process.
    #[cfg(test)]
    pub(crate) fn take_asking(&self) -> tokio::sync::OwnedSemaphorePermit {
        let asking = Arc::clone(&self.asking);
        let count = u32::try_from(asking.available_permits()).expect("a few");
        asking.try_acquire_many_owned(count).expect("no request waits")
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

/// Checks what is needed to serve other hosts, before the port is taken.
fn check_remote(options: &WebOptions) -> Result<(), RemoteError> {
    if has_proxy() {
        return Err(RemoteError::Keys(
            "ARMOR_VIA is set, for a system on another host, which would take all orders for those \
             of one key; run the server on the robot's host"
                .into(),
        ));
    }
    let Some(folder) = &options.keys else {
        return Err(RemoteError::Keys("HOME is not set, so no folder of keys is found".into()));
    };
    RemoteAccess::open(folder, options.listen).map(drop)
}

/// A connection that other threads are to serve.
enum HandedOver {
    Local(std::net::TcpStream),
    Remote(Box<RemoteStream>),
}

/// The loop of the thread for STOP.
async fn accept_connections(
    web: Arc<WebState>,
    listener: std::net::TcpListener,
    hand_over: mpsc::Sender<HandedOver>,
) {
    let listener = match TcpListener::from_std(listener) {
        Ok(listener) => listener,
        Err(error) => return tracing::error!("the server does not listen: {error}"),
    };
    let router = make_stop_router(Arc::clone(&web));
    let faults = FaultTable::default();
    let mut accepting = AcceptLog::default();
    let mut open: VecDeque<OpenStop> = VecDeque::new();
    loop {
        let (stream, address) = match listener.accept().await {
            Ok(accepted) => {
                if accepting.note_success() {
                    tracing::info!("connections are accepted again");
                }
                accepted
            }
            Err(error) => {
                if accepting.note_failure(Instant::now()) {
                    tracing::warn!("no connection can be accepted: {error}");
                }
                // Without free file descriptors the next attempt fails immediately.
                sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        if let Some(remote) = &web.remote {
            let lane = RemoteLane {
                web: Arc::clone(&web),
                remote: Arc::clone(remote),
                router: router.clone(),
                hand_over: hand_over.clone(),
            };
            tokio::spawn(lane.serve(stream, address.ip().to_canonical()));
            continue;
        }
        let stream = match check_stranger(stream) {
            Ok(stream) => stream,
            Err(error) if is_closed_already(&error) => {
                tracing::debug!("a client has left before it was served");
                continue;
            }
            Err(error) => {
                web.counters.count_refusal();
                let reason = error.to_string();
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
fn check_stranger(stream: TcpStream) -> io::Result<TcpStream> {
    stream.into_std().and_then(own_connection).and_then(TcpStream::from_std)
}

impl StopLane {
    /// Serves a connection that asks for STOP, and hands over every other.
    async fn sort_connection(self, stream: TcpStream, hand_over: mpsc::Sender<HandedOver>) {
        match timeout(HEADERS_WITHIN, asks_for_stop(&stream)).await {
            Ok(Ok(true)) => {
                self.is_served.store(true, Ordering::Relaxed);
                serve_connection(stream, (), None, self.router).await;
            }
            Ok(Ok(false)) => {
                let local = stream.into_std().ok().map(HandedOver::Local);
                let handed = local.map(|local| hand_over.try_send(local));
                if !matches!(handed, Some(Ok(()))) {
                    self.web.counters.count_refusal();
                }
            }
            // It has sent nothing, or is gone.
            Ok(Err(_)) | Err(_) => {}
        }
    }
}

/// What a new connection from another host needs.
struct RemoteLane {
    web: Arc<WebState>,
    remote: Arc<RemoteAccess>,
    router: Router,
    hand_over: mpsc::Sender<HandedOver>,
}

impl RemoteLane {
    /// Serves a connection that asks for STOP, and hands over every other.
    async fn serve(self, stream: TcpStream, address: IpAddr) {
        let mut place = self.remote.handshakes.enter(address);
        let stream = tokio::select! {
            () = place.ended() => None,
            stream = begin_connection(&self.remote, stream, address, is_stop_request) => stream,
        };
        drop(place);
        match stream {
            None => self.web.counters.count_refusal(),
            Some(stream) if stream.connection().is_stop() => {
                let connection = Arc::clone(stream.connection());
                connection.hold_place(self.remote.guests.enter(address));
                serve_connection(stream, (), Some(connection), self.router).await;
            }
            Some(stream) => {
                if self.hand_over.try_send(HandedOver::Remote(Box::new(stream))).is_err() {
                    self.web.counters.count_refusal();
                }
            }
        }
    }
}

/// The loop of the other threads.
async fn serve_handed_over(web: Arc<WebState>, mut handed_over: mpsc::Receiver<HandedOver>) {
    let router = make_router(Arc::clone(&web));
    while let Some(handed) = handed_over.recv().await {
        if web.counters.connections.fetch_add(1, Ordering::Relaxed) >= MAX_CONNECTIONS {
            web.counters.connections.fetch_sub(1, Ordering::Relaxed);
            web.counters.count_refusal();
            continue;
        }
        let place = OpenConnection(Arc::clone(&web));
        match handed {
            HandedOver::Local(stream) => {
                let Ok(stream) = TcpStream::from_std(stream) else { continue };
                tokio::spawn(serve_connection(stream, place, None, router.clone()));
            }
            HandedOver::Remote(stream) => {
                tokio::spawn(serve_remote(*stream, place, Arc::clone(&web), router.clone()));
            }
        }
    }
}

/// Serves a browser on another host, which loses its place to a newcomer as long as it is not logged
/// in.
async fn serve_remote(
    stream: RemoteStream,
    place: OpenConnection,
    web: Arc<WebState>,
    router: Router,
) {
    let Some(remote) = &web.remote else { return };
    let connection = Arc::clone(stream.connection());
    connection.hold_place(remote.guests.enter(connection.address));
    serve_connection(stream, place, Some(connection), router).await;
}

/// One place of [`MAX_CONNECTIONS`].
struct OpenConnection(Arc<WebState>);

impl Drop for OpenConnection {
    fn drop(&mut self) {
        self.0.counters.connections.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Serves a connection to its end; `place` is held for as long, also by a WebSocket. `connection` is
/// that of a browser on another host.
async fn serve_connection(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    place: impl Unpin + Send + Sync + 'static,
    connection: Option<Arc<RemoteConnection>>,
    router: Router,
) {
    let stream = TokioIo::new(StallGuard::new(stream, WRITE_STALL, place));
    let routes = TowerToHyperService::new(router);
    let service = service_fn(move |mut request: Request<Incoming>| {
        if let Some(connection) = &connection {
            request.extensions_mut().insert(Arc::clone(connection));
        }
        routes.call(request)
    });
    let serving = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADERS_WITHIN)
        .max_buf_size(MAX_HEAD_LEN)
        .max_headers(MAX_HEADERS)
        .serve_connection(stream, service)
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
    fn an_address_beyond_loopback_is_refused_without_keys() {
        let folder = std::env::temp_dir().join("armor-web-no-keys");
        for (keys, remedy) in [(Some(folder), "armor keys add"), (None, "HOME is not set")] {
            let options = WebOptions {
                listen: "0.0.0.0:0".parse().unwrap(),
                keys,
                registry: "127.0.0.1:1".into(),
                author: "ruth".into(),
            };
            let error = WebServer::start(&options, None).err().expect("refused").to_string();
            for words in [remedy, "armor connect", "127.0.0.1"] {
                assert!(error.contains(words), "{error}");
            }
        }
    }
}
