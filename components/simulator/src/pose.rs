//! How poses compose, with sines from `libm` instead of the platform's: those differ in the last
//! bit from one machine to the next, and a seed shall give the same run on all of them.

pub use armor_grid::{Pose2, wrap_angle};

/// The transforms of [`Pose2`], rounded the same way on every machine.
pub trait Portable {
    /// Composes two transforms: `world_from_robot.then(robot_from_laser)` is `world_from_laser`.
    #[must_use]
    fn then(self, inner: Self) -> Self;

    /// Maps a point given in this pose's frame into the frame the pose is given in (metres).
    fn point_from(self, x_m: f64, y_m: f64) -> (f64, f64);

    /// Inverts the transform: `world_from_robot` becomes `robot_from_world`.
    #[must_use]
    fn inverted(self) -> Self;
}

impl Portable for Pose2 {
    fn then(self, inner: Self) -> Self {
        let (x_m, y_m) = self.point_from(inner.x_m, inner.y_m);
        Self { x_m, y_m, yaw_rad: wrap_angle(self.yaw_rad + inner.yaw_rad) }
    }

    fn point_from(self, x_m: f64, y_m: f64) -> (f64, f64) {
        let (sin, cos) = libm::sincos(self.yaw_rad);
        (self.x_m + cos * x_m - sin * y_m, self.y_m + sin * x_m + cos * y_m)
    }

    fn inverted(self) -> Self {
        let turned_back = Self::new(0.0, 0.0, -self.yaw_rad);
        let (x_m, y_m) = turned_back.point_from(-self.x_m, -self.y_m);
        Self { x_m, y_m, yaw_rad: wrap_angle(-self.yaw_rad) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn pose() -> impl Strategy<Value = Pose2> {
        (-50.0..50.0, -50.0..50.0, -PI..PI).prop_map(|(x, y, yaw)| Pose2::new(x, y, yaw))
    }

    fn is_close(a: Pose2, b: Pose2) -> bool {
        (a.x_m - b.x_m).abs() < 1e-9
            && (a.y_m - b.y_m).abs() < 1e-9
            && wrap_angle(a.yaw_rad - b.yaw_rad).abs() < 1e-9
    }

    proptest! {
        #[test]
        fn they_agree_with_the_platforms(a in pose(), b in pose()) {
            prop_assert!(is_close(a.then(b), a.compose(b)));
            prop_assert!(is_close(a.inverted(), a.inverse()));
            prop_assert!(is_close(a.then(a.inverted()), Pose2::IDENTITY));
        }
    }
}
