//! The dynamic window (Fox, Burgard & Thrun, "The Dynamic Window Approach to Collision Avoidance",
//! IEEE RAM 1997): of the speeds the base can take up next, those whose arc hits nothing before it
//! could stop, and of these the one that best approaches the target.

use armor_grid::{Point2, Pose2};

use crate::limits::{DriveLimits, REACTION_S, Velocity};
use crate::zones_around::ZonesAround;

/// Arcs are looked at this far ahead, in seconds.
pub(crate) const HORIZON_S: f64 = 1.2;
/// In steps of this, in seconds: 6 cm at full speed.
const STEP_S: f64 = 0.1;
/// A command takes effect this long after the senses it is based on, in seconds; until then the
/// robot moves on as it does now.
const DELAY_S: f64 = 0.1;
/// The faster past a thing, the wider, in metres per metre per second: senses and commands are
/// late, and a person takes a step.
const CARE_S: f64 = 0.1;
/// So much closer than it should be the robot may creep in a narrow place, in metres, and no more.
const SLACK_M: f64 = 0.012;
/// Speeds tried between the slowest and the fastest.
const SPEEDS: usize = 6;
/// Turn rates tried between the left-most and the right-most; odd, so that the middle is one.
const TURNS: usize = 15;

// The cost of an arc is a weighted sum, in units of the distance to the target: an arc that comes
// no closer to it costs 1, one that passes through it 0. The weights state what else is worth how
// much.

/// A radian off the target's direction costs as much as missing the target by 35 % of its distance:
/// of two arcs that come equally close, the one that faces the target wins.
const HEADING_WEIGHT: f64 = 0.35;
/// The closest passage that is allowed costs as much as 40 % of the distance. The term is squared,
/// so that half of the comfort distance costs a quarter of that and a narrow gap still beats
/// standing.
const TIGHT_WEIGHT: f64 = 0.4;
/// Standing costs as much as 20 % of the distance. It is the smallest weight: speed decides between
/// arcs that are about equally good otherwise.
const SLOW_WEIGHT: f64 = 0.2;
/// Closer to the target than this, its direction counts less the closer it is, in metres: a target
/// that is reached has no direction any more.
const DIRECTION_M: f64 = 0.2;
/// The distance to the target counts as this at least, in metres, so that a miss by millimetres is
/// not divided by nothing.
const LEAST_DISTANCE_M: f64 = 0.1;
/// A fastest speed below this counts as this, in metres per second: it is a divisor.
const LEAST_FASTEST_MPS: f64 = 0.05;
/// Braking may be sharper than starting: this many times as hard.
const BRAKE_FACTOR: f64 = 2.0;
/// A base that needs less than this to stop hardly rolls any more, and may turn where it is, in
/// metres.
const ROLLED_OUT_M: f64 = 0.01;
/// From too close, an arc may come closer by this, in metres: the noise of a range is larger.
const CLOSER_M: f64 = 0.005;
/// From too close, an arc must leave this much of the distance at least, in metres: rounding must
/// not forbid an arc that stays at that distance.
const ROUNDING_M: f64 = 0.001;

/// How close the robot's centre may and should come to things.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Distances {
    /// Never closer, in metres.
    pub(crate) keep_m: f64,
    /// Closer only if it must be, in metres.
    pub(crate) comfort_m: f64,
}

/// One choice to make: where to, from which speeds, among what.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DynamicWindow<'a> {
    pub(crate) limits: &'a DriveLimits,
    pub(crate) distances: Distances,
    /// Everything near, in the robot's frame.
    pub(crate) obstacles: &'a [Point2],
    /// The zones near the robot; `None` if it is not known where it is on the map.
    pub(crate) zones: Option<&'a ZonesAround<'a>>,
    /// The velocity now.
    pub(crate) now: Velocity,
    /// Until the next choice, in seconds.
    pub(crate) interval_s: f64,
}

