//! GeoJSON (RFC 7946): lines are routes, polygons and circles fences, points rally points or
//! others. The property `kind` states what a feature is; circles are points with `radius_m`.

use serde_json::{Map, Value, json};

use crate::error::{MOST_POSITIONS, PlanReadError};
use crate::plan::{
    AltitudeReference, Fence, FenceShape, NamedPosition, Omissions, PlanAltitude, PlanItem,
    PlanNote, PlanPosition, PlannedRoute, RoutePlan, rounded,
};

const FORMAT: &str = "GeoJSON";
const NO_GO: &str = "no-go";
const STAY_IN: &str = "stay-in";
const RALLY: &str = "rally";
const HOME: &str = "home";
const BREACH_RETURN: &str = "breach-return";

pub(crate) fn read(text: &str) -> Result<RoutePlan, PlanReadError> {
    let file: Value = serde_json::from_str(text)
        .map_err(|error| PlanReadError::Syntax { format: FORMAT, reason: error.to_string() })?;
    let mut plan = RoutePlan::default();
    let mut reading = Reading { plan: &mut plan, positions: 0 };
    match file["type"].as_str() {
        Some("FeatureCollection") => {
            let features = file["features"]
                .as_array()
                .ok_or_else(|| PlanReadError::missing("the file", "features"))?;
            for (index, feature) in features.iter().enumerate() {
                reading.read_feature(feature, &format!("feature {}", index + 1))?;
            }
        }
        Some("Feature") => reading.read_feature(&file, "the feature")?,
        Some(_) => reading.read_geometry(&file, &Value::Null, "the geometry")?,
        None => {
            let reason = "it has no `type`".to_owned();
            return Err(PlanReadError::Syntax { format: FORMAT, reason });
        }
    }
    Ok(plan)
}

struct Reading<'a> {
    plan: &'a mut RoutePlan,
    positions: usize,
}

