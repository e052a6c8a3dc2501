//! The slots of an output: which one the next message goes to, and which are given back.

/// The slots of an output, each with its memory `M`.
#[derive(Debug)]
pub struct SlotPool<M> {
    slots: Vec<PooledSlot<M>>,
    /// The number of the next slot.
    next: u32,
    /// Counts the calls of [`SlotPool::take_idle`].
    looks: u64,
}

/// A slot.
#[derive(Debug)]
pub struct PooledSlot<M> {
    /// Its number; no other slot of the output ever has it.
    pub number: u32,
    /// Its entry in the tables of the links.
    pub index: u32,
    /// The bytes that it can hold.
    pub len: usize,
    /// Its memory.
    pub memory: M,
    /// The look before which it was used last.
    used: u64,
}

/// Where the next message goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// Into the slot at this place.
    Reuse(usize),
    /// Into a new slot with this number and index. If all entries are taken, a free slot that is too
    /// small is removed for it: that at the place `instead_of`.
    Add {
        /// Its number.
        number: u32,
        /// Its entry in the tables of the links.
        index: u32,
        /// The slot that is removed.
        instead_of: Option<usize>,
    },
    /// Nowhere: subscribers hold all slots that there may be.
    Exhausted,
}

impl<M> Default for SlotPool<M> {
    fn default() -> Self {
        Self { slots: Vec::new(), next: 1, looks: 0 }
    }
}

impl<M> SlotPool<M> {
    /// The slot at a place.
    pub fn slot_mut(&mut self, place: usize) -> &mut PooledSlot<M> {
        &mut self.slots[place]
    }

    /// All slots.
    pub fn slots(&self) -> &[PooledSlot<M>] {
        &self.slots
    }

    /// The slot of a number.
    pub fn find(&self, number: u32) -> Option<&PooledSlot<M>> {
        self.slots.iter().find(|slot| slot.number == number)
    }

    /// Where a message of `len` bytes goes, if there may be `most` slots. `is_held` returns whether a
    /// subscriber may still read the slot of an index.
    pub fn place(&self, len: usize, most: u32, is_held: impl Fn(u32) -> bool) -> Placement {
        // Each slot is looked at one time: a subscriber may give it back between two looks.
        let (mut fitting, mut instead_of) = (None::<usize>, None);
        for (place, slot) in self.slots.iter().enumerate() {
            if is_held(slot.index) {
                continue;
            }
            if slot.len < len {
                // It is in the way: messages have become larger.
                instead_of = Some(place);
            } else if fitting.is_none_or(|best| slot.len < self.slots[best].len) {
                fitting = Some(place);
            }
        }
        if let Some(place) = fitting {
            return Placement::Reuse(place);
        }
        let taken = |index: u32| self.slots.iter().any(|slot| slot.index == index);
        let index = match instead_of {
            Some(place) => Some(self.slots[place].index),
            None => (0..most).find(|index| !taken(*index) && !is_held(*index)),
        };
        match index {
            Some(index) => Placement::Add { number: self.next, index, instead_of },
            None => Placement::Exhausted,
        }
    }

    /// Adds the slot of a [`Placement::Add`], after the slot in its place was removed. Returns its
    /// place.
    pub fn add(&mut self, index: u32, len: usize, memory: M) -> usize {
        let number = self.next;
        // No process publishes so many different slots; if one did, numbers would repeat only after
        // the first was long gone.
        self.next = (self.next + 1) & !(1 << 31);
        self.next = self.next.max(1);
        self.slots.push(PooledSlot { number, index, len, memory, used: self.looks });
        self.slots.len() - 1
    }

    /// Removes the slot at a place.
    pub fn remove(&mut self, place: usize) -> PooledSlot<M> {
        self.slots.swap_remove(place)
    }

    /// Notes that the slot at a place is used.
    pub fn mark_used(&mut self, place: usize) {
        self.slots[place].used = self.looks;
    }

