//! Floor plans as GeoJSON (RFC 7946): polygons and lines, in degrees, or in what `crs` names.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use armor_geo::{GeoPosition, MercatorPosition};
use serde_json::Value;

use crate::drawn_plan::{DrawnPlan, PlanShapes};
use crate::error::{OpenError, OpenFault};
use crate::limits::{MAX_GEOJSON_BYTES, MAX_PLAN_POINTS};
use crate::reference::{MapReference, PlanePoint};

/// Collections within collections.
const MAX_DEPTH: usize = 8;
/// Largest coordinate in metres.
const MAX_COORDINATE_M: f64 = 1e8;

/// Reads the shapes of one file.
struct ShapeReader {
    reference: MapReference,
    shapes: PlanShapes,
    points: usize,
}

/// Opens a plan, and states in which plane it is painted: degrees are painted in Web Mercator.
pub(crate) fn open_geojson(path: &Path) -> Result<(DrawnPlan, MapReference), OpenError> {
    let file = path.display().to_string();
    let error = |place: String, fault| OpenError::new(&file, place, fault);
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|opened| opened.take(MAX_GEOJSON_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|e| error(String::new(), OpenFault::Unreadable(e.to_string())))?;
    if bytes.len() as u64 > MAX_GEOJSON_BYTES {
        let remedy = "simplify the plan, or split it";
        return Err(error(String::new(), OpenFault::TooLarge { most: MAX_GEOJSON_BYTES, remedy }));
    }
    let plan: Value = serde_json::from_slice(&bytes).map_err(|e| {
        let place = format!("line {}", e.line());
        error(place, OpenFault::Damaged(format!("it is no JSON: {e}")))
    })?;
    drop(bytes);
    let stated = read_reference(&plan).map_err(|fault| error("`crs`".to_owned(), fault))?;
    let mut reader = ShapeReader { reference: stated, shapes: PlanShapes::default(), points: 0 };
    reader.read_object(&plan, 0).map_err(|(place, fault)| error(place, fault))?;
    let drawn = DrawnPlan::new(reader.shapes).map_err(|fault| error(String::new(), fault))?;
    let is_degrees = stated == MapReference::Wgs84;
    Ok((drawn, if is_degrees { MapReference::WebMercator } else { stated }))
}

/// The reference that `crs` names; without one, degrees.
fn read_reference(plan: &Value) -> Result<MapReference, OpenFault> {
    let Some(crs) = plan.get("crs").filter(|crs| !crs.is_null()) else {
        return Ok(MapReference::Wgs84);
    };
    let name = crs.pointer("/properties/name").and_then(Value::as_str).unwrap_or_default();
    let shown = || name.chars().take(60).collect::<String>();
    match name {
        "local" => return Ok(MapReference::Local),
        "urn:ogc:def:crs:OGC:1.3:CRS84" | "urn:ogc:def:crs:OGC::CRS84" | "CRS84" => {
            return Ok(MapReference::Wgs84);
        }
        _ => {}
    }
    let digits = name.rsplit(':').next().unwrap_or_default();
    let number = digits.parse().ok().filter(|_| name.to_ascii_uppercase().contains("EPSG"));
    let number: u32 = number.ok_or_else(|| OpenFault::Reference(format!("`{}`", shown())))?;
    MapReference::from_epsg(number).ok_or_else(|| OpenFault::Reference(format!("EPSG {number}")))
}

type Fault = (String, OpenFault);

fn damaged(place: &str, what: impl Into<String>) -> Fault {
    (place.to_owned(), OpenFault::Damaged(what.into()))
}

