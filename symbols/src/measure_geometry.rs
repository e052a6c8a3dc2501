//! The geometry of lines and areas: parallels, marks along a line, hatching.

use crate::outline::Position;

/// The most marks along a line, and the most hatching lines of an area: more cannot be distinguished.
const MOST_MARKS: f64 = 1000.0;
/// How far a parallel's corner may stick out, in multiples of its distance.
const MITRE: f64 = 4.0;

fn distance(from: Position, to: Position) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}

/// The unit vector from one position to another; to the right if they coincide.
pub(crate) fn direction(from: Position, to: Position) -> Position {
    let length = distance(from, to);
    if length > 0.0 { [(to[0] - from[0]) / length, (to[1] - from[1]) / length] } else { [1.0, 0.0] }
}

/// The last position, and the last one before it that differs from it.
pub(crate) fn tip(positions: &[Position]) -> (Position, Position) {
    let tip = positions.last().copied().unwrap_or_default();
    let before = positions.iter().rev().find(|position| **position != tip).copied();
    (tip, before.unwrap_or(tip))
}

/// Both ends of a line, each with the position before it.
pub(crate) fn ends(positions: &[Position]) -> [(Position, Position); 2] {
    let reversed: Vec<Position> = positions.iter().rev().copied().collect();
    [tip(positions), tip(&reversed)]
}

