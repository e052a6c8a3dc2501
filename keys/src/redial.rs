//! Connecting to a host that may have been cut off a moment ago. The kernel repeats a request to connect
//! after 1 s, then after 3 s; a host that is back in between would be reached late.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::net::{TcpStream, ToSocketAddrs, lookup_host};
use tokio::task::JoinSet;
use tokio::time;

/// From one request to connect to the next. Those before it stay: a slow network answers them.
const REPEAT: Duration = Duration::from_millis(250);
/// Most requests that are open.
const MOST_OPEN: usize = 8;

/// Connects to the first address that accepts, with a request at each interval until one is answered.
///
/// # Errors
/// Why the first address refuses. If nothing answers it does not return: the caller has a time limit.
pub(crate) async fn connect_repeatedly(gate: impl ToSocketAddrs) -> io::Result<TcpStream> {
    let addresses: Vec<SocketAddr> = lookup_host(gate).await?.collect();
    let mut attempts = JoinSet::new();
    loop {
        if attempts.len() < MOST_OPEN {
            let addresses = addresses.clone();
            attempts.spawn(async move { TcpStream::connect(addresses.as_slice()).await });
        }
        if let Ok(Some(Ok(ended))) = time::timeout(REPEAT, attempts.join_next()).await {
            return ended;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;
    use std::pin::pin;

    use tokio::net::TcpSocket;

    use super::*;

    #[tokio::test]
    async fn an_answer_is_passed_on() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("it has one");
        let stream = connect_repeatedly(address).await.expect("it is accepted");
        assert_eq!(stream.peer_addr().expect("it has one"), address);
        drop((stream, listener));
        let refused = connect_repeatedly(address).await.expect_err("nothing listens");
        assert_eq!(refused.kind(), io::ErrorKind::ConnectionRefused);
    }

    #[tokio::test]
    async fn a_host_that_drops_requests_for_a_while_is_reached() {
        // With a full queue the kernel drops requests to connect, as a network that is cut does.
        let socket = TcpSocket::new_v4().expect("a socket");
        socket.bind(([127, 0, 0, 1], 0).into()).expect("a port");
        let listener = socket.listen(0).expect("it listens");
        let address = listener.local_addr().expect("it has one");
        let first = TcpStream::connect(address).await.expect("the queue has room for one");
        let mut connecting = pin!(connect_repeatedly(address));
        let early = time::timeout(3 * REPEAT, &mut connecting).await;
        assert!(early.is_err(), "the requests are dropped");
        drop((listener.accept().await.expect("the first"), first));
        connecting.await.expect("a later request is accepted");
    }
}
