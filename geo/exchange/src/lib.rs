//! Routes, fences and rally points in the file formats of other planners: QGroundControl's `.plan`,
//! `QGC WPL 110`, GPX 1.1, GeoJSON and KML. Each is read into one model ([`RoutePlan`]) and written
//! from it; what a format has no counterpart for becomes a note. Pure: text in, text out.
//!
//! ```
//! use armor_exchange::{PlanFormat, read_plan, write_plan};
//! let list = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t48.1\t11.5\t520\t1\n\
//!             1\t0\t3\t16\t0\t0\t0\t0\t48.2\t11.6\t30\t1\n";
//! let plan = read_plan(list, PlanFormat::WaypointList)?;
//! assert_eq!(plan.routes[0].items.len(), 1);
//! let (gpx, notes) = write_plan(&plan, PlanFormat::Gpx)?;
//! assert!(gpx.contains("<rtept lat=\"48.2\" lon=\"11.6\">"));
//! assert_eq!(notes[0].to_string(), "GPX: has no place for: home position (1)");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod format;
mod geojson;
mod gpx;
mod ground_control;
mod ground_control_writing;
mod kml;
mod mavlink;
mod plan;
mod waypoint_list;
mod xml_tree;

pub use error::{PlanReadError, PlanWriteError};
pub use format::{PlanFormat, read_plan, write_plan};
pub use plan::{
    AltitudeReference, Fence, FenceShape, MavlinkCommand, NamedPosition, PlanAltitude, PlanItem,
    PlanNote, PlanPosition, PlannedRoute, RoutePlan,
};
