//! Gives one message to the links of an output that share memory with their subscribers: encoded
//! once, into a slot that all of them read.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use armor_memory::MemoryError;
use armor_memory::step::{ProtocolStep, pass_step};
use armor_wire::codec::{self, Encodable, EncodeError};
use armor_wire::frame::{self, DATA_HEADER_LEN, DataHeader, Frame, FrameKind, PREFIX_LEN};
use armor_wire::keep::Keep;
use armor_wire::message::WireType;
use armor_wire::shared_memory::{
    MemoryOfferBody, MemoryUse, SLOT_HEADER_LEN, SlotEndBody, SlotOfferBody, write_slot_header,
};

use super::memory_out::{
    LinkMemory, OutputSlots, RingResult, SlotWriter, place_message, remove_idle,
};
use super::publishing::{LARGE_LEN, OutputState};
use super::wire_out::OutgoingLink;

impl OutputState {
    /// Encodes the message into a slot and gives that to every link with memory. Links that can
    /// have memory get it first, if they have asked for it or the message is large.
    pub(super) fn publish_in_memory<T: Encodable>(
        &mut self,
        message: &T,
        header: &DataHeader,
    ) -> Result<(), EncodeError> {
        let len = codec::encoded_len(message)?;
        self.encoded_len = len;
        self.open_memories(len);
        self.share(header, len, None, |slot| codec::write(message, &mut SlotWriter(slot)).is_ok());
        Ok(())
    }

    /// Gives an encoded frame to the links with memory, or to the one at `only`, unless they have had
    /// it or newer data.
    pub(super) fn share_frame(&mut self, frame: &[u8], only: Option<usize>) {
        let Some((prefix, body)) = frame.split_at_checked(PREFIX_LEN) else { return };
        let frame = Frame { kind: FrameKind::Data, flags: prefix[5], body };
        let Ok((header, payload)) = frame.data() else { return };
        self.open_memories(payload.len());
        self.share(&header, payload.len(), only, |slot| {
            slot[..payload.len()].copy_from_slice(payload);
            true
        });
    }

    /// Whether a link has memory, or may get it for a message of a type that can be large.
    pub(super) fn wants_memory(&self, may_be_large: bool) -> bool {
        self.links.iter().any(|link| {
            link.memory.is_some()
                || link.memory_use == MemoryUse::Always
                || (link.memory_use == MemoryUse::Large && may_be_large)
        })
    }

    fn open_memories(&mut self, len: usize) {
        for at in 0..self.links.len() {
            let link = &self.links[at];
            let is_due = match link.memory_use {
                MemoryUse::Never => false,
                MemoryUse::Large => len > LARGE_LEN,
                MemoryUse::Always => true,
            };
            let is_taken = link.is_pushed() || link.keep == Keep::Pull;
            if link.memory.is_none() && is_due && is_taken && self.links[at].is_queue_free() {
                let link = &self.links[at];
                let others = self.links.iter().filter_map(|link| link.memory.as_ref());
                let created = LinkMemory::create(link.keep, link.history, others);
                self.links[at].open_memory(created);
            }
        }
    }

    fn share(
        &mut self,
        header: &DataHeader,
        len: usize,
        only: Option<usize>,
        write: impl FnOnce(&mut [u8]) -> bool,
    ) {
        let takers: Vec<usize> = (0..self.links.len())
            .filter(|at| only.is_none_or(|only| only == *at))
            .filter(|at| self.links[*at].takes_from_memory(header.sequence))
            .collect();
        if takers.is_empty() {
            return;
        }
        let place = self.place(len);
        let Some(place) = place else {
            takers.into_iter().for_each(|at| self.links[at].miss_message(header.sequence));
            return;
        };
        let slot = self.slots.slot_mut(place).memory.bytes_mut();
        write_slot_header(slot, header, len);
        pass_step(ProtocolStep::HeaderWritten);
        if !write(&mut slot[SLOT_HEADER_LEN..]) {
            return;
        }
        pass_step(ProtocolStep::SlotWritten);
        for at in takers {
            self.links[at].offer_slot(&self.slots, place, header.sequence);
        }
    }

