//! A laser scan as the mapper needs it: points on surfaces, and how far every beam saw nothing.

use crate::bare_walls::find_points;
use crate::pose::{Point, Pose};
use nalgebra::Vector2;
use std::collections::HashSet;

/// One sweep of a planar laser, ranges as in a LaserScan message.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MapperScan {
    /// Time of the measurement, seconds.
    pub stamp_s: f64,
    /// Direction of the first beam in the laser's frame, radians.
    pub angle_min_rad: f64,
    /// Angle between beams, radians.
    pub increment_rad: f64,
    /// Shorter readings mean nothing, metres.
    pub range_min_m: f64,
    /// Readings at or above it mean that nothing was seen up to it, metres.
    pub range_max_m: f64,
    /// Readings in metres; +infinity saw nothing, NaN is no reading.
    pub ranges_m: Vec<f32>,
}

/// One beam in the robot's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Where it ends.
    pub end: Point,
    /// Whether it ends on a surface; if not, all up to the end is free.
    pub hit: bool,
}

/// A point of a surface, in the robot's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanPoint {
    /// Where it is.
    pub place: Point,
    /// Standard deviation along the wall that it lies on, metres, as a vector along that wall: zero
    /// where the point measures all directions.
    pub along_m: Vector2<f64>,
}

impl ScanPoint {
    /// Returns whether the point measures all directions.
    pub fn measures_all(&self) -> bool {
        self.along_m == Vector2::zeros()
    }
}

impl From<Point> for ScanPoint {
    /// A point that measures all directions.
    fn from(place: Point) -> Self {
        Self { place, along_m: Vector2::zeros() }
    }
}

/// How far beams are believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamReach {
    /// Surfaces farther away are not used, metres.
    pub hit_m: f64,
    /// A beam that saw nothing clears this far, metres: glass and black walls return nothing too.
    pub clear_m: f64,
}

impl MapperScan {
    /// Returns the beams that measured something, in the robot's frame.
    pub fn beams(&self, robot_from_laser: &Pose, reach: BeamReach) -> Vec<Beam> {
        let (range_min_m, range_max_m) = (self.range_min_m, self.range_max_m);
        let beam = |(index, &range): (usize, &f32)| {
            let range_m = f64::from(range);
            let hit = range_m < range_max_m && range_m <= reach.hit_m;
            let length_m = if hit { range_m } else { reach.clear_m.min(range_max_m) };
            if range_m.is_nan() || range_m < range_min_m || range_m <= 0.0 {
                return None;
            }
            let (sin, cos) = (self.angle_min_rad + self.increment_rad * index as f64).sin_cos();
            let end = robot_from_laser.apply(Point { x_m: cos * length_m, y_m: sin * length_m });
            Some(Beam { end, hit })
        };
        self.ranges_m.iter().enumerate().filter_map(beam).collect()
    }
}

/// Keeps the first surface point in every square of `side_m`, so that near walls, which get most
/// of the beams, do not outvote far ones.
pub fn thinned(beams: &[Beam], side_m: f64) -> Vec<ScanPoint> {
    thin_by(find_points(beams).into_iter(), side_m, |point| point.place)
}

/// Keeps the first point in every square of `side_m`.
pub fn thin(points: impl Iterator<Item = Point>, side_m: f64) -> Vec<Point> {
    thin_by(points, side_m, |point| *point)
}

fn thin_by<P>(points: impl Iterator<Item = P>, side_m: f64, place: impl Fn(&P) -> Point) -> Vec<P> {
    let mut taken = HashSet::new();
    let square = |metres: f64| (metres / side_m).floor() as i64;
    let is_first = |point: &P| {
        let Point { x_m, y_m } = place(point);
        taken.insert((square(x_m), square(y_m)))
    };
    points.filter(is_first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn readings_beyond_the_range_clear_and_broken_ones_say_nothing() {
        let scan = MapperScan {
            angle_min_rad: -FRAC_PI_2,
            increment_rad: FRAC_PI_2 / 2.0,
            range_min_m: 0.1,
            range_max_m: 10.0,
            ranges_m: vec![2.0, f32::NAN, f32::INFINITY, 0.05, 7.0],
            ..MapperScan::default()
        };
        let reach = BeamReach { hit_m: 5.0, clear_m: 3.0 };
        let beams = scan.beams(&Pose::new(0.5, 0.0, 0.0), reach);
        let lengths: Vec<_> =
            beams.iter().map(|b| (b.hit, (b.end.x_m - 0.5).hypot(b.end.y_m))).collect();
        assert_eq!(lengths.len(), 3);
        for (got, expected) in lengths.iter().zip([(true, 2.0), (false, 3.0), (false, 3.0)]) {
            assert!(got.0 == expected.0 && (got.1 - expected.1).abs() < 1e-12, "{lengths:?}");
        }
        assert!((beams[0].end.y_m + 2.0).abs() < 1e-12, "the first beam points right: {beams:?}");
    }

    #[test]
    fn thinning_keeps_one_point_a_square() {
        let beam = |x_m: f64| Beam { end: Point { x_m, y_m: 0.0 }, hit: true };
        let kept = thinned(&[beam(0.01), beam(0.04), beam(0.11)], 0.1);
        assert_eq!(kept.len(), 2);
    }
}
