//! The earliest and latest times of moments that each come as soon as all that they wait for has come.

/// A moment waits for another one, and for a duration after it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimeWait {
    /// The number of the moment that it waits for.
    pub(crate) after: usize,
    /// The shortest duration.
    pub(crate) least_ns: i128,
    /// The nominal one, if there is a longest one.
    pub(crate) nominal_ns: Option<i128>,
    /// The longest one, if there is one.
    pub(crate) most_ns: Option<i128>,
}

impl TimeWait {
    /// A duration that is known exactly.
    pub(crate) fn exact(after: usize, ns: i128) -> Self {
        Self { after, least_ns: ns, nominal_ns: Some(ns), most_ns: Some(ns) }
    }
}

/// Returns the moments in an order in which each comes after those that it waits for; else the moments
/// of a circle, each waiting for the next. `waits[moment]` is what it waits for.
pub(crate) fn sort_moments(waits: &[Vec<TimeWait>]) -> Result<Vec<usize>, Vec<usize>> {
    #[derive(Clone, Copy, PartialEq)]
    enum Mark {
        New,
        Open,
        Done,
    }
    let mut marks = vec![Mark::New; waits.len()];
    let mut order = Vec::with_capacity(waits.len());
    for first in 0..waits.len() {
        if marks[first] != Mark::New {
            continue;
        }
        // Depth first without recursion: a moment, and how many of its waits have been followed.
        let mut path = vec![(first, 0)];
        marks[first] = Mark::Open;
        while let Some((moment, followed)) = path.last_mut() {
            let moment = *moment;
            let Some(wait) = waits[moment].get(*followed) else {
                marks[moment] = Mark::Done;
                order.push(moment);
                path.pop();
                continue;
            };
            *followed += 1;
            match marks[wait.after] {
                Mark::New => {
                    marks[wait.after] = Mark::Open;
                    path.push((wait.after, 0));
                }
                Mark::Open => {
                    let begin = path.iter().position(|step| step.0 == wait.after).unwrap_or(0);
                    return Err(path[begin..].iter().map(|step| step.0).collect());
                }
                Mark::Done => {}
            }
        }
    }
    Ok(order)
}

/// Returns how long after `anchor` each moment comes at least; none where it may come without it.
pub(crate) fn least_after(
    anchor: usize,
    order: &[usize],
    waits: &[Vec<TimeWait>],
) -> Vec<Option<i128>> {
    let mut least = vec![None; waits.len()];
    for &moment in order {
        least[moment] = match moment == anchor {
            true => Some(0),
            false => {
                let after = |wait: &TimeWait| Some(least[wait.after]? + wait.least_ns);
                waits[moment].iter().filter_map(after).max()
            }
        };
    }
    least
}

/// Returns how long after the latest of the anchors each moment comes at most; none where something else
/// or a wait without end may delay it. `anchors` has a moment and its own time for each.
pub(crate) fn most_after(
    anchors: &[(usize, i128)],
    order: &[usize],
    waits: &[Vec<TimeWait>],
) -> Vec<Option<i128>> {
    time_moments(anchors, order, waits, |_, wait| wait.most_ns)
}

/// Returns the time of each moment when every wait takes one duration; none of a moment that something
/// without a duration delays. `anchors` has a moment and its own time for each; `duration` is given the
/// moment that waits.
pub(crate) fn time_moments(
    anchors: &[(usize, i128)],
    order: &[usize],
    waits: &[Vec<TimeWait>],
    duration: impl Fn(usize, &TimeWait) -> Option<i128>,
) -> Vec<Option<i128>> {
    let mut times = vec![None; waits.len()];
    for &moment in order {
        let anchor = anchors.iter().find(|anchor| anchor.0 == moment);
        times[moment] = match anchor {
            Some(anchor) => Some(anchor.1),
            None => {
                let mut latest = None;
                for wait in &waits[moment] {
                    let after = times[wait.after].zip(duration(moment, wait));
                    let Some((after, ns)) = after else {
                        latest = None;
                        break;
                    };
                    latest = latest.max(Some(after + ns));
                }
                latest
            }
        };
    }
    times
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random waits, each for moments before it; the first moment waits for nothing.
    fn draw(random: &mut fastrand::Rng) -> Vec<Vec<TimeWait>> {
        let mut waits = vec![Vec::new()];
        for moment in 1..random.usize(2..7) {
            let draw = |random: &mut fastrand::Rng| {
                let least_ns = i128::from(random.u8(0..5));
                let most_ns = Some(least_ns + i128::from(random.u8(0..3)));
                TimeWait { after: random.usize(..moment), least_ns, nominal_ns: most_ns, most_ns }
            };
            waits.push((0..random.usize(1..3)).map(|_| draw(random)).collect());
        }
        waits
    }

    /// The least and the greatest time of each moment over all whole durations.
    fn try_all(waits: &[Vec<TimeWait>]) -> Vec<(i128, i128)> {
        let mut found = vec![(i128::MAX, i128::MIN); waits.len()];
        let all: Vec<_> = waits.iter().flatten().collect();
        let choices: Vec<_> = all.iter().map(|it| it.most_ns.unwrap() - it.least_ns + 1).collect();
        for number in 0..choices.iter().product::<i128>() {
            let (mut rest, mut index, mut times) = (number, 0, vec![0; waits.len()]);
            for (moment, waits) in waits.iter().enumerate() {
                for wait in waits {
                    let duration = wait.least_ns + rest % choices[index];
                    (rest, index) = (rest / choices[index], index + 1);
                    times[moment] = times[wait.after].max(times[moment] - duration) + duration;
                }
                let range = &mut found[moment];
                *range = (range.0.min(times[moment]), range.1.max(times[moment]));
            }
        }
        found
    }

    #[test]
    fn the_extremes_are_those_of_all_durations() {
        let mut random = fastrand::Rng::with_seed(91);
        for _ in 0..300 {
            let waits = draw(&mut random);
            let order = sort_moments(&waits).expect("no circle");
            let (least, most) =
                (least_after(0, &order, &waits), most_after(&[(0, 0)], &order, &waits));
            for (moment, range) in try_all(&waits).into_iter().enumerate() {
                assert_eq!((least[moment], most[moment]), (Some(range.0), Some(range.1)));
            }
        }
    }

    #[test]
    fn a_circle_is_returned_in_its_order() {
        let wait = |after| TimeWait { after, least_ns: 0, nominal_ns: None, most_ns: None };
        let waits = [vec![wait(1)], vec![wait(3)], vec![], vec![wait(2), wait(0)]];
        assert_eq!(sort_moments(&waits), Err(vec![0, 1, 3]));
    }
}
