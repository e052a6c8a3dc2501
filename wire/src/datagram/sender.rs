//! The publisher's end of a link in datagrams.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use super::fragments::FragmentSet;
use super::packet::{DataPacket, Fragment, Receipt, count_fragments, cut_fragment};
use super::round_trip::RoundTrip;
use super::{DATAGRAM_LEN, MAX_DATAGRAM_MESSAGE, MAX_RESENT};
use crate::frame::DataHeader;

/// After this time without a datagram that has arrived, data take the stream.
const SILENCE: Duration = Duration::from_secs(2);
/// So many messages in a row, within [`SILENCE`], of which none became whole: the way loses a part of each.
const MOST_BROKEN: u32 = 5;
/// Shortest time between two probes.
const PROBE_PERIOD: Duration = Duration::from_millis(200);
/// Receipts that must show that datagrams arrive, after the first time that they did not; twice as many
/// after each further time, up to 2⁵ times.
const PROVEN_BY: u32 = 5;
const MOST_DOUBLINGS: u32 = 5;
/// After this time in datagrams, earlier times do not count any more.
const FORGIVEN: Duration = Duration::from_secs(60);
/// A message is sent again this often, at shortening intervals, before the intervals grow: the
/// subscriber is busy or cut off, and more datagrams would not help it.
const FAST_TRIES: u32 = 8;
/// Longest interval between two tries.
const SLOWEST: Duration = Duration::from_millis(500);
/// Fragments that are sent again together. More would only fill the same queue again.
const BURST: usize = 64;

/// A message that may have to be sent again.
struct KeptMessage {
    header: DataHeader,
    payload: Arc<[u8]>,
    arrived: FragmentSet,
    tries: u32,
    due: Duration,
}

/// See the module.
pub struct DatagramSender {
    token: u64,
    resent: u32,
    number: u64,
    /// Oldest first.
    kept: VecDeque<KeptMessage>,
    /// The sequence after the last that was published.
    next: u64,
    is_on: bool,
    on_since: Duration,
    /// Messages fit into datagrams: data are to go in them.
    is_wanted: bool,
    /// Changes between stream and datagrams, those of the subscriber's last receipt among them.
    switches: u32,
    /// How many times datagrams have stopped arriving since they last arrived for a whole minute.
    falls: u32,
    /// Receipts since then that show that they arrive.
    proofs: u32,
    last_probe: Option<Duration>,
    /// Where nothing is sent again: up to where messages have become whole, and how many were sent since
    /// which time without any that did.
    base: u64,
    broken: u32,
    broken_since: Duration,
    /// Number of the last receipt.
    receipt: u64,
    /// Highest number that has arrived, and when that was reported.
    heard: u64,
    heard_at: Duration,
    /// The number of the datagrams at the last receipt.
    number_at_receipt: u64,
    /// A datagram whose receipt is awaited, and when it was sent.
    measured: Option<(u64, Duration)>,
    round_trip: RoundTrip,
}

/// What a receipt brings about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReceiptEffect {
    /// It is none of this link, or an old one.
    Ignored,
    /// It was counted.
    Counted,
    /// Datagrams arrive: data can take them from here on. The caller sends
    /// [`DatagramSwitchBody`](super::DatagramSwitchBody) by the stream.
    SwitchOn,
}

impl DatagramSender {
    /// The end of a link whose datagrams begin with `token`, and which sends the newest `resent`
    /// messages again.
    pub fn new(token: u64, resent: u32, now: Duration) -> Self {
        Self {
            token,
            resent: resent.min(MAX_RESENT),
            number: 0,
            kept: VecDeque::new(),
            next: 0,
            is_on: false,
            on_since: now,
            is_wanted: true,
            switches: 0,
            falls: 0,
            proofs: 0,
            last_probe: None,
            base: 0,
            broken: 0,
            broken_since: now,
            receipt: 0,
            heard: 0,
            heard_at: now,
            number_at_receipt: 0,
            measured: None,
            round_trip: RoundTrip::default(),
        }
    }

    /// The token of its datagrams.
    pub fn token(&self) -> u64 {
        self.token
    }

