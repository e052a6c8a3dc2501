//! Whether legs and exits keep their distance from zones and lines. Exact, by [`armor_geo`].

use armor_geo::{Clearance, MapArea, MapPoint, MapPolygon, MapSegment, PointLocation};

use crate::site_map::{DrawnLine, DrawnZone, LineKind, SiteMap, ZoneKind};

/// What a path does that it must not do.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PathFault<'a> {
    /// It enters a zone, or comes nearer than its margin.
    Enters(&'a DrawnZone),
    /// It is in none of the zones to stay in; this is the first.
    Leaves(&'a DrawnZone),
    /// It crosses or touches a line.
    Crosses(&'a DrawnLine),
}

/// Returns the first fault of the straight path from `start` to `end` for a robot of this radius.
pub(crate) fn find_leg_fault(
    map: &SiteMap,
    start: MapPoint,
    end: MapPoint,
    radius: Clearance,
) -> Option<PathFault<'_>> {
    find_fault(map, &[MapSegment::new(start, end)], None, radius)
}

/// Returns the first fault of the straight paths to `end` from any point between `start` and
/// `middle`: they fill a triangle.
pub(crate) fn find_exit_fault(
    map: &SiteMap,
    (start, middle): (MapPoint, MapPoint),
    end: MapPoint,
    radius: Clearance,
) -> Option<PathFault<'_>> {
    let sides =
        [MapSegment::new(start, middle), MapSegment::new(middle, end), MapSegment::new(end, start)];
    // Three points on one line, or two that are the same, have no inside.
    let inside = MapPolygon::new(vec![start, middle, end]).ok();
    // The leg itself is not a path of the exit: its own faults are found at the leg.
    find_fault(map, &sides[1..], inside.as_ref(), radius)
}

fn find_fault<'a>(
    map: &'a SiteMap,
    paths: &[MapSegment],
    inside: Option<&MapPolygon>,
    radius: Clearance,
) -> Option<PathFault<'a>> {
    let mut no_go = map.zones.iter().filter(|zone| zone.kind == ZoneKind::NoGo);
    let entered = no_go.find(|zone| {
        let margin = add_radius(zone.margin, radius);
        paths.iter().any(|path| path.intrudes(&zone.area.value, margin))
            || inside.is_some_and(|inside| has_corner_in(&zone.area.value, inside))
    });
    if let Some(zone) = entered {
        return Some(PathFault::Enters(zone));
    }
    let mut stay_in = map.zones.iter().filter(|zone| zone.kind == ZoneKind::StayIn).peekable();
    let first = stay_in.peek().copied();
    // A simple polygon that contains the sides of a triangle contains the triangle.
    let stays = |zone: &DrawnZone| {
        let margin = add_radius(zone.margin, radius);
        paths.iter().all(|path| path.stays_within(&zone.area.value, margin))
    };
    if let Some(zone) = first.filter(|_| !stay_in.any(stays)) {
        return Some(PathFault::Leaves(zone));
    }
    let mut lines = map.lines.iter().filter(|line| line.kind != LineKind::Phase);
    let crossed = lines.find(|line| paths.iter().any(|path| line.shape.value.touches(*path)));
    crossed.map(PathFault::Crosses)
}

/// The margin and the radius; the sum of two lengths of the map's size is one, too.
pub(crate) fn add_radius(margin: Clearance, radius: Clearance) -> Clearance {
    margin.plus(radius).unwrap_or(margin)
}

/// Whether an area that touches no side of the triangle lies in it.
fn has_corner_in(area: &MapArea, triangle: &MapPolygon) -> bool {
    let corner = match area {
        MapArea::Polygon(polygon) => polygon.corners().first().copied(),
        MapArea::Circle(circle) => Some(circle.centre()),
    };
    corner.is_some_and(|corner| triangle.locate(corner) != PointLocation::Outside)
}

#[cfg(test)]
#[expect(clippy::print_stdout, reason = "the figures")]
mod tests;