impl DynamicWindow<'_> {
    /// Returns the best forward velocity towards `target`, no faster than `fastest_mps`.
    ///
    /// `target` is in the robot's frame. `None` if every arc hits something.
    pub(crate) fn choose_velocity(&self, target: Point2, fastest_mps: f64) -> Option<Velocity> {
        let candidates = self.reachable_speeds(fastest_mps).flat_map(|speed_mps| {
            self.reachable_turns().map(move |turn_radps| Velocity { speed_mps, turn_radps })
        });
        candidates
            .filter_map(|velocity| Some((velocity, self.arc_cost(velocity, target, fastest_mps)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(velocity, _)| velocity)
    }

    /// Returns whether the base can drive on like this and still stop before it hits anything.
    pub(crate) fn is_safe(&self, velocity: Velocity) -> bool {
        self.nearest_on_arc(velocity).is_some()
    }

    /// Returns whether the base comes to rest before it hits anything, whatever it turns meanwhile.
    pub(crate) fn is_room_to_stop(&self) -> bool {
        let speed_mps = self.now.speed_mps.abs();
        let stop_m =
            speed_mps * REACTION_S + speed_mps * speed_mps / (2.0 * self.limits.acceleration_mps2);
        let keep_m = self.distances.keep_m + stop_m;
        let is_clear = || {
            self.nearest_m(Pose2::IDENTITY) > keep_m
                && self.zone_room_m(Pose2::IDENTITY, |_| keep_m).is_some()
        };
        stop_m < ROLLED_OUT_M || is_clear()
    }

    /// Returns whether nothing is closer than `clear_m` to the straight line to a point in the
    /// robot's frame, or no closer than it is to the robot now.
    pub(crate) fn is_way_clear(&self, to: Point2, clear_m: f64) -> bool {
        if !self.zones.is_none_or(|zones| zones.is_line_clear(to, clear_m)) {
            return false;
        }
        let clear_m = clear_m.min(self.nearest_m(Pose2::IDENTITY));
        let length_m2 = (to.x_m * to.x_m + to.y_m * to.y_m).max(1e-9);
        self.obstacles.iter().all(|point| {
            let along = (point.x_m * to.x_m + point.y_m * to.y_m) / length_m2;
            Point2::default().toward(to, along.clamp(0.0, 1.0)).distance_m(*point) >= clear_m
        })
    }

    fn reachable_speeds(&self, fastest_mps: f64) -> impl Iterator<Item = f64> + use<> {
        let step = self.limits.acceleration_mps2 * self.interval_s;
        let highest = (self.now.speed_mps + step).min(fastest_mps).max(0.0);
        let lowest = (self.now.speed_mps - BRAKE_FACTOR * step).clamp(0.0, highest);
        spread_evenly(lowest, highest, SPEEDS)
    }

    fn reachable_turns(&self) -> impl Iterator<Item = f64> + use<> {
        let step = self.limits.turn_acceleration_radps2 * self.interval_s;
        let most = self.limits.turn_radps;
        let right = (self.now.turn_radps - step).clamp(-most, most);
        let left = (self.now.turn_radps + step).clamp(-most, most);
        spread_evenly(right, left, TURNS)
    }

    /// What an arc costs (lower is better), or `None` if it is not safe.
    fn arc_cost(&self, velocity: Velocity, target: Point2, fastest_mps: f64) -> Option<f64> {
        let (nearest_m, seconds) = self.nearest_on_arc(velocity)?;
        let now_m = target.distance_m(Point2::default()).max(LEAST_DISTANCE_M);
        // Judged where it comes closest, not where it ends: passing the target fast is no fault.
        let (in_robot, miss_m) = self.closest_to(target, velocity, seconds);
        let bearing_rad = Point2::default().bearing_rad(in_robot);
        let off_rad = bearing_rad.abs() * (miss_m / DIRECTION_M).min(1.0);
        let Distances { keep_m, comfort_m } = self.distances;
        let tight = ((comfort_m - nearest_m) / (comfort_m - keep_m)).clamp(0.0, 1.0);
        let slow = 1.0 - velocity.speed_mps / fastest_mps.max(LEAST_FASTEST_MPS);
        let terms = miss_m / now_m + HEADING_WEIGHT * off_rad + TIGHT_WEIGHT * tight * tight;
        Some(terms + SLOW_WEIGHT * slow)
    }

    /// The least distance to anything on the arc as far as it is driven before a stop, and for how
    /// long it can be driven; `None` if that comes too close.
    fn nearest_on_arc(&self, velocity: Velocity) -> Option<(f64, f64)> {
        let start_m = self.nearest_m(Pose2::IDENTITY);
        let speed_mps = velocity.speed_mps.abs();
        // A robot that stands too close already may move, but hardly closer.
        let keep_from = |start_m: f64| {
            let crept_m = (start_m - CLOSER_M).max(self.distances.keep_m - SLACK_M);
            let slack_m = crept_m.min(start_m - ROUNDING_M);
            (self.distances.keep_m + CARE_S * speed_mps).min(slack_m)
        };
        let keep_m = keep_from(start_m);
        let stop_s = REACTION_S + self.interval_s + speed_mps / self.limits.acceleration_mps2;
        let mut nearest_m = start_m;
        let mut time_s = 0.0;
        while time_s < HORIZON_S.max(stop_s) {
            let next_s = time_s + STEP_S;
            let pose = self.pose_after(velocity, next_s);
            let away_m = self.nearest_m(pose);
            let room_m = self.zone_room_m(pose, keep_from).filter(|_| away_m >= keep_m);
            let Some(room_m) = room_m else {
                return (next_s > stop_s).then_some((nearest_m, time_s));
            };
            nearest_m = nearest_m.min(away_m).min(room_m);
            time_s = next_s;
        }
        Some((nearest_m, time_s))
    }

    /// The target as it lies before the robot where the arc passes closest to it, and how far away.
    fn closest_to(&self, target: Point2, velocity: Velocity, seconds: f64) -> (Point2, f64) {
        let steps = (seconds / STEP_S).round() as u32;
        let passed = (0..=steps).map(|step| {
            let pose = self.pose_after(velocity, f64::from(step) * STEP_S);
            let in_robot = pose.inverse().apply(target);
            (in_robot, in_robot.distance_m(Point2::default()))
        });
        passed.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((target, f64::INFINITY))
    }

    /// Where the robot will be when it has driven like this for a while.
    fn pose_after(&self, velocity: Velocity, time_s: f64) -> Pose2 {
        let Velocity { speed_mps, turn_radps } = self.now;
        Pose2::IDENTITY.after_arc(speed_mps, turn_radps, DELAY_S).after_arc(
            velocity.speed_mps,
            velocity.turn_radps,
            time_s,
        )
    }

    /// The least room that zones leave at a pose; `None` if one leaves less than it must.
    fn zone_room_m(&self, pose: Pose2, keep_m: impl Fn(f64) -> f64) -> Option<f64> {
        self.zones.map_or(Some(f64::INFINITY), |zones| zones.check_room(pose.point(), keep_m))
    }

    fn nearest_m(&self, pose: Pose2) -> f64 {
        let squares = self.obstacles.iter().map(|obstacle| {
            let (dx, dy) = (obstacle.x_m - pose.x_m, obstacle.y_m - pose.y_m);
            dx * dx + dy * dy
        });
        squares.fold(f64::INFINITY, f64::min).sqrt()
    }
}

fn spread_evenly(low: f64, high: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |index| low + (high - low) * index as f64 / (count - 1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: DriveLimits = DriveLimits {
        speed_mps: 0.6,
        turn_radps: 1.2,
        acceleration_mps2: 0.8,
        turn_acceleration_radps2: 3.0,
    };

    fn window(obstacles: &[Point2], now: Velocity) -> DynamicWindow<'_> {
        let distances = Distances { keep_m: 0.2, comfort_m: 0.4 };
        DynamicWindow { limits: &LIMITS, distances, obstacles, zones: None, now, interval_s: 0.1 }
    }

    const CRUISE: Velocity = Velocity { speed_mps: 0.5, turn_radps: 0.0 };

    #[test]
    fn in_the_open_it_speeds_up_straight_ahead() {
        let chosen = window(&[], CRUISE).choose_velocity(Point2::new(1.0, 0.0), 0.6).unwrap();
        assert!(chosen.speed_mps > 0.55 && chosen.turn_radps.abs() < 1e-9, "{chosen:?}");
    }

    #[test]
    fn it_turns_towards_the_target() {
        let chosen = window(&[], CRUISE).choose_velocity(Point2::new(0.6, 0.4), 0.6).unwrap();
        assert!(chosen.turn_radps > 0.1, "{chosen:?}");
    }

    #[test]
    fn it_never_exceeds_what_the_base_can_do_next() {
        let chosen =
            window(&[], Velocity::ZERO).choose_velocity(Point2::new(1.0, 1.0), 0.6).unwrap();
        assert!(chosen.speed_mps <= 0.08 + 1e-9 && chosen.turn_radps <= 0.3 + 1e-9, "{chosen:?}");
    }

    #[test]
    fn it_passes_a_post_on_the_free_side() {
        let post: Vec<Point2> =
            (0..5).map(|i| Point2::new(0.5, -0.1 + 0.04 * f64::from(i))).collect();
        let slow = Velocity { speed_mps: 0.2, turn_radps: 0.0 };
        let chosen = window(&post, slow).choose_velocity(Point2::new(0.8, -0.15), 0.6).unwrap();
        assert!(chosen.turn_radps < 0.0, "{chosen:?}");
    }

    #[test]
    fn a_post_is_passed_closely_only_when_slow() {
        let post = [Point2::new(0.4, 0.22)];
        let slow = Velocity { speed_mps: 0.15, turn_radps: 0.0 };
        assert!(window(&post, slow).is_safe(slow));
        assert!(!window(&post, CRUISE).is_safe(CRUISE));
        let further = [Point2::new(0.4, 0.26)];
        assert!(window(&further, CRUISE).is_safe(CRUISE));
    }

    #[test]
    fn it_does_not_creep_up_to_what_stands_in_the_way() {
        let (mut ahead_m, mut now) = (0.4, Velocity::ZERO);
        for _ in 0..400 {
            let post = [Point2::new(ahead_m, 0.0)];
            let window = DynamicWindow { now, interval_s: 0.05, ..window(&post, now) };
            let target = Point2::new(ahead_m + 0.5, 0.0);
            now = window.choose_velocity(target, 0.6).unwrap_or(Velocity::ZERO);
            now.turn_radps = 0.0;
            ahead_m -= now.speed_mps * 0.05;
        }
        assert!(ahead_m > 0.2 - SLACK_M - 0.001, "{ahead_m} m");
        assert!(now.speed_mps < 1e-9, "{now:?}");
    }

    #[test]
    fn a_wall_ahead_forbids_what_could_not_stop() {
        let wall: Vec<Point2> = (-20..=20).map(|i| Point2::new(0.4, 0.05 * f64::from(i))).collect();
        assert!(!window(&wall, CRUISE).is_safe(CRUISE));
        assert!(window(&wall, CRUISE).is_safe(Velocity::ZERO));
        assert!(window(&wall, CRUISE).is_safe(Velocity { speed_mps: -0.1, turn_radps: 0.0 }));
    }

    #[test]
    fn from_too_close_it_may_only_move_away() {
        let post = [Point2::new(0.15, 0.0)];
        let window = window(&post, Velocity::ZERO);
        assert!(!window.is_safe(Velocity { speed_mps: 0.08, turn_radps: 0.0 }));
        assert!(window.is_safe(Velocity { speed_mps: -0.08, turn_radps: 0.0 }));
    }
}