impl ShapeReader {
    /// Reads a collection, a feature or a geometry.
    fn read_object(&mut self, object: &Value, depth: usize) -> Result<(), Fault> {
        let kind = object.get("type").and_then(Value::as_str).unwrap_or_default();
        match kind {
            "FeatureCollection" => {
                let features = object.get("features").and_then(Value::as_array);
                let features = features.ok_or_else(|| damaged("", "it has no `features`"))?;
                for (number, feature) in (1..).zip(features) {
                    let is_feature = feature.get("type").is_some_and(|kind| kind == "Feature");
                    let read = if is_feature {
                        self.read_object(feature, depth + 1)
                    } else {
                        Err(damaged("", "it is no `Feature`"))
                    };
                    read.map_err(|(_, fault)| (format!("feature {number}"), fault))?;
                }
                Ok(())
            }
            "Feature" => match object.get("geometry") {
                // A feature without a place is allowed.
                None | Some(Value::Null) => Ok(()),
                Some(geometry) => self.read_geometry(geometry, depth + 1),
            },
            _ => self.read_geometry(object, depth),
        }
    }

    fn read_geometry(&mut self, geometry: &Value, depth: usize) -> Result<(), Fault> {
        if depth > MAX_DEPTH {
            return Err(damaged("", "its collections are nested too deeply"));
        }
        let kind = geometry.get("type").and_then(Value::as_str).unwrap_or_default();
        if kind == "GeometryCollection" {
            let parts = geometry.get("geometries").and_then(Value::as_array);
            let parts = parts.ok_or_else(|| damaged("", "it has no `geometries`"))?;
            return parts.iter().try_for_each(|part| self.read_geometry(part, depth + 1));
        }
        let coordinates = geometry.get("coordinates").unwrap_or(&Value::Null);
        match kind {
            // A point has no extent to paint.
            "Point" | "MultiPoint" => {}
            "LineString" => {
                let line = self.read_line(coordinates)?;
                self.shapes.lines.push(line);
            }
            "MultiLineString" => {
                for line in list(coordinates)? {
                    let line = self.read_line(line)?;
                    self.shapes.lines.push(line);
                }
            }
            "Polygon" => self.read_polygon(coordinates)?,
            "MultiPolygon" => {
                list(coordinates)?.iter().try_for_each(|polygon| self.read_polygon(polygon))?;
            }
            other => {
                let shown: String = other.chars().take(40).collect();
                return Err(damaged("", format!("`{shown}` is no type of GeoJSON")));
            }
        }
        Ok(())
    }

    fn read_polygon(&mut self, rings: &Value) -> Result<(), Fault> {
        let mut area = Vec::new();
        for ring in list(rings)? {
            let mut ring = self.read_line(ring)?;
            // Some programs leave the last point out.
            if ring.first() != ring.last() {
                ring.extend(ring.first().copied());
            }
            area.push(ring);
        }
        self.shapes.areas.push(area);
        Ok(())
    }

    fn read_line(&mut self, points: &Value) -> Result<Vec<PlanePoint>, Fault> {
        let points = list(points)?;
        self.points += points.len();
        if self.points > MAX_PLAN_POINTS {
            return Err((String::new(), OpenFault::TooManyPoints));
        }
        points.iter().map(|point| self.read_point(point)).collect()
    }

    fn read_point(&self, point: &Value) -> Result<PlanePoint, Fault> {
        let number = |index: usize| point.get(index).and_then(Value::as_f64);
        let (Some(x), Some(y)) = (number(0), number(1)) else {
            return Err(damaged("", "a position is no list of two or three numbers"));
        };
        if self.reference == MapReference::Wgs84 {
            let position = GeoPosition::new(y, x, 0.0).and_then(MercatorPosition::try_from);
            let plane = position.map_err(|e| damaged("", e.to_string()))?;
            return Ok(PlanePoint::new(plane.x_m, plane.y_m));
        }
        if x.abs() > MAX_COORDINATE_M || y.abs() > MAX_COORDINATE_M {
            return Err(damaged("", format!("the position {x}, {y} is beyond the Earth")));
        }
        Ok(PlanePoint::new(x, y))
    }
}

fn list(value: &Value) -> Result<&[Value], Fault> {
    value.as_array().map(Vec::as_slice).ok_or_else(|| damaged("", "`coordinates` is no list"))
}
