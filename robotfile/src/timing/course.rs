//! The moments of a mission's routes: when each step ends, what it waits for, and its limits.

use std::collections::BTreeMap;
use std::time::Duration;

use armor_geo::MapPoint;
use armor_wire::quantity::{self, Dimension};

use crate::date::Date;
use crate::drawn_route::{DrawnLeg, DrawnMeet, DrawnRoute, DrawnStay, RouteStep};
use crate::mission::Mission;
use crate::model::System;
use crate::route::{MAX_ROUTE_PIECES, RoutePiece, divide_into_pieces, find_partner};
use crate::source::{Location, Spanned};
use crate::time_words::{estimate_in_words, time_in_words};
use crate::timing::drive::{DriveLengths, Driving};
use crate::timing::extremes::TimeWait;

/// The moment from which dates are counted: the beginning of 1970.
pub(super) const DATES: usize = 0;
/// The moment at which the mission begins.
pub(super) const BEGIN: usize = 1;

/// Radius of a robot of which the file states none: the default of `planner`, `driver` and `simulator`.
const STOCK_RADIUS_M: f64 = 0.18;

/// The moments of a mission.
#[derive(Clone, Debug)]
pub(super) struct Course {
    /// What each moment waits for.
    pub(super) waits: Vec<Vec<TimeWait>>,
    /// The same in words, and where it is drawn.
    pub(super) reasons: Vec<Vec<WaitReason>>,
    /// The limits.
    pub(super) limits: Vec<CourseLimit>,
    /// The ends of steps, in the order of the file.
    pub(super) ends: Vec<CourseEnd>,
    /// Where the robots are between the moments: one for each route, in the order of the file.
    pub(super) tracks: Vec<CourseTrack>,
}

/// Where the robot of a route is between its moments.
#[derive(Clone, Debug)]
pub(super) struct CourseTrack {
    pub(super) route: String,
    /// Radius of the robot.
    pub(super) radius_m: f64,
    /// Where it is before its route begins.
    pub(super) start: Option<MapPoint>,
    /// The moment at which its route begins.
    pub(super) begins: usize,
    /// What follows, each from the end of the one before it.
    pub(super) stretches: Vec<CourseStretch>,
}

/// A straight drive, or a stop.
#[derive(Clone, Debug)]
pub(super) struct CourseStretch {
    /// The name of its step, as that of its end.
    pub(super) step: String,
    /// The moment at which it ends.
    pub(super) ends: usize,
    /// Where it ends; it begins where the one before it has ended.
    pub(super) to: Option<MapPoint>,
    /// By which share the speed of a drive may differ; none of a stop.
    pub(super) tolerance: Option<f64>,
}

/// Why a moment waits for another one.
#[derive(Clone, Debug)]
pub(super) struct WaitReason {
    /// `red.l1`, or of a date `red.l1 is not before 2026-…`.
    pub(super) what: String,
    /// Whether it is a date.
    pub(super) is_date: bool,
    /// Where it is drawn.
    pub(super) at: Location,
}

/// A limit: a moment comes at most some time after another one.
#[derive(Clone, Debug)]
pub(super) struct CourseLimit {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) at_most_ns: i128,
    /// The number of the end that it is a limit of.
    pub(super) end: usize,
    /// `by 1 min`.
    pub(super) words: String,
    pub(super) at: Location,
}

/// The end of a step, or of a part of a leg.
#[derive(Clone, Debug)]
pub(super) struct CourseEnd {
    /// The route.
    pub(super) route: String,
    /// The other route of a meeting.
    pub(super) with: Option<String>,
    /// `l1`, or `l1 to green` for the part of a leg that ends at a phase line.
    pub(super) step: String,
    /// Its moment.
    pub(super) moment: usize,
    /// Where the step is drawn.
    pub(super) at: Location,
}

impl Course {
    /// Of a mission, which begins at a date, if this is known.
    pub(super) fn of_mission(
        mission: &Mission,
        system: &System,
        lengths: &dyn DriveLengths,
        begin: Option<Date>,
    ) -> Self {
        let mut course = Self {
            waits: Vec::new(),
            reasons: Vec::new(),
            limits: Vec::new(),
            ends: Vec::new(),
            tracks: Vec::new(),
        };
        for _ in [DATES, BEGIN] {
            course.add_moment();
        }
        if let Some(begin) = begin {
            let what = format!("the mission begins at {begin}");
            let reason = WaitReason { what, is_date: true, at: mission.at.clone() };
            course.wait(BEGIN, TimeWait::exact(DATES, begin.since_1970_ns()), reason);
        }
        let mut meetings = BTreeMap::new();
        for (number, route) in mission.routes.iter().enumerate() {
            let pieces = divide_into_pieces(route, mission.map.as_ref());
            let is_second =
                mission.routes[..number].iter().any(|other| other.name.value == route.name.value);
            // Both are findings.
            if pieces.len() > MAX_ROUTE_PIECES || is_second {
                continue;
            }
            let driving = Driving::new(route, mission.map.as_ref(), system, lengths);
            let start = pieces.first().and_then(|piece| piece.start);
            let heading_rad = driving.first_heading_rad(start);
            let mut builder = RouteCourse {
                course: &mut course,
                driving,
                routes: &mission.routes,
                meetings: &mut meetings,
                heading_rad,
            };
            builder.add_route(route, &pieces, find_radius_m(route, system));
        }
        course
    }

