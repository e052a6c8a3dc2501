//! Curves from one point to another, as points on them.

use eframe::egui::{Pos2, Vec2};

/// How far a curve goes straight on at its ends, at least and at most.
const MIN_REACH: f32 = 30.0;
const MAX_REACH: f32 = 220.0;
/// Between a block and a wire that leads back below it.
pub(super) const BELOW: f32 = 22.0;
/// Most pieces of the curve of a wire.
const MAX_PIECES: usize = 24;

/// A smooth line that passes points from left to right.
pub(super) fn through(
    [(from, out), (to, into)]: [(Pos2, Vec2); 2],
    via: &[Pos2],
    pieces: usize,
) -> Vec<Pos2> {
    const RIGHT: Vec2 = Vec2::new(1.0, 0.0);
    let mut points = Vec::new();
    let mut start = (from, out);
    let each = (pieces / (via.len() + 1)).max(4);
    for at in via {
        points.extend(curve([start, (*at, -RIGHT)], each));
        start = (*at, RIGHT);
    }
    points.extend(curve([start, (to, into)], each));
    points
}

/// A line out to the right, below, and back in from the left, with round corners.
pub(super) fn around(from: Pos2, to: Pos2, low: f32, away: f32) -> Vec<Pos2> {
    let corners = [
        from,
        Pos2::new(from.x + away, from.y),
        Pos2::new(from.x + away, low),
        Pos2::new(to.x - away, low),
        Pos2::new(to.x - away, to.y),
        to,
    ];
    let mut points = vec![from];
    for at in 1..corners.len() - 1 {
        let (before, corner, after) = (corners[at - 1], corners[at], corners[at + 1]);
        let reach =
            ((before - corner).length() / 2.0).min((after - corner).length() / 2.0).min(14.0);
        let enters = corner + (before - corner).normalized() * reach;
        let leaves = corner + (after - corner).normalized() * reach;
        for n in 0..=4 {
            let t = n as f32 / 4.0;
            let (a, b) = (enters + (corner - enters) * t, corner + (leaves - corner) * t);
            points.push(a + (b - a) * t);
        }
    }
    points.push(to);
    points
}

/// The points of a smooth line from one end to the other, each with its direction there.
pub fn curve([(from, out), (to, into)]: [(Pos2, Vec2); 2], pieces: usize) -> Vec<Pos2> {
    if pieces <= 1 {
        return vec![from, to];
    }
    let [b, c] = controls([(from, out), (to, into)]);
    let pieces = pieces.min(MAX_PIECES);
    let point = |n: usize| {
        let t = n as f32 / pieces as f32;
        let u = 1.0 - t;
        let (from, b, c, to) = (from.to_vec2(), b.to_vec2(), c.to_vec2(), to.to_vec2());
        (from * (u * u * u) + b * (3.0 * u * u * t) + c * (3.0 * u * t * t) + to * (t * t * t))
            .to_pos2()
    };
    (0..=pieces).map(point).collect()
}

/// The two middle control points of the cubic curve.
pub(super) fn controls([(from, out), (to, into)]: [(Pos2, Vec2); 2]) -> [Pos2; 2] {
    let apart = to - from;
    let reach = apart.length() * 0.4;
    let reach = reach.clamp(MIN_REACH.min(apart.length() / 2.0), MAX_REACH);
    [from + out * reach, to + into * reach]
}

/// How far a point is from a line of points.
pub(super) fn distance(points: &[Pos2], at: Pos2) -> f32 {
    let pieces = points.windows(2).map(|piece| {
        let (a, b) = (piece[0], piece[1]);
        let along = b - a;
        let share = if along.length_sq() > 0.0 {
            ((at - a).dot(along) / along.length_sq()).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (at - (a + along * share)).length()
    });
    pieces.fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_begins_and_ends_at_its_ends() {
        let ends = [
            (Pos2::new(0.0, 0.0), Vec2::new(1.0, 0.0)),
            (Pos2::new(200.0, 80.0), Vec2::new(-1.0, 0.0)),
        ];
        let points = curve(ends, 16);
        assert_eq!(points.len(), 17);
        assert_eq!((points[0], points[16]), (ends[0].0, ends[1].0));
        assert!(points[1].y.abs() < points[1].x, "it leaves to the right");
        assert_eq!(curve(ends, 1).len(), 2);
    }

    #[test]
    fn the_distance_is_to_the_nearest_piece() {
        let points = [Pos2::new(0.0, 0.0), Pos2::new(10.0, 0.0), Pos2::new(10.0, 10.0)];
        assert_eq!(distance(&points, Pos2::new(5.0, 3.0)), 3.0);
        assert_eq!(distance(&points, Pos2::new(12.0, 5.0)), 2.0);
    }
}
