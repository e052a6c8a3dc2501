//! When the firings of a sequence happen: the earliest or the latest moments that the net's times
//! allow in this order, if they allow it.
//!
//! Each firing's moment is an unknown; clocks and the order are differences between two of them
//! (Berthomieu and Diaz, 1991, section III), solved as longest ways by relaxation (Bellman-Ford).

use std::time::Duration;

use armor_petri::{Net, NetTransition, PlaceId, TransitionId};

/// Firings that are looked at; a longer sequence is shown without times.
const MAX_FIRINGS: usize = 2000;

/// `unknown[later] >= unknown[earlier] + least`, in nanoseconds.
struct Difference {
    later: usize,
    earlier: usize,
    least: i128,
}

/// Which of the moments that the times allow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// The earliest.
    #[default]
    Earliest,
    /// The latest; where there is none, the earliest.
    Latest,
}

/// The moment of each firing, counted from the start. `None` if the sequence cannot happen in this
/// order with the net's times, or at all.
pub fn schedule(net: &Net, sequence: &[TransitionId], pace: Pace) -> Option<Vec<Duration>> {
    if sequence.len() > MAX_FIRINGS {
        return None;
    }
    let differences = differences(net, sequence)?;
    let earliest = earliest(&differences, sequence.len() + 1)?;
    let moments = match pace {
        Pace::Earliest => earliest,
        Pace::Latest => latest(&differences, sequence.len() + 1).unwrap_or(earliest),
    };
    let duration = |ns: &i128| Duration::from_nanos(u64::try_from(*ns).unwrap_or(u64::MAX));
    Some(moments[1..].iter().map(duration).collect())
}

fn earliest(differences: &[Difference], count: usize) -> Option<Vec<i128>> {
    let mut moments = vec![0_i128; count];
    for _ in 0..=count {
        let mut is_settled = true;
        for Difference { later, earlier, least } in differences {
            let wanted = moments[*earlier].saturating_add(*least);
            if moments[*later] < wanted {
                moments[*later] = wanted;
                is_settled = false;
            }
        }
        // The start cannot be put off.
        if moments[0] > 0 {
            return None;
        }
        if is_settled {
            return Some(moments);
        }
    }
    None
}

/// None if something may be delayed without end.
fn latest(differences: &[Difference], count: usize) -> Option<Vec<i128>> {
    let mut moments: Vec<Option<i128>> = vec![None; count];
    moments[0] = Some(0);
    for _ in 0..=count {
        let mut is_settled = true;
        for Difference { later, earlier, least } in differences {
            let Some(most) = moments[*later].map(|later| later - least) else { continue };
            if moments[*earlier].is_none_or(|known| most < known) {
                moments[*earlier] = Some(most);
                is_settled = false;
            }
        }
        if is_settled {
            return moments.into_iter().collect();
        }
    }
    None
}

/// What the clocks of all enabled transitions and the order say of the moments; moment 0 is the
/// start, moment `n` the n-th firing.
fn differences(net: &Net, sequence: &[TransitionId]) -> Option<Vec<Difference>> {
    let mut marking = net.initial().to_vec();
    let mut since: Vec<Option<usize>> =
        net.transitions().iter().map(|t| is_enabled(t, &marking).then_some(0)).collect();
    let mut found = Vec::new();
    for (number, id) in sequence.iter().enumerate() {
        let now = number + 1;
        found.push(Difference { later: now, earlier: number, least: 0 });
        let fired = net.transition(*id);
        let enabled = since[id.index()]?;
        let earliest = fired.interval.earliest.as_nanos() as i128;
        found.push(Difference { later: now, earlier: enabled, least: earliest });
        for (other, since) in net.transitions().iter().zip(&since) {
            // A gate may open at any later time.
            if let (Some(since), Some(latest), false) = (since, other.interval.latest, other.gated)
            {
                let latest = latest.as_nanos() as i128;
                found.push(Difference { later: *since, earlier: now, least: -latest });
            }
        }
        let between = taken(fired, &marking)?;
        marking = put(fired, &between)?;
        for (n, other) in net.transitions().iter().enumerate() {
            let goes_on = n != id.index() && is_enabled(other, &between);
            since[n] = match since[n] {
                _ if !is_enabled(other, &marking) => None,
                Some(before) if goes_on => Some(before),
                _ => Some(now),
            };
        }
    }
    Some(found)
}

