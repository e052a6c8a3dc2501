//! Gives one message to the links of an output whose data go in datagrams, and to their streams what
//! those do not carry.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use armor_wire::codec::{self, Encodable, EncodeError};
use armor_wire::datagram::{DatagramSender, DatagramSwitchBody};
use armor_wire::frame::{self, DataHeader, Frame, FrameKind, PREFIX_LEN};
use armor_wire::message::WireType;

use super::datagrams_out::LinkDatagrams;
use super::publishing::OutputState;
use super::wire_out::OutgoingLink;

impl OutgoingLink {
    /// Whether data go in datagrams now.
    pub(super) fn is_in_datagrams(&self) -> bool {
        self.datagrams.as_ref().is_some_and(|datagrams| datagrams.is_on())
    }

    /// Offers datagrams to the subscriber, directly behind the welcome.
    pub(super) fn offer_datagrams(&mut self) {
        if let Some(offer) = self.datagrams.as_deref().map(LinkDatagrams::offer) {
            self.send_body(FrameKind::DatagramOffer, &offer);
        }
    }

    fn send_body<T: WireType>(&mut self, kind: FrameKind, body: &T) {
        if let Ok(bytes) = frame::to_bytes(kind, body) {
            self.send_unqueued(&bytes);
        }
    }

    /// Sends a message in datagrams. Returns whether the service thread must look after them.
    fn send_in_datagrams(&mut self, header: DataHeader, payload: &Arc<[u8]>) -> bool {
        let Some(datagrams) = self.datagrams.as_mut().filter(|it| it.is_on()) else { return false };
        if self.paused || self.broken || self.last_sequence >= Some(header.sequence) {
            return false;
        }
        let fresh = std::mem::take(&mut self.fresh);
        let is_taken = datagrams.publish(&DataHeader { fresh, ..header }, payload);
        self.sent += 1;
        self.last_sequence = Some(header.sequence);
        // What the system refuses is lost, unless it is sent again.
        self.dropped += u64::from(!is_taken && !datagrams.resends());
        datagrams.resends()
    }

    /// Data take the stream from here on, those first that may not have arrived.
    fn leave_datagrams(&mut self) {
        let Some(datagrams) = self.datagrams.as_mut().filter(|it| it.is_on()) else { return };
        let switch = DatagramSwitchBody { in_datagrams: false, next: datagrams.floor() };
        let unreceived = datagrams.switch_off();
        self.send_body(FrameKind::DatagramSwitch, &switch);
        // A frozen subscriber gets nothing.
        let is_paused = self.paused;
        for (header, payload) in unreceived.into_iter().filter(|_| !is_paused) {
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
        if !datagrams.receive(packet, from) {
            return;
        }
        // What waits for the stream would be overtaken; there will be another receipt.
        if !self.queue.is_empty() && !self.drain_queue() {
            if let Some(datagrams) = &mut self.datagrams {
                datagrams.undo_switch_on();
            }
            return;
        }
        if self.datagrams.as_mut().is_some_and(|datagrams| datagrams.note_return()) {
            tracing::info!("datagrams to `{}` arrive again", self.to);
        }
        let switch = DatagramSwitchBody { in_datagrams: true, next: published };
        self.send_body(FrameKind::DatagramSwitch, &switch);
    }

    /// Sends again what is due, and leaves datagrams that do not arrive. Returns the time until it must
    /// be called again.
    fn look_after_datagrams(&mut self) -> Option<Duration> {
        let datagrams = self.datagrams.as_mut()?;
        if !datagrams.note_silence() {
            return datagrams.resend();
        }
        let is_first = datagrams.falls() == 1;
        self.leave_datagrams();
        if is_first {
            tracing::warn!(
                "`{}` has confirmed no datagram for 2 s, or no whole message; TCP carries the data",
                self.to
            );
        }
        None
    }
}

impl OutputState {
    /// Gives the message to the links whose data go in datagrams; those that cannot carry it take the
    /// stream. Returns whether the service thread must look after them.
    pub(super) fn publish_in_datagrams<T: Encodable>(
        &mut self,
        message: &T,
        header: DataHeader,
    ) -> Result<bool, EncodeError> {
        self.encoded_len = codec::encoded_len(message)?;
        if self.check_len(self.encoded_len) && self.has_datagrams() {
            let payload: Arc<[u8]> = codec::encode(message)?.into();
            return Ok(self.give_datagrams(header, &payload));
        }
        Ok(false)
    }

    /// Whether datagrams can carry a message of this length. If they cannot, it takes the stream.
    fn check_len(&mut self, len: usize) -> bool {
        let fits = DatagramSender::can_carry(len);
        for link in &mut self.links {
            if !fits {
                link.leave_datagrams();
            }
            if let Some(datagrams) = &mut link.datagrams {
                datagrams.set_wanted(fits);
            }
        }
        fits
    }

    /// The same for an encoded frame.
    pub(super) fn send_frame_in_datagrams(&mut self, frame: &[u8]) -> bool {
        let Some((prefix, body)) = frame.split_at_checked(PREFIX_LEN) else { return false };
        let frame = Frame { kind: FrameKind::Data, flags: prefix[5], body };
        let Ok((header, payload)) = frame.data() else { return false };
        self.check_len(payload.len()) && self.give_datagrams(header, &Arc::from(payload))
    }

    fn give_datagrams(&mut self, header: DataHeader, payload: &Arc<[u8]>) -> bool {
        self.links.iter_mut().fold(false, |any, link| link.send_in_datagrams(header, payload) | any)
    }

    /// Whether a link can use datagrams.
    pub(super) fn may_use_datagrams(&self) -> bool {
        self.links.iter().any(|link| link.datagrams.is_some())
    }

    /// Whether data of a link go in datagrams now.
    fn has_datagrams(&self) -> bool {
        self.links.iter().any(OutgoingLink::is_in_datagrams)
    }

    /// Takes a datagram of a subscriber. Returns whether it is one of this output's.
    pub(super) fn receive_receipt(&mut self, token: u64, packet: &[u8], from: SocketAddr) -> bool {
        let has_token = |link: &&mut OutgoingLink| {
            link.datagrams.as_ref().is_some_and(|datagrams| datagrams.token() == token)
        };
        let Some(link) = self.links.iter_mut().find(has_token) else { return false };
        link.receive_receipt(packet, from, self.published);
        true
    }

    /// Sends again what is due. Returns the time until it must be called again.
    pub(super) fn look_after_datagrams(&mut self) -> Option<Duration> {
        self.links.iter_mut().filter_map(OutgoingLink::look_after_datagrams).min()
    }
}