    /// Finds a slot; the one that was removed for it is ended at all links.
    fn place(&mut self, len: usize) -> Option<usize> {
        let links = self.links.iter().filter_map(|link| link.memory.as_ref());
        match place_message(&mut self.slots, len, links) {
            Ok(Some((place, removed))) => {
                self.end_slots(removed.as_slice());
                Some(place)
            }
            Ok(None) => None,
            Err(error) => {
                if !std::mem::replace(&mut self.has_failed_slot, true) {
                    tracing::error!("messages are dropped: {error}");
                }
                None
            }
        }
    }

    /// Takes back what frozen subscribers have not read.
    pub(super) fn clear_paused_rings(&mut self) {
        for link in &mut self.links {
            // One that pulls takes the newest when it is active again.
            let is_paused = link.paused && link.keep != Keep::Pull;
            if let Some(memory) = link.memory.as_mut().filter(|_| is_paused) {
                memory.clear(&self.slots);
            }
        }
    }

    /// Gives the slots back to the system that have not been used since the look before the last.
    pub(super) fn release_idle_slots(&mut self) {
        if !self.slots.slots().is_empty() {
            let links = self.links.iter().filter_map(|link| link.memory.as_ref());
            let removed = remove_idle(&mut self.slots, links);
            self.end_slots(&removed);
        }
    }

    fn end_slots(&mut self, slots: &[u32]) {
        for slot in slots {
            self.links.iter_mut().for_each(|link| link.end_slot(*slot));
        }
    }
}

impl OutgoingLink {
    /// Whether data come by frames on its stream.
    pub(super) fn sends_frames(&self) -> bool {
        self.is_pushed() && self.memory.is_none() && !self.is_in_datagrams()
    }

    /// Whether the sender must wait before it publishes: the ring has no room, and nothing may be
    /// dropped.
    pub(super) fn is_ring_full(&self) -> bool {
        self.keep.is_all()
            && self.is_pushed()
            && self.memory.as_ref().is_some_and(LinkMemory::is_full)
    }

    fn takes_from_memory(&self, sequence: u64) -> bool {
        self.memory.is_some()
            && (self.is_pushed() || self.keep == Keep::Pull)
            && self.last_sequence.is_none_or(|last| last < sequence)
    }

    /// Whether a frame can be sent now, and not between the parts of another one.
    fn is_queue_free(&mut self) -> bool {
        self.queue.is_empty() || self.drain_queue()
    }

    /// Offers memory to the subscriber. If that is not possible now, frames continue as before.
    fn open_memory(&mut self, created: Result<(LinkMemory, OwnedFd), MemoryError>) {
        let (memory, file) = match created {
            Ok(created) => created,
            Err(error) => {
                tracing::warn!("the link to `{}` uses its socket: {error}", self.to);
                self.memory_use = MemoryUse::Never;
                return;
            }
        };
        pass_step(ProtocolStep::PageCreated);
        let layout = memory.layout();
        let body =
            MemoryOfferBody { cells: layout.cells, slots: layout.slots, held: memory.most_held() };
        if self.send_with_file(FrameKind::MemoryOffer, &body, file.as_fd()) {
            pass_step(ProtocolStep::PageOffered);
            self.memory = Some(memory);
        }
    }