pub(super) fn is_enabled(transition: &NetTransition, marking: &[u32]) -> bool {
    let holds = |(place, weight): &(PlaceId, u32)| marking[place.index()] >= *weight;
    let is_below = |(place, weight): &(PlaceId, u32)| marking[place.index()] < *weight;
    transition.inputs.iter().chain(&transition.reads).all(holds)
        && transition.inhibitors.iter().all(is_below)
}

fn taken(transition: &NetTransition, marking: &[u32]) -> Option<Vec<u32>> {
    let mut left = marking.to_vec();
    for (place, weight) in &transition.inputs {
        left[place.index()] = left[place.index()].checked_sub(*weight)?;
    }
    transition.resets.iter().for_each(|place| left[place.index()] = 0);
    Some(left)
}

fn put(transition: &NetTransition, left: &[u32]) -> Option<Vec<u32>> {
    let mut marking = left.to_vec();
    for (place, weight) in &transition.outputs {
        marking[place.index()] = marking[place.index()].checked_add(*weight)?;
    }
    Some(marking)
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_petri::{FiringInterval, NetBuilder};

    const SECOND: Duration = Duration::from_secs(1);

    fn within(earliest: u32, latest: u32) -> FiringInterval {
        FiringInterval { earliest: earliest * SECOND, latest: Some(latest * SECOND) }
    }

    /// Two clocks side by side; `c` follows `a`.
    fn clocks(a: FiringInterval, b: FiringInterval, c: FiringInterval) -> (Net, [TransitionId; 3]) {
        let mut net = NetBuilder::default();
        let (one, two, three) = (net.place("one", 1), net.place("two", 1), net.place("three", 0));
        let a = net.transition("a").input(one, 1).output(three, 1).interval(a).id();
        let b = net.transition("b").input(two, 1).interval(b).id();
        let c = net.transition("c").input(three, 1).interval(c).id();
        (net.build().unwrap(), [a, b, c])
    }

    #[test]
    fn a_firing_is_put_off_so_that_what_follows_can_keep_its_deadline() {
        let (net, [a, b, c]) = clocks(within(0, 9), within(5, 5), within(0, 1));
        assert_eq!(
            schedule(&net, &[a, b, c], Pace::Earliest),
            Some(vec![4 * SECOND, 5 * SECOND, 5 * SECOND])
        );
        assert_eq!(
            schedule(&net, &[a, c, b], Pace::Earliest),
            Some(vec![Duration::ZERO, Duration::ZERO, 5 * SECOND])
        );
    }

    #[test]
    fn what_the_times_do_not_allow_has_no_schedule() {
        let (net, [a, b, c]) = clocks(within(2, 3), within(5, 9), within(0, 1));
        assert_eq!(schedule(&net, &[b, a], Pace::Earliest), None, "a must fire by 3 s");
        assert_eq!(schedule(&net, &[c], Pace::Earliest), None, "a token is missing");
        assert_eq!(schedule(&net, &[a, c], Pace::Earliest), Some(vec![2 * SECOND, 2 * SECOND]));
    }

    #[test]
    fn the_latest_moments_are_as_late_as_all_deadlines_allow() {
        let (net, [a, b, c]) = clocks(within(0, 9), within(5, 7), within(0, 1));
        let latest = schedule(&net, &[a, b, c], Pace::Latest);
        assert_eq!(latest, Some(vec![7 * SECOND, 7 * SECOND, 8 * SECOND]));
        let (net, [a, ..]) = clocks(FiringInterval::UNTIMED, within(5, 5), within(0, 1));
        let endless = FiringInterval { earliest: 2 * SECOND, latest: None };
        assert_eq!(
            schedule(&net, &[a], Pace::Latest),
            Some(vec![5 * SECOND]),
            "b must fire by 5 s"
        );
        let (net, [a, ..]) = clocks(endless, endless, within(0, 1));
        assert_eq!(
            schedule(&net, &[a], Pace::Latest),
            Some(vec![2 * SECOND]),
            "there is no latest"
        );
    }
}
