//! The heading that straight walls measure.
//!
//! Long walls of a building are parallel to others far away. A scan that is matched with the last few
//! metres of the map cannot use that: in each new corridor the heading errs by a little more, and the
//! position with it, until a loop is closed. So the directions of all long walls are counted. A wall
//! that is nearly parallel to many others measures the heading against all of them. A wall in any other
//! direction is ignored. If no direction has many walls, none is used.
//!
//! The idea is that of Nguyen, Harati, Martinelli, Siegwart and Tomatis, *Orthogonal SLAM* (IROS
//! 2006). Right angles are not assumed here, since they are less exact than parallels, and other walls
//! are not left out of the map.
//!
//! **Limits.** A wall that is askew by less than a degree is taken for parallel, and the map is bent by
//! as much along it, unless the scans contradict.

use crate::pose::{Point, Pose, wrapped};
use crate::refine::BEAM_WORTH;
use crate::scan::Beam;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::PI;

/// Beams that end farther apart than this do not end on one wall, metres.
const GAP_M: f64 = 0.6;
/// Points may be this far from the line between the first and the last one, metres.
const STRAIGHT_M: f64 = 0.05;
/// Shorter walls do not count, metres.
const LEAST_LENGTH_M: f64 = 1.5;
const FEWEST_POINTS: usize = 8;
/// Scatter of the points of a wall, metres.
const ROUGHNESS_M: f64 = 0.02;
/// A part of the points may be compared with lines this many times each. Only where nearly every point is
/// a corner it takes more, and such a part has no walls.
const COMPARISONS_PER_POINT: usize = 64;

/// Cells of the histogram of directions, over 180 degrees.
const CELLS: usize = 1800;
/// Directions that differ by less than this are taken for parallel, radians.
const PARALLEL_RAD: f64 = PI / 180.0;
/// The same in cells.
const PARALLEL_CELLS: usize = (PARALLEL_RAD / PI * CELLS as f64) as usize;
/// A direction has many walls if this share of the length of all walls belongs to it …
const DIRECTED_SHARE: f64 = 0.2;
/// … and if walls of this many drawn scans are known.
const FEWEST_SCANS: usize = 5;
/// After these, the walls of a scan are counted if the robot has moved this far, metres, or turned this
/// far, radians, since those of another were: else the walls of a place where it stands would outnumber
/// all others.
const COUNTED_EVERY_M: f64 = 0.15;
const COUNTED_EVERY_RAD: f64 = 8.0 * PI / 180.0;
/// The walls of one scan measure the heading at best with this standard deviation, radians: walls are
/// not built more exactly.
const BUILT_RAD: f64 = 0.3 * PI / 180.0;

/// A straight wall in a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StraightWall {
    /// Its direction in the robot's frame, radians.
    angle_rad: f64,
    length_m: f64,
    /// How exactly the direction is known, rad⁻².
    information: f64,
}

/// The heading according to walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WallHeading {
    /// The heading in the map, radians.
    pub(crate) yaw_rad: f64,
    /// Its information, rad⁻².
    pub(crate) information: f64,
}

/// The directions of the walls on a map.
#[derive(Clone, Debug)]
pub(crate) struct WallDirections {
    /// Length of the walls in each direction of the map, metres, over 180 degrees.
    lengths_m: Vec<f64>,
    scan_count: usize,
    /// Where the last scan that was counted was taken.
    counted: Option<Pose>,
}

impl Default for WallDirections {
    fn default() -> Self {
        Self { lengths_m: vec![0.0; CELLS], scan_count: 0, counted: None }
    }
}

impl WallDirections {
    /// Counts the walls of a scan that was drawn at this pose.
    pub(crate) fn count_walls(&mut self, walls: &[StraightWall], pose: &Pose) {
        let is_near = |counted: Pose| {
            pose.distance_m(&counted) < COUNTED_EVERY_M
                && wrapped(pose.yaw_rad - counted.yaw_rad).abs() < COUNTED_EVERY_RAD
        };
        let stands = self.scan_count >= FEWEST_SCANS && self.counted.is_some_and(is_near);
        if walls.is_empty() || stands {
            return;
        }
        for wall in walls {
            let turned = (wall.angle_rad + pose.yaw_rad).rem_euclid(PI) / PI;
            self.lengths_m[(turned * CELLS as f64) as usize % CELLS] += wall.length_m;
        }
        self.scan_count += 1;
        self.counted = Some(*pose);
    }