impl Reading<'_> {
    fn read_feature(&mut self, feature: &Value, place: &str) -> Result<(), PlanReadError> {
        if feature["type"].as_str() != Some("Feature") {
            return Err(PlanReadError::value(place, "its type is not Feature"));
        }
        self.read_geometry(&feature["geometry"], &feature["properties"], place)
    }

    /// A geometry; serde_json limits how deep collections are nested.
    fn read_geometry(
        &mut self,
        geometry: &Value,
        properties: &Value,
        place: &str,
    ) -> Result<(), PlanReadError> {
        let coordinates = &geometry["coordinates"];
        match geometry["type"].as_str() {
            Some("Point") => self.read_point(coordinates, properties, place),
            Some("MultiPoint") => self.each(coordinates, place, |reading, point, place| {
                reading.read_point(point, properties, place)
            }),
            Some("LineString") => self.read_line(coordinates, properties, place),
            Some("MultiLineString") => self.each(coordinates, place, |reading, line, place| {
                reading.read_line(line, properties, place)
            }),
            Some("Polygon") => self.read_polygon(coordinates, properties, place),
            Some("MultiPolygon") => self.each(coordinates, place, |reading, polygon, place| {
                reading.read_polygon(polygon, properties, place)
            }),
            Some("GeometryCollection") => {
                self.each(&geometry["geometries"], place, |reading, geometry, place| {
                    reading.read_geometry(geometry, properties, place)
                })
            }
            Some(other) => {
                let other: String = other.chars().take(40).collect();
                Err(PlanReadError::value(place, format!("the geometry {other} is not defined")))
            }
            None if geometry.is_null() => {
                self.plan.note(place, "a feature without a geometry was left out");
                Ok(())
            }
            None => Err(PlanReadError::missing(place, "type of a geometry")),
        }
    }

    fn each(
        &mut self,
        list: &Value,
        place: &str,
        mut read: impl FnMut(&mut Self, &Value, &str) -> Result<(), PlanReadError>,
    ) -> Result<(), PlanReadError> {
        let list = list.as_array().ok_or_else(|| PlanReadError::missing(place, "coordinates"))?;
        for (index, value) in list.iter().enumerate() {
            read(self, value, &format!("{place}, part {}", index + 1))?;
        }
        Ok(())
    }

    fn position(&mut self, value: &Value, place: &str) -> Result<PlanPosition, PlanReadError> {
        self.positions += 1;
        if self.positions > MOST_POSITIONS {
            return Err(PlanReadError::TooMany { most: MOST_POSITIONS });
        }
        let number = |index: usize| value.get(index).and_then(Value::as_f64);
        let (Some(longitude), Some(latitude)) = (number(0), number(1)) else {
            return Err(PlanReadError::missing(place, "longitude and latitude"));
        };
        let altitude = number(2).map(|m| PlanAltitude { m, reference: AltitudeReference::Sea });
        PlanPosition::checked(latitude, longitude, altitude)
            .map_err(|reason| PlanReadError::value(place, reason))
    }

    fn line(&mut self, value: &Value, place: &str) -> Result<Vec<PlanPosition>, PlanReadError> {
        let list = value.as_array().ok_or_else(|| PlanReadError::missing(place, "coordinates"))?;
        list.iter().map(|position| self.position(position, place)).collect()
    }

    fn read_point(
        &mut self,
        coordinates: &Value,
        properties: &Value,
        place: &str,
    ) -> Result<(), PlanReadError> {
        let position = self.position(coordinates, place)?;
        let (name, kind) = (name_of(properties), kind_of(properties));
        if let Some(radius_m) = properties["radius_m"].as_f64().map(rounded) {
            if !(radius_m.is_finite() && radius_m > 0.0) {
                let reason = format!("radius {radius_m} is not above 0");
                return Err(PlanReadError::value(place, reason));
            }
            let shape = FenceShape::Circle { centre: position, radius_m };
            self.plan.fences.push(Fence { name, stay_in: kind == STAY_IN, shape });
            return Ok(());
        }
        match kind {
            HOME if self.plan.home.is_none() => self.plan.home = Some(position),
            BREACH_RETURN if self.plan.breach_return.is_none() => {
                self.plan.breach_return = Some(position);
            }
            RALLY => self.plan.rally_points.push(NamedPosition { name, position }),
            _ => self.plan.points.push(NamedPosition { name, position }),
        }
        Ok(())
    }

    fn read_line(
        &mut self,
        coordinates: &Value,
        properties: &Value,
        place: &str,
    ) -> Result<(), PlanReadError> {
        let positions = self.line(coordinates, place)?;
        let names = properties["names"].as_array();
        let name_at = |index: usize| names?.get(index)?.as_str().map(str::to_owned);
        let go = |(index, position)| PlanItem::Go { position, stay_s: 0.0, name: name_at(index) };
        let items = positions.into_iter().enumerate().map(go).collect();
        self.plan.routes.push(PlannedRoute { name: name_of(properties), items });
        Ok(())
    }

    fn read_polygon(
        &mut self,
        coordinates: &Value,
        properties: &Value,
        place: &str,
    ) -> Result<(), PlanReadError> {
        let rings =
            coordinates.as_array().ok_or_else(|| PlanReadError::missing(place, "coordinates"))?;
        if rings.len() > 1 {
            let reason = format!(
                "{} holes in it have no counterpart and would be closed; draw areas around them",
                rings.len() - 1
            );
            return Err(PlanReadError::value(place, reason));
        }
        let ring = rings.first().unwrap_or(&Value::Null);
        let mut corners = self.line(ring, place)?;
        // The last corner of a ring is the first one again.
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() < 3 {
            let reason = format!("it has {} corners, and an area needs three", corners.len());
            return Err(PlanReadError::value(place, reason));
        }
        let kind = kind_of(properties);
        if !matches!(kind, NO_GO | STAY_IN) {
            self.plan.note(
                place,
                format!(
                    "an area without the property `kind` ({NO_GO} or {STAY_IN}) is read as {NO_GO}"
                ),
            );
        }
        let shape = FenceShape::Polygon(corners);
        let (name, stay_in) = (name_of(properties), kind == STAY_IN);
        self.plan.fences.push(Fence { name, stay_in, shape });
        Ok(())
    }
}

