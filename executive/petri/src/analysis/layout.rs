//! Packs markings into as few bits as the bounds of the places allow: fields in 64-bit words, none
//! of them across two words.

use std::collections::BTreeMap;

/// The position of each place's field, and how to read and write it.
#[derive(Clone, Debug)]
pub(crate) struct MarkingLayout {
    fields: Vec<BitField>,
    words: usize,
}

#[derive(Clone, Copy, Debug)]
struct BitField {
    word: u32,
    shift: u32,
    mask: u32,
    /// The tokens of a place that never changes and has no bits.
    constant: u32,
}

/// The room that a place needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Room {
    /// It always holds this many.
    Constant(u32),
    /// It holds up to this many.
    UpTo(u32),
}

impl MarkingLayout {
    pub fn new(rooms: &[Room]) -> Self {
        let width = |room: &Room| match room {
            Room::Constant(_) => 0,
            Room::UpTo(most) => u32::BITS - most.leading_zeros(),
        };
        let mut order: Vec<usize> = (0..rooms.len()).collect();
        order.sort_by_key(|index| std::cmp::Reverse(width(&rooms[*index])));
        let mut fields = vec![BitField { word: 0, shift: 0, mask: 0, constant: 0 }; rooms.len()];
        let mut used: Vec<u32> = vec![0];
        // A word without room for one field has none for the next field of the same width.
        let (mut start, mut start_width) = (0, u32::MAX);
        for index in order {
            let width = width(&rooms[index]);
            if let Room::Constant(tokens) = rooms[index] {
                fields[index].constant = tokens;
                continue;
            }
            if width != start_width {
                (start, start_width) = (0, width);
            }
            let fits = (start..used.len()).find(|word| used[*word] + width <= u64::BITS);
            let word = fits.unwrap_or(used.len());
            if word == used.len() {
                used.push(0);
            }
            let mask = (1u64 << width) - 1;
            let mask = u32::try_from(mask).expect("a field has 32 bits or fewer");
            // A field without bits may be in any word, also behind its last bit, so it has no
            // shift.
            let shift = if width == 0 { 0 } else { used[word] };
            fields[index] = BitField { word: word as u32, shift, mask, constant: 0 };
            used[word] += width;
            start = word;
        }
        Self { fields, words: used.len() }
    }

    /// Returns the words per marking, at least one.
    pub fn words(&self) -> usize {
        self.words
    }

    /// Returns the most tokens that the field of a place can hold.
    pub fn capacity(&self, place: u32) -> u32 {
        let field = &self.fields[place as usize];
        if field.mask == 0 { field.constant } else { field.mask }
    }

    /// Returns the room of a place, for a layout in which other places differ.
    pub fn room(&self, place: u32) -> Room {
        let field = &self.fields[place as usize];
        match field.mask {
            0 if field.constant > 0 => Room::Constant(field.constant),
            mask => Room::UpTo(mask),
        }
    }

    /// Writes the tokens per place to `out`.
    pub fn unpack(&self, words: &[u64], out: &mut [u32]) {
        for (tokens, field) in out.iter_mut().zip(&self.fields) {
            let bits = (words[field.word as usize] >> field.shift) as u32;
            *tokens = (bits & field.mask) | field.constant;
        }
    }

    /// Writes the words to `out`. The tokens of every place must fit its field.
    pub fn pack(&self, marking: &[u32], out: &mut [u64]) {
        out.fill(0);
        for (tokens, field) in marking.iter().zip(&self.fields) {
            out[field.word as usize] |= u64::from(tokens & field.mask) << field.shift;
        }
    }

    /// Returns what to add, wrapping, to the words of a marking to change its places by `change`.
    pub fn difference(&self, change: &[(u32, i64)]) -> Vec<(u32, u64)> {
        let mut words: BTreeMap<u32, u64> = BTreeMap::new();
        for &(place, change) in change {
            let field = &self.fields[place as usize];
            // Two's complement: borrows between fields cancel as long as every field stays in its
            // room.
            let bits = (change as u64) << field.shift;
            let word = words.entry(field.word).or_default();
            *word = word.wrapping_add(bits);
        }
        words.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn unpacking_reverses_packing_and_adding_differences_fires(
            places in prop::collection::vec((any::<u32>(), 0u32..=32, any::<u32>(), any::<bool>()), 1..40)
        ) {
            let most = |bits: u32| u32::MAX.checked_shr(32 - bits).unwrap_or(0);
            let rooms: Vec<Room> = places.iter().map(|&(tokens, bits, _, constant)| match constant {
                true => Room::Constant(tokens),
                false => Room::UpTo(most(bits)),
            }).collect();
            let layout = MarkingLayout::new(&rooms);
            let fit = |wish: u32, room: &Room| match room {
                Room::Constant(tokens) => *tokens,
                Room::UpTo(most) => if *most == u32::MAX { wish } else { wish % (most + 1) },
            };
            let before: Vec<u32> = places.iter().zip(&rooms).map(|(p, room)| fit(p.0, room)).collect();
            let after: Vec<u32> = places.iter().zip(&rooms).map(|(p, room)| fit(p.2, room)).collect();
            let mut words = vec![0; layout.words()];
            let mut back = vec![0; places.len()];
            layout.pack(&before, &mut words);
            layout.unpack(&words, &mut back);
            prop_assert_eq!(&back, &before);
            let change: Vec<(u32, i64)> = (0..places.len())
                .map(|p| (p as u32, i64::from(after[p]) - i64::from(before[p])))
                .filter(|(p, _)| matches!(rooms[*p as usize], Room::UpTo(_)))
                .collect();
            for (word, bits) in layout.difference(&change) {
                words[word as usize] = words[word as usize].wrapping_add(bits);
            }
            layout.unpack(&words, &mut back);
            prop_assert_eq!(&back, &after);
        }
    }
}
