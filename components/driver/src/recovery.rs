//! Detects a stuck robot and frees it: back off a little, then turn.

use std::f64::consts::TAU;

use armor_grid::{Point2, Pose2, wrap_angle};

use crate::limits::Velocity;
use crate::window::DynamicWindow;

/// Without having moved `MOVED_M` for this long, not counting turns, the robot is stuck, in
/// seconds.
const STUCK_S: f64 = 4.0;
/// Less than this is not moving, in metres.
const MOVED_M: f64 = 0.1;
/// Turning this far on one spot leads nowhere, in radians.
const DIZZY_RAD: f64 = 2.0 * TAU;
/// How long and how fast to back off: 15 cm at most, for little is known of what is behind.
const BACK_S: f64 = 1.5;
const BACK_MPS: f64 = -0.1;
/// How long and how fast to turn afterwards: about a right angle.
const TURN_S: f64 = 2.0;
const TURN_RADPS: f64 = 0.8;

/// Watches the robot get somewhere.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StuckRecovery {
    /// Where and when it was last known to move, and how it turned since.
    moved: Option<Moved>,
    /// When getting loose began, and to which side to turn.
    began: Option<(f64, f64)>,
}

#[derive(Clone, Copy, Debug)]
struct Moved {
    place: Point2,
    at_s: f64,
    yaw_rad: f64,
    turned_rad: f64,
    /// The part of the turns that came before `at_s`.
    uncounted_rad: f64,
}

impl StuckRecovery {
    /// The robot has no reason to move, or just got one.
    pub(crate) fn rest(&mut self) {
        *self = Self::default();
    }

    /// The robot has turned on the spot to where its path leads. Where it goes next may be where it came
    /// from, so that it counts from here whether it gets somewhere; the turns on one spot count on.
    pub(crate) fn turned_to_path(&mut self, robot: Pose2, now_s: f64) {
        if let Some(moved) = &mut self.moved {
            (moved.place, moved.yaw_rad) = (robot.point(), robot.yaw_rad);
            (moved.at_s, moved.uncounted_rad) = (now_s, moved.turned_rad);
        }
    }

    /// Returns how to move if the robot is stuck; backing off only if it `has_path` to return to.
    pub(crate) fn step(
        &mut self,
        robot: Pose2,
        has_path: bool,
        window: &DynamicWindow<'_>,
        now_s: f64,
    ) -> Option<Velocity> {
        if let Some((began_s, side)) = self.began {
            return self.choose_escape(began_s, side, has_path, window, now_s);
        }
        let Pose2 { yaw_rad, .. } = robot;
        let place = robot.point();
        let here = Moved { place, at_s: now_s, yaw_rad, turned_rad: 0.0, uncounted_rad: 0.0 };
        let moved = self.moved.get_or_insert(here);
        moved.turned_rad += wrap_angle(yaw_rad - moved.yaw_rad).abs();
        moved.yaw_rad = yaw_rad;
        // A robot that turns towards its path stays in place and is not stuck. Endless turning is:
        // two turns on one spot lead nowhere.
        let turned_s = (moved.turned_rad - moved.uncounted_rad) / window.limits.turn_radps;
        if moved.place.distance_m(here.place) > MOVED_M {
            *moved = here;
        } else if now_s - moved.at_s - turned_s > STUCK_S || moved.turned_rad > DIZZY_RAD {
            self.began = Some((now_s, free_side(window.obstacles)));
        }
        None
    }

    fn choose_escape(
        &mut self,
        began_s: f64,
        side: f64,
        has_path: bool,
        window: &DynamicWindow<'_>,
        now_s: f64,
    ) -> Option<Velocity> {
        let back = Velocity { speed_mps: BACK_MPS, turn_radps: 0.0 };
        // The absolute value: after time went back, an escape must not last until time has caught
        // up.
        match (now_s - began_s).abs() {
            since_s if since_s < BACK_S && has_path && window.is_safe(back) => Some(back),
            since_s if since_s < BACK_S + TURN_S => Some(Velocity::spin(side * TURN_RADPS)),
            _ => {
                self.rest();
                None
            }
        }
    }
}