    /// How many messages are sent again.
    pub fn resent(&self) -> u32 {
        self.resent
    }

    /// Whether data are sent in datagrams now.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// No message before this sequence is sent, or sent again.
    pub fn floor(&self) -> u64 {
        self.kept.front().map_or(self.next, |kept| kept.header.sequence)
    }

    /// Notes whether the messages fit into datagrams: data are to go in them only then.
    pub fn set_wanted(&mut self, is_wanted: bool) {
        self.is_wanted = is_wanted;
    }

    /// How many times datagrams have stopped arriving since they last arrived for a whole minute.
    pub fn falls(&self) -> u32 {
        self.falls
    }

    /// Whether a payload of this length can be sent.
    pub fn can_carry(len: usize) -> bool {
        len <= MAX_DATAGRAM_MESSAGE
    }

    /// Sends a message; `send` gets each of its datagrams.
    pub fn publish(
        &mut self,
        header: &DataHeader,
        payload: &Arc<[u8]>,
        now: Duration,
        mut send: impl FnMut(&[u8]),
    ) {
        self.next = header.sequence + 1;
        if self.resent > 0 {
            let oldest = self.next.saturating_sub(u64::from(self.resent));
            while self.kept.front().is_some_and(|kept| kept.header.sequence < oldest) {
                self.kept.pop_front();
            }
            self.kept.push_back(KeptMessage {
                header: *header,
                payload: Arc::clone(payload),
                arrived: FragmentSet::default(),
                tries: 0,
                due: now + self.round_trip.wait(),
            });
        }
        if self.broken == 0 {
            self.broken_since = now;
        }
        self.broken += 1;
        let all = count_fragments(payload.len());
        self.send_fragments(header, payload, 0..all, now, &mut send);
    }

    fn send_fragments(
        &mut self,
        header: &DataHeader,
        payload: &[u8],
        indices: impl Iterator<Item = usize>,
        now: Duration,
        send: &mut impl FnMut(&[u8]),
    ) {
        for index in indices {
            let fragment = Fragment {
                sequence: header.sequence,
                stamp_s: header.stamp_s,
                fresh: header.fresh,
                payload_len: payload.len(),
                index,
                bytes: cut_fragment(payload, index),
            };
            self.send_packet(Some(fragment), now, send);
        }
    }

    fn send_packet(
        &mut self,
        fragment: Option<Fragment<'_>>,
        now: Duration,
        send: &mut impl FnMut(&[u8]),
    ) {
        self.number += 1;
        let floor = self.floor();
        let is_probe = fragment.is_none();
        let packet = DataPacket { token: self.token, number: self.number, floor, fragment };
        let mut buffer = [0; DATAGRAM_LEN];
        let len = packet.write(&mut buffer);
        // The receipt of a probe comes when one is due in any case.
        if !is_probe {
            self.measured = self.measured.or(Some((self.number, now)));
        }
        send(&buffer[..len]);
    }

    /// Takes a datagram of the subscriber.
    pub fn receive(
        &mut self,
        packet: &[u8],
        now: Duration,
        mut send: impl FnMut(&[u8]),
    ) -> ReceiptEffect {
        let receipt = Receipt::read(packet).filter(|receipt| receipt.token == self.token);
        let Some(receipt) = receipt.filter(|receipt| {
            // One that was overtaken reports less than is known.
            receipt.number > self.receipt && receipt.heard <= self.number
        }) else {
            return ReceiptEffect::Ignored;
        };
        self.receipt = receipt.number;
        // If a later one has arrived, the one that was measured may be lost.
        if let Some((number, sent_at)) = self.measured.take_if(|(it, _)| *it <= receipt.heard)
            && number == receipt.heard
        {
            self.round_trip.add_measurement(now.saturating_sub(sent_at));
        }
        self.note_arrivals(&receipt);
        if receipt.base > self.base {
            (self.base, self.broken) = (receipt.base, 0);
        }
        let has_arrived = receipt.heard > self.heard;
        if has_arrived {
            self.heard = receipt.heard;
            self.heard_at = now;
        }
        // There must be something whose arrival the next receipt can report.
        let is_due = self.last_probe.is_none_or(|last| now.saturating_sub(last) >= PROBE_PERIOD);
        if (self.number == self.number_at_receipt || !self.is_on) && is_due {
            self.last_probe = Some(now);
            self.send_packet(None, now, &mut send);
        }
        self.number_at_receipt = self.number;
        if self.is_on {
            if now.saturating_sub(self.on_since) > FORGIVEN {
                self.falls = 0;
            }
            return ReceiptEffect::Counted;
        }
        self.proofs += u32::from(has_arrived);
        let needed = match self.falls.checked_sub(1) {
            None => 1,
            Some(further) => PROVEN_BY << further.min(MOST_DOUBLINGS),
        };
        // What the stream still carries would be overtaken.
        let has_followed = receipt.switches == self.switches;
        if has_arrived && self.proofs >= needed && self.is_wanted && has_followed {
            self.is_on = true;
            self.on_since = now;
            self.broken = 0;
            self.switches = self.switches.wrapping_add(1);
            return ReceiptEffect::SwitchOn;
        }
        ReceiptEffect::Counted
    }

