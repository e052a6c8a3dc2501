//! The publisher's end of a link in datagrams: the socket that all links of the process share, and what
//! goes where its datagrams do not arrive.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::{DatagramSocket, random_id};
use armor_wire::codec::{self, EncodeError};
use armor_wire::datagram::{
    DatagramOfferBody, DatagramSender, DatagramSwitchBody, MAX_RESENT, ReceiptEffect,
};
use armor_wire::frame::{self, DataHeader, Frame, FrameKind, PREFIX_LEN};
use armor_wire::keep::Keep;
use armor_wire::message::{Message, WireType};

use super::publishing::OutputState;
use super::wire_out::OutgoingLink;

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

    fn offer(&self) -> DatagramOfferBody {
        DatagramOfferBody { token: self.sender.token(), resent: self.sender.resent() }
    }

    /// Whether data go in datagrams now.
    pub fn is_on(&self) -> bool {
        self.sender.is_on()
    }

    /// What carries the data, as `armor graph` shows it.
    pub fn transport(&self) -> &'static str {
        match (self.is_on(), self.has_fallen) {
            (true, _) => "udp",
            (false, true) => "udp→tcp",
            (false, false) => "tcp",
        }
    }
}

impl OutgoingLink {
    /// Whether data go in datagrams now.
    pub(super) fn is_in_datagrams(&self) -> bool {
        self.datagrams.as_ref().is_some_and(|datagrams| datagrams.is_on())
    }

    /// Offers datagrams to the subscriber, directly behind the welcome.
    pub(super) fn offer_datagrams(&mut self) {
        let Some(datagrams) = &self.datagrams else { return };
        let offer = datagrams.offer();
        self.send_body(FrameKind::DatagramOffer, &offer);
    }

    fn send_body<T: WireType>(&mut self, kind: FrameKind, body: &T) {
        if let Ok(bytes) = frame::to_bytes(kind, body) {
            self.send_unqueued(&bytes);
        }
    }

    /// Sends a message in datagrams. Returns whether the service thread must look after them.
    pub(super) fn send_in_datagrams(&mut self, header: DataHeader, payload: &Arc<[u8]>) -> bool {
        let Some(datagrams) = self.datagrams.as_mut().filter(|it| it.is_on()) else { return false };
        if self.paused || self.broken || self.last_sequence >= Some(header.sequence) {
            return false;
        }
        let fresh = std::mem::take(&mut self.fresh);
        let header = DataHeader { fresh, ..header };
        let LinkDatagrams { sender, socket, to, start, .. } = &mut **datagrams;
        let Some(to) = *to else { return false };
        let mut is_refused = false;
        let send = |bytes: &[u8]| is_refused |= socket.try_send_to(bytes, to).is_err();
        sender.publish(&header, payload, start.elapsed(), send);
        self.sent += 1;
        self.last_sequence = Some(header.sequence);
        // What the system refuses is lost, unless it is sent again.
        self.dropped += u64::from(is_refused && sender.resent() == 0);
        sender.resent() > 0
    }

    /// Data take the stream from here on, those first that may not have arrived.
    pub(super) fn leave_datagrams(&mut self) {
        let Some(datagrams) = self.datagrams.as_mut().filter(|it| it.is_on()) else { return };
        let switch = DatagramSwitchBody { in_datagrams: false, next: datagrams.sender.floor() };
        let unreceived = datagrams.sender.switch_off();
        self.send_body(FrameKind::DatagramSwitch, &switch);
        for (header, payload) in unreceived {
            let mut frame = header.to_bytes(payload.len()).to_vec();
            frame.extend_from_slice(&payload);
            let written = if self.queue.is_empty() { self.write(&frame) } else { 0 };
            if written < frame.len() && !self.broken {
                self.queue.set_congested();
                self.dropped += self.queue.push_shared(Arc::new(frame), written);
            }
        }
    }

