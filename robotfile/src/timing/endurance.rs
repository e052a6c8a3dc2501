//! Whether a robot gets to safety on its battery, from the end of each step of its route.

use armor_geo::MapPoint;

use crate::drawn_route::{DrawnRoute, RouteStep};
use crate::mission::Mission;
use crate::model::System;
use crate::route::{
    ExitPath, ExitPaths, ExitTarget, MAX_ROUTE_PIECES, RoutePiece, divide_into_pieces,
    find_exit_target,
};
use crate::source::Location;
use crate::timing::course::as_nanoseconds;
use crate::timing::drive::{DriveLengths, Driving};

/// Why it is not shown that the battery suffices.
#[derive(Clone, Debug)]
pub(crate) enum EnduranceGap {
    /// It is empty before the robot is at its goal.
    Empty {
        /// The step.
        step: String,
        /// The longest time to the end of the step.
        used_ns: i128,
        /// The point to which the robot drives from there, and the longest time to it; none at the end
        /// of the route.
        exit: Option<(String, i128)>,
        /// Where the step is.
        at: Location,
    },
    /// Something has no longest time.
    Open {
        /// The step.
        step: String,
        /// What has no longest time: the step, or the drive to a point.
        what: OpenTime,
        /// Where it is.
        at: Location,
    },
}

/// What has no longest time.
#[derive(Clone, Debug)]
pub(crate) enum OpenTime {
    /// A leg whose speed is not known.
    Leg,
    /// The wait at a phase line, or for a date.
    Date,
    /// A stay that a report ends.
    Stay,
    /// A meeting without patience.
    Meeting,
    /// The drive to a point.
    Drive(String),
}

/// Returns the first gap of a route that has an endurance; none if its battery suffices in the worst
/// case: every step takes its longest, and every exit begins at the end of its step.
pub(crate) fn find_endurance_gap(
    mission: &Mission,
    route: &DrawnRoute,
    system: &System,
    lengths: &dyn DriveLengths,
) -> Option<EnduranceGap> {
    let endurance_ns = as_nanoseconds(route.endurance.as_ref()?.value);
    let map = mission.map.as_ref();
    let pieces = divide_into_pieces(route, map);
    if pieces.len() > MAX_ROUTE_PIECES {
        return None;
    }
    let driving = Driving::new(route, map, system, lengths);
    let mut paths = ExitPaths::new(map);
    let mut used_ns = 0;
    for piece in &pieces {
        let name = route.steps[piece.step].name();
        let (step, at) = (format!("{}.{}", route.name.value, name.value), name.at.clone());
        match longest_ns(&driving, piece) {
            Ok(longest_ns) => used_ns += longest_ns,
            Err(what) => return Some(EnduranceGap::Open { step, what, at }),
        }
        if used_ns > endurance_ns {
            return Some(EnduranceGap::Empty { step, used_ns, exit: None, at });
        }
        for exit in &route.exits {
            let ExitTarget::Point(point) = find_exit_target(route, exit, piece, &mut paths) else {
                continue;
            };
            let there = point.position.value.point;
            let to = point.name.value.clone();
            match exit_ns(&driving, &mut paths, piece, there) {
                Some(drive_ns) if used_ns + drive_ns <= endurance_ns => {}
                Some(drive_ns) => {
                    let exit = Some((to, drive_ns));
                    return Some(EnduranceGap::Empty { step, used_ns, exit, at });
                }
                None => {
                    let what = OpenTime::Drive(to);
                    return Some(EnduranceGap::Open { step, what, at });
                }
            }
        }
    }
    None
}

/// The longest time that the robot is on a piece: it is late then, if not before.
fn longest_ns(driving: &Driving<'_>, piece: &RoutePiece<'_>) -> Result<i128, OpenTime> {
    match &driving.route.steps[piece.step] {
        RouteStep::Leg(leg) => {
            let by_ns = leg.by.as_ref().map(|by| as_nanoseconds(by.value));
            let drive_ns = match (piece.start, piece.end) {
                (Some(start), Some(end)) => driving.leg_time(leg, start, end, None).most_ns,
                _ => None,
            };
            let waits = match piece.ends_at {
                // The time of the part does not count at the line.
                Some(_) => return Err(OpenTime::Date),
                None => leg.not_before.is_some(),
            };
            let longest_ns = match (by_ns, drive_ns.filter(|_| !waits)) {
                (Some(by_ns), Some(drive_ns)) => Some(by_ns.min(drive_ns)),
                (one, other) => one.or(other),
            };
            longest_ns.ok_or(if waits { OpenTime::Date } else { OpenTime::Leg })
        }
        RouteStep::Stay(stay) => {
            let time = stay.duration.as_ref().map(|time| as_nanoseconds(time.value));
            time.ok_or(OpenTime::Stay)
        }
        RouteStep::Meet(meet) => {
            let patience = meet.patience.as_ref().map(|time| as_nanoseconds(time.value));
            patience.ok_or(OpenTime::Meeting)
        }
    }
}

/// The longest time of a drive to a point from anywhere on a piece.
fn exit_ns(
    driving: &Driving<'_>,
    paths: &mut ExitPaths<'_>,
    piece: &RoutePiece<'_>,
    there: MapPoint,
) -> Option<i128> {
    let limit_ns = driving.route.rally_by.as_ref().map(|by| as_nanoseconds(by.value));
    let drive_ns = piece.known_ends().and_then(|(start, end)| {
        if let ExitPath::Around(longest) =
            paths.find_path((start, end), there, driving.route.radius)
        {
            return driving.exit_time(&longest.points).most_ns;
        }
        let from = |here| driving.exit_time(&[here, there]).most_ns;
        Some(from(start)?.max(from(end)?))
    });
    match (limit_ns, drive_ns) {
        (Some(limit_ns), Some(drive_ns)) => Some(limit_ns.min(drive_ns)),
        (one, other) => one.or(other),
    }
}
