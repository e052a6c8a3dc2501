//! A simple temporal network: moments, and bounds on the time between two of them (Dechter, Meiri &
//! Pearl, "Temporal constraint networks", Artificial Intelligence 49, 1991). Pure; times are whole
//! nanoseconds, so that sums are exact.

/// A bound: `to` comes at most `at_most_ns` after `from`. A lower bound is one of the other direction
/// with a negative time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimeBound {
    /// The number of the first moment.
    pub(crate) from: usize,
    /// The number of the second moment.
    pub(crate) to: usize,
    /// The most time between them.
    pub(crate) at_most_ns: i128,
}

/// Bounds that exclude each other: a cycle whose sum is negative.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NegativeCycle {
    /// The numbers of its bounds, each ending where the next begins.
    pub(crate) bounds: Vec<usize>,
    /// By how much they exclude each other.
    pub(crate) excess_ns: i128,
}

/// Returns a cycle of bounds that exclude each other; none if all moments can be so that all bounds are
/// kept. Bellman and Ford's algorithm: O(moments × bounds).
pub(crate) fn find_negative_cycle(moments: usize, bounds: &[TimeBound]) -> Option<NegativeCycle> {
    // As from a source with a bound of 0 to every moment.
    let mut least_ns = vec![0_i128; moments];
    let mut through: Vec<Option<usize>> = vec![None; moments];
    let mut changed = None;
    for _ in 0..=moments {
        changed = None;
        for (number, bound) in bounds.iter().enumerate() {
            let reached_ns = least_ns[bound.from] + bound.at_most_ns;
            if reached_ns < least_ns[bound.to] {
                least_ns[bound.to] = reached_ns;
                through[bound.to] = Some(number);
                changed = Some(bound.to);
            }
        }
        changed?;
    }
    // A change in the last round follows from a cycle; that many steps back, the moment is on it.
    let step_back = |moment: usize| through[moment].map(|number| bounds[number].from);
    let mut on_cycle = changed?;
    for _ in 0..moments {
        on_cycle = step_back(on_cycle)?;
    }
    let mut cycle = Vec::new();
    let mut moment = on_cycle;
    loop {
        let number = through[moment]?;
        cycle.push(number);
        moment = bounds[number].from;
        if moment == on_cycle {
            break;
        }
    }
    cycle.reverse();
    let sum_ns: i128 = cycle.iter().map(|number| bounds[*number].at_most_ns).sum();
    Some(NegativeCycle { bounds: cycle, excess_ns: -sum_ns })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether some cycle is negative, by Floyd and Warshall's algorithm.
    fn is_inconsistent(moments: usize, bounds: &[TimeBound]) -> bool {
        const NONE: i128 = i128::MAX / 4;
        let mut least = vec![vec![NONE; moments]; moments];
        for (moment, row) in least.iter_mut().enumerate() {
            row[moment] = 0;
        }
        for bound in bounds {
            let cell = &mut least[bound.from][bound.to];
            *cell = (*cell).min(bound.at_most_ns);
        }
        for middle in 0..moments {
            for from in 0..moments {
                for to in 0..moments {
                    let through = least[from][middle].saturating_add(least[middle][to]);
                    least[from][to] = least[from][to].min(through);
                }
            }
        }
        (0..moments).any(|moment| least[moment][moment] < 0)
    }

    #[test]
    fn a_cycle_is_found_if_and_only_if_there_is_one() {
        let mut random = fastrand::Rng::with_seed(19);
        let (mut consistent, mut inconsistent) = (0, 0);
        for _ in 0..5_000 {
            let moments = random.usize(1..9);
            let bounds: Vec<_> = (0..random.usize(0..20))
                .map(|_| TimeBound {
                    from: random.usize(..moments),
                    to: random.usize(..moments),
                    at_most_ns: i128::from(random.i32(-6..20)),
                })
                .collect();
            let found = find_negative_cycle(moments, &bounds);
            assert_eq!(found.is_some(), is_inconsistent(moments, &bounds), "{bounds:?}");
            let Some(cycle) = found else {
                consistent += 1;
                continue;
            };
            inconsistent += 1;
            let mut sum = 0;
            for (index, number) in cycle.bounds.iter().enumerate() {
                let next = cycle.bounds[(index + 1) % cycle.bounds.len()];
                assert_eq!(bounds[*number].to, bounds[next].from, "{cycle:?}");
                sum += bounds[*number].at_most_ns;
            }
            assert!(sum < 0 && cycle.excess_ns == -sum, "{cycle:?}");
        }
        assert!(consistent > 1_000 && inconsistent > 1_000, "{consistent}, {inconsistent}");
    }
}
