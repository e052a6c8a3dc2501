//! The world as the robot meets it: straight walls in the map frame, whose origin is the start pose.
//! Rays and clearances walk parry's tree of boxes and compute each wall in double precision: parry's
//! own segment test calls a ray parallel to a short wall at up to 2°.

use std::path::Path;

use parry2d::bounding_volume::Aabb;
use parry2d::math::Vector;
use parry2d::partitioning::{Bvh, BvhBuildStrategy};
use parry2d::query::{PointQuery, Ray};

use crate::drawing::Drawing;
pub use crate::drawing::{DrawingError, DrawingFault, Segment};
use crate::pose::{Portable, Pose2};

/// By how much boxes in single precision are widened, so that rounding never hides a wall (metres).
const BOX_MARGIN_M: f32 = 0.001;

/// How far beyond its ends a wall still stops a ray, so that none slips through a corner (metres).
const CORNER_SEAL_M: f64 = 1e-6;

/// An axis-aligned extent in the map frame, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// The smallest x and y.
    pub min_m: (f64, f64),
    /// The largest x and y.
    pub max_m: (f64, f64),
}

/// A world of straight walls, in the map frame (REP-103, origin and heading of the start).
#[derive(Clone)]
pub struct World {
    file: String,
    start_line: usize,
    segments: Vec<Segment>,
    boxes: Bvh,
}

impl World {
    /// Reads the world from an SVG drawing file.
    ///
    /// # Errors
    /// The first fault of the drawing, with file and line.
    pub fn read(path: &Path) -> Result<Self, DrawingError> {
        Ok(Self::from_drawing(path.display().to_string(), Drawing::read(path)?))
    }

    /// Reads the world from the bytes of a drawing; `file` names it in errors.
    ///
    /// # Errors
    /// The first fault of the drawing, with file and line.
    pub fn parse(file: &str, bytes: &[u8]) -> Result<Self, DrawingError> {
        Ok(Self::from_drawing(file.to_owned(), Drawing::parse(file, bytes)?))
    }

    fn from_drawing(file: String, drawing: Drawing) -> Self {
        let map_from_drawing = drawing.start.inverted();
        let moved = |(x_m, y_m): (f64, f64)| map_from_drawing.point_from(x_m, y_m);
        let segments: Vec<Segment> = drawing
            .segments
            .iter()
            .map(|wall| Segment { from_m: moved(wall.from_m), to_m: moved(wall.to_m) })
            .collect();
        let boxes: Vec<Aabb> = segments.iter().map(wall_box).collect();
        Self {
            file,
            start_line: drawing.start_line,
            boxes: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            segments,
        }
    }

    /// All walls; never empty.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The extent of all walls.
    pub fn extent(&self) -> Extent {
        let mut extent = Extent {
            min_m: (f64::INFINITY, f64::INFINITY),
            max_m: (f64::NEG_INFINITY, f64::NEG_INFINITY),
        };
        for (x, y) in self.segments.iter().flat_map(|wall| [wall.from_m, wall.to_m]) {
            extent.min_m = (extent.min_m.0.min(x), extent.min_m.1.min(y));
            extent.max_m = (extent.max_m.0.max(x), extent.max_m.1.max(y));
        }
        extent
    }

    /// Checks that a round base fits where it starts.
    ///
    /// # Errors
    /// [`DrawingFault::StartBlocked`] when a wall is nearer than the radius.
    pub fn check_start(&self, radius_m: f64) -> Result<(), DrawingError> {
        let clearance_m = self.clearance_m(0.0, 0.0);
        if clearance_m > radius_m {
            return Ok(());
        }
        let fault = DrawingFault::StartBlocked { radius_m, clearance_m };
        Err(DrawingError { file: self.file.clone(), line: self.start_line, fault })
    }

    /// The distance from a pose along its heading to the first wall, if one is nearer than
    /// `max_range_m` (metres).
    pub fn range_m(&self, from: Pose2, max_range_m: f64) -> Option<f64> {
        let (sin, cos) = libm::sincos(from.yaw_rad);
        let exact = |wall: u32| ray_to_wall_m(from, (cos, sin), &self.segments[wall as usize]);
        let ray = Ray::new(single(from.x_m, from.y_m), single(cos, sin));
        let reach = max_range_m as f32 + BOX_MARGIN_M;
        let (nearest, _) = self
            .boxes
            .cast_ray(&ray, reach, |wall, _| exact(wall).map(|range_m| range_m as f32))?;
        exact(nearest).filter(|&range_m| range_m < max_range_m)
    }

