//! Where an exit of a route leads.

use armor_geo::MapPoint;

use crate::drawn_route::{DrawnRoute, ExitAction, RouteExit};
use crate::route::clear::choose_rally;
use crate::route::pieces::RoutePiece;
use crate::site_map::{DrawnPoint, SiteMap};

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
    map: Option<&'a SiteMap>,
) -> ExitTarget<'a> {
    let named = |name: &str| map.and_then(|map| map.find_point(name));
    let found = match (exit.action.value, &exit.to) {
        (ExitAction::Hold, _) => return ExitTarget::Safe,
        (ExitAction::Skip, _) => return ExitTarget::NextStep,
        (ExitAction::Rally, Some(to)) => named(&to.value),
        (ExitAction::Rally, None) => map.and_then(|map| find_nearest_rally(route, piece, map)),
        (ExitAction::Home, _) => route.start.as_ref().and_then(|start| named(&start.value)),
    };
    found.map_or(ExitTarget::Missing, ExitTarget::Point)
}

/// Where the robot is on the piece is between its ends; an end that is unknown is as the other one.
fn find_nearest_rally<'a>(
    route: &DrawnRoute,
    piece: &RoutePiece<'_>,
    map: &'a SiteMap,
) -> Option<&'a DrawnPoint> {
    let Some((start, end)) = piece.known_ends() else { return map.rallies.first() };
    choose_rally(map, (start, end), route.radius).map(|(rally, _)| rally)
}

impl RoutePiece<'_> {
    /// The positions between which the robot is; none if nothing is known.
    pub(crate) fn known_ends(&self) -> Option<(MapPoint, MapPoint)> {
        let any = self.start.or(self.end)?;
        Some((self.start.unwrap_or(any), self.end.unwrap_or(any)))
    }
}
