//! The exits of drawn routes: their paths keep their distance from zones and lines. A straight path does it
//! whatever drives the robot; a path around zones needs a robot that knows them.

use armor_geo::Clearance;

use crate::code::Code;
use crate::drawn_route::{DrawnRoute, ExitAction, RouteExit};
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::Mission;
use crate::model::System;
use crate::route::clear::{PathFault, find_exit_fault};
use crate::route::{
    ExitPath, ExitPaths, ExitTarget, RoutePiece, find_exit_target, find_firings, name_piece,
};
use crate::site_map::{DrawnPoint, SiteMap};
use crate::trace::FiringTrace;

/// The input through which a component receives zones, and the parameter that has them instead of those
/// of the map.
const ZONES: &str = "zones";

/// Where the exits of a route are.
#[derive(Clone, Copy)]
pub(super) struct ExitSite<'a> {
    pub(super) mission: &'a Mission,
    pub(super) map: &'a SiteMap,
    pub(super) system: &'a System,
    /// Whether it is the mission that is played: names of its transitions are those of firings, and
    /// robots receive its zones.
    pub(super) is_whole: bool,
}

/// Checks the paths of the exits from each piece of a route.
pub(super) fn check_exits<'a>(
    route: &DrawnRoute,
    pieces: &[RoutePiece<'_>],
    site: ExitSite<'a>,
    paths: &mut ExitPaths<'a>,
    findings: &mut Findings,
) {
    let receives_zones = site.is_whole && drives_around_zones(route, site);
    for piece in pieces {
        let faulty = find_faulty_exit(route, piece, site.map, paths, receives_zones);
        let Some(faulty) = faulty else { continue };
        let mut finding = report_exit(route, piece, &faulty, site.is_whole);
        if site.is_whole {
            let here = name_piece(route, piece).value;
            let drive = format!("{here}.to-{}", faulty.point.name.value);
            if let Some(firings) = find_firings(site.mission, &here, &drive) {
                finding = finding.trace(FiringTrace { firings, ..FiringTrace::default() });
            }
        }
        findings.push(finding);
    }
}

/// Whether the robot of a route drives around the zones of the map: its mover, or a component that
/// receives what the mover publishes, receives zones that are those of the map.
fn drives_around_zones(route: &DrawnRoute, site: ExitSite<'_>) -> bool {
    let links = &site.system.links;
    let mover = route.mover.component.value.as_str();
    let receives = |component: &str| {
        let to_it = links.iter().filter(|link| link.to.component.value == component);
        let mut zones = to_it.filter(|link| link.to.port.value == ZONES);
        zones.any(|link| publishes_those_of(site, &link.from.component.value))
    };
    let from_mover = links.iter().filter(|link| link.from.component.value == mover);
    receives(mover) || from_mover.into_iter().any(|link| receives(&link.to.component.value))
}

/// Whether the zones that a component publishes are those of the map: the file assigns it no others.
fn publishes_those_of(site: ExitSite<'_>, component: &str) -> bool {
    let mut components = site.system.components.iter();
    let found = components.find(|it| it.name.value == component);
    let assigned = found.and_then(|component| component.parameter(ZONES));
    let drawn_at = site.map.zones.first().map(|zone| &zone.name.at);
    // Those of the map are assigned where the first of them is drawn.
    assigned.is_none_or(|parameter| {
        drawn_at.is_some_and(|at| {
            parameter.value.at.span == at.span
                && parameter.value.at.source.path() == at.source.path()
        })
    })
}

/// An exit whose path is not kept.
struct FaultyExit<'a, 'r> {
    exit: &'r RouteExit,
    point: &'a DrawnPoint,
    fault: PathFault<'a>,
    /// Whether a path leads around the zones, which nothing gives to the robot.
    leads_around: bool,
    /// A rally point to which all paths are straight.
    instead: Option<&'a DrawnPoint>,
}

fn find_faulty_exit<'a, 'r>(
    route: &'r DrawnRoute,
    piece: &RoutePiece<'_>,
    map: &'a SiteMap,
    paths: &mut ExitPaths<'a>,
    receives_zones: bool,
) -> Option<FaultyExit<'a, 'r>> {
    let ends = piece.known_ends()?;
    let is_straight = |point: &DrawnPoint| {
        find_exit_fault(map, ends, point.position.value.point, route.radius).is_none()
    };
    route.exits.iter().find_map(|exit| {
        let ExitTarget::Point(point) = find_exit_target(route, exit, piece, paths) else {
            return None;
        };
        let there = point.position.value.point;
        let leads_around = match paths.find_path(ends, there, route.radius) {
            ExitPath::Straight => return None,
            ExitPath::Around(_) if receives_zones => return None,
            ExitPath::Around(_) => true,
            ExitPath::Blocked => false,
        };
        let fault = find_exit_fault(map, ends, there, route.radius)?;
        let is_chosen = exit.action.value == ExitAction::Rally && exit.to.is_none();
        let instead = map.rallies.iter().find(|rally| is_chosen && is_straight(rally));
        Some(FaultyExit { exit, point, fault, leads_around, instead })
    })
}

fn report_exit(
    route: &DrawnRoute,
    piece: &RoutePiece<'_>,
    faulty: &FaultyExit<'_, '_>,
    is_whole: bool,
) -> Finding {
    let step = route.steps[piece.step].name();
    let path = format!("the path to {} from some point of {}", faulty.point.name.value, step.value);
    let (message, at) = match faulty.fault {
        PathFault::Enters(zone) => {
            let intrusion = describe_intrusion(&zone.name.value, zone.margin, route.radius);
            (format!("{path} {intrusion}"), &zone.area.at)
        }
        PathFault::Leaves(zone) => (format!("{path} leaves {}", zone.name.value), &zone.area.at),
        PathFault::Crosses(line) => (format!("{path} crosses {}", line.name.value), &line.shape.at),
    };
    Finding::new(Code::ExitIntrudes, &step.at, message)
        .remedy(advise_exit(faulty, is_whole))
        .related(&faulty.exit.action.at, "this exit")
        .related(at, "this is on the path")
}

fn advise_exit(faulty: &FaultyExit<'_, '_>, is_whole: bool) -> String {
    let instead = faulty.instead.map(|rally| format!("write to=\"{}\"", rally.name.value));
    let otherwise = instead.unwrap_or_else(|| match faulty.exit.action.value {
        ExitAction::Home => {
            "draw a rally point on this side, and write do=\"rally\"; or do=\"hold\"".into()
        }
        _ => "draw a rally point on this side of it; or write do=\"hold\"".into(),
    });
    if faulty.leads_around && is_whole {
        format!(
            "a path leads around it: link the zones of a chart to what plans the path, which then \
             drives around it; or {otherwise}"
        )
    } else {
        otherwise
    }
}

/// `enters school`, `enters school or comes nearer to it than 2.3 m`.
pub(super) fn describe_intrusion(zone: &str, margin: Clearance, radius: Clearance) -> String {
    let keep_m = margin.metres() + radius.metres();
    if keep_m > 0.0 {
        // Without the digits that only rounding gives.
        let shown = (keep_m * 1e4).round() / 1e4;
        format!("enters {zone}, or comes nearer to it than {shown} m")
    } else {
        format!("enters {zone}")
    }
}
