//! A mission's routes as they are followed: prepared once for each version of the file.

use armor_geo::MapPoint;

use crate::date::Date;
use crate::drawn_route::{DrawnRoute, RouteStep};
use crate::mission::{ArcKind, Mission};
use crate::model::System;
use crate::route::{MAX_ROUTE_PIECES, RoutePiece, divide_into_pieces, find_partner};
use crate::site_map::SiteMap;
use crate::time_words::time_in_words;
use crate::timing::course::find_radius_m;
use crate::timing::drive::{DrivenRobot, Driving, StraightLengths};
use crate::timing::motion::as_seconds;

/// The routes of a mission, prepared to be compared with what is observed.
#[derive(Clone, Debug)]
pub struct FollowedMission {
    pub(super) routes: Vec<FollowedRoute>,
    pub(super) map: Option<SiteMap>,
}

#[derive(Clone, Debug)]
pub(super) struct FollowedRoute {
    pub(super) drawn: DrawnRoute,
    pub(super) radius_m: f64,
    robot: DrivenRobot,
    pub(super) pieces: Vec<FollowedPiece>,
}

/// A step, or a part of a leg.
#[derive(Clone, Debug)]
pub(super) struct FollowedPiece {
    /// `l1`, or `l1 to green`.
    pub(super) label: String,
    /// Its place in the net.
    pub(super) place: String,
    /// The place where the robot waits at the phase line that the piece ends at.
    pub(super) waits_in: Option<String>,
    /// The transitions that put a token into its place: it begins, also once more.
    pub(super) begins: Vec<String>,
    /// The transitions that lead from it to what comes after.
    pub(super) ends: Vec<String>,
    /// Whether its place has a token at first.
    pub(super) is_initial: bool,
    pub(super) from: Option<MapPoint>,
    pub(super) to: Option<MapPoint>,
    /// The number of its step.
    pub(super) step: usize,
    pub(super) work: PieceWork,
    /// The limit from its begin on, in seconds, and in words.
    pub(super) by: Option<(f64, String)>,
    pub(super) not_after: Option<Date>,
    /// The robot does not continue before this date.
    pub(super) not_before: Option<Date>,
}

/// What is done in a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PieceWork {
    /// A drive; how many seconds it takes at the speeds of the file, if these are known.
    Drive(Option<f64>),
    /// A stop; how many seconds it takes, if it has a time.
    Stay(Option<f64>),
    /// A meeting with a piece of another route, if that has it.
    Meet(Option<[usize; 2]>),
}

impl FollowedMission {
    /// Of a mission. Its routes and their order are those of the file.
    pub fn of_mission(mission: &Mission, system: &System) -> Self {
        let map = mission.map.clone();
        let mut routes: Vec<_> = mission
            .routes
            .iter()
            .map(|route| FollowedRoute::of_route(route, mission, system))
            .collect();
        let meetings: Vec<Vec<_>> = (0..routes.len())
            .map(|number| find_meetings(number, &mission.routes, &routes))
            .collect();
        for (route, meetings) in routes.iter_mut().zip(meetings) {
            for (piece, partner) in route.pieces.iter_mut().zip(meetings) {
                if let PieceWork::Meet(with) = &mut piece.work {
                    *with = partner;
                }
            }
        }
        Self { routes, map }
    }

    /// The names of the routes, each with the radius of its robot and the output with its pose.
    pub fn robots(&self) -> impl Iterator<Item = (&str, f64, Option<String>)> {
        self.routes.iter().map(|route| {
            let pose = route.drawn.pose.as_ref();
            let pose = pose.map(|pose| format!("{}.{}", pose.component.value, pose.port.value));
            (route.drawn.name.value.as_str(), route.radius_m, pose)
        })
    }
}

impl FollowedRoute {
    fn of_route(route: &DrawnRoute, mission: &Mission, system: &System) -> Self {
        let map = mission.map.as_ref();
        let driving = Driving::new(route, map, system, &StraightLengths);
        let robot = driving.robot;
        let mut pieces = divide_into_pieces(route, map);
        // That is a finding, and the route has no net.
        if pieces.len() > MAX_ROUTE_PIECES {
            pieces.clear();
        }
        let start = pieces.first().and_then(|piece| piece.start);
        let mut heading_rad = driving.first_heading_rad(start);
        let mut followed: Vec<_> = pieces
            .iter()
            .map(|piece| FollowedPiece::of_piece(route, piece, &driving, &mut heading_rad))
            .collect();
        let name = &route.name.value;
        let places: Vec<_> = followed.iter().map(|piece| piece.place.clone()).collect();
        let end = route.leave.as_ref().map_or_else(|| format!("{name}.end"), |it| it.value.clone());
        for (number, piece) in followed.iter_mut().enumerate() {
            let after = places.get(number + 1).unwrap_or(&end);
            piece.find_transitions(mission, after);
        }
        Self {
            radius_m: find_radius_m(route, system),
            drawn: route.clone(),
            robot,
            pieces: followed,
        }
    }

