//! The places and transitions of the routes of a mission.
//!
//! A route is a state machine: it has one token. A piece that is driven is a place with the mover
//! and its waypoint; its report leads on, and each exit has a transition. What is driven to a rally
//! point has a place for each piece, so that `resume` leads back to the piece that was left.

mod early_ends;

use armor_geo::MapPoint;

use crate::code::Code;
use crate::drawn_route::{DrawnLeg, DrawnRoute, RoutePort, RouteStep};
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{
    Arc, ArcKind, Class, Interval, Mission, Place, PlaceParameter, ReportRef, Transition,
};
use crate::model::Parameter;
use crate::read::MAX_ELEMENTS;
use crate::route::exit_paths::ExitPaths;
use crate::route::pieces::{MAX_ROUTE_PIECES, RoutePiece, divide_into_pieces};
use crate::site_map::DrawnLine;
use crate::source::Spanned;
use early_ends::Limits;

/// Adds the places and transitions of all routes, in the order of the file. A route whose net makes
/// the mission larger than it may be is a finding and has none.
pub(crate) fn add_nets(mission: &mut Mission, findings: &mut Findings) {
    let routes = std::mem::take(&mut mission.routes);
    let map = mission.map.take();
    let mut paths = ExitPaths::new(map.as_ref());
    for (number, route) in routes.iter().enumerate() {
        // The second of a name is a finding, and would be findings of its places as well.
        if routes[..number].iter().any(|other| other.name.value == route.name.value) {
            continue;
        }
        let mut net = RouteNet {
            route,
            others: &routes,
            pieces: divide_into_pieces(route, map.as_ref()),
            paths,
            safe: route.safe.clone().or_else(|| mission.safe.clone()),
            places: Vec::new(),
            transitions: Vec::new(),
        };
        let fits = net.pieces.len() <= MAX_ROUTE_PIECES && {
            net.add_all();
            mission.places.len() + net.places.len() <= MAX_ELEMENTS
                && mission.transitions.len() + net.transitions.len() <= MAX_ELEMENTS
        };
        let (places, transitions) = (net.places, net.transitions);
        paths = net.paths;
        if !fits {
            let message = format!(
                "with this route, the mission has more than {MAX_ELEMENTS} places or transitions, \
                 or the route is divided into more than {MAX_ROUTE_PIECES} pieces"
            );
            let finding = Finding::new(Code::TooMany, &route.name.at, message);
            findings.push(finding.remedy("draw fewer legs, exits or phase lines"));
            (mission.unreadable.in_start, mission.unreadable.in_moves) = (true, true);
            continue;
        }
        mission.places.extend(places);
        mission.transitions.extend(transitions);
    }
    drop(paths);
    (mission.routes, mission.map) = (routes, map);
}

struct RouteNet<'a> {
    route: &'a DrawnRoute,
    others: &'a [DrawnRoute],
    pieces: Vec<RoutePiece<'a>>,
    paths: ExitPaths<'a>,
    /// Where a robot ends that cannot continue.
    safe: Option<Spanned<String>>,
    places: Vec<Place>,
    transitions: Vec<Transition>,
}

impl<'a> RouteNet<'a> {
    fn add_all(&mut self) {
        let route = self.route;
        let Some(first) = self.pieces.first().map(|piece| name_piece(route, piece)) else { return };
        for number in 0..self.pieces.len() {
            self.add_piece(number);
        }
        match &route.enter {
            Some(enter) => {
                let name = self.name("begin");
                self.add(name, enter, &first);
            }
            None => {
                self.places.iter_mut().take(1).for_each(|place| place.initial = 1);
            }
        }
        if route.leave.is_none() {
            self.push_place(self.name("end"), Vec::new(), Vec::new());
        }
    }

    fn add_piece(&mut self, number: usize) {
        let piece = self.pieces[number];
        let here = name_piece(self.route, &piece);
        // The second step of a name is a finding.
        if self.places.iter().any(|place| place.name.value == here.value) {
            return;
        }
        let next = self.name_after(number);
        match &self.route.steps[piece.step] {
            RouteStep::Leg(leg) => self.add_drive(leg, &piece, &here, &next),
            RouteStep::Stay(stay) => {
                self.add_place(here.clone(), stay.components.clone(), Vec::new());
                let times = stay.duration.as_ref();
                let ends = stay.on.as_ref();
                if let Some(on) = ends {
                    self.add_on(&here, "done", on, &on.port.value.clone(), &next);
                }
                if let Some(time) = times {
                    let word = if ends.is_some() { "over" } else { "done" };
                    self.add_timed(&here, word, time, &next);
                }
                self.add_exits(&here, &piece, Limits::default(), ends);
            }
            RouteStep::Meet(meet) => {
                self.add_place(here.clone(), Vec::new(), Vec::new());
                let limits = Limits { by: meet.patience.as_ref(), not_after: None };
                self.add_exits(&here, &piece, limits, None);
                self.add_meeting(number, &meet.with.value, &here, &next);
            }
        }
    }

