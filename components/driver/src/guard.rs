//! Limits manual velocities so that the robot does not run into things.

use crate::limits::Velocity;
use crate::window::DynamicWindow;

/// Speeds tried between what the hand wants and none.
const SPEEDS: u32 = 10;

/// Returns what comes nearest to `wanted` of what the base can take up next and can still stop from
/// before it hits anything: the turn as wanted, and as much of the speed as is safe.
pub(crate) fn guard_velocity(window: &DynamicWindow<'_>, wanted: Velocity) -> Velocity {
    let slower = (0..=SPEEDS).rev().map(|step| {
        let speed_mps = wanted.speed_mps * f64::from(step) / f64::from(SPEEDS);
        window.limits.approach_velocity(
            window.now,
            Velocity { speed_mps, ..wanted },
            window.interval_s,
        )
    });
    // Where even slowing down on another arc is not safe, this one was.
    let braked = || window.limits.brake_velocity(window.now, window.interval_s);
    slower.into_iter().find(|&next| window.is_safe(next)).unwrap_or_else(braked)
}
