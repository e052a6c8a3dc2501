//! Datagrams of connections between hosts: those of the local processes come and go on loopback, those
//! between the hosts are sealed. The router and the gate do the same, in opposite directions.

use std::collections::HashMap;
use std::hash::Hash;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::Arc;

use armor_socket::enlarge_datagram_buffers;
use parking_lot::Mutex;
use tokio::net::UdpSocket;
use tokio::sync::mpsc;

use crate::seal::{DatagramSeal, SEALED_LEN, read_id};

/// Datagrams that wait for one connection; more are lost.
const MOST_WAITING: usize = 512;

/// A datagram, and where it comes from.
type Arrived = (Vec<u8>, SocketAddr);

/// A socket for the datagrams of many connections, and what distinguishes them.
pub(crate) struct DatagramPort<K> {
    socket: Arc<UdpSocket>,
    ways: Mutex<HashMap<K, mpsc::Sender<Arrived>>>,
    key: fn(&[u8], SocketAddr) -> Option<K>,
}

/// That of a gate: a sealed datagram names its connection.
pub(crate) type GatePort = DatagramPort<u64>;
/// That of a router: a process sends from the port of the number that its connection has.
pub(crate) type RouterPort = DatagramPort<SocketAddr>;

/// One connection's place, which is returned when this is dropped.
pub(crate) struct DatagramWay<K: Copy + Eq + Hash> {
    port: Arc<DatagramPort<K>>,
    key: K,
    arrived: mpsc::Receiver<Arrived>,
}

impl GatePort {
    /// Opens the port of a gate that listens at `address`.
    pub async fn open(address: SocketAddr) -> io::Result<Arc<Self>> {
        Self::bind(address, |sealed, _| read_id(sealed)).await
    }
}

impl RouterPort {
    /// Opens the port of a router that listens at `address`.
    pub async fn open_router(address: SocketAddr) -> io::Result<Arc<Self>> {
        Self::bind(address, |_, from| Some(from)).await
    }
}

impl<K: Copy + Eq + Hash> DatagramPort<K> {
    async fn bind(
        address: SocketAddr,
        key: fn(&[u8], SocketAddr) -> Option<K>,
    ) -> io::Result<Arc<Self>> {
        let socket = Arc::new(UdpSocket::bind(address).await?);
        enlarge_datagram_buffers(&*socket);
        Ok(Arc::new(Self { socket, ways: Mutex::default(), key }))
    }

    /// A place for the datagrams of one connection.
    pub fn open_way(self: &Arc<Self>, key: K) -> DatagramWay<K> {
        let (sender, arrived) = mpsc::channel(MOST_WAITING);
        self.ways.lock().insert(key, sender);
        DatagramWay { port: Arc::clone(self), key, arrived }
    }

    /// Hands each datagram that arrives to its connection, until the future is dropped.
    pub async fn serve(&self) -> ! {
        let mut buffer = [0; SEALED_LEN + 1];
        loop {
            // An error concerns a datagram that was sent before.
            let Ok((len, from)) = self.socket.recv_from(&mut buffer).await else { continue };
            let datagram = &buffer[..len];
            let way =
                (self.key)(datagram, from).and_then(|key| self.ways.lock().get(&key).cloned());
            if let Some(way) = way {
                // A connection that does not keep up loses what comes, as a network does.
                let _ = way.try_send((datagram.to_vec(), from));
            }
        }
    }
}

impl<K: Copy + Eq + Hash> Drop for DatagramWay<K> {
    fn drop(&mut self) {
        self.arrived.close();
        // A later connection may have the place by now.
        let mut ways = self.port.ways.lock();
        if ways.get(&self.key).is_some_and(mpsc::Sender::is_closed) {
            ways.remove(&self.key);
        }
    }
}

impl DatagramWay<u64> {
    /// Carries the datagrams of a connection between its client and the process at `process`, until the
    /// future is dropped.
    pub async fn carry_to_process(self, seal: DatagramSeal, process: SocketAddr) {
        self.carry(process, seal, DatagramSeal::open, DatagramSeal::seal).await;
    }
}

impl DatagramWay<SocketAddr> {
    /// Carries the datagrams of a connection between its process and the gate at `gate`, until the
    /// future is dropped.
    pub async fn carry_to_gate(self, seal: DatagramSeal, gate: SocketAddr) {
        self.carry(gate, seal, DatagramSeal::seal, DatagramSeal::open).await;
    }
}

/// Seals or opens a datagram.
type Turn = fn(&mut DatagramSeal, &[u8]) -> Option<Vec<u8>>;

impl<K: Copy + Eq + Hash> DatagramWay<K> {
    async fn carry(mut self, far: SocketAddr, mut seal: DatagramSeal, there: Turn, back: Turn) {
        // Most connections have no datagrams: socket and buffer are made for the first.
        let mut buffer = Vec::new();
        let mut socket: Option<UdpSocket> = None;
        let mut near = None;
        loop {
            tokio::select! {
                Some((datagram, from)) = self.arrived.recv() => {
                    let Some(turned) = there(&mut seal, &datagram) else { continue };
                    // The way of the other host may have changed; only it can have sealed this.
                    near = Some(from);
                    if socket.is_none() {
                        socket = connect(far).await.ok();
                        buffer.resize(SEALED_LEN + 1, 0);
                    }
                    if let Some(socket) = &socket {
                        let _ = socket.send(&turned).await;
                    }
                }
                received = receive(socket.as_ref(), &mut buffer) => {
                    if let (Ok(len), Some(near)) = (received, near)
                        && let Some(turned) = back(&mut seal, &buffer[..len])
                    {
                        let _ = self.port.socket.send_to(&turned, near).await;
                    }
                }
            }
        }
    }
}

async fn connect(far: SocketAddr) -> io::Result<UdpSocket> {
    let any = match far.ip() {
        ip if ip.is_loopback() => ip,
        IpAddr::V4(_) => Ipv4Addr::UNSPECIFIED.into(),
        IpAddr::V6(_) => Ipv6Addr::UNSPECIFIED.into(),
    };
    let socket = UdpSocket::bind((any, 0)).await?;
    enlarge_datagram_buffers(&socket);
    socket.connect(far).await?;
    Ok(socket)
}

async fn receive(socket: Option<&UdpSocket>, buffer: &mut [u8]) -> io::Result<usize> {
    match socket {
        Some(socket) => socket.recv(buffer).await,
        None => std::future::pending().await,
    }
}
