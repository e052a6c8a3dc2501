//! The map and routes of a mission file as a plan for other planners. Pure.

use std::collections::BTreeSet;

use armor_exchange::{
    AltitudeReference, Fence, FenceShape, NamedPosition, PlanAltitude, PlanItem, PlanNote,
    PlanPosition, PlannedRoute, RoutePlan,
};
use armor_geo::{GeoError, GeoPosition, MapArea, MapPlacement, MapPoint};
use armor_robotfile::drawn_route::{DrawnLeg, DrawnRoute, DrawnStay, RoutePort, RouteStep};
use armor_robotfile::site_map::{DrawnPoint, DrawnPosition, DrawnZone, SiteMap, ZoneKind};
use armor_wire::quantity::{Dimension, parse_in};

use super::drawing::ComponentPort;
use super::marks::BREACH_RETURN;

/// Why a drawing cannot be a plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanningError {
    /// Where the map is in the world is unknown.
    #[error(
        "the map has no origin, so that where it is in the world is unknown: write origin=\"48.8583 2.2945 35m\" at <map>, the position of its point 0 0"
    )]
    NoOrigin,
    /// A point of the map has no position in the world.
    #[error("{place}: {reason}")]
    Position {
        /// The point.
        place: String,
        /// Why not.
        reason: GeoError,
    },
}

/// Returns the map and these routes as a plan. Its notes name what has no counterpart in any plan.
/// `camera` is the component whose stays and legs are commands to take pictures.
///
/// # Errors
/// If the map has no origin, or a position is out of its reach.
pub fn plan_drawing(
    map: &SiteMap,
    routes: &[&DrawnRoute],
    camera: Option<&ComponentPort>,
) -> Result<RoutePlan, PlanningError> {
    let placement = map.placement.ok_or(PlanningError::NoOrigin)?;
    let mut planner = RoutePlanner { map, placement, camera, plan: RoutePlan::default() };
    planner.plan_home(routes)?;
    for route in routes {
        planner.plan_route(route)?;
    }
    planner.plan_zones()?;
    for rally in &map.rallies {
        let position = planner.position_of(rally)?;
        if rally.name.value == BREACH_RETURN {
            planner.plan.breach_return = Some(position);
        } else {
            let name = Some(rally.name.value.clone());
            planner.plan.rally_points.push(NamedPosition { name, position });
        }
    }
    planner.plan_other_points(routes)?;
    for line in &map.lines {
        planner.note(format!("line {}", line.name.value), "has no counterpart");
    }
    for symbol in &map.symbols {
        planner.note(format!("symbol {}", symbol.sidc.value), "has no counterpart");
    }
    Ok(planner.plan)
}

struct RoutePlanner<'a> {
    map: &'a SiteMap,
    placement: MapPlacement,
    camera: Option<&'a ComponentPort>,
    plan: RoutePlan,
}

