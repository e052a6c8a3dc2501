//! A round base that moves until something stops it, and what its bumper feels.

use std::f64::consts::FRAC_PI_4;

use crate::pose::{Pose2, wrap_angle};
use crate::scene::WorldScene;

/// How far the base must be off a thing before touching it again counts as another collision
/// (metres).
const CONTACT_RELEASE_M: f64 = 0.02;

/// Nearer than this to its edge the base touches, in metres: the bumper's travel.
const CONTACT_M: f64 = 0.001;

/// A side of the base, a quarter of it each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactSide {
    /// Within 45° of ahead.
    Front,
    /// Within 45° of the left.
    Left,
    /// Within 45° of backwards.
    Rear,
    /// Within 45° of the right.
    Right,
}

/// The base as a body: where it is and what it has run into.
#[derive(Clone, Debug)]
pub(crate) struct Base {
    pub(crate) radius_m: f64,
    pub(crate) pose: Pose2,
    pub(crate) collisions: u64,
    is_touching: bool,
}

impl Base {
    /// At the origin of the map.
    pub(crate) fn new(radius_m: f64) -> Self {
        Self { radius_m, pose: Pose2::default(), collisions: 0, is_touching: false }
    }

    /// Drives an arc of a given length and turn, as far as things let it; returns whether the whole
    /// arc was driven stop it. The arc is cut into pieces of a quarter radius: a base that is clear
    /// of a wall cannot be beyond it one piece later.
    pub(crate) fn travel_until_contact(
        &mut self,
        scene: WorldScene<'_>,
        length_m: f64,
        turn_rad: f64,
    ) -> bool {
        let pieces = libm::ceil(length_m.abs() / (self.radius_m / 4.0)).max(1.0);
        let mut is_free = true;
        for _ in 0..pieces as u32 {
            let next = along_arc(self.pose, length_m / pieces, turn_rad / pieces);
            if length_m == 0.0 || self.may_be(scene, next) {
                self.pose = next;
            } else {
                self.run_into(scene, length_m / pieces, turn_rad / pieces);
                is_free = false;
                break;
            }
        }
        self.feel_contact(scene);
        is_free
    }

    /// What the bumper feels: the side of the nearest thing that touches.
    pub(crate) fn contact(&self, scene: WorldScene<'_>) -> Option<ContactSide> {
        let (away_m, bearing_rad) = scene.nearest(self.pose.x_m, self.pose.y_m)?;
        if away_m > self.radius_m + CONTACT_M {
            return None;
        }
        let from_ahead_rad = wrap_angle(bearing_rad - self.pose.yaw_rad);
        Some(match from_ahead_rad.abs() {
            off_rad if off_rad <= FRAC_PI_4 => ContactSide::Front,
            off_rad if off_rad >= 3.0 * FRAC_PI_4 => ContactSide::Rear,
            _ if from_ahead_rad > 0.0 => ContactSide::Left,
            _ => ContactSide::Right,
        })
    }

    /// Whether the base may be there: clear of everything, or leaving what it touches.
    fn may_be(&self, scene: WorldScene<'_>, next: Pose2) -> bool {
        let clearance_m = scene.clearance_m(next.x_m, next.y_m);
        clearance_m >= self.radius_m
            || clearance_m > scene.clearance_m(self.pose.x_m, self.pose.y_m)
    }

    /// Halves the motion until the base touches, and counts a new contact.
    fn run_into(&mut self, scene: WorldScene<'_>, length_m: f64, turn_rad: f64) {
        let (mut free, mut blocked) = (0.0, 1.0);
        for _ in 0..10 {
            let share = f64::midpoint(free, blocked);
            let there = along_arc(self.pose, length_m * share, turn_rad * share);
            let is_free = scene.clearance_m(there.x_m, there.y_m) >= self.radius_m;
            *(if is_free { &mut free } else { &mut blocked }) = share;
        }
        let stop = along_arc(self.pose, length_m * free, turn_rad * free);
        // Turning on the spot is free: the footprint is round.
        self.pose = Pose2 { yaw_rad: wrap_angle(self.pose.yaw_rad + turn_rad), ..stop };
        self.count_touch();
    }

