//! GPX 1.1: routes (`rte`), tracks (`trk`) and waypoints (`wpt`).

use std::fmt::Write;

use crate::error::{MOST_POSITIONS, PlanReadError};
use crate::plan::{
    AltitudeReference, NamedPosition, Omissions, PlanAltitude, PlanItem, PlanNote, PlanPosition,
    PlannedRoute, RoutePlan,
};
use crate::xml_tree::{XmlElement, escape_xml, read_xml};

const FORMAT: &str = "GPX";
/// The `type` of a waypoint that is a rally point.
const RALLY: &str = "rally";

pub(crate) fn read(text: &str) -> Result<RoutePlan, PlanReadError> {
    let root = read_xml(text, FORMAT)?;
    if root.name != "gpx" {
        let reason = format!("its root is <{}>, not <gpx>", root.name);
        return Err(PlanReadError::Syntax { format: FORMAT, reason });
    }
    match root.attribute("version") {
        // Routes are the same in both versions.
        Some("1.1" | "1.0") => {}
        Some(version) => {
            let (what, found) = ("the file".to_owned(), version.chars().take(20).collect());
            return Err(PlanReadError::Version { what, found, known: "1.1" });
        }
        None => return Err(PlanReadError::missing("the file", "version")),
    }
    let mut plan = RoutePlan::default();
    let mut count = 0;
    for (index, element) in root.children.iter().enumerate() {
        let place = format!("<{}> {}", element.name, index + 1);
        match element.name.as_str() {
            "wpt" => {
                let point = named_position(element, &place)?;
                if element.text_of("type") == Some(RALLY) {
                    plan.rally_points.push(point);
                } else {
                    plan.points.push(point);
                }
                count += 1;
            }
            "rte" => plan.routes.push(route_of(element, element, "rtept", &place)?),
            "trk" => {
                let segments: Vec<_> =
                    element.children.iter().filter(|child| child.name == "trkseg").collect();
                if segments.len() > 1 {
                    plan.note(
                        &place,
                        format!("{} segments, each of which is a route", segments.len()),
                    );
                }
                for segment in segments {
                    plan.routes.push(route_of(element, segment, "trkpt", &place)?);
                }
            }
            "metadata" => {}
            _ => plan.note(place, "has no counterpart, and was left out"),
        }
        let items = plan.routes.iter().map(|route| route.items.len()).sum::<usize>();
        if count + items > MOST_POSITIONS {
            return Err(PlanReadError::TooMany { most: MOST_POSITIONS });
        }
    }
    Ok(plan)
}

fn route_of(
    named: &XmlElement,
    holder: &XmlElement,
    point: &str,
    place: &str,
) -> Result<PlannedRoute, PlanReadError> {
    let mut route =
        PlannedRoute { name: named.text_of("name").map(str::to_owned), items: Vec::new() };
    for element in holder.children.iter().filter(|child| child.name == point) {
        let place = format!("{place}, position {}", route.items.len() + 1);
        let NamedPosition { name, position } = named_position(element, &place)?;
        route.items.push(PlanItem::Go { position, stay_s: 0.0, name });
    }
    Ok(route)
}

fn named_position(element: &XmlElement, place: &str) -> Result<NamedPosition, PlanReadError> {
    let number = |text: &str| {
        text.trim().parse::<f64>().map_err(|_| {
            let text: String = text.chars().take(40).collect();
            PlanReadError::value(place, format!("`{text}` is no number"))
        })
    };
    let latitude =
        number(element.attribute("lat").ok_or_else(|| PlanReadError::missing(place, "lat"))?)?;
    let longitude =
        number(element.attribute("lon").ok_or_else(|| PlanReadError::missing(place, "lon"))?)?;
    let altitude = match element.text_of("ele") {
        Some(text) => Some(PlanAltitude { m: number(text)?, reference: AltitudeReference::Sea }),
        None => None,
    };
    let position = PlanPosition::checked(latitude, longitude, altitude)
        .map_err(|reason| PlanReadError::value(place, reason))?;
    Ok(NamedPosition { name: element.text_of("name").map(str::to_owned), position })
}

pub(crate) fn write(plan: &RoutePlan) -> (String, Vec<PlanNote>) {
    let mut omissions = Omissions::default();
    omissions.add("home position", usize::from(plan.home.is_some()));
    omissions.add("fence", plan.fences.len());
    omissions.add("breach return", usize::from(plan.breach_return.is_some()));
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<gpx version=\"1.1\" creator=\"Armor\" xmlns=\"http://www.topografix.com/GPX/1/1\">\n".to_owned();
    for (points, kind) in [(&plan.points, ""), (&plan.rally_points, "<type>rally</type>")] {
        for point in points {
            write_position(
                &mut text,
                "wpt",
                point.position,
                point.name.as_deref(),
                kind,
                &mut omissions,
            );
        }
    }
    for route in &plan.routes {
        omissions.add_actions(route);
        text.push_str("<rte>");
        if let Some(name) = &route.name {
            // Writing to a string cannot fail.
            let _ = write!(text, "<name>{}</name>", escape_xml(name));
        }
        text.push('\n');
        for item in &route.items {
            let name = match item {
                PlanItem::Go { name, .. } => name.as_deref(),
                _ => None,
            };
            if let Some(position) = item.position() {
                write_position(&mut text, "rtept", position, name, "", &mut omissions);
            }
        }
        text.push_str("</rte>\n");
    }
    text.push_str("</gpx>\n");
    (text, omissions.into_notes(FORMAT))
}

fn write_position(
    text: &mut String,
    element: &str,
    position: PlanPosition,
    name: Option<&str>,
    kind: &str,
    omissions: &mut Omissions,
) {
    let (latitude, longitude) = (position.latitude_deg, position.longitude_deg);
    let _ = write!(text, "<{element} lat=\"{latitude}\" lon=\"{longitude}\">");
    match position.altitude {
        Some(PlanAltitude { m, reference: AltitudeReference::Sea }) => {
            let _ = write!(text, "<ele>{m}</ele>");
        }
        // An altitude above home or ground would be read as one above the sea.
        Some(_) => omissions.add("altitude above home or ground", 1),
        None => {}
    }
    if let Some(name) = name {
        let _ = write!(text, "<name>{}</name>", escape_xml(name));
    }
    let _ = writeln!(text, "{kind}</{element}>");
}