impl RoutePlanner<'_> {
    fn note(&mut self, place: impl Into<String>, text: impl Into<String>) {
        self.plan.notes.push(PlanNote { place: place.into(), text: text.into(), item: None });
    }

    /// Home is where the routes begin; planners require one.
    fn plan_home(&mut self, routes: &[&DrawnRoute]) -> Result<(), PlanningError> {
        let starts = routes.iter().filter_map(|route| route.start.as_ref());
        let names: BTreeSet<_> = starts.map(|start| start.value.as_str()).collect();
        let start = names.first().and_then(|name| self.map.find_point(name));
        if let Some(point) = start.filter(|_| names.len() == 1) {
            let mut home = self.position_of(point)?;
            let reference = AltitudeReference::Sea;
            home.altitude = Some(PlanAltitude { m: self.placement.origin().height_m(), reference });
            self.plan.home = Some(home);
            return Ok(());
        }
        let origin = self.placement.origin();
        let reference = AltitudeReference::Sea;
        let altitude = Some(PlanAltitude { m: origin.height_m(), reference });
        self.plan.home = Some(PlanPosition { altitude, ..plain_position(origin) });
        if !routes.is_empty() {
            self.note("home", "no single route has a start: the home position is the map's origin");
        }
        Ok(())
    }

    fn plan_route(&mut self, route: &DrawnRoute) -> Result<(), PlanningError> {
        let place = format!("route {}", route.name.value);
        let mut items = Vec::new();
        let (mut speed_mps, mut with_camera) = (None, false);
        for step in &route.steps {
            match step {
                RouteStep::Leg(leg) => {
                    let speed = leg.speed.as_ref();
                    let own = speed
                        .and_then(|speed| parse_in(&speed.value, Dimension::Speed, "a speed").ok());
                    match own {
                        Some(own) if speed_mps != Some(own) => items.push(PlanItem::Speed(own)),
                        None if speed_mps.is_some() => self.note(
                            format!("leg {}", leg.name.value),
                            "has no speed of its own; in the plan that of the leg before continues",
                        ),
                        _ => {}
                    }
                    speed_mps = own.or(speed_mps);
                    let takes_pictures = self.is_camera_in(&leg.components);
                    if takes_pictures != with_camera {
                        items.push(match takes_pictures {
                            true => PlanItem::TakePictures { interval_s: 0.0, count: 0 },
                            false => PlanItem::StopPictures,
                        });
                    }
                    with_camera = takes_pictures;
                    if let Some(point) = self.map.find_point(&leg.to.value) {
                        let position = self.position_of(point)?;
                        let name = Some(point.name.value.clone());
                        items.push(PlanItem::Go { position, stay_s: 0.0, name });
                    }
                    self.note_leg(leg);
                }
                RouteStep::Stay(stay) => self.plan_stay(stay, &mut items),
                RouteStep::Meet(meet) => {
                    self.note(format!("meeting {}", meet.name.value), "has no counterpart");
                }
            }
        }
        self.note_route(route, &place);
        self.plan.routes.push(PlannedRoute { name: Some(route.name.value.clone()), items });
        Ok(())
    }

    fn plan_stay(&mut self, stay: &DrawnStay, items: &mut Vec<PlanItem>) {
        let place = format!("stay {}", stay.name.value);
        let picture = stay.on.as_ref().filter(|on| self.is_camera(on));
        if picture.is_some() {
            items.push(PlanItem::TakePictures { interval_s: 0.0, count: 1 });
        } else if let Some(on) = &stay.on {
            let on = format!("{}.{}", on.component.value, on.port.value);
            self.note(&place, format!("its end by {on} has no counterpart"));
        }
        if let Some(duration) = &stay.duration {
            let seconds = duration.value.as_secs_f64();
            // A stay directly behind a leg is that of its waypoint.
            match items.last_mut() {
                Some(PlanItem::Go { stay_s, .. }) if *stay_s == 0.0 => *stay_s = seconds,
                _ => items.push(PlanItem::Delay(seconds)),
            }
        }
        let others = stay.components.iter().filter(|name| !self.is_camera_named(&name.value));
        let others: Vec<_> = others.map(|name| name.value.as_str()).collect();
        if !others.is_empty() {
            self.note(place, format!("its components have no counterpart: {}", others.join(", ")));
        }
    }

    fn note_leg(&mut self, leg: &DrawnLeg) {
        let others = leg.components.iter().filter(|name| !self.is_camera_named(&name.value));
        let others = others.map(|name| name.value.as_str()).collect::<Vec<_>>().join(", ");
        let without: Vec<_> = [
            ("by", leg.by.is_some()),
            ("not-before", leg.not_before.is_some()),
            ("not-after", leg.not_after.is_some()),
        ]
        .iter()
        .filter_map(|(name, is_given)| is_given.then_some(*name))
        .collect();
        let place = format!("leg {}", leg.name.value);
        if !without.is_empty() {
            self.note(&place, format!("{} has no counterpart", without.join(", ")));
        }
        if !others.is_empty() {
            self.note(place, format!("its components have no counterpart: {others}"));
        }
    }

    fn note_route(&mut self, route: &DrawnRoute, place: &str) {
        let mut without = Vec::new();
        let given = [
            ("components", !route.components.is_empty()),
            ("radius", route.radius.metres() > 0.0),
            ("patience", route.patience.is_some()),
            ("rally-by", route.rally_by.is_some()),
            ("<otherwise>", !route.exits.is_empty()),
        ];
        without.extend(given.iter().filter_map(|(name, is_given)| is_given.then_some(*name)));
        if !without.is_empty() {
            self.note(place, format!("{} has no counterpart", without.join(", ")));
        }
    }

    fn plan_zones(&mut self) -> Result<(), PlanningError> {
        for zone in &self.map.zones {
            let place = format!("zone {}", zone.name.value);
            let stay_in = match zone.kind {
                ZoneKind::NoGo => false,
                ZoneKind::StayIn => true,
                ZoneKind::Speed | ZoneKind::Observe => {
                    self.note(place, "of its kind has no counterpart");
                    continue;
                }
            };
            if zone.margin.metres() > 0.0 {
                self.note(
                    &place,
                    format!("its margin of {} m has no counterpart", zone.margin.metres()),
                );
            }
            let shape = self.shape_of(zone, &place)?;
            self.plan.fences.push(Fence { name: Some(zone.name.value.clone()), stay_in, shape });
        }
        Ok(())
    }

    fn shape_of(&self, zone: &DrawnZone, place: &str) -> Result<FenceShape, PlanningError> {
        match &zone.area.value {
            MapArea::Circle(circle) => Ok(FenceShape::Circle {
                centre: self.position_at(circle.centre(), place)?,
                radius_m: circle.radius().metres(),
            }),
            MapArea::Polygon(polygon) => {
                let corners = polygon.corners().iter();
                let positions = corners.map(|corner| self.position_at(*corner, place));
                Ok(FenceShape::Polygon(positions.collect::<Result<_, _>>()?))
            }
        }
    }

    /// The points that no route leads to.
    fn plan_other_points(&mut self, routes: &[&DrawnRoute]) -> Result<(), PlanningError> {
        let legs = routes.iter().flat_map(|route| &route.steps).filter_map(|step| match step {
            RouteStep::Leg(leg) => Some(leg.to.value.as_str()),
            _ => None,
        });
        let starts = routes.iter().filter_map(|route| route.start.as_ref());
        let starts = starts.map(|start| start.value.as_str());
        let used: BTreeSet<_> = legs.chain(starts).collect();
        for point in &self.map.points {
            if !used.contains(point.name.value.as_str()) {
                let position = self.position_of(point)?;
                let name = Some(point.name.value.clone());
                self.plan.points.push(NamedPosition { name, position });
            }
        }
        Ok(())
    }

    fn position_of(&self, point: &DrawnPoint) -> Result<PlanPosition, PlanningError> {
        match point.position.value {
            DrawnPosition { geo: Some(geo), .. } => Ok(plain_position(geo)),
            DrawnPosition { point: at, geo: None } => self.position_at(at, &point.name.value),
        }
    }

    fn position_at(&self, point: MapPoint, place: &str) -> Result<PlanPosition, PlanningError> {
        let place = || place.to_owned();
        let geo = self.placement.geo_from_map(point);
        geo.map(plain_position).map_err(|reason| PlanningError::Position { place: place(), reason })
    }

    fn is_camera_named(&self, name: &str) -> bool {
        self.camera.is_some_and(|camera| camera.component == name)
    }

    fn is_camera_in(&self, names: &[armor_robotfile::Spanned<String>]) -> bool {
        names.iter().any(|name| self.is_camera_named(&name.value))
    }

    fn is_camera(&self, port: &RoutePort) -> bool {
        self.is_camera_named(&port.component.value)
            && self.camera.is_some_and(|camera| camera.port == port.port.value)
    }
}

/// A position without altitude, with ten decimals of a degree (0.01 mm).
fn plain_position(geo: GeoPosition) -> PlanPosition {
    let rounded = |degrees: f64| (degrees * 1e10).round() / 1e10 + 0.0;
    // The map counts longitudes up to a full turn, planners up to half of one.
    let longitude = geo.longitude_deg();
    let longitude = longitude - 360.0 * (longitude / 360.0).round();
    PlanPosition {
        latitude_deg: rounded(geo.latitude_deg()),
        longitude_deg: rounded(longitude),
        altitude: None,
    }
}