    /// Counts the people that have run into the base, and forgets a contact that is over.
    fn feel_contact(&mut self, scene: WorldScene<'_>) {
        let Pose2 { x_m, y_m, .. } = self.pose;
        let bodies = scene.bodies.iter().map(|body| body.clearance_m(x_m, y_m));
        if bodies.fold(f64::INFINITY, f64::min) <= self.radius_m + CONTACT_M {
            self.count_touch();
        } else if scene.clearance_m(x_m, y_m) > self.radius_m + CONTACT_RELEASE_M {
            self.is_touching = false;
        }
    }

    fn count_touch(&mut self) {
        self.collisions += u64::from(!self.is_touching);
        self.is_touching = true;
    }
}

/// Where a pose ends up after an arc of a given length and turn.
fn along_arc(pose: Pose2, length_m: f64, turn_rad: f64) -> Pose2 {
    let half_rad = turn_rad / 2.0;
    let chord_m =
        if half_rad.abs() < 1e-9 { length_m } else { length_m * libm::sin(half_rad) / half_rad };
    let (sin, cos) = libm::sincos(pose.yaw_rad + half_rad);
    Pose2 {
        x_m: pose.x_m + chord_m * cos,
        y_m: pose.y_m + chord_m * sin,
        yaw_rad: wrap_angle(pose.yaw_rad + turn_rad),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Body, BodyKind};
    use crate::world::World;

    fn room() -> World {
        let text = r#"<svg><rect x="-3" y="-3" width="6" height="6"/><circle id="start"/></svg>"#;
        World::parse("room.svg", text.as_bytes()).expect("a readable world")
    }

    #[test]
    fn the_bumper_reports_which_side_touches() {
        let world = room();
        let scene = WorldScene::from(&world);
        for (yaw_rad, side) in [
            (0.0, ContactSide::Front),
            (1.57, ContactSide::Right),
            (3.1, ContactSide::Rear),
            (-1.57, ContactSide::Left),
        ] {
            let mut base = Base::new(0.2);
            assert_eq!(base.contact(scene), None);
            base.pose = Pose2::new(2.7995, 0.0, yaw_rad);
            assert_eq!(base.contact(scene), Some(side), "{yaw_rad}");
        }
    }

    #[test]
    fn who_runs_into_a_base_that_stands_is_counted_once() {
        let world = room();
        let mut base = Base::new(0.2);
        let at = |x_m| Body { x_m, y_m: 0.0, radius_m: 0.25, kind: BodyKind::Person };
        for (x_m, collisions) in [(0.6, 0), (0.4505, 1), (0.45, 1), (0.465, 1), (0.6, 1), (0.45, 2)]
        {
            let bodies = [at(x_m)];
            assert!(base.travel_until_contact(
                WorldScene { world: &world, bodies: &bodies },
                0.0,
                0.0
            ));
            assert_eq!(base.collisions, collisions, "{x_m}");
        }
    }

    #[test]
    fn a_body_stops_the_base_and_it_may_leave() {
        let world = room();
        let bodies = [Body { x_m: 1.0, y_m: 0.0, radius_m: 0.25, kind: BodyKind::Person }];
        let scene = WorldScene { world: &world, bodies: &bodies };
        let mut base = Base::new(0.2);
        assert!(!base.travel_until_contact(scene, 2.0, 0.0));
        assert!((base.pose.x_m - 0.55).abs() < 0.001, "{:?}", base.pose);
        assert_eq!((base.contact(scene), base.collisions), (Some(ContactSide::Front), 1));
        assert!(base.travel_until_contact(scene, -0.3, 0.0));
        assert_eq!((base.contact(scene), base.collisions), (None, 1));
    }
}