    /// How long the drive of a piece takes from a position, at the speeds of the file, without a turn.
    pub(super) fn drive_s(
        &self,
        piece: &FollowedPiece,
        from: MapPoint,
        map: Option<&SiteMap>,
    ) -> Option<f64> {
        let RouteStep::Leg(leg) = self.drawn.steps.get(piece.step)? else { return None };
        let (route, robot) = (&self.drawn, self.robot);
        let driving = Driving { route, map, robot, lengths: &StraightLengths };
        driving.leg_time(leg, from, piece.to?, Some(0.0)).nominal_ns.map(as_seconds)
    }
}

impl FollowedPiece {
    fn of_piece(
        route: &DrawnRoute,
        piece: &RoutePiece<'_>,
        driving: &Driving<'_>,
        heading_rad: &mut Option<f64>,
    ) -> Self {
        let step = &route.steps[piece.step];
        let name = &step.name().value;
        let whole = format!("{}.{name}", route.name.value);
        let place = match piece.behind {
            Some(line) => format!("{whole}.after-{}", line.name.value),
            None => whole,
        };
        let limit = |time: std::time::Duration, word: &str| {
            (time.as_secs_f64(), format!("{word} {}", time_in_words(time)))
        };
        let mut followed = Self {
            label: name.clone(),
            waits_in: None,
            begins: Vec::new(),
            ends: Vec::new(),
            is_initial: false,
            from: piece.start,
            to: piece.end,
            step: piece.step,
            work: PieceWork::Meet(None),
            by: None,
            not_after: None,
            not_before: None,
            place,
        };
        match step {
            RouteStep::Leg(leg) => {
                let ends = piece.start.zip(piece.end);
                if ends.is_none() {
                    *heading_rad = None;
                }
                let time = ends.and_then(|(from, to)| {
                    let turn_rad = driving.turn_rad(heading_rad, from, to);
                    driving.leg_time(leg, from, to, turn_rad).nominal_ns.map(as_seconds)
                });
                followed.work = PieceWork::Drive(time);
                followed.by = leg.by.as_ref().map(|by| limit(by.value, "by"));
                followed.not_after = leg.not_after.as_ref().map(|date| date.value);
                match piece.ends_at {
                    Some(line) => {
                        followed.label = format!("{name} to {}", line.name.value);
                        followed.waits_in =
                            Some(format!("{}.at-{}", followed.place, line.name.value));
                        followed.not_before = line.not_before.as_ref().map(|date| date.value);
                    }
                    None => followed.not_before = leg.not_before.as_ref().map(|date| date.value),
                }
            }
            RouteStep::Stay(stay) => {
                let time = stay.duration.as_ref().map(|time| time.value.as_secs_f64());
                followed.work = PieceWork::Stay(time);
            }
            RouteStep::Meet(meet) => {
                followed.by = meet.patience.as_ref().map(|time| limit(time.value, "patience"));
            }
        }
        followed
    }

    /// Finds the transitions of the net that begin and end it.
    fn find_transitions(&mut self, mission: &Mission, after: &str) {
        let named = mission.places.iter().find(|place| place.name.value == self.place);
        self.is_initial = named.is_some_and(|place| place.initial > 0);
        let last = self.waits_in.as_ref().unwrap_or(&self.place);
        for transition in &mission.transitions {
            let leads = |kind, place: &str| {
                transition.arcs.iter().any(|arc| arc.kind == kind && arc.place.value == place)
            };
            let name = || transition.name.value.clone();
            if leads(ArcKind::Put, &self.place) {
                self.begins.push(name());
            }
            if leads(ArcKind::Take, last) && leads(ArcKind::Put, after) {
                self.ends.push(name());
            }
        }
    }
}

/// For each piece of a route the meeting of the other route that it is, by route and piece.
fn find_meetings(
    number: usize,
    drawn: &[DrawnRoute],
    followed: &[FollowedRoute],
) -> Vec<Option<[usize; 2]>> {
    let route = &drawn[number];
    let pieces = followed[number].pieces.iter();
    let partner = |piece: &FollowedPiece| {
        let RouteStep::Meet(meet) = &route.steps[piece.step] else { return None };
        let with = meet.with.value.as_str();
        let before = route.steps[..piece.step]
            .iter()
            .filter(|step| matches!(step, RouteStep::Meet(other) if other.with.value == with));
        let (partner, at) = find_partner(route, before.count(), with, drawn)?;
        let other = drawn.iter().position(|it| it.name.value == partner.name.value)?;
        let piece = followed[other].pieces.iter().position(|piece| piece.step == at)?;
        Some([other, piece])
    };
    pieces.map(partner).collect()
}
