//! Where a scan is expected to have been taken, and how far around that it is searched.

use crate::pose::Pose;

/// What is searched, and what is expected there.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// The pose in the middle of the window.
    pub pose: Pose,
    /// Expected error of the position, metres along each axis.
    pub sigma_m: f64,
    /// Expected error of the heading, radians.
    pub sigma_rad: f64,
    /// Half the window's side, metres.
    pub window_m: f64,
    /// Half the window's angle, radians.
    pub window_rad: f64,
}
