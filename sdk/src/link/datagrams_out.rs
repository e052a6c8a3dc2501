//! The datagrams of one link at its publisher: what is sent to where, over the socket that all links of
//! the process share.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::{DatagramSocket, random_id};
use armor_wire::datagram::{DatagramOfferBody, DatagramSender, MAX_RESENT, ReceiptEffect};
use armor_wire::frame::DataHeader;
use armor_wire::keep::Keep;

/// A message that may not have arrived.
pub(super) type Unreceived = (DataHeader, Arc<[u8]>);

/// See the module.
pub(crate) struct LinkDatagrams {
    sender: DatagramSender,
    socket: Arc<DatagramSocket>,
    /// Where the last receipt came from.
    to: Option<SocketAddr>,
    start: Instant,
    /// They did not arrive for a while, so that the stream has taken over.
    has_fallen: bool,
}

impl LinkDatagrams {
    /// Those of a link with this policy; `None` if datagrams cannot keep it.
    pub fn open(keep: Keep, latched: bool, socket: &Arc<DatagramSocket>) -> Option<Self> {
        let resent = match keep {
            // Nothing newer may come for a long time.
            Keep::Latest => u32::from(latched),
            Keep::Last { count } => count.min(MAX_RESENT),
            Keep::All { .. } | Keep::Pull => return None,
        };
        Some(Self {
            sender: DatagramSender::new(random_id(), resent, Duration::ZERO),
            socket: Arc::clone(socket),
            to: None,
            start: Instant::now(),
            has_fallen: false,
        })
    }

    pub fn offer(&self) -> DatagramOfferBody {
        DatagramOfferBody { token: self.token(), resent: self.sender.resent() }
    }

    pub fn token(&self) -> u64 {
        self.sender.token()
    }

    /// Whether data go in datagrams now.
    pub fn is_on(&self) -> bool {
        self.sender.is_on()
    }

    /// Whether messages are sent again.
    pub fn resends(&self) -> bool {
        self.sender.resent() > 0
    }

    /// No message before this sequence is sent, or sent again.
    pub fn floor(&self) -> u64 {
        self.sender.floor()
    }

    /// What carries the data, as `armor graph` shows it.
    pub fn transport(&self) -> &'static str {
        match (self.is_on(), self.has_fallen) {
            (true, _) => "udp",
            (false, true) => "udp→tcp",
            (false, false) => "tcp",
        }
    }

    /// Sends a message. Returns whether the system took all of it.
    pub fn publish(&mut self, header: &DataHeader, payload: &Arc<[u8]>) -> bool {
        let Some(to) = self.to else { return false };
        let mut is_taken = true;
        let send = |bytes: &[u8]| is_taken &= self.socket.try_send_to(bytes, to).is_ok();
        self.sender.publish(header, payload, self.start.elapsed(), send);
        is_taken
    }

    /// Takes a datagram of the subscriber. Returns whether data can go in datagrams from here on.
    pub fn receive(&mut self, packet: &[u8], from: SocketAddr) -> bool {
        let send = |bytes: &[u8]| drop(self.socket.try_send_to(bytes, from));
        let effect = self.sender.receive(packet, self.start.elapsed(), send);
        if effect != ReceiptEffect::Ignored {
            // The way may have changed.
            self.to = Some(from);
        }
        effect == ReceiptEffect::SwitchOn
    }

    /// Sends again what is due. Returns the time until it must be called again.
    pub fn resend(&mut self) -> Option<Duration> {
        let (now, to) = (self.start.elapsed(), self.to?);
        let send = |bytes: &[u8]| drop(self.socket.try_send_to(bytes, to));
        self.sender.resend(now, send).map(|due| due.saturating_sub(now))
    }

    /// Whether the stream must take over, because datagrams do not arrive.
    pub fn note_silence(&mut self) -> bool {
        let has_fallen = self.sender.note_silence(self.start.elapsed());
        self.has_fallen |= has_fallen;
        has_fallen
    }

    /// How many times datagrams have stopped arriving since they last arrived for a whole minute.
    pub fn falls(&self) -> u32 {
        self.sender.falls()
    }

    /// Notes whether the messages fit into datagrams.
    pub fn set_wanted(&mut self, is_wanted: bool) {
        self.sender.set_wanted(is_wanted);
    }

    /// Takes back the switch to datagrams, of which the subscriber has not been informed.
    pub fn undo_switch_on(&mut self) {
        self.sender.undo_switch_on();
    }

    /// Notes that data go in datagrams. Returns whether the stream had taken over.
    pub fn note_return(&mut self) -> bool {
        std::mem::take(&mut self.has_fallen)
    }

    /// Data take the stream from here on: returns those that may not have arrived, oldest first.
    pub fn switch_off(&mut self) -> Vec<Unreceived> {
        self.sender.switch_off()
    }
}