    /// Returns the directions that many walls have, radians, the one with most of them first.
    fn find_directions(&self) -> Vec<f64> {
        let mut directions_rad = Vec::new();
        if self.scan_count < FEWEST_SCANS {
            return directions_rad;
        }
        let mut left_m = self.lengths_m.clone();
        let least_m = DIRECTED_SHARE * left_m.iter().sum::<f64>();
        let around = |middle: usize| {
            let first = middle + CELLS - PARALLEL_CELLS;
            (first..=first + 2 * PARALLEL_CELLS).map(|cell| cell % CELLS)
        };
        loop {
            let length_m = |middle: usize| around(middle).map(|cell| left_m[cell]).sum::<f64>();
            let lengths = (0..CELLS).map(|middle| (middle, length_m(middle)));
            let longest = lengths.max_by(|one, other| one.1.total_cmp(&other.1));
            let Some((middle, with_it_m)) = longest.filter(|(_, it_m)| *it_m > least_m) else {
                break;
            };
            let of_cell =
                |(at, cell): (usize, usize)| (at as f64 - PARALLEL_CELLS as f64) * left_m[cell];
            let off: f64 = around(middle).enumerate().map(of_cell).sum::<f64>() / with_it_m;
            directions_rad.push((middle as f64 + 0.5 + off) / CELLS as f64 * PI);
            around(middle).for_each(|cell| left_m[cell] = 0.0);
        }
        directions_rad
    }

    /// Returns what the walls of a scan can be compared with; `None` if there is nothing to compare.
    pub(crate) fn build_compass(&self, walls: &[StraightWall]) -> Option<WallCompass> {
        if walls.is_empty() {
            return None;
        }
        let directions_rad = self.find_directions();
        (!directions_rad.is_empty()).then(|| WallCompass { walls: walls.to_vec(), directions_rad })
    }
}

/// The walls of a scan, and the directions that many walls of the map have.
#[derive(Clone, Debug)]
pub(crate) struct WallCompass {
    walls: Vec<StraightWall>,
    directions_rad: Vec<f64>,
}

impl WallCompass {
    /// Returns the heading, close to the one that is given, at which the walls are parallel to those of
    /// the map; `None` if no wall is nearly parallel to them.
    pub(crate) fn measure_heading(&self, yaw_rad: f64) -> Option<WallHeading> {
        let (mut weighted_rad, mut information) = (0.0, 0.0);
        for wall in &self.walls {
            let off_rad = |direction_rad: &f64| {
                let turns = (wall.angle_rad + yaw_rad - direction_rad) / PI;
                (turns - turns.round()) * PI
            };
            let offs_rad = self.directions_rad.iter().map(off_rad);
            let least_rad = offs_rad.min_by(|one, other| one.abs().total_cmp(&other.abs()));
            if let Some(off_rad) = least_rad.filter(|off_rad| off_rad.abs() < PARALLEL_RAD) {
                weighted_rad += off_rad * wall.information;
                information += wall.information;
            }
        }
        if information <= 0.0 {
            return None;
        }
        let variance = BUILT_RAD * BUILT_RAD + information.recip();
        let yaw_rad = yaw_rad - weighted_rad / information;
        Some(WallHeading { yaw_rad, information: variance.recip() })
    }
}

/// Returns the long straight walls in a scan: neighbouring points, split where they are farthest from
/// the line between the first and the last one (Nguyen, Martinelli, Tomatis and Siegwart, IROS 2005,
/// section II).
pub(crate) fn find_straight_walls(beams: &[Beam]) -> Vec<StraightWall> {
    let (mut walls, mut run) = (Vec::new(), Vec::<Vector2<f64>>::new());
    for beam in beams {
        let Point { x_m, y_m } = beam.end;
        let end = Vector2::new(x_m, y_m);
        let goes_on = run.last().is_none_or(|last| (end - last).norm() <= GAP_M);
        if !beam.hit || !goes_on {
            split_at_corners(&run, &mut walls);
            run.clear();
        }
        if beam.hit {
            run.push(end);
        }
    }
    split_at_corners(&run, &mut walls);
    walls
}