    fn add_moment(&mut self) -> usize {
        self.waits.push(Vec::new());
        self.reasons.push(Vec::new());
        self.waits.len() - 1
    }

    /// Lets a moment wait for another one and a duration after it.
    fn wait(&mut self, moment: usize, wait: TimeWait, reason: WaitReason) {
        self.waits[moment].push(wait);
        self.reasons[moment].push(reason);
    }

    /// The robot of the newest route drives or stops until a moment.
    fn stretch(&mut self, step: &str, ends: usize, to: Option<MapPoint>, tolerance: Option<f64>) {
        let step = step.to_owned();
        if let Some(track) = self.tracks.last_mut() {
            track.stretches.push(CourseStretch { step, ends, to, tolerance });
        }
    }
}

/// Returns the radius of a route's robot: that of the route, else the largest `radius` that the file gives
/// to a component that the route names, else that of the stock components.
pub(super) fn find_radius_m(route: &DrawnRoute, system: &System) -> f64 {
    if route.radius.metres() > 0.0 {
        return route.radius.metres();
    }
    let ports = [Some(&route.mover), route.pace.as_ref(), route.pose.as_ref()];
    let named = ports.into_iter().flatten().map(|port| &port.component).chain(&route.components);
    let radii = named.filter_map(|name| {
        let parameter = system.component(&name.value)?.parameter("radius")?;
        quantity::parse_in(&parameter.value.value, Dimension::Length, "a radius").ok()
    });
    radii.filter(|radius_m| *radius_m > 0.0).max_by(f64::total_cmp).unwrap_or(STOCK_RADIUS_M)
}

/// Two steps that are one meeting: the routes and their steps, the smaller first.
type Meeting = [(String, usize); 2];

struct RouteCourse<'a, 'b> {
    course: &'b mut Course,
    driving: Driving<'a>,
    routes: &'a [DrawnRoute],
    /// The moment of each meeting.
    meetings: &'b mut BTreeMap<Meeting, usize>,
    /// The direction of the robot after the drive before, if it is known.
    heading_rad: Option<f64>,
}

