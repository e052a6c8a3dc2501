//! The options of a connected socket.

use std::io;
use std::time::Duration;

use armor_wire::liveness::{MISSED_BEATS, SILENCE, UNACKNOWLEDGED};
use socket2::{SockRef, TcpKeepalive};

use crate::stream::Stream;

/// Send buffer of a link, in bytes. A frame up to about this size goes to the kernel in one call.
const LINK_BUFFER_LEN: usize = 4 << 20;
/// Silence after which the kernel begins to probe the peer's host, and the pause between its
/// probes.
const PROBE_PERIOD: Duration = Duration::from_secs(1);

/// Makes a TCP connection send small frames without delay and end when the peer's host falls
/// silent. A Unix socket needs neither.
///
/// # Errors
/// If the system refuses an option.
pub fn tune(stream: &Stream) -> io::Result<()> {
    match stream {
        Stream::Unix(_) => Ok(()),
        Stream::Tcp(stream) => {
            let socket = SockRef::from(stream);
            socket.set_tcp_nodelay(true)?;
            // Ends a connection whose sent bytes are not acknowledged; the probes do so for one
            // that sends nothing.
            socket.set_tcp_user_timeout(Some(SILENCE))?;
            let probes = TcpKeepalive::new()
                .with_time(PROBE_PERIOD)
                .with_interval(PROBE_PERIOD)
                .with_retries(MISSED_BEATS);
            socket.set_tcp_keepalive(&probes)
        }
    }
}

/// As [`tune`], for a connection to another host, of which the network may cut only one direction.
///
/// # Errors
/// If the system refuses an option.
pub fn tune_between_hosts(stream: &Stream) -> io::Result<()> {
    tune(stream)?;
    match stream {
        Stream::Unix(_) => Ok(()),
        Stream::Tcp(stream) => SockRef::from(stream).set_tcp_user_timeout(Some(UNACKNOWLEDGED)),
    }
}

/// Gives the connection the send buffer of a link. The kernel caps it at its own maximum.
///
/// # Errors
/// If the system refuses the option.
pub fn enlarge_send_buffer(stream: &Stream) -> io::Result<()> {
    SockRef::from(stream).set_send_buffer_size(LINK_BUFFER_LEN)
}