    /// Called at regular intervals: takes out the free slots that were not used since the call before
    /// the last one, except for the `spare` that were used last.
    pub fn take_idle(&mut self, spare: usize, is_held: impl Fn(u32) -> bool) -> Vec<PooledSlot<M>> {
        let end = self.looks;
        self.looks += 1;
        self.slots.sort_by_key(|slot| std::cmp::Reverse(slot.used));
        let (mut kept, mut idle, mut free) = (Vec::new(), Vec::new(), 0);
        for slot in self.slots.drain(..) {
            if is_held(slot.index) {
                kept.push(slot);
                continue;
            }
            free += 1;
            if slot.used + 1 > end || free <= spare { kept.push(slot) } else { idle.push(slot) }
        }
        self.slots = kept;
        idle
    }

    /// Takes out all slots.
    pub fn take_all(&mut self) -> Vec<PooledSlot<M>> {
        std::mem::take(&mut self.slots)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    fn publish(pool: &mut SlotPool<()>, len: usize, held: &BTreeSet<u32>) -> Option<u32> {
        let place = match pool.place(len, 4, |index| held.contains(&index)) {
            Placement::Reuse(place) => place,
            Placement::Add { number, index, instead_of } => {
                if let Some(place) = instead_of {
                    pool.remove(place);
                }
                let place = pool.add(index, len, ());
                assert_eq!(pool.slot_mut(place).number, number);
                place
            }
            Placement::Exhausted => return None,
        };
        pool.mark_used(place);
        Some(pool.slot_mut(place).index)
    }

    #[test]
    fn a_free_slot_is_used_again_and_one_that_is_too_small_is_replaced() {
        let (mut pool, mut held) = (SlotPool::default(), BTreeSet::new());
        let first = publish(&mut pool, 100, &held);
        assert_eq!(publish(&mut pool, 50, &held), first);
        held.extend(first);
        let second = publish(&mut pool, 50, &held);
        assert_ne!(second, first);
        assert_eq!((publish(&mut pool, 200, &held), pool.slots().len()), (second, 2));
        assert_eq!(pool.slots().iter().map(|slot| slot.number).collect::<Vec<_>>(), [1, 3]);
        held.extend(0..4);
        assert_eq!(publish(&mut pool, 1, &held), None);
        held.remove(&3);
        assert_eq!(publish(&mut pool, 1, &held), Some(3));
    }

    #[test]
    fn what_is_not_used_is_given_back_after_two_looks() {
        let (mut pool, mut held) = (SlotPool::default(), BTreeSet::new());
        for _ in 0..4 {
            held.extend(publish(&mut pool, 10, &held));
        }
        assert!(pool.take_idle(1, |_| true).is_empty() && pool.take_idle(1, |_| true).is_empty());
        let in_use = publish(&mut pool, 10, &BTreeSet::new());
        assert_eq!(pool.take_idle(1, |_| false).len(), 3, "used before the last look");
        assert_eq!(pool.take_idle(1, |_| false).len(), 0, "one is kept");
        assert_eq!(
            pool.slots().iter().map(|slot| slot.index).collect::<Vec<_>>(),
            Vec::from_iter(in_use)
        );
        assert_eq!((pool.take_idle(0, |_| false).len(), pool.slots().len()), (1, 0));
    }

    proptest! {
        #[test]
        fn no_slot_is_written_while_it_is_held(steps in proptest::collection::vec((0usize..3, 1usize..9, 0u32..4), 0..100)) {
            let (mut pool, mut held) = (SlotPool::default(), BTreeSet::new());
            for (step, len, index) in steps {
                match step {
                    0 => {
                        let used = publish(&mut pool, len, &held);
                        prop_assert!(used.is_none_or(|used| !held.contains(&used)));
                        prop_assert_eq!(used.is_none(), held.len() == 4);
                        held.extend(used);
                    }
                    1 => drop(held.remove(&index)),
                    _ => {
                        for slot in pool.take_idle(1, |index| held.contains(&index)) {
                            prop_assert!(!held.contains(&slot.index));
                        }
                    }
                }
                let indices: BTreeSet<_> = pool.slots().iter().map(|slot| slot.index).collect();
                prop_assert_eq!(indices.len(), pool.slots().len(), "each has an entry of its own");
            }
        }
    }
}
