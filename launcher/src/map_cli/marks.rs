//! Positions, fences and rally points of a plan as marks of the map, with new names. Pure.

use std::collections::BTreeSet;

use armor_exchange::{Fence, FenceShape, NamedPosition, PlanNote, PlanPosition, RoutePlan};
use armor_geo::{Clearance, GeoPosition, MapCircle, MapPlacement, MapPoint, MapPolygon};
use armor_robotfile::{
    MAX_ELEMENTS, MAX_MAP_CORNERS, MAX_RALLIES, MAX_SHAPE_CORNERS, MAX_ZONES, NewElement,
};
use armor_wire::name::{MAX_NAME_LEN, is_name};

use super::drawing::{DrawingError, ExistingDrawing, PositionForm, general_note};

/// The rally point for the position to which a breach of a fence leads.
pub(super) const BREACH_RETURN: &str = "breach-return";
/// The point for the home position.
const HOME: &str = "home";
/// Words of a circle in a shape: `circle 1,2 3m`.
const CIRCLE_WORDS: usize = 3;

/// The marks that are drawn, and the map that they are drawn on.
pub(super) struct MarkBook<'a> {
    placement: MapPlacement,
    origin: Option<String>,
    form: PositionForm,
    existing: &'a ExistingDrawing,
    taken: BTreeSet<String>,
    points: Vec<DrawnMark>,
    zones: Vec<NewElement>,
    rallies: Vec<NewElement>,
    corners: usize,
    with_altitude: usize,
}

/// A point that is drawn. A position that the plan has several times is one point.
struct DrawnMark {
    name: String,
    degrees: (f64, f64),
    at: String,
}

impl<'a> MarkBook<'a> {
    /// Marks on the map of the file, or on one whose origin is the plan's home position, or else its
    /// first position.
    pub(super) fn new(
        plan: &RoutePlan,
        route: Option<usize>,
        form: PositionForm,
        existing: &'a ExistingDrawing,
    ) -> Result<Self, DrawingError> {
        let (placement, origin) = match existing.placement {
            Some(placement) => (placement, None),
            None => {
                let first = plan.home.or_else(|| find_first_position(plan, route));
                let (placement, origin) = place_map(&first.ok_or(DrawingError::Empty)?)?;
                (placement, Some(origin))
            }
        };
        Ok(Self {
            placement,
            origin,
            form,
            existing,
            taken: existing.marks.clone(),
            points: Vec::new(),
            zones: Vec::new(),
            rallies: Vec::new(),
            corners: 0,
            with_altitude: 0,
        })
    }

    /// The `origin` of a map that had none.
    pub(super) fn new_origin(&self) -> Option<String> {
        self.origin.clone()
    }

    pub(super) fn has_rallies(&self) -> bool {
        !self.rallies.is_empty()
    }

    pub(super) fn has_any(&self) -> bool {
        self.points.len() + self.zones.len() + self.rallies.len() > 0
    }

    /// Draws a point where none is drawn yet, and returns its name.
    pub(super) fn draw_point(
        &mut self,
        position: &PlanPosition,
        name: Option<&str>,
        place: &str,
    ) -> Result<String, DrawingError> {
        self.count_altitude(position);
        self.draw_once(position, name, place)
    }

    /// Draws the home position. Its altitude is the height of the map.
    pub(super) fn draw_home(&mut self, position: &PlanPosition) -> Result<String, DrawingError> {
        self.draw_once(position, Some(HOME), "the home position")
    }

    fn draw_once(
        &mut self,
        position: &PlanPosition,
        name: Option<&str>,
        place: &str,
    ) -> Result<String, DrawingError> {
        let degrees = (position.latitude_deg, position.longitude_deg);
        if let Some(known) = self.points.iter().find(|point| point.degrees == degrees) {
            return Ok(known.name.clone());
        }
        let at = self.write_position(position, " ", place)?;
        let name = self.choose_name(name, "P");
        self.points.push(DrawnMark { name: name.clone(), degrees, at });
        Ok(name)
    }

    /// The points of the plan that no route leads to.
    pub(super) fn draw_other_points(
        &mut self,
        points: &[NamedPosition],
    ) -> Result<(), DrawingError> {
        let (found, present) = (self.points.len() + points.len(), self.existing.points);
        if found + present > MAX_ELEMENTS {
            let (what, most) = ("points", MAX_ELEMENTS);
            return Err(DrawingError::TooMany { what, found, present, most });
        }
        for (index, point) in points.iter().enumerate() {
            let place = format!("point {}", index + 1);
            self.draw_point(&point.position, point.name.as_deref(), &place)?;
        }
        Ok(())
    }