    /// The distance from a point in the map frame to the nearest wall, in metres.
    pub fn clearance_m(&self, x_m: f64, y_m: f64) -> f64 {
        let point = single(x_m, y_m);
        let exact = |wall: u32| point_to_wall_m((x_m, y_m), &self.segments[wall as usize]);
        self.boxes
            .find_best(
                f32::MAX,
                |node, _| node.aabb().distance_to_local_point(point, true),
                |wall, _| Some(exact(wall) as f32),
            )
            .map_or(f64::INFINITY, |(nearest, _)| exact(nearest))
    }
}

fn single(x: f64, y: f64) -> Vector {
    Vector::new(x as f32, y as f32)
}

fn wall_box(wall: &Segment) -> Aabb {
    let (from, to) = (single(wall.from_m.0, wall.from_m.1), single(wall.to_m.0, wall.to_m.1));
    let margin = Vector::new(BOX_MARGIN_M, BOX_MARGIN_M);
    Aabb::new(from.min(to) - margin, from.max(to) + margin)
}

/// Where a ray meets a wall: its distance, or nothing.
fn ray_to_wall_m(from: Pose2, (cos, sin): (f64, f64), wall: &Segment) -> Option<f64> {
    let (along_x, along_y) = (wall.to_m.0 - wall.from_m.0, wall.to_m.1 - wall.from_m.1);
    let (to_x, to_y) = (wall.from_m.0 - from.x_m, wall.from_m.1 - from.y_m);
    let length_m = libm::sqrt(along_x * along_x + along_y * along_y);
    let cross = cos * along_y - sin * along_x;
    // How far the wall's first end is off the ray, to the left.
    let offset_m = cos * to_y - sin * to_x;
    if cross.abs() <= 1e-12 * length_m {
        // Seen from its end, a wall is as near as its nearer end.
        let ends = [cos * to_x + sin * to_y, cos * (to_x + along_x) + sin * (to_y + along_y)];
        let is_met = offset_m.abs() <= CORNER_SEAL_M && ends[0].max(ends[1]) >= 0.0;
        return is_met.then(|| ends[0].min(ends[1]).max(0.0));
    }
    let on_wall_m = -offset_m / cross * length_m;
    let range_m = (to_x * along_y - to_y * along_x) / cross;
    let is_met = range_m >= 0.0 && (-CORNER_SEAL_M..=length_m + CORNER_SEAL_M).contains(&on_wall_m);
    is_met.then_some(range_m)
}