    /// Takes back the switch to datagrams, of which the subscriber has not been informed.
    pub fn undo_switch_on(&mut self) {
        self.is_on = false;
        self.switches = self.switches.wrapping_sub(1);
    }

    fn note_arrivals(&mut self, receipt: &Receipt) {
        for (sequence, fragments) in &receipt.parts {
            let kept = self.kept.iter_mut().find(|kept| kept.header.sequence == *sequence);
            if let Some(kept) = kept {
                kept.arrived.add_all(fragments);
            }
        }
        self.kept.retain(|kept| match kept.header.sequence.checked_sub(receipt.base) {
            None => false,
            Some(ahead) => ahead >= 64 || receipt.arrived >> ahead & 1 == 0,
        });
    }

    /// Sends again what is due. Returns when it must be called the next time.
    pub fn resend(&mut self, now: Duration, mut send: impl FnMut(&[u8])) -> Option<Duration> {
        if !self.is_on {
            return None;
        }
        let wait = self.round_trip.wait();
        for at in 0..self.kept.len() {
            let kept = &mut self.kept[at];
            if kept.due > now {
                continue;
            }
            kept.tries += 1;
            // The first loss has been noticed: from here on there is no need to wait for an answer to
            // each try, until there have been many.
            kept.due = now + next_wait(wait, kept.tries);
            let (header, payload, arrived) = (kept.header, Arc::clone(&kept.payload), kept.arrived);
            let missing = (0..count_fragments(payload.len())).filter(|it| !arrived.contains(*it));
            self.send_fragments(&header, &payload, missing.take(BURST), now, &mut send);
        }
        self.kept.iter().map(|kept| kept.due).min()
    }

    /// Whether data must take the stream from here on: nothing has arrived for too long, or no message
    /// has become whole. The caller switches off then.
    pub fn note_silence(&mut self, now: Duration) -> bool {
        let is_silent = now.saturating_sub(self.heard_at) > SILENCE;
        let is_broken = self.resent == 0
            && self.broken >= MOST_BROKEN
            && now.saturating_sub(self.broken_since) > SILENCE;
        let has_fallen = self.is_on && (is_silent || is_broken);
        self.falls += u32::from(has_fallen);
        has_fallen
    }

    /// Data take the stream from here on: returns the messages that may not have arrived, oldest first.
    /// The caller sends [`DatagramSwitchBody`](super::DatagramSwitchBody) before them.
    pub fn switch_off(&mut self) -> Vec<(DataHeader, Arc<[u8]>)> {
        self.is_on = false;
        self.proofs = 0;
        self.switches = self.switches.wrapping_add(1);
        std::mem::take(&mut self.kept).into_iter().map(|kept| (kept.header, kept.payload)).collect()
    }
}

fn next_wait(wait: Duration, tries: u32) -> Duration {
    match tries.checked_sub(FAST_TRIES) {
        None => wait / 2,
        Some(slow) => (wait * 2u32.saturating_pow(slow.min(16))).min(SLOWEST),
    }
}