    /// Puts the slot into the ring, and wakes the subscriber if it sleeps.
    fn offer_slot(&mut self, slots: &OutputSlots, place: usize, sequence: u64) {
        let slot = &slots.slots()[place];
        if self.memory.as_ref().is_some_and(|memory| memory.needs_offer(slot.number)) {
            let len = slot.len as u32;
            let body = SlotOfferBody { slot: slot.number, index: slot.index, len };
            // The offer must not come between the parts of another frame.
            if !self.is_queue_free()
                || !self.send_with_file(FrameKind::SlotOffer, &body, slot.memory.file())
            {
                return self.miss_message(sequence);
            }
            pass_step(ProtocolStep::SlotOffered);
        }
        let fresh = self.fresh;
        let Some(memory) = &mut self.memory else { return };
        memory.note_offer(slot.number);
        let missed = match memory.push(slots, place, fresh) {
            RingResult::Refused => return self.miss_message(sequence),
            RingResult::Pushed { missed } => u64::from(missed),
        };
        let must_wake = memory.must_wake();
        // No subscriber has asked for what a newer message replaces before it is pulled.
        if self.keep == Keep::Pull {
            self.sent += 1 - missed;
        } else {
            self.sent += 1;
            self.dropped += missed;
        }
        self.fresh = false;
        self.last_sequence = Some(sequence);
        self.patience.restart();
        if must_wake && self.queue.is_empty() {
            pass_step(ProtocolStep::WakeClaimed);
            // If the socket is full, the subscriber has bytes to wake up for.
            self.write(&frame::signal(FrameKind::Ready));
        }
    }

    /// Counts a message that the link could not carry.
    fn miss_message(&mut self, sequence: u64) {
        self.sent += 1;
        self.dropped += 1;
        self.last_sequence = Some(sequence);
    }

    fn end_slot(&mut self, slot: u32) {
        let was_offered = self.memory.as_mut().is_some_and(|memory| memory.forget_slot(slot));
        if !was_offered || self.broken {
            return;
        }
        pass_step(ProtocolStep::SlotRemoved);
        let Ok(bytes) = frame::to_bytes(FrameKind::SlotEnd, &SlotEndBody { slot }) else { return };
        self.send_unqueued(&bytes);
    }

    /// Sends a frame that no policy drops: now, or before the data that wait.
    pub(super) fn send_unqueued(&mut self, bytes: &[u8]) {
        if !self.queue.is_empty() && !self.drain_queue() {
            return self.queue.insert_answer(|_| bytes.to_vec());
        }
        let written = self.write(bytes);
        if written < bytes.len() && !self.broken {
            self.queue.push_tail(bytes[written..].to_vec());
        }
    }

    /// Sends a small frame with a file, whole or not at all.
    fn send_with_file<T: WireType>(
        &mut self,
        kind: FrameKind,
        body: &T,
        file: BorrowedFd<'_>,
    ) -> bool {
        let Ok(bytes) = frame::to_bytes(kind, body) else { return false };
        match self.stream.try_send_with_file(&bytes, file) {
            Ok(len) => {
                if len < bytes.len() {
                    self.queue.push_tail(bytes[len..].to_vec());
                }
                true
            }
            Err(error) if armor_socket::is_temporary(&error) => false,
            Err(_) => {
                self.break_off();
                false
            }
        }
    }
}

// A frame's header and that of a slot have the same content.
const _: () = assert!(SLOT_HEADER_LEN >= DATA_HEADER_LEN - PREFIX_LEN + 8);

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixStream;

    use armor_memory::{LinkPage, RingEntry, RingWriter};

    use super::*;
    use crate::link::wire_out::tests::pull_link;
    use crate::messages::Flag;

    #[test]
    fn a_subscriber_that_writes_into_its_ring_corrupts_no_count() {
        let (near, _far) = UnixStream::pair().unwrap();
        let (memory, file) = LinkMemory::create(Keep::Pull, 1, std::iter::empty()).unwrap();
        let page = LinkPage::map(&file, memory.layout()).unwrap();
        let (memory_use, memory) = (MemoryUse::Always, Some(memory));
        let link = OutgoingLink { memory_use, memory, ..pull_link(near) };
        let mut state = OutputState { links: vec![link], ..Default::default() };
        RingWriter::default().push(page.words(), RingEntry { slot: 9, fresh: false });
        assert_eq!(state.links[0].status().sent, 0);
        let header = DataHeader { sequence: 0, stamp_s: 0.0, instance: 1, fresh: false };
        state.publish_in_memory(&Flag::default(), &header).unwrap();
        let status = state.links[0].status();
        assert_eq!((status.sent, status.dropped, status.transport.as_str()), (0, 0, "shm"));
    }
}
