//! The subscriber's end of a link's shared memory: slots as the publisher offers them, and messages
//! from the ring.

use std::collections::VecDeque;
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

use armor_memory::step::{ProtocolStep, pass_step};
use armor_memory::{LinkPage, PageLayout, RingEntry, RingReader, SlotView};
use armor_wire::codec;
use armor_wire::frame::{DataHeader, Frame, FrameKind};
use armor_wire::message::WireType;
use armor_wire::shared_memory::{
    MemoryOfferBody, SLOT_HEADER_LEN, SlotEndBody, SlotOfferBody, read_slot,
};

use super::payload::HeldSlot;

/// Why a frame about slots before any memory is an error.
pub(crate) const NO_MEMORY: &str = "a slot of memory that was not offered";

/// The memory of one link, once the publisher has offered it.
pub(crate) struct MemoryReader {
    page: Arc<LinkPage>,
    ring: RingReader,
    /// A few, so that a search costs less than hashing, of which a pull has nothing in its caches.
    slots: Vec<OfferedSlot>,
    /// Taken from the ring, but its slot has not been offered yet: the offer is in the socket.
    early: Option<RingEntry>,
    held: Arc<AtomicU32>,
    most_held: u32,
}

struct OfferedSlot {
    number: u32,
    view: Arc<SlotView>,
    index: u32,
}

/// What the ring holds.
pub(crate) enum TakenMessage {
    Nothing,
    /// A message in a slot whose offer is still in the socket.
    OfferAwaited,
    Message(DataHeader, HeldSlot),
}

impl MemoryReader {
    /// Maps the page that a `MemoryOffer` brings.
    pub fn open(frame: &Frame<'_>, files: &mut VecDeque<OwnedFd>) -> Result<Self, String> {
        let offer: MemoryOfferBody = read_body(frame)?;
        let layout = PageLayout { cells: offer.cells, slots: offer.slots };
        let page = LinkPage::map(&take_file(files)?, layout).map_err(|e| e.to_string())?;
        pass_step(ProtocolStep::PageMapped);
        Ok(Self {
            page: Arc::new(page),
            ring: RingReader::default(),
            slots: Vec::new(),
            early: None,
            held: Arc::default(),
            most_held: offer.held,
        })
    }

    /// Stores one slot less: a pull holds two messages while it passes over the older one.
    pub fn reserve_slot(&mut self) {
        self.most_held = self.most_held.saturating_sub(1);
    }

    /// Stores at most so many slots, if the publisher allows as many.
    pub fn limit_held(&mut self, most: u32) {
        self.most_held = self.most_held.min(most);
    }

    /// Follows a frame about slots.
    pub fn follow(
        &mut self,
        frame: &Frame<'_>,
        files: &mut VecDeque<OwnedFd>,
    ) -> Result<(), String> {
        if frame.kind == FrameKind::SlotEnd {
            let ended = read_body::<SlotEndBody>(frame)?.slot;
            self.slots.retain(|slot| slot.number != ended);
            return Ok(());
        }
        let offer: SlotOfferBody = read_body(frame)?;
        let view = SlotView::map(&take_file(files)?, offer.len as usize)
            .map_err(|error| error.to_string())?;
        pass_step(ProtocolStep::SlotMapped);
        self.slots.retain(|slot| slot.number != offer.slot);
        let offered = OfferedSlot { number: offer.slot, view: Arc::new(view), index: offer.index };
        self.slots.push(offered);
        Ok(())
    }

    /// Takes the oldest message from the ring.
    pub fn take_message(&mut self) -> Result<TakenMessage, String> {
        let Some(entry) = self.early.take().or_else(|| self.ring.take(self.page.words())) else {
            return Ok(TakenMessage::Nothing);
        };
        let Some(slot) = self.slots.iter().find(|slot| slot.number == entry.slot) else {
            self.early = Some(entry);
            return Ok(TakenMessage::OfferAwaited);
        };
        let (header, len) = match read_slot(slot.view.bytes()) {
            Some((header, payload)) => (header, payload.len()),
            None => return Err(format!("slot {} holds no message", entry.slot)),
        };
        let hold = HeldSlot::new(
            Arc::clone(&slot.view),
            SLOT_HEADER_LEN..SLOT_HEADER_LEN + len,
            (Arc::clone(&self.page), slot.index),
            (Arc::clone(&self.held), self.most_held),
        );
        Ok(TakenMessage::Message(DataHeader { fresh: entry.fresh, ..header }, hold))
    }

    /// Whether there may be a message in the ring.
    pub fn has_messages(&self) -> bool {
        self.early.is_some() || self.ring.has_entries(self.page.words())
    }

    /// Asks to be woken by the next message. `false` if there is one already.
    pub fn announce_sleep(&self) -> bool {
        self.page.words().announce_sleep();
        pass_step(ProtocolStep::SleepAnnounced);
        !self.has_messages()
    }
}

fn read_body<T: WireType>(frame: &Frame<'_>) -> Result<T, String> {
    codec::decode_control(frame.body).map_err(|error| format!("a {:?} frame: {error}", frame.kind))
}

fn take_file(files: &mut VecDeque<OwnedFd>) -> Result<OwnedFd, String> {
    files.pop_front().ok_or_else(|| {
        "shared memory was offered, but no file came with the offer (has this process no file \
         descriptors left?)"
            .into()
    })
}
