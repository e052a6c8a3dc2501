//! What is drawn, as things to compare. The legs of a route are compared as the places and
//! transitions that are derived from them.

use super::Subject;
use super::items::{ComparedItem, new_aspect, plain_aspect, text_aspect};
use crate::drawn_route::{DrawnRoute, RouteStep, USUAL_TOLERANCE};
use crate::mission::Mission;
use crate::site_map::{DrawnPoint, LineKind, SiteMap, ZoneKind};

/// Returns the map, its marks, and the routes.
pub(super) fn of_drawing(mission: &Mission) -> Vec<ComparedItem> {
    let mut items: Vec<_> = mission.map.iter().flat_map(of_map).collect();
    items.extend(mission.routes.iter().map(of_route));
    items
}

fn of_map(map: &SiteMap) -> Vec<ComparedItem> {
    let origin = map.origin.as_ref();
    let heading = map.placement.map(|placement| placement.heading_rad().to_degrees());
    let symbols: Vec<_> = map
        .symbols
        .iter()
        .map(|it| format!("{} {}", it.sidc.value, it.position.at.text()))
        .collect();
    let itself = vec![
        origin.map(|it| new_aspect("origin", format!("{:?}", it.value), it.at.text())),
        heading.and_then(|heading| plain_aspect("heading", format!("{heading}deg"))),
        text_aspect("picture", &map.picture),
        text_aspect("grid", &map.grid),
        plain_aspect("symbols", symbols.join(", ")),
    ];
    let mut items = vec![ComparedItem::new(Subject::Map, "", itself)];
    let points = map.points.iter().map(|point| ("point", point));
    let points = points.chain(map.rallies.iter().map(|rally| ("rally", rally)));
    items.extend(points.map(|(sort, point)| of_point(sort, point)));
    for zone in &map.zones {
        let kind = ZoneKind::NAMED.iter().find(|(_, kind)| *kind == zone.kind);
        let speed = zone.speed_mps.as_ref();
        let aspects = vec![
            kind.and_then(|(word, _)| plain_aspect("kind", *word)),
            of_margin(zone.margin.metres()),
            speed.map(|speed| new_aspect("speed", speed.value.to_string(), speed.at.text())),
            Some(new_aspect("shape", format!("{:?}", zone.area.value), zone.area.at.text())),
        ];
        items.push(ComparedItem::new(Subject::Mark, &*zone.name.value, aspects));
    }
    for line in &map.lines {
        let kind = LineKind::NAMED.iter().find(|(_, kind)| *kind == line.kind);
        let date = line.not_before.as_ref();
        let aspects = vec![
            kind.and_then(|(word, _)| plain_aspect("kind", *word)),
            of_margin(line.margin.metres()),
            date.map(|date| new_aspect("not-before", date.value.to_string(), date.at.text())),
            Some(new_aspect("shape", format!("{:?}", line.shape.value), line.shape.at.text())),
        ];
        items.push(ComparedItem::new(Subject::Mark, &*line.name.value, aspects));
    }
    items
}

fn of_margin(margin_m: f64) -> Option<super::items::Aspect> {
    plain_aspect("margin", if margin_m > 0.0 { format!("{margin_m}m") } else { String::new() })
}

fn of_point(sort: &str, point: &DrawnPoint) -> ComparedItem {
    let position = &point.position;
    let at = new_aspect("at", format!("{:?}", position.value.point), position.at.text());
    let aspects = vec![plain_aspect("kind", sort), Some(at)];
    ComparedItem::new(Subject::Mark, &*point.name.value, aspects)
}

fn of_route(route: &DrawnRoute) -> ComparedItem {
    let radius_m = route.radius.metres();
    let straight = route.steps.iter().filter_map(|step| match step {
        RouteStep::Leg(leg) if leg.is_straight => Some(leg.name.value.as_str()),
        _ => None,
    });
    let straight: Vec<_> = straight.collect();
    let is_usual = (route.tolerance - USUAL_TOLERANCE).abs() < f64::EPSILON;
    let share = format!("{}%", (route.tolerance * 1e4).round() / 1e2);
    // The default is no change of a file that does not state it.
    let tolerance = if is_usual { String::new() } else { share };
    let aspects = vec![
        plain_aspect("tolerance", tolerance),
        route
            .endurance
            .as_ref()
            .map(|time| new_aspect("endurance", format!("{:?}", time.value), time.at.text())),
        plain_aspect("straight legs", straight.join(" ")),
        text_aspect("start", &route.start),
        plain_aspect("radius", if radius_m > 0.0 { format!("{radius_m}m") } else { String::new() }),
        route.pose.as_ref().and_then(|pose| {
            plain_aspect("pose", format!("{}.{}", pose.component.value, pose.port.value))
        }),
    ];
    ComparedItem::new(Subject::Route, &*route.name.value, aspects)
}
