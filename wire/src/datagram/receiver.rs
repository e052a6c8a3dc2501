//! The subscriber's end of a link in datagrams.

use std::collections::BTreeMap;

use super::fragments::FragmentSet;
use super::packet::{DataPacket, FRAGMENT_LEN, Fragment, MAX_PARTS, Receipt, count_fragments};
use super::{DatagramSwitchBody, MAX_RESENT};

/// Most messages that wait to be complete, or for older ones.
const MOST_WAITING: usize = 2 * MAX_RESENT as usize;

/// A message that has arrived whole.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedMessage {
    /// Counts what the output has published.
    pub sequence: u64,
    /// When it was created: system time in seconds.
    pub stamp_s: f64,
    /// Whether the sequence jumps on purpose before it.
    pub fresh: bool,
    /// One value of the output's type.
    pub payload: Vec<u8>,
}

/// A message of which some fragments have arrived.
struct PartMessage {
    message: ReceivedMessage,
    fragments: FragmentSet,
}

/// See the module.
pub struct DatagramReceiver {
    token: u64,
    /// Whether messages are sent again: then older ones are waited for. Otherwise the newest wins.
    is_ordered: bool,
    in_datagrams: bool,
    /// Highest number that has arrived.
    heard: u64,
    receipts: u64,
    /// How many changes it has followed.
    switches: u32,
    /// Sequences before this one do not come any more, as stream and datagrams state.
    stream_floor: u64,
    packet_floor: u64,
    /// The sequence after the last that was taken.
    next: Option<u64>,
    parts: BTreeMap<u64, PartMessage>,
    whole: BTreeMap<u64, ReceivedMessage>,
}

impl DatagramReceiver {
    /// The end of a link whose datagrams begin with `token`, and whose publisher sends the newest
    /// `resent` messages again.
    pub fn new(token: u64, resent: u32) -> Self {
        Self {
            token,
            is_ordered: resent > 0,
            in_datagrams: false,
            heard: 0,
            receipts: 0,
            switches: 0,
            stream_floor: 0,
            packet_floor: 0,
            next: None,
            parts: BTreeMap::new(),
            whole: BTreeMap::new(),
        }
    }

    /// Whether messages come in order, those of the stream among them.
    pub fn is_ordered(&self) -> bool {
        self.is_ordered
    }

    /// Whether data come in datagrams now.
    pub fn is_in_datagrams(&self) -> bool {
        self.in_datagrams
    }

    /// Takes a datagram of the publisher. Returns whether the publisher waits for its receipt.
    pub fn receive(&mut self, packet: &[u8]) -> bool {
        let packet = DataPacket::read(packet).filter(|packet| packet.token == self.token);
        let Some(packet) = packet else { return false };
        self.heard = self.heard.max(packet.number);
        self.packet_floor = self.packet_floor.max(packet.floor);
        // A probe waits for the receipt that comes in any case: an answer to each would be answered again.
        let Some(fragment) = packet.fragment else { return false };
        self.add_fragment(&fragment);
        self.is_ordered
    }

    fn add_fragment(&mut self, fragment: &Fragment<'_>) {
        let sequence = fragment.sequence;
        if self.next.is_some_and(|next| sequence < next) || self.whole.contains_key(&sequence) {
            return;
        }
        let part = self.parts.entry(sequence).or_insert_with(|| PartMessage {
            message: ReceivedMessage {
                sequence,
                stamp_s: fragment.stamp_s,
                fresh: fragment.fresh,
                payload: vec![0; fragment.payload_len],
            },
            fragments: FragmentSet::default(),
        });
        // Another message by the same sequence would be the publisher's fault.
        if part.message.payload.len() != fragment.payload_len
            || !part.fragments.insert(fragment.index)
        {
            return;
        }
        let start = fragment.index * FRAGMENT_LEN;
        part.message.payload[start..start + fragment.bytes.len()].copy_from_slice(fragment.bytes);
        if part.fragments.count() == count_fragments(fragment.payload_len)
            && let Some(part) = self.parts.remove(&sequence)
        {
            self.whole.insert(sequence, part.message);
        }
        let most = if self.is_ordered { MOST_WAITING } else { MAX_PARTS };
        while self.parts.len() > most {
            self.parts.pop_first();
        }
    }

    /// Takes a message that has come by the stream, if those of the datagrams are put in order with it.
    pub fn receive_by_stream(&mut self, message: ReceivedMessage) {
        if !self.in_datagrams {
            self.stream_floor = self.stream_floor.max(message.sequence);
        }
        if self.next.is_none_or(|next| message.sequence >= next) {
            self.parts.remove(&message.sequence);
            self.whole.insert(message.sequence, message);
        }
    }

    /// Follows a change of what carries the data.
    pub fn switch(&mut self, switch: DatagramSwitchBody) {
        self.switches = self.switches.wrapping_add(1);
        self.in_datagrams = switch.in_datagrams;
        self.stream_floor = self.stream_floor.max(switch.next);
    }

    /// Sequences before this one do not come any more.
    fn floor(&self) -> u64 {
        // The datagrams do not know what the stream still carries.
        let packet_floor = if self.in_datagrams { self.packet_floor } else { 0 };
        self.stream_floor.max(packet_floor)
    }

    /// The next message, newer than all before.
    pub fn take_message(&mut self) -> Option<ReceivedMessage> {
        let first = *self.whole.first_key_value()?.0;
        let is_due = !self.is_ordered
            || self.next == Some(first)
            || first <= self.floor()
            || self.whole.len() > MOST_WAITING;
        if !is_due {
            return None;
        }
        let next = first.saturating_add(1);
        self.next = Some(next);
        self.parts = self.parts.split_off(&next);
        self.whole.pop_first().map(|(_, message)| message)
    }

    /// The datagram that reports what has arrived.
    pub fn write_receipt(&mut self) -> Vec<u8> {
        self.receipts += 1;
        // All before it have been taken, or will not come. Where nothing is sent again, the publisher
        // sees by it whether messages become whole.
        let next = self.next.unwrap_or(0);
        let base = if self.is_ordered { next.max(self.floor()) } else { next };
        let is_whole = |at: u64| self.whole.contains_key(&at);
        let arrived = (0..64).filter(|ahead| base.checked_add(*ahead).is_some_and(is_whole));
        let receipt = Receipt {
            token: self.token,
            number: self.receipts,
            switches: self.switches,
            heard: self.heard,
            base,
            arrived: arrived.fold(0, |bits, ahead| bits | 1 << ahead),
            parts: self.parts.iter().take(MAX_PARTS).map(|(at, it)| (*at, it.fragments)).collect(),
        };
        receipt.to_bytes()
    }
}