fn length(positions: &[Position]) -> f64 {
    positions.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

/// The position half way along a line.
pub(crate) fn middle(positions: &[Position]) -> Position {
    let mut rest = length(positions) / 2.0;
    for pair in positions.windows(2) {
        let step = distance(pair[0], pair[1]);
        if step >= rest && step > 0.0 {
            let part = rest / step;
            return [
                pair[0][0] + part * (pair[1][0] - pair[0][0]),
                pair[0][1] + part * (pair[1][1] - pair[0][1]),
            ];
        }
        rest -= step;
    }
    positions.first().copied().unwrap_or_default()
}

/// A spacing near the wanted one that divides the line evenly into at most `MOST_MARKS` parts.
pub(crate) fn spacing(positions: &[Position], wanted: f64) -> f64 {
    let length = length(positions);
    let count = (length / wanted).round().clamp(1.0, MOST_MARKS);
    if length > 0.0 { length / count } else { wanted }
}

/// The middles of parts of this length along a line, each with the line's direction there.
pub(crate) fn marks(positions: &[Position], spacing: f64) -> Vec<(Position, Position)> {
    let mut marks = Vec::new();
    let mut next = spacing / 2.0;
    for pair in positions.windows(2) {
        let (step, along) = (distance(pair[0], pair[1]), direction(pair[0], pair[1]));
        while next <= step && (marks.len() as f64) < MOST_MARKS {
            marks.push(([pair[0][0] + along[0] * next, pair[0][1] + along[1] * next], along));
            next += spacing;
        }
        next -= step;
    }
    marks
}

/// A line parallel to this one, on its left if `by` is positive (with y down).
pub(crate) fn offset(positions: &[Position], by: f64) -> Vec<Position> {
    let last = positions.len().saturating_sub(1);
    let along = |index: usize| direction(positions[index], positions[index + 1]);
    positions
        .iter()
        .enumerate()
        .map(|(index, [x, y])| {
            if last == 0 {
                return [*x, *y];
            }
            let before = along(index.saturating_sub(1));
            let after = along(index.min(last - 1));
            let sum = [before[0] + after[0], before[1] + after[1]];
            let bisector = direction([0.0, 0.0], sum);
            // The corner of a parallel lies further out the sharper the turn is.
            let cosine = (before[0] * bisector[0] + before[1] * bisector[1]).max(1.0 / MITRE);
            let reach = by / cosine;
            [x + bisector[1] * reach, y - bisector[0] * reach]
        })
        .collect()
}

/// Left corner, tip and right corner of an arrow's head of this size, its tip set back by `back`.
pub(crate) fn arrow_head(tip: Position, along: Position, back: f64, size: f64) -> [Position; 3] {
    let at = |behind: f64, aside: f64| {
        [
            tip[0] - along[0] * behind + along[1] * aside,
            tip[1] - along[1] * behind - along[0] * aside,
        ]
    };
    [at(back + size, size * 0.8), at(back, 0.0), at(back + size, -size * 0.8)]
}

/// The centre of an area; the mean of the corners if it has no surface.
pub(crate) fn centroid(corners: &[Position]) -> Position {
    let count = corners.len().max(1) as f64;
    let mean =
        corners.iter().fold([0.0, 0.0], |sum, [x, y]| [sum[0] + x / count, sum[1] + y / count]);
    let (mut doubled, mut sum) = (0.0, [0.0, 0.0]);
    for (index, from) in corners.iter().enumerate() {
        let to = corners[(index + 1) % corners.len()];
        // Relative to the mean, so that large coordinates do not cancel.
        let (from, to) =
            ([from[0] - mean[0], from[1] - mean[1]], [to[0] - mean[0], to[1] - mean[1]]);
        let cross = from[0] * to[1] - to[0] * from[1];
        doubled += cross;
        sum = [sum[0] + (from[0] + to[0]) * cross, sum[1] + (from[1] + to[1]) * cross];
    }
    let centre = [mean[0] + sum[0] / (3.0 * doubled), mean[1] + sum[1] / (3.0 * doubled)];
    if centre.iter().all(|value| value.is_finite()) && doubled != 0.0 { centre } else { mean }
}

/// Slanted lines inside an area.
pub(crate) fn hatch(corners: &[Position], wanted: f64) -> Vec<[Position; 2]> {
    // Rotated by 45°, the lines are those of equal v = x + y.
    let rotated: Vec<Position> = corners.iter().map(|[x, y]| [x - y, x + y]).collect();
    let low = rotated.iter().map(|[_, v]| *v).fold(f64::MAX, f64::min);
    let high = rotated.iter().map(|[_, v]| *v).fold(f64::MIN, f64::max);
    let count = ((high - low) / (wanted * 2.0_f64.sqrt())).floor().clamp(0.0, MOST_MARKS);
    let mut lines = Vec::new();
    for index in 0..count as usize {
        let v = low + (high - low) * (index as f64 + 0.5) / count;
        let mut crossings: Vec<f64> = Vec::new();
        for (index, from) in rotated.iter().enumerate() {
            let to = rotated[(index + 1) % rotated.len()];
            if (from[1] > v) != (to[1] > v) {
                crossings.push(from[0] + (v - from[1]) / (to[1] - from[1]) * (to[0] - from[0]));
            }
        }
        crossings.sort_by(f64::total_cmp);
        for pair in crossings.chunks_exact(2) {
            lines.push([pair[0], pair[1]].map(|u| [(u + v) / 2.0, (v - u) / 2.0]));
        }
    }
    lines
}

/// An outline with square teeth of this size towards the outside.
pub(crate) fn battlement(corners: &[Position], size: f64) -> Vec<Position> {
    let mut closed = corners.to_vec();
    closed.extend(corners.first());
    let spacing = spacing(&closed, 2.0 * size);
    // Outside is on the left of an outline that turns to the right on the screen.
    let turns: f64 =
        closed.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[1][0] * pair[0][1]).sum();
    let out = if turns >= 0.0 { size } else { -size };
    let mut outline = Vec::new();
    for pair in closed.windows(2) {
        outline.push(pair[0]);
        for ([x, y], along) in marks(pair, spacing) {
            let half = spacing / 4.0;
            for (side, up) in [(-half, 0.0), (-half, out), (half, out), (half, 0.0)] {
                outline.push([
                    x + along[0] * side + along[1] * up,
                    y + along[1] * side - along[0] * up,
                ]);
            }
        }
    }
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Position; 4] = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];

    #[test]
    fn a_parallel_keeps_its_distance_around_a_corner() {
        let parallel = offset(&SQUARE[..3], 2.0);
        assert_eq!(parallel[0], [0.0, -2.0]);
        assert!(distance(parallel[1], [12.0, -2.0]) < 1e-9, "{parallel:?}");
        assert!(distance(parallel[2], [12.0, 10.0]) < 1e-9, "{parallel:?}");
    }

    #[test]
    fn hatching_stays_inside_the_area() {
        let lines = hatch(&SQUARE, 1.0);
        assert!(lines.len() > 10);
        for [x, y] in lines.iter().flatten() {
            assert!((-1e-9..=10.0 + 1e-9).contains(x) && (-1e-9..=10.0 + 1e-9).contains(y));
        }
    }

    #[test]
    fn marks_lie_on_the_line_at_even_distances() {
        let line = [[0.0, 0.0], [6.0, 0.0], [6.0, 6.0]];
        let at: Vec<_> = marks(&line, 4.0).into_iter().map(|(at, _)| at).collect();
        assert_eq!(at, [[2.0, 0.0], [6.0, 0.0], [6.0, 4.0]]);
        assert_eq!(middle(&line), [6.0, 0.0]);
    }

    #[test]
    fn the_centre_of_an_area_does_not_depend_on_the_number_of_its_corners() {
        let mut corners = SQUARE.to_vec();
        corners.insert(1, [5.0, 0.0]);
        assert!(distance(centroid(&corners), [5.0, 5.0]) < 1e-9);
        assert_eq!(centroid(&[[1.0, 1.0]; 3]), [1.0, 1.0]);
    }
}
