//! `<map>` → [`SiteMap`].

use std::sync::Arc;

use armor_geo::{Clearance, GeoPosition, MapPlacement};
use armor_wire::quantity::{self, Dimension};

use crate::code::Code;
use crate::elements::MAP_CHILDREN;
use crate::fields::ElementFields;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::read::limits::{MAX_ELEMENTS, MAX_MAP_CORNERS, MAX_RALLIES, MAX_ZONES, add_limited};
use crate::read::position::{parse_degrees, read_position, read_shape};
use crate::site_map::{DrawnLine, DrawnPoint, DrawnSymbol, DrawnZone, LineKind, SiteMap, ZoneKind};
use crate::source::{Source, Spanned};
use crate::tree::Element;

/// The elements that a map may contain.
/// What the elements of a map are read with.
pub(super) struct MapScale {
    pub(super) placement: Option<MapPlacement>,
    /// Points of shapes that the map may still have.
    pub(super) corners_left: usize,
}

pub(super) fn read(element: &Element, source: &Arc<Source>, findings: &mut Findings) -> SiteMap {
    let mut fields = ElementFields::new(element, source, findings);
    let origin = fields.converted("origin", parse_origin);
    let heading = fields.number_in("heading", Dimension::Angle);
    let mut map = SiteMap {
        placement: origin.as_ref().and_then(|origin| {
            let heading_rad = heading.as_ref().map_or(0.0, |heading| heading.value);
            MapPlacement::new(origin.value, heading_rad, 1.0).ok()
        }),
        origin,
        picture: fields.text("picture"),
        grid: fields.text("grid"),
        points: Vec::new(),
        zones: Vec::new(),
        lines: Vec::new(),
        rallies: Vec::new(),
        symbols: Vec::new(),
        at: fields.at(),
    };
    if fields.attribute_at("origin").is_none() {
        fields.without_effect("heading", "it turns the map about its origin: write origin=\"…\"");
    }
    let children = fields.finish(MAP_CHILDREN);
    let mut scale = MapScale { placement: map.placement, corners_left: MAX_MAP_CORNERS };
    for child in children {
        read_child(&mut map, &mut scale, child, source, findings);
    }
    map
}

fn read_child(
    map: &mut SiteMap,
    scale: &mut MapScale,
    child: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) {
    /// Adds what was read to its list.
    macro_rules! into {
        ($list:ident, $limit:expr, $read:expr) => {
            if let Some(item) = $read {
                add_limited(&mut map.$list, item, $limit, &child.at(source), findings);
            }
        };
    }
    match child.name.as_str() {
        "point" => into!(points, MAX_ELEMENTS, read_point(child, scale, source, findings)),
        "rally" => into!(rallies, MAX_RALLIES, read_point(child, scale, source, findings)),
        "zone" => into!(zones, MAX_ZONES, read_zone(child, scale, source, findings)),
        "line" => into!(lines, MAX_ZONES, read_line(child, scale, source, findings)),
        _ => into!(symbols, MAX_ELEMENTS, read_symbol(child, scale, source, findings)),
    }
}

/// `48.85830 2.29450 35m`: latitude and longitude in degrees, height above the ellipsoid.
fn parse_origin(text: &str) -> Result<GeoPosition, String> {
    let expected = "a latitude, a longitude and a height are expected, such as 48.8583 2.2945 35m";
    let mut words = text.split_ascii_whitespace();
    let (Some(latitude), Some(longitude)) = (words.next(), words.next()) else {
        return Err(expected.into());
    };
    let (height, rest) = (words.next(), words.next());
    let degrees = parse_degrees(latitude, ['N', 'S']).zip(parse_degrees(longitude, ['E', 'W']));
    let height_m = match height {
        None => Some(0.0),
        Some(height) => quantity::parse_in(height, Dimension::Length, "a height").ok(),
    };
    match (degrees, height_m, rest) {
        (Some((latitude, longitude)), Some(height_m), None) => {
            GeoPosition::new(latitude, longitude, height_m).map_err(|error| error.to_string())
        }
        _ => Err(expected.into()),
    }
}

