//! Poses in the plane and their composition: `world_from_robot * robot_from_laser`.

use std::f64::consts::{PI, TAU};
use std::ops::Mul;

/// A position and heading, or the transform from its frame to the frame it is given in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Metres along x.
    pub x_m: f64,
    /// Metres along y.
    pub y_m: f64,
    /// Heading in radians, counter-clockwise from x.
    pub yaw_rad: f64,
}

impl Pose {
    /// Makes a pose; the heading is kept as given.
    pub const fn new(x_m: f64, y_m: f64, yaw_rad: f64) -> Self {
        Self { x_m, y_m, yaw_rad }
    }

    /// Returns the inverse transform: `robot_from_world` of `world_from_robot`.
    pub fn inverse(&self) -> Self {
        let (sin, cos) = self.yaw_rad.sin_cos();
        Self {
            x_m: -cos * self.x_m - sin * self.y_m,
            y_m: sin * self.x_m - cos * self.y_m,
            yaw_rad: -self.yaw_rad,
        }
    }

    /// Brings a point of this frame into the frame the pose is given in.
    pub fn apply(&self, point: Point) -> Point {
        let (sin, cos) = self.yaw_rad.sin_cos();
        Point {
            x_m: self.x_m + cos * point.x_m - sin * point.y_m,
            y_m: self.y_m + sin * point.x_m + cos * point.y_m,
        }
    }

    /// Distance between the positions, metres.
    pub fn distance_m(&self, other: &Self) -> f64 {
        (self.x_m - other.x_m).hypot(self.y_m - other.y_m)
    }

    /// The pose at `part` of the distance to another (0 … 1), turning by the smaller angle.
    pub fn towards(&self, other: &Self, part: f64) -> Self {
        Self::new(
            self.x_m + part * (other.x_m - self.x_m),
            self.y_m + part * (other.y_m - self.y_m),
            wrapped(self.yaw_rad + part * wrapped(other.yaw_rad - self.yaw_rad)),
        )
    }

    /// Returns whether all three numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.x_m.is_finite() && self.y_m.is_finite() && self.yaw_rad.is_finite()
    }
}

impl Mul for Pose {
    type Output = Self;

    // Composing poses adds their headings.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, inner: Self) -> Self {
        let position = self.apply(Point { x_m: inner.x_m, y_m: inner.y_m });
        Self::new(position.x_m, position.y_m, wrapped(self.yaw_rad + inner.yaw_rad))
    }
}

/// A point in the plane, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Metres along x.
    pub x_m: f64,
    /// Metres along y.
    pub y_m: f64,
}

/// Brings an angle into -π..π.
pub fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_times_its_inverse_is_nothing() {
        let pose = Pose::new(3.0, -2.0, 2.5);
        for nothing in [pose * pose.inverse(), pose.inverse() * pose] {
            assert!(nothing.distance_m(&Pose::default()) < 1e-12, "{nothing:?}");
            assert!(nothing.yaw_rad.abs() < 1e-12, "{nothing:?}");
        }
    }

    #[test]
    fn composition_goes_from_the_inner_frame_outwards() {
        let point = Pose::new(1.0, 0.0, PI / 2.0) * Pose::new(2.0, 0.0, PI);
        assert!(point.distance_m(&Pose::new(1.0, 2.0, 0.0)) < 1e-12, "{point:?}");
        assert!((point.yaw_rad + PI / 2.0).abs() < 1e-12, "{point:?}");
    }
}
