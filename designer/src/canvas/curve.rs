//! Curves from one point to another, as points on them.

use eframe::egui::{Pos2, Vec2};

/// How far a curve goes straight on at its ends, at least and at most.
const MIN_REACH: f32 = 30.0;
const MAX_REACH: f32 = 220.0;
/// Between a block and a wire that leads back below it.
pub(super) const BELOW: f32 = 22.0;
/// Largest distance from a corner at which it begins to be round.
const MAX_ROUND: f32 = 14.0;
/// Most pieces of the curve of a wire.
const MAX_PIECES: usize = 24;

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
    rounded(&corners)
}

/// A line from corner to corner, each of them round.
pub(super) fn rounded(corners: &[Pos2]) -> Vec<Pos2> {
    let [first, .., last] = corners else { return corners.to_vec() };
    let mut points = vec![*first];
    for three in corners.windows(3) {
        let (before, corner, after) = (three[0], three[1], three[2]);
        let reach = ((before - corner).length() / 2.0).min((after - corner).length() / 2.0);
        let reach = reach.min(MAX_ROUND);
        let enters = corner + (before - corner).normalized() * reach;
        let leaves = corner + (after - corner).normalized() * reach;
        for n in 0..=4 {
            let t = n as f32 / 4.0;
            let (a, b) = (enters + (corner - enters) * t, corner + (leaves - corner) * t);
            points.push(a + (b - a) * t);
        }
    }
    points.push(*last);
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

/// Returns the point at a share of the length of a wire.
pub fn point_at(points: &[Pos2], share: f32) -> Pos2 {
    let lengths = points.windows(2).map(|pair| pair[0].distance(pair[1]));
    let mut rest = share * lengths.sum::<f32>();
    for pair in points.windows(2) {
        let length = pair[0].distance(pair[1]);
        if rest <= length {
            return pair[0].lerp(pair[1], rest / length.max(f32::EPSILON));
        }
        rest -= length;
    }
    points.last().copied().unwrap_or_default()
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
    fn a_point_at_a_share_of_a_line_is_found_by_its_length() {
        let points = [Pos2::new(0.0, 0.0), Pos2::new(10.0, 0.0), Pos2::new(10.0, 30.0)];
        for (share, expected) in
            [(0.0, Pos2::new(0.0, 0.0)), (0.25, Pos2::new(10.0, 0.0)), (0.5, Pos2::new(10.0, 10.0))]
        {
            assert!(point_at(&points, share).distance(expected) < 0.01, "{share}");
        }
        assert!(point_at(&points, 1.0).distance(points[2]) < 0.01);
    }

    #[test]
    fn the_distance_is_to_the_nearest_piece() {
        let points = [Pos2::new(0.0, 0.0), Pos2::new(10.0, 0.0), Pos2::new(10.0, 10.0)];
        assert_eq!(distance(&points, Pos2::new(5.0, 3.0)), 3.0);
        assert_eq!(distance(&points, Pos2::new(12.0, 5.0)), 2.0);
    }
}
