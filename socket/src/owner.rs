//! The user whose process is at the other end of a connection, as the kernel reports it.
//!
//! Without keys a system belongs to one user of one host. A port on loopback and a socket in Linux's
//! abstract namespace are open to every user of the host, who could otherwise read its data and
//! command it. Both ends check each other, so that no stranger listens in the place of a daemon that
//! has died either.
//!
//! A Unix socket has the credentials of its peer (unix(7), `SO_PEERCRED`). For TCP the kernel is
//! asked for the peer's own socket, which is on this host too (sock_diag(7)).

use std::io;
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::os::fd::AsFd;

use netlink_packet_core::{NLM_F_REQUEST, NetlinkHeader, NetlinkMessage, NetlinkPayload};
use netlink_packet_sock_diag::SockDiagMessage;
use netlink_packet_sock_diag::constants::{
    AF_INET, AF_INET6, IPPROTO_TCP, TCP_ESTABLISHED, TCP_LISTEN,
};
use netlink_packet_sock_diag::inet::{
    ExtensionFlags, InetRequest, InetResponseHeader, SocketId, StateFlags,
};
use netlink_sys::Socket;
use netlink_sys::protocols::NETLINK_SOCK_DIAG;
use rustix::net::sockopt::socket_peercred;
use rustix::process::geteuid;
use thiserror::Error;

use crate::stream::Stream;

/// Names the group whose members may take part, besides the user of this process. The launcher sets
/// it from the file; a member sets it to use tools on the system of another.
pub const GROUP_VARIABLE: &str = "ARMOR_GROUP";

/// The user id of the administrator, who can do everything on this host anyway.
const ROOT: u32 = 0;
/// Stands for "any" as the cookie of a socket.
const ANY_COOKIE: [u8; 8] = [0xff; 8];
/// Longer than the kernel's answer about one socket.
const ANSWER_LEN: usize = 4 << 10;

/// Why the process at the other end may not take part.
#[derive(Debug, Error)]
pub enum OwnerError {
    /// It belongs to another user.
    #[error(
        "the other end belongs to user {user}, and this system to user {own}: run it as that user, \
         or as root"
    )]
    OtherUser {
        /// The user id of the other end.
        user: u32,
        /// The user id of this process.
        own: u32,
    },
    /// It has closed its end already.
    #[error("the other end has closed the connection already")]
    Closed,
    /// It is not on this host.
    #[error("the other end, {0}, is not on this host, and without keys its user is not known")]
    OtherHost(IpAddr),
    /// The kernel does not answer.
    #[error("the user of the other end is not known: {0}")]
    Unknown(#[source] io::Error),
}

impl OwnerError {
    /// Returns whether the other end is to blame, and not this host.
    pub fn is_stranger(&self) -> bool {
        matches!(self, Self::OtherUser { .. } | Self::OtherHost(_))
    }
}

/// Checks the user of the process that has connected to a socket of this one.
///
/// # Errors
/// If it is neither this process's user nor root.
pub fn check_client(stream: &Stream) -> Result<(), OwnerError> {
    let tcp = match stream {
        Stream::Unix(stream) => return check_unix(stream),
        Stream::Tcp(tcp) => tcp,
    };
    let client = tcp.peer_addr().map_err(|_| OwnerError::Closed)?;
    let server = tcp.local_addr().map_err(OwnerError::Unknown)?;
    if !client.ip().is_loopback() {
        return Err(OwnerError::OtherHost(client.ip()));
    }
    // A socket that its process has closed belongs to user 0 and has no inode.
    match find_socket(client, server)? {
        Some(socket) if socket.state == TCP_ESTABLISHED && socket.inode != 0 => {
            check_user(socket.uid)
        }
        _ => Err(OwnerError::Closed),
    }
}

/// Accepts a TCP connection of this user only, and tunes it for short messages: another user is refused
/// before a byte is read.
///
/// # Errors
/// [`OwnerError`] in the error, or that of the socket.
pub fn own_connection(stream: TcpStream) -> io::Result<TcpStream> {
    stream.set_nodelay(true)?;
    let stream = Stream::Tcp(stream);
    check_client(&stream).map_err(io::Error::other)?;
    match stream {
        Stream::Tcp(stream) => Ok(stream),
        Stream::Unix(_) => Err(io::ErrorKind::Unsupported.into()),
    }
}

