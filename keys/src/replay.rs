//! Protection against replayed datagrams: each number is accepted once, and none that is far behind the
//! newest (RFC 4303, section 3.4.3).

/// Numbers behind the newest that are still accepted: datagrams overtake each other.
const WINDOW: u64 = 1024;
const WORDS: usize = (WINDOW / 64) as usize;

/// The numbers that have been accepted.
#[derive(Debug, Default)]
pub(crate) struct ReplayWindow {
    /// One more than the highest.
    next: u64,
    /// A bit for each of the last numbers, by its remainder.
    seen: [u64; WORDS],
}

impl ReplayWindow {
    /// Accepts a number. Returns whether it is new.
    pub fn accept(&mut self, number: u64) -> bool {
        if number == u64::MAX || number + WINDOW < self.next {
            return false;
        }
        if number >= self.next {
            // What lies between has not come.
            let first = self.next.max((number + 1).saturating_sub(WINDOW));
            (first..=number).for_each(|skipped| self.set(skipped, false));
            self.next = number + 1;
        } else if self.is_set(number) {
            return false;
        }
        self.set(number, true);
        true
    }

    fn is_set(&self, number: u64) -> bool {
        let (word, bit) = place(number);
        self.seen[word] >> bit & 1 == 1
    }

    fn set(&mut self, number: u64, is_set: bool) {
        let (word, bit) = place(number);
        self.seen[word] &= !(1 << bit);
        self.seen[word] |= u64::from(is_set) << bit;
    }
}

fn place(number: u64) -> (usize, u64) {
    ((number % WINDOW / 64) as usize, number % 64)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn each_number_is_accepted_once_also_when_they_overtake_each_other() {
        let mut window = ReplayWindow::default();
        assert!([0, 2, 1, 900, 899, 3].into_iter().all(|number| window.accept(number)));
        assert!([0, 1, 2, 3, 899, 900].into_iter().all(|number| !window.accept(number)));
        assert!(window.accept(5000));
        assert!(window.accept(5000 + 1 - WINDOW) && !window.accept(5000 - WINDOW));
        assert!(!window.accept(900) && !window.accept(u64::MAX));
    }

    #[test]
    fn it_decides_as_a_list_of_all_numbers_does() {
        let (mut state, mut window) = (7u64, ReplayWindow::default());
        let (mut seen, mut next) = (HashSet::new(), 0u64);
        for step in 0..200_000u64 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let number = (step / 3 + (state >> 33) % 3000).saturating_sub(1500);
            let is_new = number + WINDOW >= next && seen.insert(number);
            assert_eq!(window.accept(number), is_new, "{number} after {next}");
            if is_new {
                next = next.max(number + 1);
            }
        }
    }
}
