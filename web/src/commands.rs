//! The robot that a page can drive and stop: the component that publishes its commands.

/// The fastest that a page may drive the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveLimits {
    /// Speed, in metres per second.
    pub speed_mps: f64,
    /// Turn rate, in radians per second.
    pub turn_radps: f64,
}

impl DriveLimits {
    /// Returns the velocity within the limits; `None` if a number is not finite.
    pub(crate) fn clamp(self, forward_mps: f64, turn_radps: f64) -> Option<(f64, f64)> {
        if !forward_mps.is_finite() || !turn_radps.is_finite() {
            return None;
        }
        let Self { speed_mps, turn_radps: turn } = self;
        Some((forward_mps.clamp(-speed_mps, speed_mps), turn_radps.clamp(-turn, turn)))
    }
}

/// Publishes commands to a robot. Each function returns the number of links that have accepted the
/// command, and never waits for a subscriber.
pub trait RobotCommands: Send + Sync {
    /// Returns the limits in force.
    fn limits(&self) -> DriveLimits;

    /// Publishes a velocity: forward in metres per second, turn in radians per second.
    ///
    /// # Errors
    /// In words, if it cannot be published.
    fn drive(&self, forward_mps: f64, turn_radps: f64) -> Result<usize, String>;

    /// Publishes STOP, or its release.
    ///
    /// # Errors
    /// In words, if it cannot be published.
    fn stop(&self, is_stopped: bool) -> Result<usize, String>;
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