fn point_to_wall_m((x, y): (f64, f64), wall: &Segment) -> f64 {
    let (along_x, along_y) = (wall.to_m.0 - wall.from_m.0, wall.to_m.1 - wall.from_m.1);
    let (to_x, to_y) = (x - wall.from_m.0, y - wall.from_m.1);
    let length_squared = along_x * along_x + along_y * along_y;
    let share = ((to_x * along_x + to_y * along_y) / length_squared).clamp(0.0, 1.0);
    let (off_x, off_y) = (to_x - share * along_x, to_y - share * along_y);
    libm::sqrt(off_x * off_x + off_y * off_y)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use super::*;

    fn world(shapes: &str, start: &str) -> World {
        let text = format!(r#"<svg>{shapes}<circle id="start" {start}/></svg>"#);
        World::parse("world.svg", text.as_bytes()).expect("a readable world")
    }

    #[test]
    fn rays_in_a_box_have_the_analytic_length() {
        let world = world(r#"<rect x="-2" y="-1" width="5" height="3"/>"#, "");
        // y up: the box is x −2..3, y −2..1 around the start.
        for beam in 0..720 {
            let yaw_rad = TAU * f64::from(beam) / 720.0;
            let to_x = if yaw_rad.cos() >= 0.0 { 3.0 } else { -2.0 } / yaw_rad.cos();
            let to_y = if yaw_rad.sin() >= 0.0 { 1.0 } else { -2.0 } / yaw_rad.sin();
            let range_m =
                world.range_m(Pose2::new(0.0, 0.0, yaw_rad), 100.0).expect("a closed box");
            assert!((range_m - to_x.min(to_y)).abs() < 1e-9, "{beam}: {range_m}");
        }
    }

    #[test]
    fn rays_to_a_pillar_have_the_analytic_length() {
        let world = world(r#"<circle cx="4" cy="0" r="0.5"/>"#, "");
        for degrees in -12..=12 {
            let yaw_rad = f64::from(degrees).to_radians();
            let hit = world.range_m(Pose2::new(0.0, 0.0, yaw_rad), 10.0);
            let beside_m = 4.0 * yaw_rad.sin();
            if beside_m.abs() < 0.499 {
                let expected = 4.0 * yaw_rad.cos() - (0.25 - beside_m * beside_m).sqrt();
                assert!((hit.expect("a hit") - expected).abs() < 0.006, "{degrees}");
            } else if beside_m.abs() > 0.5 {
                assert_eq!(hit, None, "{degrees}");
            }
        }
    }

    #[test]
    fn the_map_frame_is_the_start_pose() {
        let world =
            world(r#"<line x1="-9" y1="3" x2="9" y2="3"/>"#, r#"cx="5" cy="8" data-heading="90""#);
        // The wall is 5 m above the start on the sheet: straight ahead.
        assert!((world.range_m(Pose2::default(), 10.0).expect("ahead") - 5.0).abs() < 1e-9);
        assert!((world.clearance_m(0.0, 0.0) - 5.0).abs() < 1e-9);
        assert!((world.clearance_m(2.0, 7.0) - 3.0).abs() < 1e-9);
        assert_eq!(world.range_m(Pose2::new(0.0, 0.0, PI), 100.0), None);
        assert_eq!(world.range_m(Pose2::default(), 4.9), None, "beyond the range");
    }

    #[test]
    fn a_wall_is_met_end_on_and_grazing() {
        let world = world(r#"<line x1="2" y1="0" x2="5" y2="0"/>"#, "");
        assert_eq!(world.range_m(Pose2::default(), 10.0), Some(2.0));
        let grazing = world.range_m(Pose2::new(0.0, 0.001, -0.0003), 10.0).expect("at 3.3 m");
        assert!((grazing - 3.333).abs() < 0.01, "{grazing}");
        assert_eq!(world.range_m(Pose2::new(6.0, 0.0, 0.0), 10.0), None, "it is behind");
    }

    #[test]
    fn the_clearance_is_to_the_nearest_wall() {
        let world = world(r#"<rect x="1" y="-1" width="2" height="2"/>"#, "");
        for (x_m, y_m, expected_m) in
            [(0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (4.0, 2.0, 2.0f64.sqrt()), (2.0, 0.75, 0.25)]
        {
            assert!((world.clearance_m(x_m, y_m) - expected_m).abs() < 1e-12, "{x_m} {y_m}");
        }
    }

    #[test]
    fn a_start_in_a_wall_is_refused_with_its_line() {
        let text =
            "<svg>\n<line x1=\"0.1\" y1=\"-1\" x2=\"0.1\" y2=\"1\"/>\n<circle id=\"start\"/></svg>";
        let world = World::parse("world.svg", text.as_bytes()).expect("readable");
        assert_eq!(world.check_start(0.05), Ok(()));
        let error = world.check_start(0.18).expect_err("too near");
        assert_eq!(error.line, 3);
        assert!(error.to_string().contains("0.10 m"), "{error}");
    }

    proptest! {
        /// The tree finds the same wall as asking every wall.
        #[test]
        fn the_tree_agrees_with_trying_every_wall(
            ends in proptest::collection::vec((-50.0..50.0f64, -50.0..50.0f64), 2..40),
            x_m in -50.0..50.0f64,
            y_m in -50.0..50.0f64,
            yaw_rad in -PI..PI,
        ) {
            let points: String = ends.iter().map(|(x, y)| format!("{x},{y} ")).collect();
            let world = world(&format!(r#"<polyline points="{points}"/>"#), "");
            let from = Pose2::new(x_m, y_m, yaw_rad);
            let direction = (libm::cos(yaw_rad), libm::sin(yaw_rad));
            let tried = world.segments().iter().filter_map(|w| ray_to_wall_m(from, direction, w));
            let nearest = tried.min_by(f64::total_cmp).filter(|&range_m| range_m < 60.0);
            let found = world.range_m(from, 60.0);
            prop_assert_eq!(found.is_some(), nearest.is_some());
            if let (Some(found), Some(nearest)) = (found, nearest) {
                prop_assert!((found - nearest).abs() < 1e-4);
            }
            let tried = world.segments().iter().map(|w| point_to_wall_m((x_m, y_m), w));
            let nearest = tried.min_by(f64::total_cmp).expect("walls");
            prop_assert!((world.clearance_m(x_m, y_m) - nearest).abs() < 1e-4);
        }
    }

    #[test]
    fn no_ray_leaks_through_a_corner() {
        let world = world(r#"<rect x="-1.3" y="-0.7" width="2.9" height="1.9"/>"#, "");
        for corner in world.segments() {
            let yaw_rad = libm::atan2(corner.from_m.1, corner.from_m.0);
            for nudge in -20..=20 {
                let from = Pose2::new(0.0, 0.0, yaw_rad + f64::from(nudge) * 1e-16);
                assert!(world.range_m(from, 10.0).is_some(), "{corner:?} {nudge}");
            }
        }
        assert!(world.range_m(Pose2::new(0.0, 0.0, FRAC_PI_2), 10.0).is_some());
    }
}
