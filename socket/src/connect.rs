//! Connecting to an endpoint, through the proxy if the process was started with one.

use std::io;
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::os::fd::OwnedFd;
use std::time::Duration;

use armor_wire::registry::ComponentEntry;
use armor_wire::transport::{Endpoint, Transport};
use socket2::{Domain, Socket, Type};

use crate::hosts::{Way, find_way, own_place};
use crate::identity::host_name;
use crate::listener::unix_address;
use crate::owner::{OwnerError, check_server};
use crate::proxy;
use crate::stream::Stream;

/// Connects to `endpoint` within `limit`.
///
/// # Errors
/// If the endpoint or the proxy refuses or does not answer.
pub fn connect(endpoint: &Endpoint, limit: Duration) -> io::Result<Stream> {
    match endpoint {
        Endpoint::Tcp(address) => connect_tcp(address, limit),
        Endpoint::Unix(instance) => {
            let stream = connect_unix(*instance, limit)?;
            reject_stranger(&stream)?;
            Ok(stream)
        }
    }
}

/// Connects to the process start `to` over the best transport that reaches it.
///
/// # Errors
/// The error of the last endpoint, its TCP address.
pub fn connect_component(
    to: &ComponentEntry,
    transport: Transport,
    limit: Duration,
) -> io::Result<Stream> {
    // Behind a proxy every address belongs to the host at its far end.
    let is_same_host = to.host == host_name() && proxy::proxy_address().is_none();
    let mut failure = io::ErrorKind::AddrNotAvailable.into();
    for endpoint in Endpoint::of_component(to, transport, is_same_host) {
        match connect(&endpoint, limit) {
            Ok(stream) => return Ok(stream),
            Err(error) => failure = error,
        }
    }
    Err(failure)
}

fn connect_unix(instance: u64, limit: Duration) -> io::Result<Stream> {
    let socket = Socket::new(Domain::UNIX, Type::STREAM, None)?;
    // Connecting to a stopped process waits once its backlog is full; the write timeout limits
    // that.
    socket.set_write_timeout(Some(limit))?;
    socket.connect(&unix_address(instance)?)?;
    socket.set_write_timeout(None)?;
    Ok(Stream::Unix(OwnedFd::from(socket).into()))
}

fn connect_tcp(address: &str, limit: Duration) -> io::Result<Stream> {
    if let Some(proxy) = proxy::proxy_address() {
        return connect_by_proxy(&proxy, proxy::PROXY, address, limit);
    }
    let address = match find_way(own_place().as_ref(), address) {
        Way::Direct(address) => address,
        Way::Router(router) => {
            return connect_by_proxy(&router.to_string(), proxy::ROUTER, address, limit);
        }
    };
    let stream = TcpStream::connect_timeout(&resolve_address(&address)?, limit)?;
    reject_self_connection(&stream)?;
    let stream = Stream::Tcp(stream);
    reject_stranger(&stream)?;
    Ok(stream)
}

/// Connects through the SOCKS5 proxy `proxy`, which errors call `source`.
fn connect_by_proxy(
    proxy: &str,
    source: &str,
    address: &str,
    limit: Duration,
) -> io::Result<Stream> {
    let reach_proxy = || {
        let stream = Stream::Tcp(TcpStream::connect_timeout(&resolve_address(proxy)?, limit)?);
        reject_stranger(&stream)?;
        Ok(stream)
    };
    let stream = reach_proxy().map_err(|error| proxy::name_source(&error, source))?;
    match proxy::connect_through(&stream, address, limit) {
        Ok(()) => Ok(stream),
        // The far end refuses: as without a proxy.
        Err(error) if error.get_ref().is_none() => Err(error),
        Err(error) => Err(proxy::name_source(&error, source)),
    }
}

/// Refuses a server of another user, who may have taken the port of a process that has died.
fn reject_stranger(stream: &Stream) -> io::Result<()> {
    check_server(stream).map_err(|error| match error {
        OwnerError::Closed => io::ErrorKind::ConnectionRefused.into(),
        error => io::Error::new(io::ErrorKind::PermissionDenied, error),
    })
}

/// Refuses a connection whose two ends are the same socket: connecting to a port of the ephemeral
/// range on which no process listens can, within one host, succeed to itself.
pub(crate) fn reject_self_connection(stream: &TcpStream) -> io::Result<()> {
    if stream.local_addr().ok() == stream.peer_addr().ok() {
        return Err(io::ErrorKind::ConnectionRefused.into());
    }
    Ok(())
}

fn resolve_address(address: &str) -> io::Result<SocketAddr> {
    address.to_socket_addrs()?.next().ok_or_else(|| io::ErrorKind::AddrNotAvailable.into())
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::Ipv4Addr;

    use super::*;
    use crate::identity::random_id;
    use crate::listener::ComponentListeners;

    const LIMIT: Duration = Duration::from_secs(20);

    fn entry(instance: u64, listeners: &ComponentListeners) -> ComponentEntry {
        ComponentEntry {
            name: "laser".into(),
            kind: "laser".into(),
            instance,
            pid: 1,
            host: host_name(),
            endpoint: listeners.endpoint().unwrap(),
        }
    }

    #[test]
    fn a_component_is_reached_over_the_transport_that_was_asked_for() {
        let instance = random_id();
        let listeners = ComponentListeners::open(instance).unwrap();
        let entry = entry(instance, &listeners);
        for (transport, is_unix) in [(Transport::Auto, true), (Transport::Tcp, false)] {
            let client = connect_component(&entry, transport, LIMIT).unwrap();
            let server = listeners.accept().unwrap().unwrap();
            assert_eq!(matches!(client, Stream::Unix(_)), is_unix, "{transport:?}");
            assert_eq!(matches!(server, Stream::Unix(_)), is_unix, "{transport:?}");
            (&server).write_all(b"hello").unwrap();
            let mut heard = [0; 5];
            (&client).read_exact(&mut heard).unwrap();
            assert_eq!(&heard, b"hello");
            assert!(listeners.accept().unwrap().is_none());
        }
    }

    #[test]
    fn without_the_unix_socket_the_tcp_address_is_used() {
        let listeners = ComponentListeners::open(random_id()).unwrap();
        let entry = entry(random_id(), &listeners);
        let client = connect_component(&entry, Transport::Auto, LIMIT).unwrap();
        assert!(matches!(client, Stream::Tcp(_)));
    }

    #[test]
    fn a_socket_that_connects_to_itself_is_refused() {
        let socket = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
        socket.bind(&SocketAddr::from((Ipv4Addr::LOCALHOST, 0)).into()).unwrap();
        let own = socket.local_addr().unwrap();
        socket.connect(&own).unwrap();
        let error = reject_self_connection(&socket.into()).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::ConnectionRefused);
    }
}
