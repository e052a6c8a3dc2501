//! The items of a planned route in the order in which they are carried out: counted repetitions are
//! written out, so that each pass has legs of its own, with their own exits, limits and times. Pure.

use armor_exchange::PlanItem;

/// Most items that repetitions may add before the route is certainly too long.
pub(super) const MOST_REPEATED: usize = 4_096;

/// Returns the indices of the items in the order in which they are carried out, without the
/// repetitions themselves; nothing if they are too many. A repetition without end is passed over.
///
/// As autopilots do, each repetition is counted once for the whole mission.
pub(super) fn play_items(items: &[PlanItem]) -> Option<Vec<usize>> {
    let mut done = vec![0_u32; items.len()];
    let (mut order, mut index, mut played) = (Vec::new(), 0, 0);
    while let Some(item) = items.get(index) {
        played += 1;
        if played > items.len() + MOST_REPEATED {
            return None;
        }
        match item {
            PlanItem::Repeat { to, times: Some(times) } if done[index] < *times => {
                done[index] += 1;
                index = *to;
                continue;
            }
            PlanItem::Repeat { .. } => {}
            _ => order.push(index),
        }
        index += 1;
    }
    Some(order)
}

/// The items in the order of the plan, without repetitions.
pub(super) fn pass_once(items: &[PlanItem]) -> Vec<usize> {
    let is_repetition = |index: &usize| matches!(items[*index], PlanItem::Repeat { .. });
    (0..items.len()).filter(|index| !is_repetition(index)).collect()
}

/// What is noted of a repetition. `written_out` states whether the counted ones are written out.
pub(super) fn describe_repetition(
    index: usize,
    to: usize,
    times: Option<u32>,
    written_out: Result<(), String>,
) -> Option<String> {
    let what = match times {
        Some(0) => return None,
        _ if to >= index => format!("the jump to item {}", to + 1),
        None => format!("the repetition of items {} to {index} without end", to + 1),
        Some(times) => format!("the repetition of items {} to {index}, {times} times,", to + 1),
    };
    Some(match (times, written_out) {
        (None, _) => format!("{what} has no counterpart: the items are driven once"),
        (_, Ok(())) => format!("{what} is written out"),
        (_, Err(reason)) => format!("{what} is left out: {reason}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn repeat(to: usize, times: Option<u32>) -> PlanItem {
        PlanItem::Repeat { to, times }
    }

    fn check(items: &[PlanItem], expected: &[usize]) {
        assert_eq!(play_items(items).as_deref(), Some(expected), "{items:?}");
    }

    #[test]
    fn repetitions_are_counted_for_the_whole_mission() {
        let go = || PlanItem::Delay(1.0);
        check(&[go(), go(), repeat(0, Some(2)), go()], &[0, 1, 0, 1, 0, 1, 3]);
        // The inner one is spent when the outer one repeats it.
        check(&[go(), repeat(0, Some(1)), go(), repeat(0, Some(1))], &[0, 0, 2, 0, 2]);
        check(&[repeat(2, Some(1)), go(), go()], &[2]);
        check(&[go(), repeat(0, Some(0)), repeat(0, None), go()], &[0, 3]);
        // A jump to itself.
        check(&[go(), repeat(1, Some(3)), go()], &[0, 2]);
    }

    #[test]
    fn too_many_repetitions_are_not_written_out() {
        let go = || PlanItem::Delay(1.0);
        assert_eq!(play_items(&[go(), repeat(0, Some(1_000_000_000))]), None);
        assert_eq!(pass_once(&[go(), repeat(0, Some(1_000_000_000)), go()]), [0, 2]);
    }
}