/// Returns whether [`own_connection`] has failed because the other end has closed the connection already:
/// nothing was refused to it.
pub fn is_closed_already(error: &io::Error) -> bool {
    let owner = error.get_ref().and_then(|inner| inner.downcast_ref::<OwnerError>());
    matches!(owner, Some(OwnerError::Closed))
}

/// Checks the user of the process that listens where this one has connected to. Nothing is known of
/// a server on another host: a proxy leads there, and its own end is checked.
///
/// # Errors
/// If it is neither this process's user nor root.
pub(crate) fn check_server(stream: &Stream) -> Result<(), OwnerError> {
    let tcp = match stream {
        Stream::Unix(stream) => return check_unix(stream),
        Stream::Tcp(tcp) => tcp,
    };
    let server = tcp.peer_addr().map_err(|_| OwnerError::Closed)?;
    if !server.ip().is_loopback() {
        return Ok(());
    }
    // The listening socket: the one of this connection belongs to no process before it is accepted.
    let any = SocketAddr::new(server.ip(), 0);
    match find_socket(server, any)? {
        Some(socket) if socket.state == TCP_LISTEN => check_user(socket.uid),
        _ => Err(OwnerError::Closed),
    }
}

/// Checks the user of the process at the other end of a Unix socket.
///
/// # Errors
/// If it is neither this process's user nor root.
pub fn check_unix(stream: impl AsFd) -> Result<(), OwnerError> {
    let credentials = socket_peercred(stream).map_err(|error| OwnerError::Unknown(error.into()))?;
    check_user(credentials.uid.as_raw())
}

/// Returns the user and the inode of the socket that listens on `address`, if there is one.
pub(crate) fn find_listener(address: SocketAddr) -> Option<(u32, u32)> {
    let any = SocketAddr::new(address.ip(), 0);
    let socket = find_socket(address, any).ok()??;
    (socket.state == TCP_LISTEN).then_some((socket.uid, socket.inode))
}

fn check_user(user: u32) -> Result<(), OwnerError> {
    let own = geteuid().as_raw();
    let group = || std::env::var(GROUP_VARIABLE).ok();
    if may_take_part(user, own) || group().is_some_and(|group| is_member(user, &group)) {
        Ok(())
    } else {
        Err(OwnerError::OtherUser { user, own })
    }
}

fn may_take_part(user: u32, own: u32) -> bool {
    user == own || user == ROOT
}

/// Returns whether this host has a group of users of this name.
pub fn has_group(name: &str) -> bool {
    uzers::get_group_by_name(name).is_some()
}

/// Returns whether a user belongs to a group. The host's user database is asked each time, so a
/// change of the group counts from then on.
fn is_member(user: u32, group: &str) -> bool {
    let Some(group) = uzers::get_group_by_name(group) else { return false };
    let groups = uzers::get_user_by_uid(user).and_then(|user| user.groups()).unwrap_or_default();
    groups.iter().any(|of_user| of_user.gid() == group.gid())
}

/// Asks the kernel for the TCP socket on this host whose own address is `local` and whose peer's is
/// `remote`; if there is none, for the one that listens on `local`.
fn find_socket(
    local: SocketAddr,
    remote: SocketAddr,
) -> Result<Option<InetResponseHeader>, OwnerError> {
    let request = InetRequest {
        family: if local.is_ipv4() { AF_INET } else { AF_INET6 },
        protocol: IPPROTO_TCP,
        extensions: ExtensionFlags::empty(),
        states: StateFlags::all(),
        socket_id: SocketId {
            source_port: local.port(),
            destination_port: remote.port(),
            source_address: local.ip(),
            destination_address: remote.ip(),
            interface_id: 0,
            cookie: ANY_COOKIE,
        },
    };
    ask_kernel(request).map_err(OwnerError::Unknown)
}

