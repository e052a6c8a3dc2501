//! What the robot meets at an instant: the walls of the world, and the round bodies of people and
//! of other robots between them.

use crate::pose::Pose2;
use crate::world::World;

/// Something round and solid, in the map frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Its middle, in metres.
    pub x_m: f64,
    /// Its middle, in metres.
    pub y_m: f64,
    /// Its radius, in metres.
    pub radius_m: f64,
    /// What it is.
    pub kind: BodyKind,
}

/// What a ray or a bumper meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyKind {
    /// A wall or furniture.
    Wall,
    /// A person.
    Person,
    /// Another robot.
    Robot,
}

/// The world and the bodies in it.
#[derive(Clone, Copy)]
pub struct WorldScene<'a> {
    /// The walls.
    pub world: &'a World,
    /// All else.
    pub bodies: &'a [Body],
}

impl<'a> From<&'a World> for WorldScene<'a> {
    /// An empty world.
    fn from(world: &'a World) -> Self {
        Self { world, bodies: &[] }
    }
}

impl WorldScene<'_> {
    /// The distance from a pose along its heading to the first thing nearer than `max_range_m`
    /// (metres), and what it is.
    pub fn hit(&self, from: Pose2, max_range_m: f64) -> Option<(f64, BodyKind)> {
        let mut nearest =
            self.world.range_m(from, max_range_m).map(|range_m| (range_m, BodyKind::Wall));
        for body in self.bodies {
            let reach_m = nearest.map_or(max_range_m, |(range_m, _)| range_m);
            if let Some(range_m) = body.range_m(from).filter(|&range_m| range_m < reach_m) {
                nearest = Some((range_m, body.kind));
            }
        }
        nearest
    }

    /// As [`hit`](Self::hit), the distance alone.
    pub fn range_m(&self, from: Pose2, max_range_m: f64) -> Option<f64> {
        self.hit(from, max_range_m).map(|(range_m, _)| range_m)
    }

    /// The distance from a point in the map frame to the nearest thing, in metres; negative within
    /// a body.
    pub fn clearance_m(&self, x_m: f64, y_m: f64) -> f64 {
        let walls_m = self.world.clearance_m(x_m, y_m);
        self.bodies.iter().map(|body| body.clearance_m(x_m, y_m)).fold(walls_m, f64::min)
    }

    /// The direction in which the nearest thing is, in the map frame, and how far away it is;
    /// nothing in a world without walls.
    pub fn nearest(&self, x_m: f64, y_m: f64) -> Option<(f64, f64)> {
        let bearing_rad = |x: f64, y: f64| libm::atan2(y - y_m, x - x_m);
        let (away_m, wall) = self.world.nearest(x_m, y_m)?;
        let mut nearest = (away_m, bearing_rad(wall.0, wall.1));
        for body in self.bodies {
            let away_m = body.clearance_m(x_m, y_m);
            if away_m < nearest.0 {
                nearest = (away_m, bearing_rad(body.x_m, body.y_m));
            }
        }
        Some(nearest)
    }
}

impl Body {
    /// The distance from a point to its edge, in metres; negative within.
    pub fn clearance_m(&self, x_m: f64, y_m: f64) -> f64 {
        libm::hypot(self.x_m - x_m, self.y_m - y_m) - self.radius_m
    }

    /// How far along a ray its middle is, and how far to the left of it, in metres.
    pub(crate) fn seen_along(&self, ray: Pose2) -> (f64, f64) {
        let (sin, cos) = libm::sincos(ray.yaw_rad);
        let (x, y) = (self.x_m - ray.x_m, self.y_m - ray.y_m);
        (cos * x + sin * y, cos * y - sin * x)
    }

    /// Where a ray meets its edge, in metres; 0 from within.
    pub(crate) fn range_m(&self, from: Pose2) -> Option<f64> {
        let (ahead_m, aside_m) = self.seen_along(from);
        let half_chord = self.radius_m * self.radius_m - aside_m * aside_m;
        if half_chord < 0.0 {
            return None;
        }
        let half_chord_m = libm::sqrt(half_chord);
        (ahead_m + half_chord_m >= 0.0).then(|| (ahead_m - half_chord_m).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERSON: Body = Body { x_m: 2.0, y_m: 0.0, radius_m: 0.25, kind: BodyKind::Person };

    fn world() -> World {
        let text = r#"<svg><rect x="-4" y="-4" width="8" height="8"/><circle id="start"/></svg>"#;
        World::parse("room.svg", text.as_bytes()).expect("a readable world")
    }

    #[test]
    fn a_body_hides_the_wall_behind_it() {
        let world = world();
        let scene = WorldScene { world: &world, bodies: &[PERSON] };
        let ray = |y_m: f64, yaw_rad: f64| scene.hit(Pose2::new(0.0, y_m, yaw_rad), 10.0);
        assert_eq!(ray(0.0, 0.0), Some((1.75, BodyKind::Person)));
        let (range_m, kind) = ray(0.15, 0.0).expect("the person's side");
        assert!((range_m - 1.8).abs() < 1e-12 && kind == BodyKind::Person);
        assert_eq!(ray(0.26, 0.0).map(|hit| hit.1), Some(BodyKind::Wall));
        assert_eq!(ray(0.0, 3.0).map(|hit| hit.1), Some(BodyKind::Wall), "behind the robot");
        assert_eq!(scene.hit(Pose2::default(), 1.7), None);
        assert_eq!(scene.range_m(Pose2::new(2.1, 0.0, 0.0), 10.0), Some(0.0), "within");
    }

    #[test]
    fn the_nearest_thing_counts() {
        let world = world();
        let scene = WorldScene { world: &world, bodies: &[PERSON] };
        assert!((scene.clearance_m(1.0, 0.0) - 0.75).abs() < 1e-12);
        assert!((scene.clearance_m(-3.0, 0.0) - 1.0).abs() < 1e-12);
        let (away_m, bearing_rad) = scene.nearest(2.0, -1.0).expect("the person");
        assert!((away_m - 0.75).abs() < 1e-12);
        assert!((bearing_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let (_, bearing_rad) = scene.nearest(-3.5, 0.0).expect("the wall");
        assert!((bearing_rad.abs() - std::f64::consts::PI).abs() < 1e-12);
    }
}
