//! The bytes of a message that has arrived: in the buffer of its link, or in a slot of shared
//! memory, which stays as it is for as long as it is held.

use std::ops::{Deref, Range};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use armor_memory::step::{ProtocolStep, pass_step};
use armor_memory::{LinkPage, SlotView};

/// A message in a slot that this process holds. The last clone gives the slot back.
#[derive(Clone, Debug)]
pub(crate) struct HeldSlot(Arc<SlotHold>);

#[derive(Debug)]
struct SlotHold {
    view: Arc<SlotView>,
    payload: Range<usize>,
    page: Arc<LinkPage>,
    /// Its entry in the table of the page.
    index: u32,
    /// How many slots of the link this process holds.
    held: Arc<AtomicU32>,
    /// How many it may store; beyond that it copies.
    most: u32,
}

impl HeldSlot {
    /// Holds the slot that the publisher has lent: `payload` of `view`, entry `index` of `page`.
    pub fn new(
        view: Arc<SlotView>,
        payload: Range<usize>,
        (page, index): (Arc<LinkPage>, u32),
        (held, most): (Arc<AtomicU32>, u32),
    ) -> Self {
        held.fetch_add(1, Ordering::Relaxed);
        Self(Arc::new(SlotHold { view, payload, page, index, held, most }))
    }
}

impl Drop for SlotHold {
    fn drop(&mut self) {
        pass_step(ProtocolStep::SlotReturning);
        self.page.words().release(self.index);
        pass_step(ProtocolStep::SlotReturned);
        self.held.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Deref for HeldSlot {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0.view.bytes()[self.0.payload.clone()]
    }
}

/// A message on its way to the component.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Payload<'a> {
    /// In a buffer that is used again for the next message.
    Buffer(&'a [u8]),
    /// In a slot.
    Slot(&'a HeldSlot),
}

impl<'a> Payload<'a> {
    pub fn bytes(self) -> &'a [u8] {
        match self {
            Self::Buffer(bytes) => bytes,
            Self::Slot(slot) => slot,
        }
    }

    /// Keeps it beyond the call: a slot is held, unless this process holds as many as it may;
    /// everything else is copied, into `spare` if that is memory of its own.
    pub fn store(self, spare: StoredPayload) -> StoredPayload {
        match self {
            Self::Slot(slot) if slot.0.held.load(Ordering::Relaxed) <= slot.0.most => {
                let stored = StoredPayload::Slot(slot.clone());
                pass_step(ProtocolStep::MessageStored);
                stored
            }
            Self::Slot(_) | Self::Buffer(_) => {
                let mut bytes = match spare {
                    StoredPayload::Copied(bytes) => bytes,
                    StoredPayload::Slot(_) => Vec::new(),
                };
                bytes.clear();
                bytes.extend_from_slice(self.bytes());
                StoredPayload::Copied(bytes)
            }
        }
    }
}

/// A message that waits, or is part of a history.
#[derive(Debug)]
pub(crate) enum StoredPayload {
    Copied(Vec<u8>),
    Slot(HeldSlot),
}

impl Default for StoredPayload {
    fn default() -> Self {
        Self::Copied(Vec::new())
    }
}

impl StoredPayload {
    pub fn as_payload(&self) -> Payload<'_> {
        match self {
            Self::Copied(bytes) => Payload::Buffer(bytes),
            Self::Slot(slot) => Payload::Slot(slot),
        }
    }
}

impl Deref for StoredPayload {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.as_payload().bytes()
    }
}

#[cfg(test)]
mod tests {
    use armor_memory::{PageLayout, SlotMemory};

    use super::*;

    #[test]
    fn a_slot_is_held_until_its_last_use_and_copied_where_too_many_are_held() {
        let layout = PageLayout { cells: 1, slots: 4 };
        let page = Arc::new(LinkPage::create(layout).unwrap().0);
        let held = Arc::new(AtomicU32::new(0));
        let hold = |index: u32| {
            let mut memory = SlotMemory::create(16).unwrap();
            memory.bytes_mut()[4] = index as u8;
            let file = memory.file().try_clone_to_owned().unwrap();
            let view = Arc::new(SlotView::map(&file, 16).unwrap());
            page.words().lend(index);
            HeldSlot::new(view, 4..6, (Arc::clone(&page), index), (Arc::clone(&held), 1))
        };
        let first = hold(1);
        let stored = Payload::Slot(&first).store(StoredPayload::default());
        assert_eq!((&*stored, matches!(stored, StoredPayload::Slot(_))), (&[1, 0][..], true));
        drop(first);
        assert!(page.words().is_held(1), "it is stored");
        let second = hold(2);
        let copied = Payload::Slot(&second).store(StoredPayload::default());
        assert_eq!((&*copied, matches!(copied, StoredPayload::Slot(_))), (&[2, 0][..], false));
        drop((second, stored));
        assert_eq!((page.words().count_held(0..4), held.load(Ordering::Relaxed)), (0, 0));
        let again = Payload::Buffer(&[7, 8]).store(copied);
        assert_eq!(&*again, [7, 8]);
    }
}
