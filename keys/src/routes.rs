//! The ways from this host to the others of its system, and the router: a SOCKS5 proxy on loopback that
//! carries connections of this host's processes along them.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::{AcceptLog, Stream};
use armor_wire::gate::{GateReply, GateRequest};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::remote_process::HostAddress;
use armor_wire::transport::Endpoint;
use parking_lot::Mutex;
use tokio::net::{TcpListener, TcpStream};
use tokio::time;
use tokio_rustls::client::TlsStream;
use tracing::{error, info};

use crate::connect::{GateClient, GateError, LIMIT};
use crate::copying::copy_both;
use crate::datagrams::RouterPort;
use crate::host_keys::HostKeys;
use crate::seal::{DatagramSeal, SealEnd};
use crate::socks::{self, SocksAnswer};
use crate::streams::own_stream;

/// How long a router may take to answer a greeting.
const ANSWERS_WITHIN: Duration = Duration::from_secs(1);
/// Rest after a connection that could not be accepted, such as for want of descriptors.
const ACCEPT_REST: Duration = Duration::from_millis(200);

/// The gates of the other hosts.
pub struct Routes {
    /// The name of this host.
    host: String,
    keys: Option<HostKeys>,
    gates: Mutex<BTreeMap<String, Arc<GateClient>>>,
}

impl Routes {
    /// Ways to the gates of other hosts, on which this one proves its key.
    pub fn new(keys: HostKeys, gates: impl IntoIterator<Item = HostAddress>) -> Self {
        let host = keys.host_name().to_owned();
        let routes = Self { host, keys: Some(keys), gates: Mutex::default() };
        routes.set_gates(gates);
        routes
    }

    /// Ways that are known by name only.
    #[cfg(test)]
    pub(crate) fn without_keys(host: &str, gates: impl IntoIterator<Item = HostAddress>) -> Self {
        let dead = |gate: HostAddress| (gate.host.clone(), Arc::new(GateClient::dead(&gate)));
        let gates = Mutex::new(gates.into_iter().map(dead).collect());
        Self { host: host.into(), keys: None, gates }
    }

    /// Replaces the gates. Connections that are open stay.
    pub fn set_gates(&self, gates: impl IntoIterator<Item = HostAddress>) {
        let Some(keys) = &self.keys else { return };
        let mut known = self.gates.lock();
        let mut before = std::mem::take(&mut *known);
        for gate in gates {
            let same = before.remove(&gate.host).filter(|it| it.addresses() == gate.addresses);
            let client = same.unwrap_or_else(|| Arc::new(GateClient::of_host(&gate, keys.clone())));
            known.insert(gate.host, client);
        }
    }

    /// Whether `host` is another host of the system.
    pub fn leads_to(&self, host: &str) -> bool {
        self.gates.lock().contains_key(host)
    }

    /// The gate of a host.
    pub fn find_gate(&self, host: &str) -> Option<Arc<GateClient>> {
        self.gates.lock().get(host).cloned()
    }
}

/// Opens the port of a router on loopback; 0 takes a free one.
///
/// # Errors
/// If it is taken.
pub async fn listen_for_processes(port: u16) -> std::io::Result<(TcpListener, SocketAddr)> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await?;
    let address = listener.local_addr()?;
    Ok((listener, address))
}

/// Whether a router answers there, within a second.
pub async fn answers(router: SocketAddr) -> bool {
    let greet = async {
        let mut stream = TcpStream::connect(router).await?;
        socks::greet(&mut stream).await
    };
    matches!(time::timeout(ANSWERS_WITHIN, greet).await, Ok(Ok(())))
}

/// Serves the processes of this user on this host until the future is dropped. `report` gets why one
/// could not be connected.
pub async fn serve_processes(
    routes: Arc<Routes>,
    listener: TcpListener,
    report: impl Fn(&GateError) + Clone + Send + 'static,
) {
    // Where the port is taken, links to other hosts take TCP.
    let datagrams = match listener.local_addr() {
        Ok(address) => RouterPort::open_router(address).await.ok(),
        Err(_) => None,
    };
    let mut log = AcceptLog::default();
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            never = serve_port(datagrams.as_ref()) => never,
        };
        let stream = match accepted {
            Ok((stream, _)) => stream,
            Err(problem) => {
                if log.note_failure(Instant::now()) {
                    error!(%problem, "cannot accept connections to other hosts; trying again");
                }
                time::sleep(ACCEPT_REST).await;
                continue;
            }
        };
        if log.note_success() {
            info!("connections to other hosts are accepted again");
        }
        let (routes, report) = (Arc::clone(&routes), report.clone());
        let datagrams = datagrams.clone();
        tokio::spawn(async move {
            if let Err(error) = serve_process(&routes, stream, datagrams.as_ref()).await {
                report(&error);
            }
        });
    }
}

