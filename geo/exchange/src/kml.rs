//! KML 2.2: lines are routes, polygons fences, points rally points (`styleUrl` `#rally`) or others.

use std::fmt::Write;

use crate::error::{MOST_POSITIONS, PlanReadError};
use crate::plan::{
    AltitudeReference, Fence, FenceShape, NamedPosition, Omissions, PlanAltitude, PlanItem,
    PlanNote, PlanPosition, PlannedRoute, RoutePlan,
};
use crate::xml_tree::{XmlElement, escape_xml, read_xml};

const FORMAT: &str = "KML";

pub(crate) fn read(text: &str) -> Result<RoutePlan, PlanReadError> {
    let root = read_xml(text, FORMAT)?;
    if root.name != "kml" {
        let reason = format!("its root is <{}>, not <kml>", root.name);
        return Err(PlanReadError::Syntax { format: FORMAT, reason });
    }
    let mut reading = Reading { plan: RoutePlan::default(), positions: 0, placemarks: 0 };
    reading.read_container(&root)?;
    Ok(reading.plan)
}

struct Reading {
    plan: RoutePlan,
    positions: usize,
    placemarks: usize,
}

impl Reading {
    /// The placemarks of a document or folder; `read_xml` limits how deep they are nested.
    fn read_container(&mut self, element: &XmlElement) -> Result<(), PlanReadError> {
        for child in &element.children {
            match child.name.as_str() {
                "Document" | "Folder" => self.read_container(child)?,
                "Placemark" => {
                    self.placemarks += 1;
                    let place = format!("placemark {}", self.placemarks);
                    self.read_geometries(child, child, &place)?;
                }
                "NetworkLink" | "GroundOverlay" | "ScreenOverlay" | "PhotoOverlay" => {
                    self.plan
                        .note(format!("<{}>", child.name), "has no counterpart, and was left out");
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn read_geometries(
        &mut self,
        placemark: &XmlElement,
        holder: &XmlElement,
        place: &str,
    ) -> Result<(), PlanReadError> {
        let name = placemark.text_of("name").map(str::to_owned);
        let style = placemark.text_of("styleUrl").unwrap_or_default();
        for geometry in &holder.children {
            match geometry.name.as_str() {
                "Point" => {
                    let position = self.line(geometry, geometry, place)?.into_iter().next();
                    let position =
                        position.ok_or_else(|| PlanReadError::missing(place, "coordinates"))?;
                    let point = NamedPosition { name: name.clone(), position };
                    match style {
                        "#rally" => self.plan.rally_points.push(point),
                        "#home" if self.plan.home.is_none() => self.plan.home = Some(position),
                        "#breach-return" if self.plan.breach_return.is_none() => {
                            self.plan.breach_return = Some(position);
                        }
                        _ => self.plan.points.push(point),
                    }
                }
                "LineString" => {
                    let go = |position| PlanItem::Go { position, stay_s: 0.0, name: None };
                    let items = self.line(geometry, geometry, place)?.into_iter().map(go).collect();
                    self.plan.routes.push(PlannedRoute { name: name.clone(), items });
                }
                "Polygon" => self.read_polygon(geometry, name.clone(), style, place)?,
                "MultiGeometry" => self.read_geometries(placemark, geometry, place)?,
                "Model" | "Track" | "MultiTrack" | "LinearRing" => {
                    self.plan.note(
                        place,
                        format!("<{}> has no counterpart, and was left out", geometry.name),
                    );
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn read_polygon(
        &mut self,
        polygon: &XmlElement,
        name: Option<String>,
        style: &str,
        place: &str,
    ) -> Result<(), PlanReadError> {
        if polygon.child("innerBoundaryIs").is_some() {
            let reason =
                "holes in it have no counterpart and would be closed; draw areas around them";
            return Err(PlanReadError::value(place, reason));
        }
        let ring = polygon.child("outerBoundaryIs").and_then(|outer| outer.child("LinearRing"));
        let ring = ring.ok_or_else(|| PlanReadError::missing(place, "outer boundary"))?;
        let mut corners = self.line(ring, polygon, place)?;
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() < 3 {
            let reason = format!("it has {} corners, and an area needs three", corners.len());
            return Err(PlanReadError::value(place, reason));
        }
        if !matches!(style, "#no-go" | "#stay-in") {
            self.plan.note(place, "an area without the style #no-go or #stay-in is read as no-go");
        }
        let (stay_in, shape) = (style == "#stay-in", FenceShape::Polygon(corners));
        self.plan.fences.push(Fence { name, stay_in, shape });
        Ok(())
    }

    /// The positions of an element's `coordinates`: longitude, latitude and altitude, with commas.
    /// The altitude's meaning stands at the geometry.
    fn line(
        &mut self,
        element: &XmlElement,
        geometry: &XmlElement,
        place: &str,
    ) -> Result<Vec<PlanPosition>, PlanReadError> {
        let text = element.text_of("coordinates");
        let text = text.ok_or_else(|| PlanReadError::missing(place, "coordinates"))?;
        let reference = match geometry.text_of("altitudeMode") {
            Some("absolute") => Some(AltitudeReference::Sea),
            Some("relativeToGround") => Some(AltitudeReference::Terrain),
            // Clamped to the ground: altitudes are not meant.
            _ => None,
        };
        let mut positions = Vec::new();
        for tuple in text.split_whitespace() {
            self.positions += 1;
            if self.positions > MOST_POSITIONS {
                return Err(PlanReadError::TooMany { most: MOST_POSITIONS });
            }
            let numbers: Result<Vec<f64>, _> = tuple.split(',').map(str::parse).collect();
            let Ok([longitude, latitude, rest @ ..]) = numbers.as_deref() else {
                let tuple: String = tuple.chars().take(60).collect();
                return Err(PlanReadError::value(place, format!("`{tuple}` is no position")));
            };
            let altitude =
                rest.first().zip(reference).map(|(m, reference)| PlanAltitude { m: *m, reference });
            positions.push(
                PlanPosition::checked(*latitude, *longitude, altitude)
                    .map_err(|reason| PlanReadError::value(place, reason))?,
            );
        }
        Ok(positions)
    }
}

pub(crate) fn write(plan: &RoutePlan) -> (String, Vec<PlanNote>) {
    let mut writing = Writing { text: String::new(), omissions: Omissions::default() };
    writing.text.push_str("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\">\n<Document>\n");
    let styles = [
        ("no-go", "ff0000ff"),
        ("stay-in", "ff00ff00"),
        ("rally", "ffff0000"),
        ("home", "ffffffff"),
        ("breach-return", "ff00ffff"),
        ("route", "ff000000"),
    ];
    for (style, color) in styles {
        // Writing to a string cannot fail.
        let _ = writeln!(
            writing.text,
            "<Style id=\"{style}\"><LineStyle><color>{color}</color></LineStyle><PolyStyle><fill>0</fill></PolyStyle></Style>"
        );
    }
    for (position, style) in [(plan.home, "home"), (plan.breach_return, "breach-return")] {
        if let Some(position) = position {
            writing.add("Point", None, style, &[position]);
        }
    }
    for route in &plan.routes {
        writing.omissions.add_actions(route);
        let is_named = |item: &&PlanItem| matches!(item, PlanItem::Go { name: Some(_), .. });
        writing.omissions.add("name of a waypoint", route.items.iter().filter(is_named).count());
        let positions: Vec<_> = route.items.iter().filter_map(PlanItem::position).collect();
        // A line without coordinates is not valid; what the route does is among the notes.
        if !positions.is_empty() {
            writing.add("LineString", route.name.as_deref(), "route", &positions);
        }
    }
    for fence in &plan.fences {
        writing.add_fence(fence);
    }
    for point in &plan.rally_points {
        writing.add("Point", point.name.as_deref(), "rally", &[point.position]);
    }
    for point in &plan.points {
        writing.add("Point", point.name.as_deref(), "", &[point.position]);
    }
    writing.text.push_str("</Document>\n</kml>\n");
    (writing.text, writing.omissions.into_notes(FORMAT))
}

struct Writing {
    text: String,
    omissions: Omissions,
}

impl Writing {
    fn add_fence(&mut self, fence: &Fence) {
        let FenceShape::Polygon(corners) = &fence.shape else {
            self.omissions.add("circle as a fence", 1);
            return;
        };
        let mut ring = corners.clone();
        ring.extend(corners.first());
        let style = if fence.stay_in { "stay-in" } else { "no-go" };
        self.add("Polygon", fence.name.as_deref(), style, &ring);
    }

    fn add(&mut self, geometry: &str, name: Option<&str>, style: &str, positions: &[PlanPosition]) {
        self.text.push_str("<Placemark>");
        if let Some(name) = name {
            let _ = write!(self.text, "<name>{}</name>", escape_xml(name));
        }
        if !style.is_empty() {
            let _ = write!(self.text, "<styleUrl>#{style}</styleUrl>");
        }
        let _ = write!(self.text, "<{geometry}>");
        let reference = self.shared_reference(positions);
        let mode = match reference {
            Some(AltitudeReference::Sea) => "<altitudeMode>absolute</altitudeMode>",
            Some(AltitudeReference::Terrain) => "<altitudeMode>relativeToGround</altitudeMode>",
            _ => "",
        };
        self.text.push_str(mode);
        let (open, close) = if geometry == "Polygon" {
            ("<outerBoundaryIs><LinearRing>", "</LinearRing></outerBoundaryIs>")
        } else {
            ("", "")
        };
        let _ = write!(self.text, "{open}<coordinates>");
        for (index, position) in positions.iter().enumerate() {
            let space = if index == 0 { "" } else { " " };
            let (longitude, latitude) = (position.longitude_deg, position.latitude_deg);
            let _ = write!(self.text, "{space}{longitude},{latitude}");
            if let (Some(_), Some(altitude)) = (reference, position.altitude) {
                let _ = write!(self.text, ",{}", altitude.m);
            }
        }
        let _ = writeln!(self.text, "</coordinates>{close}</{geometry}></Placemark>");
    }

    /// What all altitudes of a geometry are measured from; KML has one mode for all of them.
    fn shared_reference(&mut self, positions: &[PlanPosition]) -> Option<AltitudeReference> {
        let first = positions.first()?.altitude.map(|altitude| altitude.reference);
        let with = positions.iter().filter(|position| position.altitude.is_some()).count();
        let same = positions
            .iter()
            .all(|position| position.altitude.map(|altitude| altitude.reference) == first);
        let known = first.filter(|reference| *reference != AltitudeReference::Home);
        if !same || known.is_none() {
            self.omissions.add("altitude above home, or of several kinds", with);
        }
        known.filter(|_| same)
    }
}
