//! The robot that a page can drive and stop: the component that publishes its commands.

use armor_inspect::DriveLimits;

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