/// 1 if there is more room on the left, -1 if on the right.
fn free_side(obstacles: &[Point2]) -> f64 {
    let crowd = |side: f64| -> f64 {
        let there = obstacles.iter().filter(|point| point.y_m * side > 0.0);
        there.map(|point| 1.0 / point.distance_m(Point2::default()).max(0.1).powi(2)).sum()
    };
    if crowd(1.0) <= crowd(-1.0) { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::DriveLimits;
    use crate::window::Distances;

    const LIMITS: DriveLimits = DriveLimits {
        speed_mps: 0.6,
        turn_radps: 1.2,
        acceleration_mps2: 0.8,
        turn_acceleration_radps2: 3.0,
    };

    /// Steps a robot that stays where it is; returns what it did in each second from 0 to 8.
    fn check(has_path: bool, obstacles: &[Point2], expected: [Option<Velocity>; 9]) {
        let distances = Distances { keep_m: 0.2, comfort_m: 0.4 };
        let now = Velocity::ZERO;
        let (zones, interval_s) = (None, 0.1);
        let window =
            DynamicWindow { limits: &LIMITS, distances, obstacles, zones, now, interval_s };
        let mut recovery = StuckRecovery::default();
        let mut did = [None; 9];
        for tick in 0..=80_u32 {
            let now_s = f64::from(tick) * 0.1;
            let velocity = recovery.step(Pose2::IDENTITY, has_path, &window, now_s);
            if tick % 10 == 0 {
                did[tick as usize / 10] = velocity;
            }
        }
        assert_eq!(did, expected);
    }

    const BACK: Option<Velocity> = Some(Velocity { speed_mps: BACK_MPS, turn_radps: 0.0 });
    const LEFT: Option<Velocity> = Some(Velocity::spin(TURN_RADPS));
    const RIGHT: Option<Velocity> = Some(Velocity::spin(-TURN_RADPS));

    #[test]
    fn stuck_it_backs_off_and_turns_to_the_free_side() {
        let left_wall = [Point2::new(0.3, 0.3)];
        check(true, &left_wall, [None, None, None, None, None, BACK, RIGHT, RIGHT, None]);
    }

    #[test]
    fn it_does_not_back_into_what_is_behind() {
        let behind = [Point2::new(-0.21, -0.01)];
        check(true, &behind, [None, None, None, None, None, LEFT, LEFT, LEFT, None]);
    }

    #[test]
    fn without_a_path_it_only_looks_around() {
        check(false, &[], [None, None, None, None, None, LEFT, LEFT, LEFT, None]);
    }

    #[test]
    fn a_robot_that_moves_is_left_alone() {
        let distances = Distances { keep_m: 0.2, comfort_m: 0.4 };
        let now = Velocity::ZERO;
        let window = DynamicWindow {
            limits: &LIMITS,
            distances,
            obstacles: &[],
            zones: None,
            now,
            interval_s: 0.1,
        };
        let mut recovery = StuckRecovery::default();
        for tick in 0..300 {
            let robot = Pose2::new(f64::from(tick) * 0.005, 0.0, 0.0);
            assert_eq!(recovery.step(robot, true, &window, f64::from(tick) * 0.1), None);
        }
    }

    #[test]
    fn a_slow_robot_that_is_sent_back_is_left_alone_until_it_turns_for_ever() {
        let distances = Distances { keep_m: 0.2, comfort_m: 0.4 };
        let now = Velocity::ZERO;
        let (zones, interval_s) = (None, 0.1);
        let window =
            DynamicWindow { limits: &LIMITS, distances, obstacles: &[], zones, now, interval_s };
        // Returns whether it has escaped within ten drives of so many steps of 5 mm, with a turn
        // after each.
        let escapes = |steps: u32| {
            let (mut recovery, mut now_s, mut robot) =
                (StuckRecovery::default(), 0.0, Pose2::IDENTITY);
            let mut has_escaped = false;
            for _ in 0..10 {
                for step in 0..steps + 26 {
                    now_s += 0.1;
                    robot = match step {
                        step if step < steps => robot.after_arc(0.05, 0.0, 0.1),
                        _ => robot.after_arc(0.0, TAU / 52.0 / 0.1, 0.1),
                    };
                    has_escaped |= recovery.step(robot, true, &window, now_s).is_some();
                }
                recovery.turned_to_path(robot, now_s);
            }
            has_escaped
        };
        assert!(!escapes(38), "it drives 19 cm, and back");
        assert!(escapes(2), "it turns on one spot");
    }
}
