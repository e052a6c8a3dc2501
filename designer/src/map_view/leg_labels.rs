//! Where the text of a leg has room: on its line, or at its outer side, and not over other legs.

use eframe::egui::{Align2, Pos2, Rect, Vec2};

use crate::item::Item;
use crate::map_view::hit::Sight;
use crate::map_view::scene::{SceneItem, SceneShape};

/// The line of a leg in the window.
pub(super) fn leg_line(sight: &Sight<'_>, entry: &SceneItem) -> Option<(Item, [Pos2; 2])> {
    match &entry.shape {
        SceneShape::Leg { from: Some(from), to } => Some((entry.item, sight.leg_ends(*from, *to))),
        _ => None,
    }
}

/// Where the text of a leg may be at the right of its direction, where no leg back is.
pub(super) fn places_beside(from: Pos2, to: Pos2) -> impl Iterator<Item = (Align2, Pos2)> {
    let way = (to - from).normalized();
    let right = Vec2::new(-way.y, way.x);
    let (align, offset) = match () {
        () if right.y.abs() > 0.7 => (Align2::CENTER_CENTER, right * 13.0),
        () if right.x > 0.0 => (Align2::LEFT_CENTER, right * 8.0),
        () => (Align2::RIGHT_CENTER, right * 8.0),
    };
    [0.5, 0.3, 0.7].into_iter().map(move |share| (align, from + (to - from) * share + offset))
}

/// Whether a line passes through an area.
pub(super) fn meets(area: Rect, line: [Pos2; 2]) -> bool {
    shares_within(area, line).is_some()
}

/// The shares of a line at which it enters an area and leaves it; none if it does not pass through
/// (Liang & Barsky, ACM Transactions on Graphics 3, 1984).
pub(super) fn shares_within(area: Rect, [from, to]: [Pos2; 2]) -> Option<[f32; 2]> {
    let (way, mut first, mut last) = (to - from, 0.0_f32, 1.0_f32);
    for axis in 0..2 {
        let (low, high) = (area.min[axis] - from[axis], area.max[axis] - from[axis]);
        if way[axis].abs() < 1e-6 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            continue;
        }
        let (one, other) = (low / way[axis], high / way[axis]);
        (first, last) = (first.max(one.min(other)), last.min(one.max(other)));
    }
    (first <= last).then_some([first, last])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_meets_an_area_or_passes_it() {
        let area = Rect::from_min_max(Pos2::new(10.0, 10.0), Pos2::new(20.0, 14.0));
        let line = |from: [f32; 2], to: [f32; 2]| meets(area, [from.into(), to.into()]);
        assert!(line([0.0, 12.0], [30.0, 12.0]) && line([15.0, 0.0], [15.0, 30.0]));
        assert!(line([12.0, 12.0], [12.0, 12.0]) && line([0.0, 0.0], [24.0, 20.0]));
        assert!(!line([0.0, 15.0], [30.0, 15.0]) && !line([0.0, 12.0], [9.0, 12.0]));
        assert!(!line([0.0, 20.0], [9.0, 0.0]));
        let shares = shares_within(area, [[0.0, 12.0].into(), [40.0, 12.0].into()]);
        assert_eq!(shares, Some([0.25, 0.5]));
    }
}