fn split_at_corners(points: &[Vector2<f64>], walls: &mut Vec<StraightWall>) {
    let mut parts = vec![points];
    let mut comparisons_left = COMPARISONS_PER_POINT * points.len();
    while let Some(part) = parts.pop() {
        let [first, .., last] = part else { continue };
        let Some(left) = comparisons_left.checked_sub(part.len()) else { return };
        comparisons_left = left;
        if part.len() < FEWEST_POINTS {
            continue;
        }
        let along = last - first;
        let length_m = along.norm();
        // Where the first point is the last one, too, there is no line between them.
        let off_m = |point: &Vector2<f64>| match point - first {
            arm if length_m < STRAIGHT_M => arm.norm(),
            arm => along.perp(&arm).abs() / length_m,
        };
        let offs_m = part.iter().map(off_m).enumerate();
        match offs_m.max_by(|one, other| one.1.total_cmp(&other.1)) {
            Some((at, off_m)) if off_m > STRAIGHT_M && at > 0 && at + 1 < part.len() => {
                parts.extend([&part[..=at], &part[at..]]);
            }
            _ if length_m >= LEAST_LENGTH_M => walls.push(fit_wall(part, length_m)),
            _ => {}
        }
    }
}

fn fit_wall(points: &[Vector2<f64>], length_m: f64) -> StraightWall {
    let mean = points.iter().sum::<Vector2<f64>>() / points.len() as f64;
    let scatter: Matrix2<f64> =
        points.iter().map(|point| (point - mean) * (point - mean).transpose()).sum();
    let angle_rad = 0.5 * (2.0 * scatter.m12).atan2(scatter.m11 - scatter.m22);
    let squared_arms_m2 = scatter.symmetric_eigenvalues().max();
    let information = BEAM_WORTH * squared_arms_m2 / (ROUGHNESS_M * ROUGHNESS_M);
    StraightWall { angle_rad, length_m, information }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points every 5 cm from one corner to the next, as a robot sees them that has a heading in the
    /// drawing.
    fn beams_along(corners: &[[f64; 2]], yaw_rad: f64) -> Vec<Beam> {
        let mut beams = Vec::new();
        let (sin, cos) = yaw_rad.sin_cos();
        for pair in corners.windows(2) {
            let [[from_x, from_y], [to_x, to_y]] = [pair[0], pair[1]];
            let steps = ((to_x - from_x).hypot(to_y - from_y) / 0.05).round() as i32;
            beams.extend((0..=steps).map(|step| f64::from(step) / f64::from(steps)).map(|part| {
                let (x_m, y_m) = (from_x + part * (to_x - from_x), from_y + part * (to_y - from_y));
                let end = Point { x_m: cos * x_m + sin * y_m, y_m: cos * y_m - sin * x_m };
                Beam { end, hit: true }
            }));
        }
        beams
    }

    /// Two walls of 4 and 3 m that meet at an angle, the first of them along x.
    fn corner(degrees: f64) -> Vec<[f64; 2]> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        vec![[-2.0, 2.0], [2.0, 2.0], [2.0 - 3.0 * cos, 2.0 - 3.0 * sin]]
    }

    /// The directions after ten scans of a drawing, each at the right heading.
    fn learn_directions(corners: &[[f64; 2]]) -> WallDirections {
        let mut directions = WallDirections::default();
        for turn in 0..10 {
            let yaw_rad = f64::from(turn) * 0.7;
            let walls = find_straight_walls(&beams_along(corners, yaw_rad));
            directions.count_walls(&walls, &Pose::new(0.0, 0.0, yaw_rad));
        }
        directions
    }

    /// How far the heading that is measured is from the true one, degrees, if the robot supposes it
    /// to be `off` degrees off.
    fn measure(known: &WallDirections, seen: &[[f64; 2]], off: f64) -> Option<f64> {
        let yaw_rad = 1.3;
        let walls = find_straight_walls(&beams_along(seen, yaw_rad));
        let found = known.build_compass(&walls)?.measure_heading(yaw_rad + off.to_radians())?;
        assert!(found.information > 0.0 && found.information <= (BUILT_RAD * BUILT_RAD).recip());
        Some((found.yaw_rad - yaw_rad).to_degrees())
    }

    /// Whether that is known to a cell of the count.
    fn is_right(found: Option<f64>) -> bool {
        found.is_some_and(|found| found.abs() < 0.1)
    }

    #[test]
    fn walls_end_at_corners_and_gaps() {
        let with_gap = [corner(90.0), vec![[-2.0, -3.0], [0.0, -3.0]]];
        let beams: Vec<_> = with_gap.iter().flat_map(|part| beams_along(part, 0.0)).collect();
        let mut walls = find_straight_walls(&beams);
        walls.sort_by(|one, other| one.length_m.total_cmp(&other.length_m));
        let lengths_m: Vec<_> = walls.iter().map(|wall| wall.length_m).collect();
        for (found, right) in lengths_m.iter().zip([2.0, 3.0, 4.0]) {
            assert!((found - right).abs() < 0.11, "{lengths_m:?}");
        }
        assert_eq!(walls.len(), 3);
        let degrees: Vec<_> = walls.iter().map(|wall| wall.angle_rad.to_degrees()).collect();
        assert!(degrees[0].abs() < 0.5 && (degrees[1].abs() - 90.0).abs() < 0.5, "{degrees:?}");
        // A long wall tells the heading better than a short one.
        assert!(walls[0].information < walls[1].information);
    }

    #[test]
    fn what_is_short_or_round_is_no_wall() {
        // A closed circle, and one with a gap.
        for last in [36, 34] {
            let points = (0..=last).map(|n| f64::from(n * 10).to_radians().sin_cos());
            let circle: Vec<_> = points.map(|(sin, cos)| [2.0 * cos, 2.0 * sin]).collect();
            assert_eq!(find_straight_walls(&beams_along(&circle, 0.0)), []);
        }
        assert_eq!(find_straight_walls(&beams_along(&[[0.0, 1.0], [1.2, 1.0]], 0.0)), []);
        let one = Beam { end: Point { x_m: 1.0, y_m: 0.0 }, hit: true };
        let nothing = Beam { hit: false, ..one };
        for beams in [vec![], vec![one], vec![one; 20], vec![nothing; 20]] {
            assert_eq!(find_straight_walls(&beams), [], "{} beams", beams.len());
        }
        let mut dotted = beams_along(&[[0.0, 1.0], [3.0, 1.0]], 0.0);
        dotted.iter_mut().step_by(5).for_each(|beam| beam.hit = false);
        assert_eq!(find_straight_walls(&dotted), []);
    }

    #[test]
    fn a_closed_room_has_all_its_walls() {
        let room = [[-2.0, -1.0], [2.0, -1.0], [2.0, 1.0], [-2.0, 1.0], [-2.0, -1.0]];
        let walls = find_straight_walls(&beams_along(&room, 0.3));
        let mut lengths_m: Vec<_> = walls.iter().map(|wall| wall.length_m).collect();
        lengths_m.sort_by(f64::total_cmp);
        let off_m = |(found, right): (&f64, f64)| (found - right).abs();
        assert!(lengths_m.iter().zip([2.0, 2.0, 4.0, 4.0]).all(|pair| off_m(pair) < 0.06));
        assert_eq!(lengths_m.len(), 4);
    }

    #[test]
    fn a_zigzag_takes_a_bounded_time() {
        // Every other beam ends 0.3 m behind a rail: each point is a corner.
        let beam = |n: i32| {
            let end = Point { x_m: 0.01 * f64::from(n), y_m: 2.0 + 0.3 * f64::from(n % 2) };
            Beam { end, hit: true }
        };
        assert_eq!(find_straight_walls(&(0..100_000).map(beam).collect::<Vec<_>>()), []);
    }

    #[test]
    fn long_walls_count_more_than_short_ones() {
        // Walls of 2 and 6 m, the shorter one 0.6 degrees askew from the direction that is known.
        let known = learn_directions(&[[-3.0, 2.0], [3.0, 2.0]]);
        let (sin, cos) = 0.6f64.to_radians().sin_cos();
        let short = beams_along(&[[0.0, -2.0], [2.0 * cos, -2.0 + 2.0 * sin]], 0.0);
        let both = [beams_along(&[[-3.0, 2.0], [3.0, 2.0]], 0.0), short].concat();
        let compass = known.build_compass(&find_straight_walls(&both)).expect("a direction");
        let found = compass.measure_heading(0.0).expect("parallel walls");
        // Length to the power of three: one part of 28.
        let off_deg = found.yaw_rad.to_degrees();
        assert!((off_deg + 0.6 / 28.0).abs() < 0.06, "{off_deg}");

        let alone = known.build_compass(&find_straight_walls(&both[121..])).expect("a direction");
        let found_alone = alone.measure_heading(0.0).expect("a parallel wall");
        assert!((found_alone.yaw_rad.to_degrees() + 0.6).abs() < 0.06, "{found_alone:?}");
        assert!(found_alone.information < found.information);
        // 41 points over 2 m, 2 cm each: 0.78 degrees, and 0.3 of the building.
        let deviation_deg = found_alone.information.powf(-0.5).to_degrees();
        assert!((0.82..0.86).contains(&deviation_deg), "{deviation_deg}");
    }

    #[test]
    fn walls_measure_the_heading_against_parallel_ones() {
        for degrees in [90.0, 88.5, 60.0] {
            let known = learn_directions(&corner(degrees));
            for off in [-0.8, 0.0, 0.5] {
                let found = measure(&known, &corner(degrees), off);
                assert!(is_right(found), "{degrees}, {off}: {found:?}");
                // Each of the two walls alone, too.
                let corners = corner(degrees);
                assert!(is_right(measure(&known, &corners[..2], off)));
                assert!(is_right(measure(&known, &corners[1..], off)));
            }
            assert!(is_right(measure(&known, &corner(degrees)[..2], 0.9)), "nearly parallel");
            assert_eq!(measure(&known, &corner(degrees)[..2], 1.1), None, "not nearly parallel");
        }
    }

    #[test]
    fn directions_are_found_over_the_end_of_the_count() {
        let mut directions = WallDirections::default();
        let walls = find_straight_walls(&beams_along(&[[-3.0, 1.0], [3.0, 1.0]], 0.0));
        for (x_m, yaw_rad) in [-0.006, -0.004, -0.002, 0.002, 0.004, 0.006].into_iter().enumerate()
        {
            directions.count_walls(&walls, &Pose::new(x_m as f64, 0.0, yaw_rad));
        }
        let found = directions.find_directions();
        assert_eq!(found.len(), 1, "{found:?}");
        let off_rad = found[0] - (found[0] / PI).round() * PI;
        assert!(off_rad.abs() < 0.001, "{found:?}");
    }

    #[test]
    fn few_scans_and_directions_of_few_walls_measure_nothing() {
        let walls = find_straight_walls(&beams_along(&corner(90.0), 0.0));
        let mut directions = WallDirections::default();
        for scans in 0..FEWEST_SCANS {
            assert!(directions.build_compass(&walls).is_none(), "{scans} scans");
            let pose = Pose::new(scans as f64, 0.0, 0.0);
            directions.count_walls(&[], &pose);
            assert!(
                directions.build_compass(&walls).is_none(),
                "a scan without walls does not count"
            );
            directions.count_walls(&walls, &pose);
        }
        assert!(directions.build_compass(&walls).is_some());
        assert!(directions.build_compass(&[]).is_none());

        // Walls all around, 12 degrees apart.
        let mut around = WallDirections::default();
        let one = find_straight_walls(&beams_along(&[[-3.0, 1.0], [3.0, 1.0]], 0.0));
        for turn in 0..15 {
            around.count_walls(&one, &Pose::new(0.0, 0.0, f64::from(turn) * 12f64.to_radians()));
        }
        assert!(around.build_compass(&one).is_none());
    }

    #[test]
    fn walls_are_not_outnumbered_by_those_of_a_place_where_the_robot_stands() {
        let mut directions = learn_directions(&corner(90.0));
        let there = find_straight_walls(&beams_along(&[[-3.0, 0.0], [3.0, 4.0]], 0.0));
        let place = Pose::new(30.0, 0.0, 0.0);
        (0..1000).for_each(|_| directions.count_walls(&there, &place));
        assert!(is_right(measure(&directions, &corner(90.0), 0.5)));
    }

    #[test]
    fn a_wall_in_another_direction_does_not_spoil_the_measurement() {
        let known = learn_directions(&corner(90.0));
        let mut seen = corner(90.0);
        let last = seen[seen.len() - 1];
        seen.push([last[0] - 4.0, last[1] - 0.25]);
        assert!(is_right(measure(&known, &seen, 0.4)), "a wall 3.6 degrees askew");
    }
}
