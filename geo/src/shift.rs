//! Points moved, turned, mirrored, and lines offset to one side.

use crate::error::ShapeError;
use crate::map_point::MapPoint;

/// Where two sides of an offset line meet is at most this many times the offset from the corner between
/// them: sharper corners are refused.
const MAX_MITRE: f64 = 8.0;

/// A change of positions that keeps all distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MapShift {
    /// Metres to the right and up.
    Move {
        /// To the right.
        x_m: f64,
        /// Up.
        y_m: f64,
    },
    /// A turn around a point.
    Rotate {
        /// The point that stays.
        centre: MapPoint,
        /// The angle, anticlockwise.
        angle_rad: f64,
    },
    /// Across a line through a point.
    Mirror {
        /// The point that stays.
        through: MapPoint,
        /// The direction of the line, anticlockwise from x.
        axis_rad: f64,
    },
}

impl MapShift {
    /// Where a point is afterwards.
    ///
    /// # Errors
    /// If it is beyond what a map may have.
    pub fn apply(self, point: MapPoint) -> Result<MapPoint, ShapeError> {
        match self {
            Self::Move { x_m, y_m } => MapPoint::new(point.x_m() + x_m, point.y_m() + y_m),
            Self::Rotate { centre, angle_rad } => {
                let (sin, cos) = exact_sin_cos(angle_rad);
                let (x, y) = (point.x_m() - centre.x_m(), point.y_m() - centre.y_m());
                MapPoint::new(centre.x_m() + x * cos - y * sin, centre.y_m() + x * sin + y * cos)
            }
            Self::Mirror { through, axis_rad } => {
                let (sin, cos) = exact_sin_cos(2.0 * axis_rad);
                let (x, y) = (point.x_m() - through.x_m(), point.y_m() - through.y_m());
                MapPoint::new(through.x_m() + x * cos + y * sin, through.y_m() + x * sin - y * cos)
            }
        }
    }
}

/// Sine and cosine, exact for quarter turns: a zone that is turned by 90° keeps its round numbers.
pub(crate) fn exact_sin_cos(angle_rad: f64) -> (f64, f64) {
    let quarters = angle_rad / std::f64::consts::FRAC_PI_2;
    if (quarters - quarters.round()).abs() > 1e-12 {
        return angle_rad.sin_cos();
    }
    match quarters.round().rem_euclid(4.0) as u8 {
        0 => (0.0, 1.0),
        1 => (1.0, 0.0),
        2 => (0.0, -1.0),
        _ => (-1.0, 0.0),
    }
}

