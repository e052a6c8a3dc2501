//! The publisher's end of shared memory: the slots of an output, which its links share, and the ring
//! of each link.

use std::collections::BTreeSet;
use std::os::fd::OwnedFd;
use std::sync::atomic::AtomicU64;

use armor_memory::page::{MAX_CELLS, MAX_SLOTS};
use armor_memory::step::{ProtocolStep, pass_step};
use armor_memory::{
    LinkPage, MemoryError, PageLayout, PageWords, Placement, RingEntry, RingWriter, SlotMemory,
    SlotPool,
};
use armor_wire::bincode;
use armor_wire::bincode::enc::write::Writer;
use armor_wire::keep::Keep;
use armor_wire::shared_memory::SLOT_HEADER_LEN;

/// The slots of an output.
pub(super) type OutputSlots = SlotPool<SlotMemory>;

/// Free slots that are kept while an output has links with memory: the next message finds its memory
/// ready.
const SPARE_SLOTS: usize = 2;
/// Cells of the ring of a `keep="all"` link.
const CELLS_FOR_ALL: u32 = 8;
/// Slots have lengths that are multiples of this, and some room to grow.
const SLOT_STEP: usize = 4 << 10;
/// Slots that the publisher itself may need beyond those that subscribers hold: the one that it
/// writes and the newest.
const OWN_SLOTS: u32 = 2;
/// Slots that any subscriber may hold, those in the ring not counted: one in its code, one that waits,
/// one on its way.
const LEAST_HELD: u32 = 3;
/// Slots that all subscribers of an output may hold beyond [`LEAST_HELD`] each. Each of them may store
/// other messages, so that without this limit a few long histories would leave no slot for the next
/// message, which every subscriber would then miss. What they may not hold they copy.
const MOST_STORED: u32 = MAX_SLOTS / 2;

/// Whether a link of this policy can use shared memory: each message that waits needs a slot.
pub(crate) fn suits_memory(keep: Keep) -> bool {
    match keep {
        Keep::Latest | Keep::All { .. } | Keep::Pull => true,
        Keep::Last { count } => count <= MAX_CELLS,
    }
}

/// Returns the most slots that an output has whose links have these policies and store so many
/// messages each: as many files its process has open. 0 if none of them can use shared memory.
pub fn count_slots(links: impl IntoIterator<Item = (Keep, u32)>) -> u32 {
    let (mut lent, mut stored) = (0, 0);
    for (keep, history) in links.into_iter().filter(|(keep, _)| suits_memory(*keep)) {
        lent += count_lent(count_cells(keep), LEAST_HELD);
        stored += most_stored(keep, history);
    }
    if lent == 0 { 0 } else { limit_slots(lent + stored.min(MOST_STORED)) }
}

fn limit_slots(lent: u32) -> u32 {
    (lent + OWN_SLOTS).min(MAX_SLOTS)
}

fn count_cells(keep: Keep) -> u32 {
    match keep {
        Keep::Latest | Keep::Pull => 1,
        Keep::Last { count } => count.clamp(1, MAX_CELLS),
        Keep::All { .. } => CELLS_FOR_ALL,
    }
}

/// How many slots a subscriber may hold beyond [`LEAST_HELD`], if the other ones leave so many.
fn most_stored(keep: Keep, history: u32) -> u32 {
    // As many messages as in the ring wait in the subscriber's inbox.
    count_cells(keep) - 1 + if history > 1 { history.min(MAX_CELLS) } else { 0 }
}

/// How many slots a subscriber may have at a time: those that it holds, those in the ring, and one
/// that it is just copying because it holds so many.
fn count_lent(cells: u32, held: u32) -> u32 {
    held + cells + 1
}

/// The memory of one link.
pub(crate) struct LinkMemory {
    page: LinkPage,
    ring: RingWriter,
    layout: PageLayout,
    /// How many slots the subscriber may hold, those in the ring not counted.
    most_held: u32,
    /// Numbers of the slots that it has been offered.
    offered: BTreeSet<u32>,
}

/// The result of giving a slot to a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RingResult {
    /// It is in the ring; `missed` if an older message was taken back for it.
    Pushed { missed: bool },
    /// The subscriber holds all the slots that it may.
    Refused,
}

