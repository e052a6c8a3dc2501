//! How long a drive takes: the robot turns on the spot to the direction of the drive, speeds up, keeps its
//! speed, and brakes. What the file does not state about its base takes no time.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use armor_geo::{Clearance, MapPoint, MapSegment};
use armor_wire::quantity::{self, Dimension};

use crate::drawn_route::{DrawnLeg, DrawnRoute};
use crate::model::{Component, System};
use crate::site_map::{SiteMap, ZoneKind};

/// Parts of a drive that are compared with slow zones.
const PARTS: u32 = 128;
/// Longest time that is counted, in seconds: 31 years.
const MOST_S: f64 = 1e9;

/// The paths of drives, from a point to another one for a robot of a radius.
pub trait DriveLengths {
    /// Returns the length in metres, at least the straight distance.
    fn length_m(&self, from: MapPoint, to: MapPoint, radius: Clearance) -> f64;

    /// Returns the directions in which the path begins and ends, in radians anticlockwise from x; none if it
    /// leads nowhere. By default it is straight.
    fn directions_rad(&self, from: MapPoint, to: MapPoint, _radius: Clearance) -> Option<[f64; 2]> {
        direction_rad(from, to).map(|straight_rad| [straight_rad; 2])
    }
}

/// All drives are straight.
#[derive(Clone, Copy, Debug)]
pub struct StraightLengths;

impl DriveLengths for StraightLengths {
    fn length_m(&self, from: MapPoint, to: MapPoint, _radius: Clearance) -> f64 {
        from.distance_m(to)
    }
}

/// The times of a drive, in nanoseconds; without a nominal and a longest time, its speed is not known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DriveTime {
    pub(crate) least_ns: i128,
    /// At exactly its speed, and slower where a zone asks for it.
    pub(crate) nominal_ns: Option<i128>,
    pub(crate) most_ns: Option<i128>,
}

/// What determines the times of a route's drives.
pub(crate) struct Driving<'a> {
    pub(crate) route: &'a DrawnRoute,
    pub(crate) map: Option<&'a SiteMap>,
    pub(crate) robot: DrivenRobot,
    pub(crate) lengths: &'a dyn DriveLengths,
}

/// What the file states about the robot of a route.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrivenRobot {
    /// The speed that the file gives to the component of the pace, in metres per second.
    usual_mps: Option<f64>,
    base: DrivenBase,
    /// The period of the mover, in seconds: it notices at a tick that it has arrived, and sends its first goal
    /// at another one, half a period late each on average.
    mover_period_s: f64,
}

/// What the file states about the base of a robot, as parameters of the component of the pace.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DrivenBase {
    /// `acceleration`, in metres per second squared.
    acceleration_mps2: Option<f64>,
    /// `turn`, in radians per second.
    turn_radps: Option<f64>,
    /// `turn_acceleration`, in radians per second squared.
    turn_acceleration_radps2: Option<f64>,
}

impl DrivenBase {
    fn of_component(component: &Component) -> Self {
        let read = |name: &'static str, dimension| {
            let text = &component.parameter(name)?.value.value;
            quantity::parse_in(text, dimension, name).ok().filter(|number| *number > 0.0)
        };
        Self {
            acceleration_mps2: read("acceleration", Dimension::Acceleration),
            turn_radps: read("turn", Dimension::AngularSpeed),
            turn_acceleration_radps2: read("turn_acceleration", Dimension::AngularAcceleration),
        }
    }

    /// The time to turn on the spot, at rest before and after.
    fn turn_s(&self, turn_rad: f64) -> f64 {
        let Some(turn_radps) = self.turn_radps else { return 0.0 };
        change_s(turn_rad, turn_radps, self.turn_acceleration_radps2)
    }

    /// How much longer a drive takes than at a constant speed, since it begins and ends at rest.
    fn start_and_stop_s(&self, length_m: f64, speed_mps: f64) -> f64 {
        let whole_s = change_s(length_m, speed_mps, self.acceleration_mps2);
        (whole_s - length_m / speed_mps).max(0.0)
    }

    /// How much longer it takes to brake to a lower speed and to speed up again afterwards.
    fn slow_down_s(&self, from_mps: f64, to_mps: f64) -> f64 {
        let Some(acceleration_mps2) = self.acceleration_mps2 else { return 0.0 };
        (from_mps - to_mps).powi(2) / (acceleration_mps2 * from_mps)
    }
}

/// The time for a way at a rate that is reached and left with an acceleration; without one, immediately.
fn change_s(way: f64, rate: f64, acceleration: Option<f64>) -> f64 {
    match acceleration {
        None => way / rate,
        Some(acceleration) if way >= rate * rate / acceleration => way / rate + rate / acceleration,
        // The rate is not reached.
        Some(acceleration) => 2.0 * (way / acceleration).sqrt(),
    }
}