    /// A drive to the end of the piece, and the wait at the phase line if it ends at one.
    fn add_drive(
        &mut self,
        leg: &DrawnLeg,
        piece: &RoutePiece<'a>,
        here: &Spanned<String>,
        next: &Spanned<String>,
    ) {
        let speed = leg.speed.as_ref();
        let end = piece.end;
        self.add_driven_place(here.clone(), end, &leg.components, speed, &leg.to);
        let mover = &self.route.mover;
        let limits = Limits { by: leg.by.as_ref(), not_after: leg.not_after.as_ref() };
        match piece.ends_at {
            None => {
                let done = self.add_on(here, "done", mover, "done", next);
                done.not_before = leg.not_before.clone();
                self.add_exits(here, piece, limits, Some(mover));
            }
            Some(line) => {
                let waiting = suffix(here, &name_wait(line));
                self.add_on(here, "reached", mover, "done", &waiting);
                self.add_exits(here, piece, limits, Some(mover));
                self.add_place(waiting.clone(), Vec::new(), Vec::new());
                let crosses = self.add(suffix(&waiting, "crosses"), &waiting, next);
                crosses.not_before = line.not_before.clone();
                let waits = RoutePiece { start: piece.end, ..*piece };
                self.add_exits(&waiting, &waits, Limits { by: None, ..limits }, None);
            }
        }
    }

    /// The meeting is one transition of both routes; the route that is drawn first has it.
    fn add_meeting(
        &mut self,
        number: usize,
        with: &str,
        here: &Spanned<String>,
        next: &Spanned<String>,
    ) {
        let before = number_of_meeting(&self.pieces, number, self.route, with);
        let partner = find_partner(self.route, before, with, self.others);
        let Some((partner, at)) = partner else { return };
        let first = self.others.iter().find(|route| {
            route.name.value == self.route.name.value || route.name.value == partner.name.value
        });
        if first.is_none_or(|first| first.name.value != self.route.name.value) {
            return;
        }
        let pieces = divide_into_pieces(partner, self.paths.map());
        let Some(index) = pieces.iter().position(|piece| piece.step == at) else { return };
        let theirs = name_piece(partner, &pieces[index]);
        let after = name_after(partner, &pieces, index);
        let met = self.add(suffix(here, "met"), here, next);
        met.arcs.insert(1, take(&theirs));
        met.arcs.push(put(&after));
    }

    fn add_driven_place(
        &mut self,
        name: Spanned<String>,
        to: Option<MapPoint>,
        components: &[Spanned<String>],
        speed: Option<&Spanned<String>>,
        drawn_at: &Spanned<String>,
    ) {
        let route = self.route;
        let pace = route.pace.as_ref();
        let all = [&route.mover.component]
            .into_iter()
            .chain(pace.map(|pace| &pace.component))
            .chain(&route.components)
            .chain(components);
        let mut active: Vec<Spanned<String>> = Vec::new();
        for component in all {
            if !active.iter().any(|known| known.value == component.value) {
                active.push(component.clone());
            }
        }
        let folder = || drawn_at.at.source.folder();
        let mut parameters = Vec::new();
        if let Some(to) = to {
            let value = drawn_at.with(format_waypoint(to));
            let name = route.mover.port.clone();
            parameters.push(PlaceParameter {
                component: route.mover.component.clone(),
                parameter: Parameter { name, value, folder: folder() },
            });
        }
        if let (Some(pace), Some(speed)) = (pace, speed) {
            let (name, value) = (pace.port.clone(), speed.clone());
            parameters.push(PlaceParameter {
                component: pace.component.clone(),
                parameter: Parameter { name, value, folder: folder() },
            });
        }
        self.add_place(name, active, parameters);
    }

    /// A place in which the robot is on its route: its fence is active there, too.
    fn add_place(
        &mut self,
        name: Spanned<String>,
        mut components: Vec<Spanned<String>>,
        parameters: Vec<PlaceParameter>,
    ) {
        if let Some(fence) = &self.route.fence
            && !components.iter().any(|known| known.value == fence.value)
        {
            components.push(fence.clone());
        }
        self.push_place(name, components, parameters);
    }

    fn push_place(
        &mut self,
        name: Spanned<String>,
        components: Vec<Spanned<String>>,
        parameters: Vec<PlaceParameter>,
    ) {
        let on_failure = self.route.safe.clone().filter(|_| !components.is_empty());
        self.places.push(Place {
            name,
            initial: 0,
            components,
            class: Class::Normal,
            on_failure,
            parameters,
        });
    }

