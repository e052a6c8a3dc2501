//! Driving by hand, as every screen does it that a person drives with.

use std::time::Duration;

/// Time without a message after which the robot is stopped: less than the driver's own timeout.
pub const DEAD_MAN: Duration = Duration::from_millis(400);

/// The fastest that a screen may drive the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveLimits {
    /// Speed, in metres per second.
    pub speed_mps: f64,
    /// Turn rate, in radians per second.
    pub turn_radps: f64,
}

impl DriveLimits {
    /// Returns the velocity within the limits; `None` if a number is not finite.
    pub fn clamp(self, forward_mps: f64, turn_radps: f64) -> Option<(f64, f64)> {
        if !forward_mps.is_finite() || !turn_radps.is_finite() {
            return None;
        }
        let Self { speed_mps, turn_radps: turn } = self;
        Some((forward_mps.clamp(-speed_mps, speed_mps), turn_radps.clamp(-turn, turn)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_stay_within_the_limits() {
        let limits = DriveLimits { speed_mps: 0.5, turn_radps: 1.0 };
        assert_eq!(limits.clamp(2.0, -3.0), Some((0.5, -1.0)));
        assert_eq!(limits.clamp(-0.1, 0.2), Some((-0.1, 0.2)));
        assert_eq!(limits.clamp(f64::NAN, 0.0), None);
        assert_eq!(limits.clamp(0.0, f64::INFINITY), None);
    }
}
