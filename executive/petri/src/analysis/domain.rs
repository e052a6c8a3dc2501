//! Firing domains: the possible firing times of the enabled transitions, as bounds on their
//! differences (Berthomieu and Diaz, 1991), in integer units of the net's own times.

use super::budget::Exhausted;
use crate::net::Net;
use std::time::Duration;

/// No bound.
pub(super) const NEVER: i64 = i64::MAX;
/// Longest time in units, far enough below the maximum that sums of a few do not overflow.
const LONGEST: i64 = i64::MAX / 1024;

/// The intervals of a net in integer units.
#[derive(Clone, Debug)]
pub(super) struct Times {
    /// Earliest and latest per transition.
    pub intervals: Vec<(i64, i64)>,
    unit_ns: u128,
}

impl Times {
    /// Converts the intervals of `net`. A gated transition gets no latest moment, because its gate
    /// may open at any time.
    ///
    /// # Errors
    /// If the times do not fit a common unit.
    pub fn of(net: &Net) -> Result<Self, Exhausted> {
        let finite = net.transitions().iter().flat_map(|t| {
            let latest = t.interval.latest.filter(|_| !t.gated);
            [Some(t.interval.earliest), latest].into_iter().flatten()
        });
        let unit_ns = finite.map(|time| time.as_nanos()).fold(0, greatest_common_divisor).max(1);
        let units = |time: Duration| {
            let units = i64::try_from(time.as_nanos() / unit_ns).ok().filter(|n| *n <= LONGEST);
            units.ok_or(Exhausted::Scale)
        };
        let interval = |t: &crate::net::NetTransition| {
            let latest = t.interval.latest.filter(|_| !t.gated);
            Ok((units(t.interval.earliest)?, latest.map_or(Ok(NEVER), units)?))
        };
        let intervals = net.transitions().iter().map(interval).collect::<Result<_, _>>()?;
        Ok(Self { intervals, unit_ns })
    }

    /// Converts units to a duration.
    pub fn duration(&self, units: i64) -> Duration {
        let ns = u128::from(units.max(0).unsigned_abs()) * self.unit_ns;
        let seconds = u64::try_from(ns / 1_000_000_000).unwrap_or(u64::MAX);
        Duration::new(seconds, (ns % 1_000_000_000) as u32)
    }
}

fn greatest_common_divisor(a: u128, b: u128) -> u128 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// A tight difference-bound matrix: entry `x, y` is the greatest possible time x minus time y.
/// Index 0 is now, the enabled transitions follow in order, and the last index, if requested, is
/// the beginning of the run.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Domain {
    size: usize,
    bounds: Box<[i64]>,
}

impl Domain {
    /// Returns the domain in which all of `enabled` have just become enabled; the beginning is now,
    /// if
    /// `with_beginning`.
    pub fn newly_enabled(times: &Times, enabled: &[u32], with_beginning: bool) -> Self {
        let size = 1 + enabled.len() + usize::from(with_beginning);
        let mut domain = Self { size, bounds: vec![0; size * size].into() };
        for (index, transition) in enabled.iter().enumerate() {
            let (earliest, latest) = times.intervals[*transition as usize];
            domain.set_bound(index + 1, 0, latest);
            domain.set_bound(0, index + 1, -earliest);
        }
        domain.join_by_now(1..size);
        domain
    }

    #[inline]
    pub fn at(&self, x: usize, y: usize) -> i64 {
        self.bounds[x * self.size + y]
    }

    #[inline]
    fn set_bound(&mut self, x: usize, y: usize, bound: i64) {
        self.bounds[x * self.size + y] = bound;
    }

    pub fn bytes(&self) -> u64 {
        self.bounds.len() as u64 * 8
    }

    /// Returns whether the transition at index `fired` can fire first of `enabled` many.
    pub fn can_be_first(&self, fired: usize, enabled: usize) -> bool {
        (1..=enabled).all(|other| self.at(other, fired) >= 0)
    }

    /// Returns the domain after the transition at index `fired` has fired first. Each transition of
    /// `after` either keeps the clock of its index here, or is newly enabled. The beginning is
    /// kept.
    pub fn after_firing(
        &self,
        times: &Times,
        fired: usize,
        enabled: usize,
        after: &[(u32, Option<usize>)],
    ) -> Self {
        let beginning = (self.size > enabled + 1).then_some(enabled + 1);
        let size = 1 + after.len() + usize::from(beginning.is_some());
        let mut next = Self { size, bounds: vec![0; size * size].into() };
        let old: Vec<Option<usize>> =
            after.iter().map(|a| a.1).chain(beginning.map(Some)).collect();
        for (index, old) in old.iter().enumerate() {
            let (upper, lower) = match old {
                Some(old) => {
                    // Strong time: a transition that stays enabled fires no earlier than this
                    // firing.
                    let first = (1..=enabled).map(|other| self.at(other, *old)).min();
                    (self.at(*old, fired), first.unwrap_or(0))
                }
                None => {
                    let (earliest, latest) = times.intervals[after[index].0 as usize];
                    (latest, -earliest)
                }
            };
            next.set_bound(index + 1, 0, upper);
            next.set_bound(0, index + 1, lower);
        }
        next.join_by_now(1..size);
        for (x, old_x) in old.iter().enumerate() {
            for (y, old_y) in old.iter().enumerate() {
                if let (Some(old_x), Some(old_y)) = (old_x, old_y) {
                    let bound = next.at(x + 1, y + 1).min(self.at(*old_x, *old_y));
                    next.set_bound(x + 1, y + 1, bound);
                }
            }
        }
        next
    }

    fn join_by_now(&mut self, range: std::ops::Range<usize>) {
        for x in range.clone() {
            for y in range.clone().filter(|y| *y != x) {
                self.set_bound(x, y, add_bounds(self.at(x, 0), self.at(0, y)));
            }
        }
    }

    /// Splits off the beginning: returns the domain without it, its row and its column.
    pub fn split_beginning(&self) -> (Self, Vec<i64>, Vec<i64>) {
        let size = self.size - 1;
        let core = (0..size).flat_map(|x| (0..size).map(move |y| (x, y)));
        let core = core.map(|(x, y)| self.at(x, y)).collect();
        let row = (0..size).map(|y| self.at(size, y)).collect();
        let column = (0..size).map(|x| self.at(x, size)).collect();
        (Self { size, bounds: core }, row, column)
    }

    /// Removes the upper bound of the time since the beginning.
    pub fn forget_latest(&mut self) {
        let beginning = self.size - 1;
        (0..beginning).for_each(|x| self.set_bound(x, beginning, NEVER));
    }

    /// Removes the lower bound of the time since the beginning.
    pub fn forget_earliest(&mut self) {
        let beginning = self.size - 1;
        (0..beginning).for_each(|y| self.set_bound(beginning, y, NEVER));
    }

    /// Returns the least time since the beginning.
    pub fn elapsed_at_least(&self) -> i64 {
        -self.at(self.size - 1, 0)
    }

    /// Returns the most time since the beginning; [`NEVER`] if there is no limit.
    pub fn elapsed_at_most(&self) -> i64 {
        self.at(0, self.size - 1)
    }
}

/// Adds two bounds; a sum beyond the range of integers counts as no bound.
fn add_bounds(a: i64, b: i64) -> i64 {
    if a == NEVER || b == NEVER { NEVER } else { a.saturating_add(b).max(-LONGEST * 4) }
}