    /// Draws fences as zones.
    pub(super) fn draw_fences(&mut self, fences: &[Fence]) -> Result<(), DrawingError> {
        let present = self.existing.zones;
        if fences.len() + present > MAX_ZONES {
            let (what, found, most) = ("fences", fences.len(), MAX_ZONES);
            return Err(DrawingError::TooMany { what, found, present, most });
        }
        for (index, fence) in fences.iter().enumerate() {
            let place = match &fence.name {
                Some(name) => format!("fence {name}"),
                None => format!("fence {}", index + 1),
            };
            let kind = if fence.stay_in { "stay-in" } else { "no-go" };
            let shape = self.write_shape(&fence.shape, &place)?;
            let name = self.choose_name(fence.name.as_deref(), &format!("{kind}-"));
            self.zones.push(
                NewElement::new("zone")
                    .attribute("name", name)
                    .attribute("kind", kind)
                    .attribute("shape", shape),
            );
        }
        Ok(())
    }

    /// Draws rally points, and the position to which a breach of a fence leads.
    pub(super) fn draw_rallies(&mut self, plan: &RoutePlan) -> Result<(), DrawingError> {
        let found = plan.rally_points.len() + usize::from(plan.breach_return.is_some());
        let present = self.existing.rallies;
        if found + present > MAX_RALLIES {
            let (what, most) = ("rally points", MAX_RALLIES);
            return Err(DrawingError::TooMany { what, found, present, most });
        }
        if let Some(position) = &plan.breach_return {
            self.draw_rally(position, Some(BREACH_RETURN), "the breach return")?;
        }
        for (index, point) in plan.rally_points.iter().enumerate() {
            let place = format!("rally point {}", index + 1);
            self.draw_rally(&point.position, point.name.as_deref(), &place)?;
        }
        Ok(())
    }

    fn draw_rally(
        &mut self,
        position: &PlanPosition,
        name: Option<&str>,
        place: &str,
    ) -> Result<(), DrawingError> {
        self.count_altitude(position);
        let at = self.write_position(position, " ", place)?;
        let name = self.choose_name(name, "R");
        self.rallies.push(NewElement::new("rally").attribute("name", name).attribute("at", at));
        Ok(())
    }

    /// How many positions had an altitude.
    pub(super) fn note_altitudes(&self) -> Option<PlanNote> {
        let count = self.with_altitude;
        let text = format!("{count}, without counterpart: the map is flat");
        (count > 0).then(|| general_note("altitudes", text))
    }

    /// Everything that was drawn, in the order of the file.
    pub(super) fn into_elements(self) -> Result<Vec<NewElement>, DrawingError> {
        let (found, present) = (self.corners, self.existing.corners);
        if found + present > MAX_MAP_CORNERS {
            let (what, most) = ("corners of fences", MAX_MAP_CORNERS);
            return Err(DrawingError::TooMany { what, found, present, most });
        }
        let points = self.points.into_iter().map(|point| {
            NewElement::new("point").attribute("name", point.name).attribute("at", point.at)
        });
        Ok(points.chain(self.zones).chain(self.rallies).collect())
    }

    fn count_altitude(&mut self, position: &PlanPosition) {
        // Formats without altitudes write zero.
        let is_given = position.altitude.is_some_and(|altitude| altitude.m != 0.0);
        self.with_altitude += usize::from(is_given);
    }

    /// A name of the plan, or the prefix with the next free number.
    fn choose_name(&mut self, planned: Option<&str>, prefix: &str) -> String {
        let name = match planned.and_then(make_name) {
            Some(name) => make_unique(&name, &self.taken),
            None => make_numbered(prefix, &self.taken),
        };
        self.taken.insert(name.clone());
        name
    }

    fn write_shape(&mut self, shape: &FenceShape, place: &str) -> Result<String, DrawingError> {
        let refuse = |reason: String| DrawingError::Shape { place: place.to_owned(), reason };
        match shape {
            FenceShape::Circle { centre, radius_m } => {
                self.corners += CIRCLE_WORDS;
                let radius = Clearance::new(*radius_m);
                let middle = self.map_point(centre, place)?;
                radius
                    .and_then(|radius| MapCircle::new(middle, radius))
                    .map_err(|error| refuse(error.to_string()))?;
                let centre = self.write_position(centre, ",", place)?;
                Ok(format!("circle {centre} {radius_m}m"))
            }
            FenceShape::Polygon(corners) => {
                // Some planners repeat the first corner at the end.
                let corners = match corners.as_slice() {
                    [first, rest @ .., last] if rest.len() > 1 && is_same(first, last) => {
                        &corners[..corners.len() - 1]
                    }
                    all => all,
                };
                if corners.len() > MAX_SHAPE_CORNERS {
                    let count = corners.len();
                    let reason = format!(
                        "it has {count} corners, and at most {MAX_SHAPE_CORNERS} are drawn"
                    );
                    return Err(refuse(reason));
                }
                self.corners += corners.len();
                let points: Result<Vec<_>, _> =
                    corners.iter().map(|corner| self.written_point(corner, place)).collect();
                MapPolygon::new(points?).map_err(|error| refuse(error.to_string()))?;
                let corners: Result<Vec<_>, _> =
                    corners.iter().map(|corner| self.write_position(corner, ",", place)).collect();
                Ok(corners?.join(" "))
            }
        }
    }

