//! Points and poses in the plane. A pose is also the transform that takes coordinates of its own
//! frame into the frame it is given in: `world_from_robot.apply(point_in_robot)`.

use std::f64::consts::PI;

/// A point in the plane, in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point2 {
    /// Coordinate along the x axis, in metres.
    pub x_m: f64,
    /// Coordinate along the y axis, in metres.
    pub y_m: f64,
}

impl Point2 {
    /// Makes a point from its coordinates in metres.
    pub const fn new(x_m: f64, y_m: f64) -> Self {
        Self { x_m, y_m }
    }

    /// Returns the distance to another point, in metres.
    pub fn distance_m(self, other: Self) -> f64 {
        (self.x_m - other.x_m).hypot(self.y_m - other.y_m)
    }

    /// Returns the direction in which another point lies, in radians from the x axis.
    pub fn bearing_rad(self, other: Self) -> f64 {
        (other.y_m - self.y_m).atan2(other.x_m - self.x_m)
    }

    /// Returns the point at `fraction` of the distance to another one (0 here, 1 there).
    pub fn toward(self, other: Self, fraction: f64) -> Self {
        Self {
            x_m: self.x_m + (other.x_m - self.x_m) * fraction,
            y_m: self.y_m + (other.y_m - self.y_m) * fraction,
        }
    }
}

/// A position and heading in the plane; also the rigid transform `outer_from_inner`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose2 {
    /// Position along the x axis, in metres.
    pub x_m: f64,
    /// Position along the y axis, in metres.
    pub y_m: f64,
    /// Heading, counter-clockwise from the x axis, in radians.
    pub yaw_rad: f64,
}

impl Pose2 {
    /// The pose at the origin, heading along x; the transform that changes nothing.
    pub const IDENTITY: Self = Self::new(0.0, 0.0, 0.0);

    /// Makes a pose from metres, metres and radians.
    pub const fn new(x_m: f64, y_m: f64, yaw_rad: f64) -> Self {
        Self { x_m, y_m, yaw_rad }
    }

    /// Returns whether it is a pose at all: what a peer sends may hold infinities and NaN.
    pub fn is_finite(self) -> bool {
        self.x_m.is_finite() && self.y_m.is_finite() && self.yaw_rad.is_finite()
    }

    /// Returns the position without the heading.
    pub const fn point(self) -> Point2 {
        Point2::new(self.x_m, self.y_m)
    }

    /// Chains two transforms: `a_from_b.compose(b_from_c)` is `a_from_c`.
    #[must_use]
    pub fn compose(self, inner: Self) -> Self {
        let position = self.apply(inner.point());
        Self::new(position.x_m, position.y_m, wrap_angle(self.yaw_rad + inner.yaw_rad))
    }

    /// Turns `a_from_b` into `b_from_a`.
    #[must_use]
    pub fn inverse(self) -> Self {
        let (sin, cos) = self.yaw_rad.sin_cos();
        Self::new(
            -cos * self.x_m - sin * self.y_m,
            sin * self.x_m - cos * self.y_m,
            wrap_angle(-self.yaw_rad),
        )
    }

    /// Takes a point of the inner frame into the outer one.
    pub fn apply(self, inner: Point2) -> Point2 {
        let (sin, cos) = self.yaw_rad.sin_cos();
        Point2::new(
            self.x_m + cos * inner.x_m - sin * inner.y_m,
            self.y_m + sin * inner.x_m + cos * inner.y_m,
        )
    }

    /// Returns the pose at `fraction` between this one and another, turning by the smaller angle.
    #[must_use]
    pub fn toward(self, other: Self, fraction: f64) -> Self {
        let position = self.point().toward(other.point(), fraction);
        let turn_rad = wrap_angle(other.yaw_rad - self.yaw_rad);
        Self::new(position.x_m, position.y_m, wrap_angle(self.yaw_rad + turn_rad * fraction))
    }