impl LinkMemory {
    /// Memory for a link of this policy whose subscriber stores a history of `history` messages,
    /// alongside the `others` of the output. Returns it with the file for the other end.
    pub fn create<'a>(
        keep: Keep,
        history: u32,
        others: impl Iterator<Item = &'a Self>,
    ) -> Result<(Self, OwnedFd), MemoryError> {
        let stored: u32 = others.map(|other| other.most_held - LEAST_HELD).sum();
        let most_held = LEAST_HELD + most_stored(keep, history).min(MOST_STORED - stored);
        let cells = count_cells(keep);
        let layout = PageLayout { cells, slots: MAX_SLOTS };
        let (page, file) = LinkPage::create(layout)?;
        let (ring, offered) = (RingWriter::default(), BTreeSet::new());
        Ok((Self { page, ring, layout, most_held, offered }, file))
    }

    /// Sizes of the page.
    pub fn layout(&self) -> PageLayout {
        self.layout
    }

    /// How many slots the subscriber may hold, those in the ring not counted.
    pub fn most_held(&self) -> u32 {
        self.most_held
    }

    fn most_lent(&self) -> u32 {
        count_lent(self.layout.cells, self.most_held)
    }

    fn words(&self) -> PageWords<'_, AtomicU64> {
        self.page.words()
    }

    /// Whether the ring has no room: the next message would take back the oldest.
    pub fn is_full(&self) -> bool {
        self.ring.is_full(self.words())
    }

    pub fn must_wake(&self) -> bool {
        self.words().must_wake()
    }

    /// Whether the slot must be offered before it is pushed.
    pub fn needs_offer(&self, slot: u32) -> bool {
        !self.offered.contains(&slot)
    }

    /// Notes that the slot has been offered.
    pub fn note_offer(&mut self, slot: u32) {
        self.offered.insert(slot);
    }

    /// Notes that the slot is gone. Returns whether it was offered.
    pub fn forget_slot(&mut self, slot: u32) -> bool {
        self.offered.remove(&slot)
    }

    /// Lends a slot to the subscriber and puts it into the ring.
    pub fn push(&mut self, slots: &OutputSlots, place: usize, fresh: bool) -> RingResult {
        let words = self.page.words();
        // Read before the slots are counted: if the subscriber takes the entry in between, its slot
        // still counts as one of those that it may have.
        let exchanged = u32::from(self.ring.is_full(words));
        let lent = words.count_held(slots.slots().iter().map(|slot| slot.index)) as u32;
        // One that gives nothing back must not take the slots of all others. A message that replaces
        // another takes none: refused, it would leave an older one as the newest.
        if lent + 1 > self.most_lent() + exchanged {
            return RingResult::Refused;
        }
        let slot = &slots.slots()[place];
        words.lend(slot.index);
        pass_step(ProtocolStep::SlotLent);
        let old = self.ring.push(words, RingEntry { slot: slot.number, fresh });
        pass_step(ProtocolStep::EntryPushed);
        if let Some(old) = old.and_then(|old| slots.find(old.slot)) {
            words.release(old.index);
            pass_step(ProtocolStep::EntryReplaced);
        }
        RingResult::Pushed { missed: old.is_some() }
    }

    /// Takes back what waits in the ring.
    pub fn clear(&mut self, slots: &OutputSlots) {
        let words = self.page.words();
        for entry in self.ring.clear(words) {
            if let Some(slot) = slots.find(entry.slot) {
                words.release(slot.index);
            }
        }
    }

    /// How many messages wait in the ring.
    pub fn count_waiting(&self) -> u64 {
        self.ring.count_waiting(self.words())
    }

    fn is_held(&self, index: u32) -> bool {
        self.words().is_held(index)
    }
}

/// Finds a slot for `len` bytes that none of the links holds; adds one if there is none. Returns its
/// place and the slot that was removed for it, or `None` if there may be no more.
pub(super) fn place_message<'a>(
    slots: &mut OutputSlots,
    len: usize,
    links: impl Iterator<Item = &'a LinkMemory> + Clone,
) -> Result<Option<(usize, Option<u32>)>, MemoryError> {
    let most = limit_slots(links.clone().map(LinkMemory::most_lent).sum());
    let is_held = |index| links.clone().any(|link| link.is_held(index));
    let mut removed = None;
    let place = match slots.place(SLOT_HEADER_LEN + len, most, is_held) {
        Placement::Reuse(place) => place,
        Placement::Exhausted => return Ok(None),
        Placement::Add { index, instead_of, .. } => {
            let needed = SLOT_HEADER_LEN + len;
            let len = (needed + needed / 8).next_multiple_of(SLOT_STEP);
            let memory = SlotMemory::create(len)?;
            pass_step(ProtocolStep::SlotCreated);
            removed = instead_of.map(|place| slots.remove(place).number);
            slots.add(index, len, memory)
        }
    };
    slots.mark_used(place);
    pass_step(ProtocolStep::SlotPlaced);
    Ok(Some((place, removed)))
}