fn name_of(properties: &Value) -> Option<String> {
    properties["name"].as_str().map(str::to_owned)
}

fn kind_of(properties: &Value) -> &str {
    properties["kind"].as_str().unwrap_or_default()
}

pub(crate) fn write(plan: &RoutePlan) -> (String, Vec<PlanNote>) {
    let mut writing = Writing { features: Vec::new(), omissions: Omissions::default() };
    if let Some(home) = plan.home {
        writing.add_point(home, None, HOME, None);
    }
    for route in &plan.routes {
        writing.add_route(route);
    }
    for fence in &plan.fences {
        writing.add_fence(fence);
    }
    if let Some(position) = plan.breach_return {
        writing.add_point(position, None, BREACH_RETURN, None);
    }
    for point in &plan.rally_points {
        writing.add_point(point.position, point.name.as_deref(), RALLY, None);
    }
    for point in &plan.points {
        writing.add_point(point.position, point.name.as_deref(), "point", None);
    }
    let file = json!({ "type": "FeatureCollection", "features": writing.features });
    (format!("{file:#}\n"), writing.omissions.into_notes(FORMAT))
}

struct Writing {
    features: Vec<Value>,
    omissions: Omissions,
}

impl Writing {
    fn coordinates(&mut self, position: PlanPosition) -> Value {
        let (longitude, latitude) = (position.longitude_deg, position.latitude_deg);
        match position.altitude {
            Some(PlanAltitude { m, reference: AltitudeReference::Sea }) => {
                json!([longitude, latitude, m])
            }
            Some(_) => {
                self.omissions.add("altitude above home or ground", 1);
                json!([longitude, latitude])
            }
            None => json!([longitude, latitude]),
        }
    }

    fn add(&mut self, kind: &str, coordinates: Value, properties: Map<String, Value>) {
        let geometry = json!({ "type": kind, "coordinates": coordinates });
        self.features
            .push(json!({ "type": "Feature", "properties": properties, "geometry": geometry }));
    }

    fn add_point(
        &mut self,
        position: PlanPosition,
        name: Option<&str>,
        kind: &str,
        radius_m: Option<f64>,
    ) {
        let mut properties = properties_of(name, kind);
        if let Some(radius_m) = radius_m {
            properties.insert("radius_m".to_owned(), json!(radius_m));
        }
        let coordinates = self.coordinates(position);
        self.add("Point", coordinates, properties);
    }

    fn add_route(&mut self, route: &PlannedRoute) {
        self.omissions.add_actions(route);
        let mut properties = properties_of(route.name.as_deref(), "route");
        let (mut coordinates, mut names) = (Vec::new(), Vec::new());
        for item in &route.items {
            let Some(position) = item.position() else { continue };
            coordinates.push(self.coordinates(position));
            names.push(match item {
                PlanItem::Go { name: Some(name), .. } => json!(name),
                _ => Value::Null,
            });
        }
        if names.iter().any(|name| !name.is_null()) {
            properties.insert("names".to_owned(), json!(names));
        }
        self.add("LineString", json!(coordinates), properties);
    }

    fn add_fence(&mut self, fence: &Fence) {
        let kind = if fence.stay_in { STAY_IN } else { NO_GO };
        match &fence.shape {
            FenceShape::Circle { centre, radius_m } => {
                self.add_point(*centre, fence.name.as_deref(), kind, Some(*radius_m));
            }
            FenceShape::Polygon(corners) => {
                let mut ring: Vec<Value> =
                    corners.iter().map(|corner| self.coordinates(*corner)).collect();
                ring.extend(ring.first().cloned());
                self.add("Polygon", json!([ring]), properties_of(fence.name.as_deref(), kind));
            }
        }
    }
}

fn properties_of(name: Option<&str>, kind: &str) -> Map<String, Value> {
    let mut properties = Map::new();
    properties.insert("kind".to_owned(), json!(kind));
    if let Some(name) = name {
        properties.insert("name".to_owned(), json!(name));
    }
    properties
}
