//! What distinguishes the kinds of zones without colours: hatching, ticks and dashes. Points of the
//! window in, lines of the window out.

use eframe::egui::{Pos2, Rect, Vec2};

/// The parts within a polygon of parallel lines in a direction, `step` apart. The lines are those
/// of the polygon's first corner, so that they move with it.
pub fn hatch(corners: &[Pos2], shown: Rect, direction: Vec2, step: f32) -> Vec<[Pos2; 2]> {
    let Some(first) = corners.first() else { return Vec::new() };
    let area = Rect::from_points(corners).intersect(shown);
    if !area.is_positive() {
        return Vec::new();
    }
    let across = direction.rot90();
    let offset = |at: Pos2| (at - *first).dot(across);
    let ends = [area.left_top(), area.right_top(), area.left_bottom(), area.right_bottom()];
    let (low, high) = ends
        .into_iter()
        .map(offset)
        .fold((f32::MAX, f32::MIN), |(low, high), at| (low.min(at), high.max(at)));
    let mut lines = Vec::new();
    for number in (low / step).ceil() as i32..=(high / step).floor() as i32 {
        // Not through a corner, where a crossing would count twice.
        let at = (number as f32 + 0.37) * step;
        let mut crossings: Vec<f32> = Vec::new();
        for (one, other) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let (from, to) = (offset(*one), offset(*other));
            if (from > at) != (to > at) {
                let crossing = *one + (*other - *one) * ((at - from) / (to - from));
                crossings.push((crossing - *first).dot(direction));
            }
        }
        crossings.sort_by(f32::total_cmp);
        let place = |along: f32| *first + direction * along + across * at;
        lines.extend(crossings.chunks_exact(2).map(|pair| [place(pair[0]), place(pair[1])]));
    }
    lines
}

/// Ticks from the boundary of a polygon inwards, `step` apart.
pub fn inward_ticks(corners: &[Pos2], shown: Rect, step: f32, length: f32) -> Vec<[Pos2; 2]> {
    let next = corners.iter().cycle().skip(1);
    let turn: f32 = corners.iter().zip(next.clone()).map(|(a, b)| a.x * b.y - b.x * a.y).sum();
    let sides = corners.iter().zip(next);
    sides.flat_map(|(from, to)| ticks([*from, *to], shown, step, length * turn.signum())).collect()
}

/// Ticks from a line to the left of its direction (in a window whose y axis points down: to the
/// right on the screen), `step` apart.
pub fn ticks([from, to]: [Pos2; 2], shown: Rect, step: f32, length: f32) -> Vec<[Pos2; 2]> {
    let along = to - from;
    let whole = along.length();
    if whole < 1.0 {
        return Vec::new();
    }
    let direction = along / whole;
    let inward = Vec2::new(-direction.y, direction.x) * length;
    let count = ((whole / step) as usize).min(4_000);
    let starts = (0..=count).map(|number| from + direction * (number as f32 + 0.5) * step);
    let starts = starts.filter(|at| (*at - from).length() <= whole && shown.contains(*at));
    starts.map(|at| [at, at + inward]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHOWN: Rect = Rect { min: Pos2::ZERO, max: Pos2::new(500.0, 500.0) };

    fn square() -> Vec<Pos2> {
        [(10.0, 10.0), (110.0, 10.0), (110.0, 110.0), (10.0, 110.0)]
            .map(|(x, y)| Pos2::new(x, y))
            .to_vec()
    }

    #[test]
    fn hatching_stays_within_the_polygon() {
        let lines = hatch(&square(), SHOWN, Vec2::new(1.0, 0.0), 10.0);
        assert_eq!(lines.len(), 10);
        let area = Rect::from_points(&square()).expand(0.01);
        assert!(lines.iter().flatten().all(|at| area.contains(*at)));
        let slanted = hatch(&square(), SHOWN, Vec2::splat(0.5_f32.sqrt()), 10.0);
        assert!(slanted.iter().flatten().all(|at| area.contains(*at)) && slanted.len() > 10);
    }

    #[test]
    fn what_is_not_shown_has_no_lines() {
        let far = Rect::from_min_size(Pos2::new(1e5, 1e5), Vec2::splat(10.0));
        assert!(hatch(&square(), far, Vec2::new(1.0, 0.0), 10.0).is_empty());
        assert!(inward_ticks(&square(), far, 10.0, 5.0).is_empty());
        assert!(hatch(&[], SHOWN, Vec2::new(1.0, 0.0), 10.0).is_empty());
    }

    #[test]
    fn ticks_point_inwards_whichever_way_the_corners_turn() {
        let mut corners = square();
        for _ in 0..2 {
            let ticks = inward_ticks(&corners, SHOWN, 20.0, 5.0);
            assert_eq!(ticks.len(), 20);
            let area = Rect::from_points(&corners);
            assert!(ticks.iter().all(|[_, end]| area.contains(*end)));
            corners.reverse();
        }
    }
}