/// Removes the slots that have not been used for a while, or all if no link has memory. Returns
/// their numbers.
pub(super) fn remove_idle<'a>(
    slots: &mut OutputSlots,
    links: impl Iterator<Item = &'a LinkMemory> + Clone,
) -> Vec<u32> {
    let has_links = links.clone().next().is_some();
    let spare = if has_links { SPARE_SLOTS } else { 0 };
    let idle = match has_links {
        true => slots.take_idle(spare, |index| links.clone().any(|link| link.is_held(index))),
        false => slots.take_all(),
    };
    idle.into_iter().map(|slot| slot.number).collect()
}

/// Writes a message into a slot.
pub(super) struct SlotWriter<'a>(pub &'a mut [u8]);

impl Writer for SlotWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), bincode::error::EncodeError> {
        let slot = std::mem::take(&mut self.0);
        let Some((room, rest)) = slot.split_at_mut_checked(bytes.len()) else {
            return Err(bincode::error::EncodeError::Other("the slot is too short"));
        };
        room.copy_from_slice(bytes);
        self.0 = rest;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use armor_memory::RingReader;

    use super::*;

    const LEN: usize = 1000;

    fn publish(slots: &mut OutputSlots, link: &mut LinkMemory) -> RingResult {
        let placed = place_message(slots, LEN, std::iter::once(&*link)).unwrap();
        let (place, _) = placed.expect("there is a slot");
        link.push(slots, place, false)
    }

    #[test]
    fn a_subscriber_that_holds_all_it_may_and_copies_one_more_is_not_refused() {
        let (mut link, file) = LinkMemory::create(Keep::ALL, 1, std::iter::empty()).unwrap();
        let far = LinkPage::map(&file, link.layout()).unwrap();
        let (mut slots, mut ring) = (OutputSlots::default(), RingReader::default());
        let taken = RingResult::Pushed { missed: false };
        let mut held = Vec::new();
        // All that it may hold, and one that it is just copying.
        for _ in 0..=link.most_held() {
            assert_eq!(publish(&mut slots, &mut link), taken);
            held.push(ring.take(far.words()).expect("it was pushed"));
        }
        for waiting in 0..link.layout().cells {
            assert!(!link.is_full(), "{waiting} wait");
            assert_eq!(publish(&mut slots, &mut link), taken, "{waiting} wait");
        }
        assert!(link.is_full(), "now a sender that may drop nothing waits");
        let replaced = RingResult::Pushed { missed: true };
        assert_eq!(publish(&mut slots, &mut link), replaced, "the newest takes no further slot");
        // One more than it may hold and copy: it would take the slots of the others.
        held.push(ring.take(far.words()).expect("it waits"));
        assert_eq!(publish(&mut slots, &mut link), RingResult::Refused);
        let copied = held.pop().and_then(|entry| slots.find(entry.slot)).expect("it is lent");
        far.words().release(copied.index);
        assert_eq!(publish(&mut slots, &mut link), taken);
    }

    #[test]
    fn long_histories_of_many_subscribers_leave_slots_for_the_next_message() {
        let mut links: Vec<LinkMemory> = Vec::new();
        for _ in 0..20 {
            links.push(LinkMemory::create(Keep::Pull, 32, links.iter()).unwrap().0);
        }
        let stored = links.iter().map(|link| link.most_held - LEAST_HELD);
        assert_eq!(stored.clone().sum::<u32>(), MOST_STORED);
        assert_eq!(stored.collect::<Vec<_>>()[3..5], [32, 0]);
        let lent = links.iter().map(LinkMemory::most_lent).sum();
        assert_eq!(limit_slots(lent), lent + OWN_SLOTS, "no slot is missing");
        assert_eq!(count_slots([(Keep::Pull, 32); 20]), lent + OWN_SLOTS);
    }
}