fn ask_kernel(request: InetRequest) -> io::Result<Option<InetResponseHeader>> {
    let mut header = NetlinkHeader::default();
    header.flags = NLM_F_REQUEST;
    let mut message = NetlinkMessage::new(header, SockDiagMessage::InetRequest(request).into());
    message.finalize();
    let mut bytes = vec![0; message.buffer_len()];
    message.serialize(&mut bytes);
    let socket = Socket::new(NETLINK_SOCK_DIAG)?;
    // The answer is there when the request has been sent; waiting for it could only hang.
    socket.set_non_blocking(true)?;
    socket.send(&bytes, 0)?;
    let mut answer = Vec::with_capacity(ANSWER_LEN);
    socket.recv(&mut answer, 0)?;
    let answer =
        NetlinkMessage::<SockDiagMessage>::deserialize(&answer).map_err(io::Error::other)?;
    match answer.payload {
        NetlinkPayload::InnerMessage(SockDiagMessage::InetResponse(response)) => {
            Ok(Some(response.header))
        }
        NetlinkPayload::Error(error) => {
            let error = error.to_io();
            if error.kind() == io::ErrorKind::NotFound { Ok(None) } else { Err(error) }
        }
        _ => Err(io::ErrorKind::InvalidData.into()),
    }
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, Ipv6Addr, Shutdown, TcpListener, TcpStream};
    use std::os::unix::net::UnixStream;

    use super::*;

    fn connect_on(address: IpAddr) -> (TcpListener, Stream, Stream) {
        let listener = TcpListener::bind((address, 0)).unwrap();
        let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let server = listener.accept().unwrap().0;
        (listener, Stream::Tcp(client), Stream::Tcp(server))
    }

    #[test]
    fn processes_of_one_user_may_connect_over_every_transport() {
        let (near, far) = UnixStream::pair().unwrap();
        check_client(&Stream::Unix(near)).unwrap();
        check_server(&Stream::Unix(far)).unwrap();
        for address in [IpAddr::from(Ipv4Addr::LOCALHOST), Ipv6Addr::LOCALHOST.into()] {
            let (_listener, client, server) = connect_on(address);
            check_client(&server).unwrap();
            check_server(&client).unwrap();
        }
    }

    #[test]
    fn a_server_that_has_not_accepted_yet_is_known_by_its_listener() {
        let listener = TcpListener::bind((Ipv4Addr::UNSPECIFIED, 0)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let client = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
        check_server(&Stream::Tcp(client)).unwrap();
    }

    #[test]
    fn a_closed_end_has_no_user_and_is_refused() {
        let (listener, client, server) = connect_on(Ipv4Addr::LOCALHOST.into());
        drop(client);
        assert!(matches!(check_client(&server), Err(OwnerError::Closed)));
        let (_listener, client, server) = {
            drop(listener);
            connect_on(Ipv4Addr::LOCALHOST.into())
        };
        client.shutdown(Shutdown::Write).unwrap();
        assert!(matches!(check_client(&server), Err(OwnerError::Closed)));
    }

    #[test]
    fn a_client_that_has_left_is_no_client_that_is_refused() {
        let (_listener, client, server) = connect_on(Ipv4Addr::LOCALHOST.into());
        drop(client);
        let Stream::Tcp(server) = server else { panic!("it is TCP") };
        assert!(is_closed_already(&own_connection(server).unwrap_err()));
        let other_user = OwnerError::OtherUser { user: 1, own: 2 };
        assert!(!is_closed_already(&io::Error::other(other_user)));
        assert!(!is_closed_already(&io::ErrorKind::NotConnected.into()));
    }

    #[test]
    fn only_the_own_user_and_root_may_take_part() {
        assert!(may_take_part(1000, 1000) && may_take_part(0, 1000) && may_take_part(0, 0));
        assert!(!may_take_part(1001, 1000) && !may_take_part(65534, 0) && !may_take_part(1000, 0));
    }

    #[test]
    fn the_members_of_a_group_are_known_to_the_host() {
        let root = uzers::get_user_by_uid(ROOT).unwrap().groups().unwrap();
        let own = root[0].name().to_str().unwrap();
        assert!(has_group(own) && is_member(ROOT, own), "{own}");
        let other = uzers::get_user_by_uid(65534).unwrap();
        assert!(!is_member(other.uid(), own), "{} is in {own}", other.name().display());
        assert!(!has_group("armor-no-such-group") && !is_member(ROOT, "armor-no-such-group"));
        assert!(!is_member(u32::MAX - 7, own), "there is no such user");
    }
}