    /// Takes a datagram of the subscriber; `published`: how much the output has published.
    fn receive_receipt(&mut self, packet: &[u8], from: SocketAddr, published: u64) {
        let Some(datagrams) = &mut self.datagrams else { return };
        let LinkDatagrams { sender, socket, to, start, .. } = &mut **datagrams;
        let send = |bytes: &[u8]| drop(socket.try_send_to(bytes, from));
        let effect = sender.receive(packet, start.elapsed(), send);
        if effect == ReceiptEffect::Ignored {
            return;
        }
        // The way may have changed.
        *to = Some(from);
        if effect == ReceiptEffect::SwitchOn {
            // What waits for the stream would be overtaken; there will be another receipt.
            if !self.queue.is_empty() && !self.drain_queue() {
                self.datagrams.as_mut().map(|datagrams| datagrams.sender.switch_off());
                return;
            }
            let switch = DatagramSwitchBody { in_datagrams: true, next: published };
            self.send_body(FrameKind::DatagramSwitch, &switch);
        }
    }

    /// Sends again what is due, and leaves datagrams that do not arrive. Returns when it wants to be
    /// called again.
    fn look_after_datagrams(&mut self) -> Option<Duration> {
        let LinkDatagrams { sender, socket, to, start, has_fallen } =
            &mut **self.datagrams.as_mut()?;
        let (now, to) = (start.elapsed(), (*to)?);
        if sender.is_silent(now) {
            *has_fallen = true;
            let name = self.to.clone();
            self.leave_datagrams();
            tracing::warn!("datagrams to `{name}` have not arrived for 2 s; TCP carries the data");
            return None;
        }
        let send = |bytes: &[u8]| drop(socket.try_send_to(bytes, to));
        sender.resend(now, send).map(|due| due.saturating_sub(now))
    }
}

impl OutputState {
    /// Gives the message to the links whose data go in datagrams; those that cannot carry it take the
    /// stream. Returns whether the service thread must look after them.
    pub(super) fn publish_in_datagrams<T: Message>(
        &mut self,
        message: &T,
        header: DataHeader,
    ) -> Result<bool, EncodeError> {
        let len = codec::encoded_len(message)?;
        if !DatagramSender::can_carry(len) {
            self.links.iter_mut().for_each(OutgoingLink::leave_datagrams);
            return Ok(false);
        }
        let payload: Arc<[u8]> = codec::encode(message)?.into();
        Ok(self.give_datagrams(header, &payload))
    }

    fn give_datagrams(&mut self, header: DataHeader, payload: &Arc<[u8]>) -> bool {
        self.links.iter_mut().fold(false, |any, link| link.send_in_datagrams(header, payload) | any)
    }

    /// The same for an encoded frame.
    pub(super) fn send_frame_in_datagrams(&mut self, frame: &[u8]) -> bool {
        let Some((prefix, body)) = frame.split_at_checked(PREFIX_LEN) else { return false };
        let frame = Frame { kind: FrameKind::Data, flags: prefix[5], body };
        let Ok((header, payload)) = frame.data() else { return false };
        if !DatagramSender::can_carry(payload.len()) {
            self.links.iter_mut().for_each(OutgoingLink::leave_datagrams);
            return false;
        }
        self.give_datagrams(header, &Arc::from(payload))
    }

    /// Whether data of a link go in datagrams now.
    pub(super) fn has_datagrams(&self) -> bool {
        self.links.iter().any(OutgoingLink::is_in_datagrams)
    }

    /// Takes a datagram of a subscriber. Returns whether it is one of this output's.
    pub(super) fn receive_receipt(&mut self, token: u64, packet: &[u8], from: SocketAddr) -> bool {
        let published = self.published;
        let has_token = |link: &&mut OutgoingLink| {
            link.datagrams.as_ref().is_some_and(|it| it.sender.token() == token)
        };
        let Some(link) = self.links.iter_mut().find(has_token) else { return false };
        link.receive_receipt(packet, from, published);
        true
    }

    /// Returns when it wants to be called again.
    pub(super) fn look_after_datagrams(&mut self) -> Option<Duration> {
        self.links.iter_mut().filter_map(OutgoingLink::look_after_datagrams).min()
    }
}