/// The angle from one direction to another one, from 0 to π.
fn turn_between(before_rad: f64, next_rad: f64) -> f64 {
    let turn_rad = (next_rad - before_rad).rem_euclid(TAU);
    turn_rad.min(TAU - turn_rad)
}

/// The direction of a straight drive; none if it leads nowhere.
fn direction_rad(from: MapPoint, to: MapPoint) -> Option<f64> {
    (from != to).then(|| (to.y_m() - from.y_m()).atan2(to.x_m() - from.x_m()))
}

impl DrivenRobot {
    pub(crate) fn of_route(route: &DrawnRoute, system: &System) -> Self {
        let pace = route.pace.as_ref();
        let component = pace.and_then(|pace| system.component(&pace.component.value));
        let usual_mps = pace.zip(component).and_then(|(pace, component)| {
            parse_speed(&component.parameter(&pace.port.value)?.value.value)
        });
        let base = component.map(DrivenBase::of_component).unwrap_or_default();
        let mover = system.component(&route.mover.component.value);
        let rate_hz = mover.and_then(|mover| mover.rate_hz.as_ref()).map(|rate_hz| rate_hz.value);
        let mover_period_s = rate_hz.filter(|rate_hz| *rate_hz > 0.0).map_or(0.0, f64::recip);
        Self { usual_mps, base, mover_period_s }
    }
}

impl<'a> Driving<'a> {
    pub(crate) fn new(
        route: &'a DrawnRoute,
        map: Option<&'a SiteMap>,
        system: &System,
        lengths: &'a dyn DriveLengths,
    ) -> Self {
        Self { route, map, robot: DrivenRobot::of_route(route, system), lengths }
    }

    /// The direction of the robot before its first drive. A map that nothing places on the Earth begins where
    /// its robot does, which looks along its x axis; anywhere else the direction is not known.
    pub(crate) fn first_heading_rad(&self, start: Option<MapPoint>) -> Option<f64> {
        let is_placed = self.map.is_some_and(|map| map.placement.is_some());
        let start = start.filter(|_| !is_placed)?;
        (start.x_m() == 0.0 && start.y_m() == 0.0).then_some(0.0)
    }

    /// The angle that the robot turns by before a drive, if it is known, from its heading, which becomes that
    /// at the end of the drive.
    pub(crate) fn turn_rad(
        &self,
        heading_rad: &mut Option<f64>,
        from: MapPoint,
        to: MapPoint,
    ) -> Option<f64> {
        let path_rad = self.lengths.directions_rad(from, to, self.route.radius);
        let Some([next_rad, last_rad]) = path_rad else { return Some(0.0) };
        let before_rad = heading_rad.replace(last_rad);
        before_rad.map(|before_rad| turn_between(before_rad, next_rad))
    }

    /// The time of a leg, or of a part of it, after a turn by this angle; none if it is not known.
    pub(crate) fn leg_time(
        &self,
        leg: &DrawnLeg,
        from: MapPoint,
        to: MapPoint,
        turn_rad: Option<f64>,
    ) -> DriveTime {
        let own = leg.speed.as_ref().and_then(|speed| parse_speed(&speed.value));
        self.time(own.or(self.robot.usual_mps), &[from, to], turn_rad)
    }

    /// The time of a drive to a rally point through these points, at the usual speed, in whatever
    /// direction.
    pub(crate) fn exit_time(&self, points: &[MapPoint]) -> DriveTime {
        self.time(self.robot.usual_mps, points, None)
    }

    fn time(
        &self,
        speed_mps: Option<f64>,
        points: &[MapPoint],
        turn_rad: Option<f64>,
    ) -> DriveTime {
        let (Some(speed_mps), [from, .., to]) = (speed_mps, points) else {
            return DriveTime { least_ns: 0, nominal_ns: None, most_ns: None };
        };
        let tolerance = self.route.tolerance;
        let straight_m = from.distance_m(*to);
        let through_m: f64 = points.windows(2).map(|part| part[0].distance_m(part[1])).sum();
        let length_m = self.lengths.length_m(*from, *to, self.route.radius).max(through_m);
        let least_s = straight_m / (speed_mps * (1.0 + tolerance));
        let slow_parts = points.windows(2).map(|part| self.slow_part(speed_mps, part[0], part[1]));
        let (slow_m, slow_s) = slow_parts
            .fold((0.0, 0.0), |(sum_m, sum_s), (more_m, more_s)| (sum_m + more_m, sum_s + more_s));
        let rest_m = (length_m - slow_m).max(0.0);
        let stops_s =
            self.robot.base.start_and_stop_s(length_m, speed_mps) + self.robot.mover_period_s;
        let driven_s = rest_m / speed_mps + slow_s + stops_s;
        // Of all directions, the mean and the largest angle to turn.
        let nominal_s = driven_s + self.robot.base.turn_s(turn_rad.unwrap_or(FRAC_PI_2));
        let most_s = driven_s + self.robot.base.turn_s(turn_rad.unwrap_or(PI));
        DriveTime {
            least_ns: nanoseconds(least_s),
            nominal_ns: Some(nanoseconds(nominal_s)),
            most_ns: Some(nanoseconds(most_s / (1.0 - tolerance))),
        }
    }