/// The line, or the closed outline, at a distance to the left of its direction; a negative one is to the
/// right. Sides stay parallel, corners are mitred.
///
/// # Errors
/// If there are too few points, two successive ones are the same, a corner is so sharp that the offset one
/// would be more than eight times as far away, or a side is too short for the offset.
pub fn offset_line(
    points: &[MapPoint],
    is_closed: bool,
    left_m: f64,
) -> Result<Vec<MapPoint>, ShapeError> {
    let needed = if is_closed { 3 } else { 2 };
    if points.len() < needed {
        return Err(ShapeError::TooFewPoints { found: points.len(), needed });
    }
    let count = points.len();
    let sides = if is_closed { count } else { count - 1 };
    let mut directions = Vec::with_capacity(sides);
    for number in 0..sides {
        let (from, to) = (points[number], points[(number + 1) % count]);
        let length_m = from.distance_m(to);
        if length_m == 0.0 {
            return Err(ShapeError::RepeatedPoint { index: number + 1 });
        }
        directions.push([(to.x_m() - from.x_m()) / length_m, (to.y_m() - from.y_m()) / length_m]);
    }
    let mut moved = Vec::with_capacity(count);
    for (number, point) in points.iter().enumerate() {
        let before = match number {
            0 if is_closed => directions[sides - 1],
            0 => directions[0],
            _ => directions[number - 1],
        };
        let after = directions.get(number).copied().unwrap_or(before);
        // The mitre is along the sum of the two normals, and 1 / cos of half the turn long.
        let cos = before[0] * after[0] + before[1] * after[1];
        let share = left_m / (1.0 + cos);
        if !share.is_finite() || (2.0 / (1.0 + cos)).sqrt() > MAX_MITRE {
            return Err(ShapeError::SharpCorner { index: number + 1 });
        }
        moved.push(MapPoint::new(
            point.x_m() - (before[1] + after[1]) * share,
            point.y_m() + (before[0] + after[0]) * share,
        )?);
    }
    for (number, direction) in directions.iter().enumerate() {
        let (from, to) = (moved[number], moved[(number + 1) % count]);
        let along = (to.x_m() - from.x_m()) * direction[0] + (to.y_m() - from.y_m()) * direction[1];
        if along <= 0.0 {
            return Err(ShapeError::SideTooShort { index: number + 1 });
        }
    }
    Ok(moved)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64, y_m: f64) -> MapPoint {
        MapPoint::new(x_m, y_m).expect("a point")
    }

    #[test]
    fn quarter_turns_and_mirrors_keep_round_numbers() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let turn = MapShift::Rotate { centre: at(1.0, 1.0), angle_rad: quarter };
        assert_eq!(turn.apply(at(3.0, 1.0)), Ok(at(1.0, 3.0)));
        let across_y = MapShift::Mirror { through: at(2.0, 0.0), axis_rad: quarter };
        assert_eq!(across_y.apply(at(3.5, 7.0)), Ok(at(0.5, 7.0)));
        let across_x = MapShift::Mirror { through: at(2.0, 1.0), axis_rad: 0.0 };
        assert_eq!(across_x.apply(at(3.5, 7.0)), Ok(at(3.5, -5.0)));
        let moved = MapShift::Move { x_m: 0.5, y_m: -1.0 };
        assert_eq!(moved.apply(at(1.0, 1.0)), Ok(at(1.5, 0.0)));
    }

    #[test]
    fn all_distances_are_kept_and_a_mirror_twice_changes_nothing() {
        let mut random = 7_u64;
        let mut number = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 33) as f64 / 4e6 - 500.0
        };
        for _ in 0..1_000 {
            let (one, other, centre) =
                (at(number(), number()), at(number(), number()), at(number(), number()));
            let angle_rad = number() / 100.0;
            let turn = MapShift::Rotate { centre, angle_rad };
            let mirror = MapShift::Mirror { through: centre, axis_rad: angle_rad };
            for shift in [turn, mirror] {
                let after = shift.apply(one).and_then(|it| Ok((it, shift.apply(other)?)));
                let (after_one, after_other) = after.expect("small numbers");
                let change = after_one.distance_m(after_other) - one.distance_m(other);
                assert!(change.abs() < 1e-9, "{shift:?}: {change}");
            }
            let twice = mirror.apply(one).and_then(|it| mirror.apply(it)).expect("small numbers");
            assert!(twice.distance_m(one) < 1e-9);
        }
    }

    #[test]
    fn an_offset_is_to_the_left_and_its_sides_stay_parallel() {
        let line = [at(0.0, 0.0), at(10.0, 0.0), at(10.0, 10.0)];
        let left = offset_line(&line, false, 1.0);
        assert_eq!(left, Ok(vec![at(0.0, 1.0), at(9.0, 1.0), at(9.0, 10.0)]));
        let square = [at(0.0, 0.0), at(4.0, 0.0), at(4.0, 4.0), at(0.0, 4.0)];
        let larger = offset_line(&square, true, -1.0);
        assert_eq!(larger, Ok(vec![at(-1.0, -1.0), at(5.0, -1.0), at(5.0, 5.0), at(-1.0, 5.0)]));
    }

    #[test]
    fn an_offset_that_turns_a_side_around_is_refused() {
        let square = [at(0.0, 0.0), at(4.0, 0.0), at(4.0, 4.0), at(0.0, 4.0)];
        assert!(matches!(
            offset_line(&square, true, 2.5),
            Err(ShapeError::SideTooShort { index: 1 })
        ));
        let back = [at(0.0, 0.0), at(4.0, 0.0), at(0.0, 0.1)];
        assert!(matches!(
            offset_line(&back, false, 0.1),
            Err(ShapeError::SharpCorner { index: 2 })
        ));
        let twice = [at(0.0, 0.0), at(0.0, 0.0)];
        assert!(matches!(
            offset_line(&twice, false, 0.1),
            Err(ShapeError::RepeatedPoint { index: 1 })
        ));
    }
}
