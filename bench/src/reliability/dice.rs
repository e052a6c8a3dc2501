//! Random choices that a seed repeats.

/// A generator of the family xorshift64*.
pub struct FaultDice(u64);

impl FaultDice {
    /// Starts from a seed.
    pub fn new(seed: u64) -> Self {
        // Seeds that differ in one bit begin far from each other.
        Self(seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn draw_bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// A number from 0 up to but not including 1.
    pub fn draw_share(&mut self) -> f64 {
        (self.draw_bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number below `count`, which is not 0.
    pub fn draw_below(&mut self, count: usize) -> usize {
        ((self.draw_share() * count as f64) as usize).min(count.saturating_sub(1))
    }

    /// One of them; none of nothing.
    pub fn choose<'a, T>(&mut self, all: &'a [T]) -> Option<&'a T> {
        all.get(self.draw_below(all.len()))
    }

    /// A number between two, of which each order of magnitude is equally likely.
    pub fn draw_between(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf(self.draw_share())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_repeats_its_choices_and_all_are_in_range() {
        let draw = |seed| {
            let mut dice = FaultDice::new(seed);
            (0..100).map(|_| dice.draw_below(7)).collect::<Vec<_>>()
        };
        assert_eq!(draw(3), draw(3));
        assert_ne!(draw(3), draw(4));
        assert!((0..7).all(|number| draw(5).contains(&number)));
        let mut dice = FaultDice::new(0);
        assert!((0..100).all(|_| (1.0..=60.0).contains(&dice.draw_between(1.0, 60.0))));
    }
}