    /// Returns where a robot is after driving an exact arc for `duration_s` at constant speeds.
    #[must_use]
    pub fn after_arc(self, speed_mps: f64, turn_rate_radps: f64, duration_s: f64) -> Self {
        let turn_rad = turn_rate_radps * duration_s;
        let (along_m, aside_m) = if turn_rad.abs() < 1e-9 {
            (speed_mps * duration_s, 0.0)
        } else {
            let radius_m = speed_mps / turn_rate_radps;
            (radius_m * turn_rad.sin(), radius_m * (1.0 - turn_rad.cos()))
        };
        self.compose(Self::new(along_m, aside_m, turn_rad))
    }
}

/// Returns the same angle within -π..=π, in radians.
pub fn wrap_angle(angle_rad: f64) -> f64 {
    if (-PI..=PI).contains(&angle_rad) {
        return angle_rad;
    }
    (angle_rad + PI).rem_euclid(2.0 * PI) - PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pose() -> impl Strategy<Value = Pose2> {
        (-50.0..50.0, -50.0..50.0, -PI..PI).prop_map(|(x, y, yaw)| Pose2::new(x, y, yaw))
    }

    fn close(a: Pose2, b: Pose2) -> bool {
        a.point().distance_m(b.point()) < 1e-9 && wrap_angle(a.yaw_rad - b.yaw_rad).abs() < 1e-9
    }

    proptest! {
        #[test]
        fn a_pose_and_its_inverse_cancel(a in pose()) {
            prop_assert!(close(a.compose(a.inverse()), Pose2::IDENTITY));
            prop_assert!(close(a.inverse().compose(a), Pose2::IDENTITY));
        }

        #[test]
        fn chaining_is_associative(a in pose(), b in pose(), c in pose()) {
            prop_assert!(close(a.compose(b).compose(c), a.compose(b.compose(c))));
        }

        #[test]
        fn transforms_keep_distances(a in pose(), b in pose(), c in pose()) {
            let before = b.point().distance_m(c.point());
            let after = a.apply(b.point()).distance_m(a.apply(c.point()));
            prop_assert!((before - after).abs() < 1e-9);
        }

        #[test]
        fn wrapping_keeps_the_direction(angle in -100.0..100.0_f64) {
            let wrapped = wrap_angle(angle);
            prop_assert!((-PI..=PI).contains(&wrapped));
            prop_assert!((wrapped.sin() - angle.sin()).abs() < 1e-9);
            prop_assert!((wrapped.cos() - angle.cos()).abs() < 1e-9);
        }

        #[test]
        fn two_half_arcs_make_one(a in pose(), v in -1.0..1.0_f64, w in -2.0..2.0_f64) {
            let halves = a.after_arc(v, w, 0.5).after_arc(v, w, 0.5);
            prop_assert!(close(halves, a.after_arc(v, w, 1.0)));
        }
    }

    #[test]
    fn what_is_not_finite_is_no_pose() {
        assert!(Pose2::new(1.0, -2.0, 3.0).is_finite());
        assert!(!Pose2::new(f64::NAN, 0.0, 0.0).is_finite());
        assert!(!Pose2::new(0.0, f64::INFINITY, 0.0).is_finite());
        assert!(!Pose2::new(0.0, 0.0, f64::NAN).is_finite());
    }

    #[test]
    fn a_quarter_turn_takes_x_into_y() {
        let world_from_robot = Pose2::new(1.0, 2.0, PI / 2.0);
        let seen = world_from_robot.apply(Point2::new(3.0, 0.0));
        assert!(seen.distance_m(Point2::new(1.0, 5.0)) < 1e-12);
    }

    #[test]
    fn half_way_turns_the_shorter_way_round() {
        let middle = Pose2::new(0.0, 0.0, 3.0).toward(Pose2::new(2.0, 0.0, -3.0), 0.5);
        assert!((middle.x_m - 1.0).abs() < 1e-12);
        assert!(wrap_angle(middle.yaw_rad - PI).abs() < 1e-12);
    }
}