    fn add_on(
        &mut self,
        from: &Spanned<String>,
        word: &str,
        port: &RoutePort,
        event: &str,
        to: &Spanned<String>,
    ) -> &mut Transition {
        let on = ReportRef {
            component: port.component.clone(),
            event: port.port.with(event.to_owned()),
        };
        let transition = self.add(suffix(from, word), from, to);
        transition.on = Some(on);
        transition
    }

    fn add_timed(
        &mut self,
        from: &Spanned<String>,
        word: &str,
        time: &Spanned<std::time::Duration>,
        to: &Spanned<String>,
    ) {
        let exact = Interval { earliest: time.value, latest: Some(time.value) };
        self.add(suffix(from, word), from, to).interval = Some(time.with(exact));
    }

    /// Adds a transition from one place to another.
    fn add(
        &mut self,
        name: Spanned<String>,
        from: &Spanned<String>,
        to: &Spanned<String>,
    ) -> &mut Transition {
        self.transitions.push(Transition::new(name, vec![take(from), put(to)]));
        // It was pushed in the line before.
        let last = self.transitions.len() - 1;
        &mut self.transitions[last]
    }

    /// `red.WORD`, at the name of the route.
    fn name(&self, word: &str) -> Spanned<String> {
        suffix(&self.route.name, word)
    }

    fn name_after(&self, number: usize) -> Spanned<String> {
        name_after(self.route, &self.pieces, number)
    }

    fn name_after_step(&self, step: usize) -> Spanned<String> {
        let last = self.pieces.iter().rposition(|piece| piece.step == step);
        self.name_after(last.unwrap_or_default())
    }
}

fn take(place: &Spanned<String>) -> Arc {
    Arc { kind: ArcKind::Take, place: place.clone(), weight: 1 }
}

fn put(place: &Spanned<String>) -> Arc {
    Arc { kind: ArcKind::Put, place: place.clone(), weight: 1 }
}

fn suffix(name: &Spanned<String>, word: &str) -> Spanned<String> {
    name.with(format!("{}.{word}", name.value))
}

/// `red.l1`, or `red.l1.after-green` behind a phase line.
pub(crate) fn name_piece(route: &DrawnRoute, piece: &RoutePiece<'_>) -> Spanned<String> {
    let step = route.steps[piece.step].name();
    let whole = step.with(format!("{}.{}", route.name.value, step.value));
    match piece.behind {
        Some(line) => suffix(&whole, &format!("after-{}", line.name.value)),
        None => whole,
    }
}

/// `at-green`, what the place of the wait at a line has behind the name of its piece.
pub(crate) fn name_wait(line: &DrawnLine) -> String {
    format!("at-{}", line.name.value)
}

/// The place after a piece: that of the next one, or where the route ends.
fn name_after(route: &DrawnRoute, pieces: &[RoutePiece<'_>], number: usize) -> Spanned<String> {
    match (pieces.get(number + 1), &route.leave) {
        (Some(next), _) => name_piece(route, next),
        (None, Some(leave)) => leave.clone(),
        (None, None) => suffix(&route.name, "end"),
    }
}

/// How many meetings with the same route come before a piece.
fn number_of_meeting(
    pieces: &[RoutePiece<'_>],
    number: usize,
    route: &DrawnRoute,
    with: &str,
) -> usize {
    let before = pieces.iter().take(number);
    before.filter(|piece| is_meeting(&route.steps[piece.step], with)).count()
}

fn is_meeting(step: &RouteStep, with: &str) -> bool {
    matches!(step, RouteStep::Meet(meet) if meet.with.value == with)
}

/// Returns the route with this name, and its step that is its meeting of this number with `route`.
pub(crate) fn find_partner<'a>(
    route: &DrawnRoute,
    number: usize,
    with: &str,
    routes: &'a [DrawnRoute],
) -> Option<(&'a DrawnRoute, usize)> {
    let is_other = |other: &&DrawnRoute| other.name.value == with && with != route.name.value;
    let partner = routes.iter().find(is_other)?;
    let meetings = partner.steps.iter().enumerate();
    let mut meetings = meetings.filter(|(_, step)| is_meeting(step, &route.name.value));
    Some((partner, meetings.nth(number)?.0))
}

/// A waypoint as `points` are written: to a tenth of a millimetre, without trailing zeros.
fn format_waypoint(point: MapPoint) -> String {
    let number = |value: f64| {
        // Rounding may give -0, which is 0.
        let rounded = (value * 1e4).round() / 1e4 + 0.0;
        format!("{rounded}")
    };
    format!("{},{}", number(point.x_m()), number(point.y_m()))
}
