//! Where an exit of a route leads.

use armor_geo::MapPoint;

use crate::drawn_route::{DrawnRoute, ExitAction, RouteExit};
use crate::route::exit_paths::ExitPaths;
use crate::route::pieces::RoutePiece;
use crate::site_map::DrawnPoint;

/// Where an exit leads from a piece of a route.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ExitTarget<'a> {
    /// To a point, which the robot drives to.
    Point(&'a DrawnPoint),
    /// To the route's safe place.
    Safe,
    /// To the next step.
    NextStep,
    /// Nowhere: the point does not exist, which is a finding.
    Missing,
}

/// Returns where an exit leads from a piece.
pub(crate) fn find_exit_target<'a>(
    route: &DrawnRoute,
    exit: &RouteExit,
    piece: &RoutePiece<'_>,
    paths: &mut ExitPaths<'a>,
) -> ExitTarget<'a> {
    let map = paths.map();
    let named = |name: &str| map?.find_point(name);
    let found = match (exit.action.value, &exit.to) {
        (ExitAction::Hold, _) => return ExitTarget::Safe,
        (ExitAction::Skip, _) => return ExitTarget::NextStep,
        (ExitAction::Rally, Some(to)) => named(&to.value),
        (ExitAction::Rally, None) => match piece.known_ends() {
            Some(ends) => paths.find_nearest_rally(ends, route.radius),
            None => map.and_then(|map| map.rallies.first()),
        },
        (ExitAction::Home, _) => route.start.as_ref().and_then(|start| named(&start.value)),
    };
    found.map_or(ExitTarget::Missing, ExitTarget::Point)
}

impl RoutePiece<'_> {
    /// The positions between which the robot is; none if nothing is known. An end that is unknown is as
    /// the other one.
    pub(crate) fn known_ends(&self) -> Option<(MapPoint, MapPoint)> {
        let any = self.start.or(self.end)?;
        Some((self.start.unwrap_or(any), self.end.unwrap_or(any)))
    }
}
