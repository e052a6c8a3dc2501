//! Where a daemon listens, and how its sockets are set.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use armor_wire::liveness::{MISSED_BEATS, SILENCE};
use socket2::{SockRef, TcpKeepalive};
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};

use crate::random::random_id;

/// Ports taken when any will do. They lie below the range from which the kernel gives a connecting
/// socket its own port: above it, a client that connects to a daemon that is gone can happen to get
/// the very port it connects to, and then talks to itself.
pub const PORTS: std::ops::Range<u16> = 10_000..32_000;

/// How many random ports are tried. With half of them taken, all fail once in 10^19 times.
const MAX_TRIES: usize = 64;

/// Why a daemon cannot listen.
#[derive(Debug, Error)]
pub enum ListenError {
    /// The address can be reached from other machines.
    #[error(
        "{0} can be reached from other machines, and without keys every one of them could command \
         the robot; listen on a loopback address such as 127.0.0.1"
    )]
    Wide(SocketAddr),
    /// The system refuses the address.
    #[error("cannot listen on {address}: {source}")]
    Taken {
        /// Which.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
}

/// Listens on a loopback address; port 0 stands for a free one of [`PORTS`].
///
/// # Errors
/// [`ListenError`] if the address is not loopback or not free.
pub async fn listen(address: SocketAddr) -> Result<TcpListener, ListenError> {
    if !address.ip().is_loopback() {
        return Err(ListenError::Wide(address));
    }
    let mut tries = if address.port() == 0 { MAX_TRIES } else { 1 };
    loop {
        tries -= 1;
        let mut candidate = address;
        if address.port() == 0 {
            let width = u64::from(PORTS.end - PORTS.start);
            let offset = u16::try_from(random_id() % width).unwrap_or(0);
            candidate.set_port(PORTS.start + offset);
        }
        match TcpListener::bind(candidate).await {
            Ok(listener) => return Ok(listener),
            Err(error) if tries > 0 && error.kind() == io::ErrorKind::AddrInUse => {}
            Err(source) => return Err(ListenError::Taken { address: candidate, source }),
        }
    }
}

/// Sets a connection up: no delay of small frames, and a peer that is cut off is noticed.
pub(crate) fn tune(stream: &TcpStream) -> io::Result<()> {
    let socket = SockRef::from(stream);
    socket.set_tcp_nodelay(true)?;
    socket.set_tcp_user_timeout(Some(SILENCE))?;
    let second = Duration::from_secs(1);
    let keepalive =
        TcpKeepalive::new().with_time(second).with_interval(second).with_retries(MISSED_BEATS);
    socket.set_tcp_keepalive(&keepalive)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run<T>(test: impl Future<Output = T>) -> T {
        tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(test)
    }

    #[test]
    fn port_0_is_a_free_port_below_the_ephemeral_range() {
        run(async {
            let mut listeners = Vec::new();
            for _ in 0..20 {
                let listener = listen(([127, 0, 0, 1], 0).into()).await.unwrap();
                assert!(PORTS.contains(&listener.local_addr().unwrap().port()));
                listeners.push(listener);
            }
        });
    }

    #[test]
    fn listening_wider_than_loopback_is_refused() {
        run(async {
            let error = listen(([0, 0, 0, 0], 0).into()).await.unwrap_err();
            assert!(error.to_string().contains("without keys"), "{error}");
            assert!(listen("[::]:0".parse().unwrap()).await.is_err());
        });
    }

    #[test]
    fn a_taken_port_is_named() {
        run(async {
            let first = listen(([127, 0, 0, 1], 0).into()).await.unwrap();
            let address = first.local_addr().unwrap();
            let error = listen(address).await.unwrap_err();
            assert!(error.to_string().contains(&address.to_string()), "{error}");
        });
    }
}