    /// The point that is read from what is written for a position.
    fn written_point(
        &self,
        position: &PlanPosition,
        place: &str,
    ) -> Result<MapPoint, DrawingError> {
        let point = self.map_point(position, place)?;
        if self.form == PositionForm::Wgs84 {
            return Ok(point);
        }
        let refuse = |reason| DrawingError::Position { place: place.to_owned(), reason };
        MapPoint::new(round_metres(point.x_m()), round_metres(point.y_m()))
            .map_err(|error| refuse(error.to_string()))
    }

    fn map_point(&self, position: &PlanPosition, place: &str) -> Result<MapPoint, DrawingError> {
        let height_m = self.placement.origin().height_m();
        GeoPosition::new(position.latitude_deg, position.longitude_deg, height_m)
            .and_then(|position| self.placement.map_from_geo(position))
            .map_err(|error| DrawingError::Position {
                place: place.to_owned(),
                reason: error.to_string(),
            })
    }

    fn write_position(
        &self,
        position: &PlanPosition,
        between: &str,
        place: &str,
    ) -> Result<String, DrawingError> {
        // Also a position in degrees must be within reach of the map.
        let point = self.written_point(position, place)?;
        Ok(match self.form {
            PositionForm::Metres => format!("{}{between}{}", point.x_m(), point.y_m()),
            PositionForm::Wgs84 => {
                let (latitude, longitude) = (position.latitude_deg, position.longitude_deg);
                let north = if latitude < 0.0 { 'S' } else { 'N' };
                let east = if longitude < 0.0 { 'W' } else { 'E' };
                format!("{}{north}{between}{}{east}", latitude.abs(), longitude.abs())
            }
        })
    }
}

fn is_same(one: &PlanPosition, other: &PlanPosition) -> bool {
    one.latitude_deg == other.latitude_deg && one.longitude_deg == other.longitude_deg
}

/// Tenths of a millimetre: the plan's route is kept within a millimetre.
fn round_metres(value: f64) -> f64 {
    // Adding zero removes the sign of a negative zero.
    (value * 1e4).round() / 1e4 + 0.0
}

/// The map with its origin at a position, and its `origin` in the file.
fn place_map(position: &PlanPosition) -> Result<(MapPlacement, String), DrawingError> {
    let (latitude, longitude) = (position.latitude_deg, position.longitude_deg);
    let above_sea = position
        .altitude
        .filter(|altitude| altitude.reference == armor_exchange::AltitudeReference::Sea);
    let height_m = above_sea.map_or(0.0, |altitude| (altitude.m * 1e3).round() / 1e3 + 0.0);
    let placement = GeoPosition::new(latitude, longitude, height_m)
        .and_then(|origin| MapPlacement::new(origin, 0.0, 1.0))
        .map_err(|error| DrawingError::Position {
            place: "the origin of the map".to_owned(),
            reason: error.to_string(),
        })?;
    Ok((placement, format!("{latitude} {longitude} {height_m}m")))
}

fn find_first_position(plan: &RoutePlan, route: Option<usize>) -> Option<PlanPosition> {
    let items = route.into_iter().flat_map(|index| &plan.routes[index].items);
    let mut positions = items.filter_map(super::route_steps::position_of);
    let fence = || {
        plan.fences.first().and_then(|fence| match &fence.shape {
            FenceShape::Circle { centre, .. } => Some(*centre),
            FenceShape::Polygon(corners) => corners.first().copied(),
        })
    };
    let rally = || plan.rally_points.first().map(|rally| rally.position);
    let point = || plan.points.first().map(|point| point.position);
    positions.next().or_else(fence).or_else(rally).or(plan.breach_return).or_else(point)
}

/// A text as a name of the file: other characters become hyphens. None if nothing is left.
pub(super) fn make_name(text: &str) -> Option<String> {
    // A number may be appended.
    const LONGEST: usize = MAX_NAME_LEN - 8;
    let begin = text.find(|c: char| c.is_ascii_alphabetic())?;
    let mut name = String::new();
    for c in text[begin..].chars() {
        let c = if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' };
        if name.len() < LONGEST && !(c == '-' && name.ends_with('-')) {
            name.push(c);
        }
    }
    let name = name.trim_end_matches('-');
    is_name(name).then(|| name.to_owned())
}

/// The name itself, or with the first number from 2 with which it is free.
pub(super) fn make_unique(name: &str, taken: &BTreeSet<String>) -> String {
    if !taken.contains(name) {
        return name.to_owned();
    }
    let numbered = (2..).map(|number| format!("{name}-{number}"));
    first_free(numbered, taken)
}

fn make_numbered(prefix: &str, taken: &BTreeSet<String>) -> String {
    first_free((1..).map(|number| format!("{prefix}{number}")), taken)
}

fn first_free(mut names: impl Iterator<Item = String>, taken: &BTreeSet<String>) -> String {
    // There are more numbers than names.
    names.find(|name| !taken.contains(name)).unwrap_or_default()
}
