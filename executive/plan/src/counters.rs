//! Variables that transitions set, called counters: whole numbers with a domain.

use armor_robotfile::guard::Count;
use armor_robotfile::mission::Counts;

/// A variable that transitions set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedCounter {
    /// Its name.
    pub name: String,
    /// What it may be.
    pub counts: Counts,
}

/// What a transition sets a counter to when it fires.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedSet {
    /// An index into the plan's counters.
    pub counter: usize,
    /// As written.
    pub value: Count,
    /// The counters that its names stand for, in their order.
    pub operands: Vec<usize>,
}

impl PlannedSet {
    /// What it comes to, by the values of all counters before; none beyond all that is counted.
    pub fn of(&self, counters: &[i64]) -> Option<i64> {
        let values: Vec<_> = self.operands.iter().map(|index| counters[*index]).collect();
        self.value.of(&values)
    }
}

/// Where a mission stands as far as its net goes.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stand {
    /// Tokens per place.
    pub marking: Vec<u32>,
    /// The values of the variables that transitions set.
    pub counters: Vec<i64>,
}
