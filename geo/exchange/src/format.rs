//! The formats, and which one a file has.

use crate::error::{PlanReadError, PlanWriteError};
use crate::plan::{PlanItem, PlanNote, RoutePlan};
use crate::{geojson, gpx, ground_control, ground_control_writing, kml, waypoint_list};

/// The most bytes of a file: a hundred times the largest plan that planners accept.
const MOST_BYTES: usize = 16 << 20;

/// A file format of plans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanFormat {
    /// QGroundControl's `.plan`.
    GroundControl,
    /// `QGC WPL 110`, as Mission Planner and MAVProxy write it.
    WaypointList,
    /// GPX 1.1.
    Gpx,
    /// GeoJSON (RFC 7946).
    GeoJson,
    /// KML 2.2.
    Kml,
}

impl PlanFormat {
    /// All formats.
    pub const ALL: &[Self] =
        &[Self::GroundControl, Self::WaypointList, Self::Gpx, Self::GeoJson, Self::Kml];

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::GroundControl => "plan of QGroundControl",
            Self::WaypointList => "QGC WPL 110",
            Self::Gpx => "GPX",
            Self::GeoJson => "GeoJSON",
            Self::Kml => "KML",
        }
    }

    /// The ends of the names of its files; the first is the usual one.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::GroundControl => &["plan"],
            Self::WaypointList => &["waypoints", "wpl", "txt"],
            Self::Gpx => &["gpx"],
            Self::GeoJson => &["geojson", "json"],
            Self::Kml => &["kml"],
        }
    }

    /// The format of a file of this name.
    pub fn of_file_name(name: &str) -> Option<Self> {
        let end = name.rsplit_once('.')?.1.to_ascii_lowercase();
        Self::ALL.iter().copied().find(|format| format.extensions().contains(&end.as_str()))
    }
}

/// Reads a file of plans.
///
/// # Errors
/// If it is not of this format or version, contains a position that is none, or something without
/// counterpart that changes the route.
pub fn read_plan(text: &str, format: PlanFormat) -> Result<RoutePlan, PlanReadError> {
    let bytes = text.len();
    if bytes > MOST_BYTES {
        return Err(PlanReadError::TooLarge { bytes, most: MOST_BYTES });
    }
    let text = text.trim_start_matches('\u{feff}');
    match format {
        PlanFormat::GroundControl => ground_control::read(text),
        PlanFormat::WaypointList => waypoint_list::read(text),
        PlanFormat::Gpx => gpx::read(text),
        PlanFormat::GeoJson => geojson::read(text),
        PlanFormat::Kml => kml::read(text),
    }
}

/// Writes a plan. The notes name what the format has no place for.
///
/// # Errors
/// If the format has place for one route and there are several, or a repetition leads nowhere.
pub fn write_plan(
    plan: &RoutePlan,
    format: PlanFormat,
) -> Result<(String, Vec<PlanNote>), PlanWriteError> {
    for route in &plan.routes {
        for (index, item) in route.items.iter().enumerate() {
            if let PlanItem::Repeat { to, .. } = item
                && *to >= route.items.len()
            {
                return Err(PlanWriteError::Repetition { item: index + 1, to: to + 1 });
            }
        }
    }
    match format {
        PlanFormat::GroundControl => ground_control_writing::write(plan),
        PlanFormat::WaypointList => waypoint_list::write(plan),
        PlanFormat::Gpx => Ok(gpx::write(plan)),
        PlanFormat::GeoJson => Ok(geojson::write(plan)),
        PlanFormat::Kml => Ok(kml::write(plan)),
    }
}
