//! The drives of a mission's routes: its legs, and those to rally points.

use armor_geo::{Clearance, MapPoint, ShortestPath};

use crate::drawn_route::{DrawnRoute, ExitAction, RouteExit, RouteStep};
use crate::mission::Mission;
use crate::route::exit_paths::{ExitPath, ExitPaths};
use crate::route::exits::{ExitTarget, find_exit_target};
use crate::route::pieces::{MAX_ROUTE_PIECES, RoutePiece, divide_into_pieces};
use crate::site_map::DrawnPoint;
use crate::source::Spanned;

/// A drive of a route.
#[derive(Clone, Debug)]
pub struct RouteDrive<'a> {
    /// Its route.
    pub route: &'a DrawnRoute,
    /// Its step: the leg, or the step that ends early.
    pub step: &'a Spanned<String>,
    /// The points between which it begins; twice the same if it begins at one.
    pub from: [MapPoint; 2],
    /// Where it leads.
    pub to: MapPoint,
    /// What it is.
    pub purpose: DrivePurpose<'a>,
}

/// What a drive is.
#[derive(Clone, Debug)]
pub enum DrivePurpose<'a> {
    /// A leg, or a part of one.
    Leg {
        /// Whether it is driven along the straight line.
        is_straight: bool,
    },
    /// To a point because the step ended early.
    Exit {
        /// The first exit that leads there.
        exit: &'a RouteExit,
        /// The point.
        point: &'a DrawnPoint,
        /// The longest path to it, from the worst point of the step, where paths lead around zones; none
        /// if all of them are straight, or none was found.
        around: Option<ShortestPath>,
        /// The other rally points that could be taken instead: the nearest one is, and the straight
        /// paths to these are clear, too; or lead around zones, as those to the nearest one do.
        others: Vec<&'a DrawnPoint>,
    },
}

impl RouteDrive<'_> {
    /// The radius of its robot.
    pub fn radius(&self) -> Clearance {
        self.route.radius
    }
}

/// Returns the drives of a mission whose ends are known, in the order of the file; each exit to one
/// point once for each step.
pub fn list_drives(mission: &Mission) -> Vec<RouteDrive<'_>> {
    let mut drives = Vec::new();
    let Some(map) = &mission.map else { return drives };
    let mut paths = ExitPaths::new(Some(map));
    for route in &mission.routes {
        let pieces = divide_into_pieces(route, Some(map));
        // That is a finding.
        if pieces.len() > MAX_ROUTE_PIECES {
            continue;
        }
        for piece in &pieces {
            let step = &route.steps[piece.step];
            if let (RouteStep::Leg(leg), Some(start), Some(to)) = (step, piece.start, piece.end) {
                let purpose = DrivePurpose::Leg { is_straight: leg.is_straight };
                let from = [start, start];
                drives.push(RouteDrive { route, step: step.name(), from, to, purpose });
            }
            add_exits(route, piece, &mut paths, &mut drives);
        }
    }
    drives
}

fn add_exits<'a>(
    route: &'a DrawnRoute,
    piece: &RoutePiece<'a>,
    paths: &mut ExitPaths<'a>,
    drives: &mut Vec<RouteDrive<'a>>,
) {
    let Some((start, end)) = piece.known_ends() else { return };
    let rallies = paths.map().map(|map| map.rallies.as_slice()).unwrap_or_default();
    let mut seen: Vec<&str> = Vec::new();
    for exit in &route.exits {
        let ExitTarget::Point(point) = find_exit_target(route, exit, piece, paths) else {
            continue;
        };
        if seen.contains(&point.name.value.as_str()) {
            continue;
        }
        seen.push(&point.name.value);
        let is_chosen = exit.action.value == ExitAction::Rally && exit.to.is_none();
        let there = point.position.value.point;
        let around = match paths.find_path((start, end), there, route.radius) {
            ExitPath::Around(longest) => Some(longest),
            ExitPath::Straight | ExitPath::Blocked => None,
        };
        let is_other = |rally: &&DrawnPoint| {
            let there = rally.position.value.point;
            is_chosen
                && rally.name.value != point.name.value
                && match paths.find_path((start, end), there, route.radius) {
                    ExitPath::Straight => true,
                    ExitPath::Around(_) => around.is_some(),
                    ExitPath::Blocked => false,
                }
        };
        let others = rallies.iter().filter(is_other).collect();
        drives.push(RouteDrive {
            route,
            step: route.steps[piece.step].name(),
            from: [start, end],
            to: there,
            purpose: DrivePurpose::Exit { exit, point, around, others },
        });
    }
}