fn read_point(
    element: &Element,
    scale: &MapScale,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<DrawnPoint> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    let position = read_position(&mut fields, "at", scale);
    fields.finish(&[]);
    Some(DrawnPoint { name: name?, position: position? })
}

fn read_zone(
    element: &Element,
    scale: &mut MapScale,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<DrawnZone> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    fields.required("kind");
    let kind = fields.choice("kind", &ZoneKind::NAMED);
    let margin = read_clearance(&mut fields, "margin");
    let speed_mps = fields.converted("speed", |text| {
        let wanted = "a speed such as 0.5m/s";
        let speed = quantity::parse_in(text, Dimension::Speed, wanted);
        speed
            .ok()
            .filter(|speed| *speed > 0.0)
            .ok_or_else(|| "a speed above zero is expected, such as 0.5m/s".to_owned())
    });
    let shape = fields.required("shape");
    let area = shape
        .and_then(|shape| read_shape(&mut fields, &shape, scale)?.into_area(&mut fields, shape));
    let is_speed = kind.as_ref().is_some_and(|kind| kind.value == ZoneKind::Speed);
    if is_speed && fields.attribute_at("speed").is_none() && !fields.has_strangers() {
        let finding = Finding::new(
            Code::DrawnIncomplete,
            &fields.at(),
            "a <zone> of this kind has no attribute speed",
        );
        fields.report(finding.remedy("write speed=\"0.5m/s\", the highest speed in it"));
    }
    if kind.as_ref().is_some_and(|kind| kind.value != ZoneKind::Speed) {
        fields.without_effect("speed", "it belongs to a zone of kind=\"speed\": remove it");
    }
    fields.finish(&[]);
    let margin = margin.unwrap_or(Clearance::ZERO);
    Some(DrawnZone { name: name?, kind: kind?.value, margin, speed_mps, area: area? })
}

fn read_line(
    element: &Element,
    scale: &mut MapScale,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<DrawnLine> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    fields.required("kind");
    let kind = fields.choice("kind", &LineKind::NAMED);
    let margin = read_clearance(&mut fields, "margin");
    let shape = fields.required("shape");
    let shape = shape
        .and_then(|shape| read_shape(&mut fields, &shape, scale)?.into_line(&mut fields, shape));
    let not_before = fields.converted("not-before", str::parse);
    if kind.as_ref().is_some_and(|kind| kind.value != LineKind::Phase) {
        for name in ["not-before", "margin"] {
            fields.without_effect(name, "robots wait at a line of kind=\"phase\" only: remove it");
        }
    }
    fields.finish(&[]);
    let margin = margin.unwrap_or(Clearance::ZERO);
    Some(DrawnLine { name: name?, kind: kind?.value, margin, shape: shape?, not_before })
}

fn read_symbol(
    element: &Element,
    scale: &MapScale,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<DrawnSymbol> {
    let mut fields = ElementFields::new(element, source, findings);
    fields.required("sidc");
    let sidc = fields.converted("sidc", |text| match is_symbol_code(text) {
        true => Ok(text.to_owned()),
        false => Err("20 digits, or the 15 letters of an older code, are expected".to_owned()),
    });
    let position = read_position(&mut fields, "at", scale);
    let label = fields.text("label");
    fields.finish(&[]);
    Some(DrawnSymbol { sidc: sidc?, position: position?, label })
}

/// 20 digits (APP-6D, MIL-STD-2525D) or 15 letters, digits, `-` and `*` (the versions before).
fn is_symbol_code(text: &str) -> bool {
    let is_old = |byte: u8| {
        byte.is_ascii_uppercase() || byte.is_ascii_digit() || matches!(byte, b'-' | b'*')
    };
    match text.len() {
        20 => text.bytes().all(|byte| byte.is_ascii_digit()),
        15 => text.bytes().all(is_old),
        _ => false,
    }
}

/// A length of at least 0.
pub(super) fn read_clearance(
    fields: &mut ElementFields<'_, '_>,
    name: &'static str,
) -> Option<Clearance> {
    let length: Spanned<f64> = fields.number_in(name, Dimension::Length)?;
    match Clearance::new(length.value) {
        Ok(clearance) => Some(clearance),
        Err(error) => {
            fields.bad_value(name, &length, error.to_string());
            None
        }
    }
}
