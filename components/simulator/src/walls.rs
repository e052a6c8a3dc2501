//! Straight walls, found by rays and by distance.
//!
//! Both walk parry's tree of boxes and compute each wall in double precision: parry's own segment
//! test calls a ray parallel to a short wall at up to 2°.

use armor_drawn_world::Segment;
use parry2d::bounding_volume::Aabb;
use parry2d::math::Vector;
use parry2d::partitioning::{Bvh, BvhBuildStrategy};
use parry2d::query::{PointQuery, Ray};

use crate::pose::Pose2;

/// By how much boxes in single precision are widened, so that rounding never hides a wall (metres).
const BOX_MARGIN_M: f32 = 0.001;

/// How far beyond its ends a wall still stops a ray, so that none slips through a corner (metres).
const CORNER_SEAL_M: f64 = 1e-6;

/// Walls and the tree that finds them.
#[derive(Clone)]
pub(crate) struct Walls {
    segments: Vec<Segment>,
    boxes: Bvh,
}

impl Walls {
    pub(crate) fn new(segments: Vec<Segment>) -> Self {
        let boxes: Vec<Aabb> = segments.iter().map(wall_box).collect();
        Self { boxes: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes), segments }
    }

    pub(crate) fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The distance from a pose along its heading to the first wall nearer than `max_range_m`.
    pub(crate) fn range_m(&self, from: Pose2, max_range_m: f64) -> Option<f64> {
        let (sin, cos) = libm::sincos(from.yaw_rad);
        let exact = |wall: u32| ray_to_wall_m(from, (cos, sin), &self.segments[wall as usize]);
        let ray = Ray::new(to_vector(from.x_m, from.y_m), to_vector(cos, sin));
        let reach = max_range_m as f32 + BOX_MARGIN_M;
        let (nearest, _) = self
            .boxes
            .cast_ray(&ray, reach, |wall, _| exact(wall).map(|range_m| range_m as f32))?;
        exact(nearest).filter(|&range_m| range_m < max_range_m)
    }

    /// How far the nearest wall is from a point, in metres, and where it is.
    pub(crate) fn nearest(&self, x_m: f64, y_m: f64) -> Option<(f64, (f64, f64))> {
        let point = to_vector(x_m, y_m);
        let exact = |wall: u32| nearest_on_wall((x_m, y_m), &self.segments[wall as usize]);
        let (nearest, _) = self.boxes.find_best(
            f32::MAX,
            |node, _| node.aabb().distance_to_local_point(point, true),
            |wall, _| Some(exact(wall).0 as f32),
        )?;
        Some(exact(nearest))
    }
}

fn to_vector(x: f64, y: f64) -> Vector {
    Vector::new(x as f32, y as f32)
}

fn wall_box(wall: &Segment) -> Aabb {
    let (from, to) = (to_vector(wall.from_m.0, wall.from_m.1), to_vector(wall.to_m.0, wall.to_m.1));
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

/// The point of a wall that is nearest to another, and how far away it is.
fn nearest_on_wall((x, y): (f64, f64), wall: &Segment) -> (f64, (f64, f64)) {
    let (along_x, along_y) = (wall.to_m.0 - wall.from_m.0, wall.to_m.1 - wall.from_m.1);
    let (to_x, to_y) = (x - wall.from_m.0, y - wall.from_m.1);
    let length_squared = along_x * along_x + along_y * along_y;
    let share = ((to_x * along_x + to_y * along_y) / length_squared).clamp(0.0, 1.0);
    let (off_x, off_y) = (to_x - share * along_x, to_y - share * along_y);
    let there = (wall.from_m.0 + share * along_x, wall.from_m.1 + share * along_y);
    (libm::sqrt(off_x * off_x + off_y * off_y), there)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::f64::consts::PI;

    use super::*;
    use crate::world::World;

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
            let drawing = format!(r#"<svg><polyline points="{points}"/><circle id="start"/></svg>"#);
            let world = World::parse("world.svg", drawing.as_bytes()).expect("a readable world");
            let from = Pose2::new(x_m, y_m, yaw_rad);
            let direction = (libm::cos(yaw_rad), libm::sin(yaw_rad));
            let tried = world.segments().iter().filter_map(|w| ray_to_wall_m(from, direction, w));
            let nearest = tried.min_by(f64::total_cmp).filter(|&range_m| range_m < 60.0);
            let found = world.range_m(from, 60.0);
            prop_assert_eq!(found.is_some(), nearest.is_some());
            if let (Some(found), Some(nearest)) = (found, nearest) {
                prop_assert!((found - nearest).abs() < 1e-4);
            }
            let tried = world.segments().iter().map(|w| nearest_on_wall((x_m, y_m), w).0);
            let nearest = tried.min_by(f64::total_cmp).expect("walls");
            prop_assert!((world.clearance_m(x_m, y_m) - nearest).abs() < 1e-4);
        }
    }
}
