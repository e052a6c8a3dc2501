//! The socket for the datagrams of all links of this process, opened for the first link that asks for
//! them.

use std::os::fd::AsFd;
use std::sync::Arc;
use std::time::Duration;

use armor_socket::DatagramSocket;
use armor_wire::datagram::{DATAGRAM_LEN, read_token};
use rustix::event::{PollFd, PollFlags};

use crate::participant::Participant;

/// Most datagrams that are taken in a row: others wait, too.
const MOST_AT_ONCE: usize = 256;

/// See the module.
pub(super) struct DatagramService {
    participant: Arc<Participant>,
    /// The TCP port of this process; that of the datagrams has the same number.
    port: Option<u16>,
    socket: Option<Arc<DatagramSocket>>,
    has_failed: bool,
}

impl DatagramService {
    pub fn new(participant: Arc<Participant>, port: Option<u16>) -> Self {
        Self { participant, port, socket: None, has_failed: false }
    }

    /// The socket; `None` if it cannot be had, which is logged once.
    pub fn open_socket(&mut self) -> Option<&Arc<DatagramSocket>> {
        if self.socket.is_none() && !self.has_failed {
            match DatagramSocket::bind(self.port?) {
                Ok(socket) => self.socket = Some(Arc::new(socket)),
                Err(error) => {
                    self.has_failed = true;
                    let port = self.port.unwrap_or_default();
                    tracing::warn!(
                        "links with transport=\"udp\" take TCP: UDP port {port} of 127.0.0.1, which \
                         has the number of this component's TCP port, cannot be opened: {error}"
                    );
                }
            }
        }
        self.socket.as_ref()
    }

    pub fn poll_fd(&self) -> Option<PollFd<'_>> {
        let socket = self.socket.as_ref()?;
        Some(PollFd::from_borrowed_fd(socket.as_fd(), PollFlags::IN))
    }

    /// Takes what has arrived, and sends again what is due. Returns the time until that must be done
    /// again; `None` if nothing waits.
    pub fn serve(&self) -> Option<Duration> {
        let socket = self.socket.as_ref()?;
        let outputs = self.participant.ports.outputs();
        let mut buffer = [0; DATAGRAM_LEN + 1];
        for _ in 0..MOST_AT_ONCE {
            // An error concerns a datagram that was sent before.
            let Ok((len, from)) = socket.try_receive(&mut buffer) else { break };
            let packet = &buffer[..len];
            let Some(token) = read_token(packet) else { continue };
            let _ = outputs.iter().any(|output| output.receive_receipt(token, packet, from));
        }
        outputs.iter().filter_map(|output| output.look_after_datagrams()).min()
    }
}
