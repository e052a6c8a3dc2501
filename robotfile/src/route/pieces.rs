//! A route divided into what is driven at a stretch: each leg, and the parts of a leg between the
//! phase lines at which the robot waits.

use armor_geo::{MapPoint, MapSegment};

use crate::drawn_route::{DrawnRoute, RouteStep};
use crate::site_map::{DrawnLine, DrawnPosition, LineKind, SiteMap};

/// Most pieces of a route: as many as two for each step.
pub(crate) const MAX_ROUTE_PIECES: usize = 128;

/// A straight drive, or a step without one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoutePiece<'a> {
    /// The number of its step.
    pub(crate) step: usize,
    /// The phase line that the robot has crossed within the leg; none in its first part.
    pub(crate) behind: Option<&'a DrawnLine>,
    /// The phase line at which it ends; none if it ends at the leg's point.
    pub(crate) ends_at: Option<&'a DrawnLine>,
    /// Where the robot is when it begins, if this is known.
    pub(crate) start: Option<MapPoint>,
    /// Where the robot is when it ends, if this is known.
    pub(crate) end: Option<MapPoint>,
}

/// Divides a route. A leg to a point that does not exist, which is a finding, leaves the robot at an
/// unknown position.
pub(crate) fn divide_into_pieces<'a>(
    route: &'a DrawnRoute,
    map: Option<&'a SiteMap>,
) -> Vec<RoutePiece<'a>> {
    let find = |name: &str| map?.find_point(name).map(|point| point.position.value);
    let as_point = |position: DrawnPosition| position.point;
    let mut position = route.start.as_ref().and_then(|start| find(&start.value)).map(as_point);
    let mut pieces = Vec::new();
    for (step, drawn) in route.steps.iter().enumerate() {
        let start = position;
        let whole = RoutePiece { step, behind: None, ends_at: None, start, end: position };
        let RouteStep::Leg(leg) = drawn else {
            pieces.push(whole);
            continue;
        };
        position = find(&leg.to.value).map(as_point);
        let whole = RoutePiece { end: position, ..whole };
        let (Some(from), Some(to), Some(map)) = (start, position, map) else {
            pieces.push(whole);
            continue;
        };
        divide_leg((from, to), map, whole, &mut pieces);
    }
    pieces
}

fn divide_leg<'a>(
    (from, to): (MapPoint, MapPoint),
    map: &'a SiteMap,
    whole: RoutePiece<'a>,
    pieces: &mut Vec<RoutePiece<'a>>,
) {
    let path = MapSegment::new(from, to);
    let gates =
        map.lines.iter().filter(|line| line.kind == LineKind::Phase && line.not_before.is_some());
    let mut crossings: Vec<_> =
        gates.filter_map(|line| find_crossing(path, line).map(|share| (share, line))).collect();
    crossings.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut next = whole;
    for (share, line) in crossings {
        let stop = path.point_at(share);
        pieces.push(RoutePiece { ends_at: Some(line), end: Some(stop), ..next });
        next = RoutePiece { behind: Some(line), start: Some(stop), ..whole };
    }
    pieces.push(next);
}

/// Returns the share of the path at which the robot waits for the line that it crosses: the margin
/// before the first crossing.
fn find_crossing(path: MapSegment, line: &DrawnLine) -> Option<f64> {
    let crossed = line.shape.value.segments().filter(|piece| piece.touches(path));
    let share = crossed.map(|piece| crossing_share(path, piece)).min_by(f64::total_cmp)?;
    let length_m = path.length_m();
    let margin = if length_m > 0.0 { line.margin.metres() / length_m } else { 0.0 };
    Some((share - margin).max(0.0))
}

/// The share of `path` at which it crosses `other`, which it touches, rounded.
fn crossing_share(path: MapSegment, other: MapSegment) -> f64 {
    let offset = |from: MapPoint, to: MapPoint| (to.x_m() - from.x_m(), to.y_m() - from.y_m());
    let cross = |a: (f64, f64), b: (f64, f64)| a.0 * b.1 - a.1 * b.0;
    let (along, across) = (offset(path.start(), path.end()), offset(other.start(), other.end()));
    let divisor = cross(along, across);
    if divisor == 0.0 {
        // Along the line: at its nearer end.
        let ends = [other.start(), other.end()].map(|end| path.share_nearest_to(end));
        return ends[0].min(ends[1]);
    }
    (cross(offset(path.start(), other.start()), across) / divisor).clamp(0.0, 1.0)
}
