//! What can be set in the file.

use std::path::PathBuf;

use armor_convert::{MountError, locate_level};
use armor_sdk::prelude::*;

use crate::config::Config;
use crate::pose::Pose;

/// An angle of one degree, in radians.
const DEG: f64 = std::f64::consts::PI / 180.0;

/// What can be set in the file.
#[derive(Debug, Parameters)]
pub(super) struct GridSlamParameters {
    /// hypotheses about trajectory and map that are followed in parallel
    #[parameter(default = 8, range = 1.0..=500.0)]
    pub particles: usize,
    /// the same seed and data give the same map
    #[parameter(default = 1, range = 0.0..=1e15)]
    pub seed: u64,
    /// cores to use, 0 for all; changes nothing but the speed
    #[parameter(default = 0, range = 0.0..=64.0)]
    pub threads: usize,
    /// old places are recognised, and the whole map is corrected by them
    #[parameter(default = true)]
    pub loop_closing: bool,
    /// long walls within 1 degree of a direction that many walls have measure the heading; false where
    /// walls differ by less
    #[parameter(default = true)]
    pub parallel_walls: bool,
    /// side of a map cell
    #[parameter(unit = "m", default = "0.05m", range = 0.01..=1.0)]
    pub resolution_m: f64,
    /// the frames of the file: where the laser is on the robot
    #[parameter(default = "", format = "frames")]
    pub frames: Vec<FixedFrame>,
    /// the laser's frame
    #[parameter(default = "laser", format = "frame")]
    pub laser_frame: String,
    /// period at which the whole map is published if it has changed; changes at every tick
    #[parameter(unit = "s", default = "1s", range = 0.05..=3600.0)]
    pub map_period_s: f64,
    /// the map is drawn on after moving this far
    #[parameter(unit = "m", default = "0.2m", range = 0.01..=10.0)]
    pub keyframe_distance_m: f64,
    /// or after turning this far
    #[parameter(unit = "deg", default = "10deg", range = 0.5 * DEG..=180.0 * DEG)]
    pub keyframe_turn_rad: f64,
    /// expected odometry error, as a share of the distance driven
    #[parameter(default = 0.06, range = 0.001..=1.0)]
    pub slip: f64,
    /// expected odometry error, heading for each metre driven
    #[parameter(unit = "deg", default = "0.02rad", range = 0.005 * DEG..=60.0 * DEG)]
    pub bend_rad: f64,
    /// expected odometry error, as a share of the angle turned
    #[parameter(default = 0.08, range = 0.001..=1.0)]
    pub skid: f64,
    /// the map is kept in a file: after its own death the mapper continues in the same frame
    #[parameter(default = true)]
    pub keep_state: bool,
    /// folder of that file, within the run's folder
    #[parameter(default = "states", written)]
    pub state_folder: PathBuf,
}

impl GridSlamParameters {
    /// Where the laser is on the robot.
    pub fn robot_from_laser(&self) -> Result<Pose, MountError> {
        let placed = locate_level(&self.frames, &self.laser_frame)?;
        Ok(Pose::new(placed.x_m, placed.y_m, placed.yaw_rad))
    }

    /// The configuration of the algorithm.
    pub fn config(&self) -> Config {
        Config {
            particles: self.particles,
            seed: self.seed,
            threads: self.threads,
            loop_closing: self.loop_closing,
            parallel_walls: self.parallel_walls,
            resolution_m: self.resolution_m,
            // Without it no scan is taken.
            robot_from_laser: self.robot_from_laser().unwrap_or_default(),
            keyframe_m: self.keyframe_distance_m,
            keyframe_rad: self.keyframe_turn_rad,
            slip: self.slip,
            bend_radpm: self.bend_rad,
            skid: self.skid,
            ..Config::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declared_defaults_are_those_of_the_algorithm() {
        assert_eq!(GridSlamParameters::defaults().config(), Config::default());
    }
}