async fn serve_process(
    routes: &Routes,
    stream: TcpStream,
    datagrams: Option<&Arc<RouterPort>>,
) -> Result<(), GateError> {
    let Ok(mut process) = own_stream(stream) else { return Ok(()) };
    let Ok(Ok(address)) = time::timeout(LIMIT, socks::read_request(&mut process)).await else {
        return Ok(());
    };
    let host = address.rsplit_once(':').map_or("", |(host, _)| host);
    if host == routes.host {
        forward_to_own(process, &address).await;
        return Ok(());
    }
    let Some(gate) = routes.find_gate(host) else {
        let _ = socks::answer(&mut process, SocksAnswer::Unreachable).await;
        let text = format!("no host of the system is called {host}");
        return Err(GateError::Refused(Refusal::new(RefusalCode::UnknownData, text)));
    };
    gate.carry(process, address, datagrams).await
}

/// A tool that does not know on which host it is asks for a process of this one.
async fn forward_to_own(mut tool: TcpStream, address: &str) {
    let port = address.rsplit_once(':').map_or("", |(_, port)| port);
    let endpoint = Endpoint::Tcp(format!("{}:{port}", Ipv4Addr::LOCALHOST));
    let dial = move || armor_socket::connect(&endpoint, LIMIT);
    let dialled = match tokio::task::spawn_blocking(dial).await {
        Ok(Ok(Stream::Tcp(stream))) => from_blocking(stream),
        Ok(Ok(Stream::Unix(_))) | Err(_) => Err(std::io::ErrorKind::Unsupported.into()),
        Ok(Err(error)) => Err(error),
    };
    let Ok(mut process) = dialled else {
        let _ = socks::answer(&mut tool, SocksAnswer::ConnectionRefused).await;
        return;
    };
    if socks::answer(&mut tool, SocksAnswer::Connected).await.is_ok() {
        let _ = copy_both(&mut tool, &mut process).await;
    }
}

fn from_blocking(stream: std::net::TcpStream) -> std::io::Result<TcpStream> {
    stream.set_nonblocking(true)?;
    TcpStream::from_std(stream)
}

impl GateClient {
    /// Carries a connection that asks for `address` through the gate, until it ends.
    pub(crate) async fn carry(
        &self,
        mut process: TcpStream,
        address: String,
        datagrams: Option<&Arc<RouterPort>>,
    ) -> Result<(), GateError> {
        let request = GateRequest::Connect { address, acts_for: None };
        let (mut gate, error) = match self.request(request).await {
            Ok((gate, GateReply::Connected)) => (gate, None),
            Ok((gate, GateReply::Refused { refusal })) => (gate, Some(GateError::Refused(refusal))),
            Ok((_, _)) => return Ok(()),
            Err(error) => {
                let _ = socks::answer(&mut process, SocksAnswer::Unreachable).await;
                return Err(error);
            }
        };
        if let Some(error) = error {
            let answer = match &error {
                // No process listens there: as without a proxy.
                GateError::Refused(refusal) if refusal.code == RefusalCode::UnknownData => {
                    SocksAnswer::ConnectionRefused
                }
                _ => SocksAnswer::Forbidden,
            };
            let _ = socks::answer(&mut process, answer).await;
            return if answer == SocksAnswer::Forbidden { Err(error) } else { Ok(()) };
        }
        if socks::answer(&mut process, SocksAnswer::Connected).await.is_ok() {
            let revoked = self.wait_for_revocation(&gate);
            let carrying = carry_datagrams(&process, &gate, datagrams);
            tokio::select! {
                () = carrying => {}
                _ = copy_both(&mut process, &mut gate) => {}
                _ = revoked => {}
            }
        }
        Ok(())
    }
}

async fn serve_port(datagrams: Option<&Arc<RouterPort>>) -> ! {
    match datagrams {
        Some(port) => port.serve().await,
        None => std::future::pending().await,
    }
}

/// Carries the datagrams of a connection, if it has any; never returns.
fn carry_datagrams(
    process: &TcpStream,
    gate: &TlsStream<TcpStream>,
    datagrams: Option<&Arc<RouterPort>>,
) -> impl Future<Output = ()> + Send + 'static {
    let (stream, session) = gate.get_ref();
    let seal = DatagramSeal::of_session(session, SealEnd::Client);
    let way = datagrams.zip(process.peer_addr().ok()).map(|(port, from)| port.open_way(from));
    let gate = stream.peer_addr();
    async move {
        if let (Some(seal), Some(way), Ok(gate)) = (seal, way, gate) {
            way.carry_to_gate(seal, gate).await;
        }
        std::future::pending::<()>().await;
    }
}