impl<'a> RouteCourse<'a, '_> {
    fn add_route(&mut self, route: &'a DrawnRoute, pieces: &[RoutePiece<'a>], radius_m: f64) {
        let mut before = self.course.add_moment();
        self.course.tracks.push(CourseTrack {
            route: route.name.value.clone(),
            radius_m,
            start: pieces.first().and_then(|piece| piece.start),
            begins: before,
            stretches: Vec::new(),
        });
        let begin = format!("route {}", route.name.value);
        let reason = WaitReason { what: begin, is_date: false, at: route.name.at.clone() };
        // When the place that begins it gets its token is not known.
        let most_ns = if route.enter.is_some() { None } else { Some(0) };
        let wait = TimeWait { after: BEGIN, least_ns: 0, nominal_ns: most_ns, most_ns };
        self.course.wait(before, wait, reason);
        for piece in pieces {
            before = match &route.steps[piece.step] {
                RouteStep::Leg(leg) => self.add_leg(route, leg, piece, before),
                RouteStep::Stay(stay) => self.add_stay(route, stay, piece, before),
                RouteStep::Meet(meet) => self.add_meeting(route, meet, piece, before),
            };
        }
    }

    fn add_leg(
        &mut self,
        route: &DrawnRoute,
        leg: &DrawnLeg,
        piece: &RoutePiece<'_>,
        before: usize,
    ) -> usize {
        let name = format!("{}.{}", route.name.value, leg.name.value);
        let arrives = self.course.add_moment();
        let (least_ns, nominal_ns, most_ns) = match (piece.start, piece.end) {
            (Some(start), Some(end)) => {
                let turn_rad = self.driving.turn_rad(&mut self.heading_rad, start, end);
                let time = self.driving.leg_time(leg, start, end, turn_rad);
                (time.least_ns, time.nominal_ns, time.most_ns)
            }
            _ => {
                self.heading_rad = None;
                (0, None, None)
            }
        };
        let wait = TimeWait { after: before, least_ns, nominal_ns, most_ns };
        let reason = WaitReason { what: name.clone(), is_date: false, at: leg.name.at.clone() };
        self.course.wait(arrives, wait, reason);
        let (waits_until, what) = match piece.ends_at {
            Some(line) => (line.not_before.as_ref(), format!("{name} at {}", line.name.value)),
            None => (leg.not_before.as_ref(), name),
        };
        let leaves = self.wait_until(arrives, waits_until, &what);
        let step = match piece.ends_at {
            Some(line) => format!("{} to {}", leg.name.value, line.name.value),
            None => leg.name.value.clone(),
        };
        self.course.stretch(&step, arrives, piece.end, Some(route.tolerance));
        if leaves != arrives {
            self.course.stretch(&step, leaves, piece.end, None);
        }
        let end = self.add_end(route, step, leaves, &leg.name.at);
        if let Some(by) = &leg.by {
            // At a phase line the time of the part is over; at its point the leg waits for the date.
            let to = if piece.ends_at.is_some() { arrives } else { leaves };
            let words = format!("by {}", time_in_words(by.value));
            self.limit(before, to, by.value, end, words, &by.at);
        }
        if let Some(date) = &leg.not_after {
            let words = format!("not after {}", date.value);
            self.course.limits.push(CourseLimit {
                from: DATES,
                to: leaves,
                at_most_ns: date.value.since_1970_ns(),
                end,
                words,
                at: date.at.clone(),
            });
        }
        leaves
    }

    /// The moment at which the robot continues from where it has arrived.
    fn wait_until(&mut self, arrives: usize, date: Option<&Spanned<Date>>, what: &str) -> usize {
        let Some(date) = date else { return arrives };
        let leaves = self.course.add_moment();
        let reason =
            |words: String, is_date| WaitReason { what: words, is_date, at: date.at.clone() };
        let is_there = TimeWait::exact(arrives, 0);
        self.course.wait(leaves, is_there, reason(what.to_owned(), false));
        let ns = date.value.since_1970_ns();
        let words = format!("{what} does not continue before {}", date.value);
        self.course.wait(leaves, TimeWait::exact(DATES, ns), reason(words, true));
        leaves
    }

    fn add_stay(
        &mut self,
        route: &DrawnRoute,
        stay: &DrawnStay,
        piece: &RoutePiece<'_>,
        before: usize,
    ) -> usize {
        let over = self.course.add_moment();
        let most_ns = stay.duration.as_ref().map(|time| as_nanoseconds(time.value));
        let least_ns = most_ns.filter(|_| stay.on.is_none()).unwrap_or(0);
        let what = format!("{}.{}", route.name.value, stay.name.value);
        let reason = WaitReason { what, is_date: false, at: stay.name.at.clone() };
        // A report may end it earlier; nominally it takes its whole time.
        let wait = TimeWait { after: before, least_ns, nominal_ns: most_ns, most_ns };
        self.course.wait(over, wait, reason);
        self.course.stretch(&stay.name.value, over, piece.end, None);
        self.add_end(route, stay.name.value.clone(), over, &stay.name.at);
        over
    }

    fn add_meeting(
        &mut self,
        route: &DrawnRoute,
        meet: &DrawnMeet,
        piece: &RoutePiece<'_>,
        before: usize,
    ) -> usize {
        let step = piece.step;
        let with = meet.with.value.as_str();
        let earlier = route.steps[..step].iter().filter(|step| match step {
            RouteStep::Meet(other) => other.with.value == with,
            _ => false,
        });
        let partner = find_partner(route, earlier.count(), with, self.routes);
        let moment = match partner {
            Some((partner, at)) => {
                let mut key = [(route.name.value.clone(), step), (partner.name.value.clone(), at)];
                key.sort();
                let course = &mut self.course;
                *self.meetings.entry(key).or_insert_with(|| course.add_moment())
            }
            // That is a finding.
            None => self.course.add_moment(),
        };
        let what = format!("{}.{}", route.name.value, meet.name.value);
        let reason = WaitReason { what, is_date: false, at: meet.name.at.clone() };
        self.course.wait(moment, TimeWait::exact(before, 0), reason);
        self.course.stretch(&meet.name.value, moment, piece.end, None);
        let end = self.add_end(route, meet.name.value.clone(), moment, &meet.name.at);
        self.course.ends[end].with = Some(meet.with.value.clone());
        if let Some(patience) = &meet.patience {
            let words = format!("patience {}", time_in_words(patience.value));
            self.limit(before, moment, patience.value, end, words, &patience.at);
        }
        moment
    }

    fn add_end(&mut self, route: &DrawnRoute, step: String, moment: usize, at: &Location) -> usize {
        let (route, at) = (route.name.value.clone(), at.clone());
        self.course.ends.push(CourseEnd { route, with: None, step, moment, at });
        self.course.ends.len() - 1
    }

    fn limit(
        &mut self,
        from: usize,
        to: usize,
        at_most: Duration,
        end: usize,
        words: String,
        at: &Location,
    ) {
        let at_most_ns = as_nanoseconds(at_most);
        let at = at.clone();
        self.course.limits.push(CourseLimit { from, to, at_most_ns, end, words, at });
    }
}

impl WaitReason {
    /// `red.l1 takes at least 24 s`.
    pub(super) fn describe_least(&self, ns: i128) -> String {
        match self.is_date {
            true => self.what.clone(),
            false => format!("{} takes at least {}", self.what, estimate_in_words(ns)),
        }
    }

    /// `red.l1 takes at most 24 s`.
    pub(super) fn describe_most(&self, ns: i128) -> String {
        match self.is_date {
            true => self.what.clone(),
            false => format!("{} takes at most {}", self.what, estimate_in_words(ns)),
        }
    }
}

pub(super) fn as_nanoseconds(time: Duration) -> i128 {
    time.as_nanos() as i128
}