    /// The metres of the straight drive within slow zones, and the time for them; rather too many than
    /// too few.
    fn slow_part(&self, speed_mps: f64, from: MapPoint, to: MapPoint) -> (f64, f64) {
        let zones = self.map.map(|map| map.zones.as_slice()).unwrap_or_default();
        let zones: Vec<_> = zones
            .iter()
            .filter(|zone| zone.kind == ZoneKind::Speed)
            .filter_map(|zone| Some((zone, zone.speed_mps.as_ref()?.value)))
            .filter(|(_, limit_mps)| *limit_mps < speed_mps)
            .map(|(zone, limit_mps)| {
                let margin = zone.margin.plus(self.route.radius).unwrap_or(zone.margin);
                (&zone.area.value, margin, limit_mps)
            })
            .collect();
        let whole = MapSegment::new(from, to);
        let near: Vec<_> =
            zones.iter().filter(|(area, margin, _)| whole.intrudes(area, *margin)).collect();
        if near.is_empty() {
            return (0.0, 0.0);
        }
        let part_m = whole.length_m() / f64::from(PARTS);
        let point = |number: u32| whole.point_at(f64::from(number) / f64::from(PARTS));
        let (mut slow_m, mut slow_s, mut is_slow) = (0.0, 0.0, false);
        for number in 0..PARTS {
            let part = MapSegment::new(point(number), point(number + 1));
            let here = near.iter().filter(|(area, margin, _)| part.intrudes(area, *margin));
            let limit_mps = here.map(|zone| zone.2).min_by(f64::total_cmp);
            if let Some(limit_mps) = limit_mps {
                slow_m += part_m;
                slow_s += part_m / limit_mps;
                if !is_slow {
                    slow_s += self.robot.base.slow_down_s(speed_mps, limit_mps);
                }
            }
            is_slow = limit_mps.is_some();
        }
        (slow_m, slow_s)
    }
}

fn parse_speed(text: &str) -> Option<f64> {
    let speed = quantity::parse_in(text, Dimension::Speed, "a speed").ok();
    speed.filter(|speed| *speed > 0.0)
}

fn nanoseconds(time_s: f64) -> i128 {
    (time_s.min(MOST_S) * 1e9).round() as i128
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(expected_s: f64, found_s: f64) {
        assert!((expected_s - found_s).abs() < 1e-9, "{found_s} s instead of {expected_s} s");
    }

    #[test]
    fn a_base_that_the_file_describes_turns_starts_and_stops() {
        let base = DrivenBase {
            acceleration_mps2: Some(2.0),
            turn_radps: Some(1.0),
            turn_acceleration_radps2: Some(4.0),
        };
        // 1 m/s is reached and left within 0.25 m each.
        check(0.5, base.start_and_stop_s(3.0, 1.0));
        // It is not reached within 0.125 m.
        check(2.0 * 0.25 - 0.125, base.start_and_stop_s(0.125, 1.0));
        check(PI + 0.25, base.turn_s(PI));
        check(2.0 * 0.1, base.turn_s(0.04));
        check(0.125, base.slow_down_s(1.0, 0.5));
    }

    #[test]
    fn what_the_file_does_not_state_takes_no_time() {
        let base = DrivenBase::default();
        check(0.0, base.turn_s(PI) + base.start_and_stop_s(3.0, 1.0) + base.slow_down_s(1.0, 0.5));
        let base = DrivenBase { turn_radps: Some(0.5), ..base };
        check(2.0 * PI, base.turn_s(PI));
    }

    #[test]
    fn a_turn_is_the_smaller_angle() {
        check(0.2, turn_between(-PI + 0.1, PI - 0.1));
        check(PI, turn_between(0.0, -PI));
        let point = |x_m, y_m| MapPoint::new(x_m, y_m).expect("a point");
        assert_eq!(direction_rad(point(1.0, 1.0), point(1.0, 1.0)), None);
        check(PI / 2.0, direction_rad(point(1.0, 1.0), point(1.0, 3.0)).expect("it leads up"));
    }
}
