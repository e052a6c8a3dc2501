//! The model of `<map>`: where the mission's map is in the world, and what is drawn on it. Every
//! position is in metres of the map; the text of the file stays as it was written.

use armor_geo::{Clearance, GeoPosition, MapArea, MapPlacement, MapPoint, MapPolyline};

use crate::date::Date;
use crate::source::{Location, Spanned};

/// The map of a mission.
#[derive(Clone, Debug)]
pub struct SiteMap {
    /// The position of the map's origin, if it is known.
    pub origin: Option<Spanned<GeoPosition>>,
    /// Where the map is in the world; none without an origin.
    pub placement: Option<MapPlacement>,
    /// The picture under the drawing, as written.
    pub picture: Option<Spanned<String>>,
    /// The grid of what is free and occupied, as written.
    pub grid: Option<Spanned<String>>,
    /// The points that routes lead to.
    pub points: Vec<DrawnPoint>,
    /// The areas with a meaning.
    pub zones: Vec<DrawnZone>,
    /// The lines with a meaning.
    pub lines: Vec<DrawnLine>,
    /// The points where robots go when something fails.
    pub rallies: Vec<DrawnPoint>,
    /// The military symbols.
    pub symbols: Vec<DrawnSymbol>,
    /// The `<map>` tag.
    pub at: Location,
}

impl SiteMap {
    /// The point or rally point with this name.
    pub fn find_point(&self, name: &str) -> Option<&DrawnPoint> {
        self.points.iter().chain(&self.rallies).find(|point| point.name.value == name)
    }

    /// The names of everything drawn that others may name, in the order of their kinds.
    pub(crate) fn names(&self) -> impl Iterator<Item = &Spanned<String>> {
        let points = self.points.iter().chain(&self.rallies).map(|point| &point.name);
        let zones = self.zones.iter().map(|zone| &zone.name);
        points.chain(zones).chain(self.lines.iter().map(|line| &line.name))
    }
}

/// A position on the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnPosition {
    /// In metres of the map.
    pub point: MapPoint,
    /// As it was written, if it was a latitude and a longitude.
    pub geo: Option<GeoPosition>,
}

/// `<point>` or `<rally>`: a named position.
#[derive(Clone, Debug)]
pub struct DrawnPoint {
    /// Its name.
    pub name: Spanned<String>,
    /// Where it is.
    pub position: Spanned<DrawnPosition>,
}

/// `<zone>`: an area with a meaning.
#[derive(Clone, Debug)]
pub struct DrawnZone {
    /// Its name.
    pub name: Spanned<String>,
    /// What it means.
    pub kind: ZoneKind,
    /// The distance to keep from its boundary.
    pub margin: Clearance,
    /// The highest speed in a [`ZoneKind::Speed`], in metres per second.
    pub speed_mps: Option<Spanned<f64>>,
    /// The area.
    pub area: Spanned<MapArea>,
}

/// What a zone means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZoneKind {
    /// No robot enters it.
    NoGo,
    /// No robot leaves it.
    StayIn,
    /// Robots are slower in it.
    Speed,
    /// It is to be observed; robots may enter it.
    Observe,
}

impl ZoneKind {
    /// Each kind with its word in the file.
    pub const NAMED: [(&str, Self); 4] = [
        ("no-go", Self::NoGo),
        ("stay-in", Self::StayIn),
        ("speed", Self::Speed),
        ("observe", Self::Observe),
    ];
}

/// `<line>`: a line with a meaning.
#[derive(Clone, Debug)]
pub struct DrawnLine {
    /// Its name.
    pub name: Spanned<String>,
    /// What it means.
    pub kind: LineKind,
    /// The distance before it at which robots wait.
    pub margin: Clearance,
    /// The line.
    pub shape: Spanned<MapPolyline>,
    /// No robot crosses a [`LineKind::Phase`] before this date.
    pub not_before: Option<Spanned<Date>>,
}

/// What a line means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineKind {
    /// A phase of the mission begins behind it.
    Phase,
    /// The boundary of an area of responsibility: no robot crosses it.
    Boundary,
    /// The limit of advance: no robot crosses it.
    Limit,
}

impl LineKind {
    /// Each kind with its word in the file.
    pub const NAMED: [(&str, Self); 3] =
        [("phase", Self::Phase), ("boundary", Self::Boundary), ("limit", Self::Limit)];
}

/// `<symbol>`: a military symbol.
#[derive(Clone, Debug)]
pub struct DrawnSymbol {
    /// Its identification code: 20 digits, or the older 15 letters.
    pub sidc: Spanned<String>,
    /// Where it is.
    pub position: Spanned<DrawnPosition>,
    /// The text next to it.
    pub label: Option<Spanned<String>>,
}
