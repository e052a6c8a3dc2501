//! Positions on the Earth and in a map, and exact geometry of legs and zones. Pure: no IO, no
//! clock, no messages.
//!
//! ```
//! use armor_geo::{Clearance, GeoPosition, MapArea, MapPlacement, MapPoint, MapPolygon, MapSegment};
//! let origin = GeoPosition::new(48.85830, 2.29450, 35.0)?;
//! let placement = MapPlacement::new(origin, 12_f64.to_radians(), 1.0)?;
//! let goal = placement.map_from_geo(GeoPosition::new(48.85857, 2.29460, 35.0)?)?;
//! assert!((goal.x_m() - 0.93).abs() < 0.01 && (goal.y_m() - 30.90).abs() < 0.01);
//!
//! let corner = |x, y| MapPoint::new(x, y);
//! let school = MapPolygon::new(vec![corner(3.0, 4.0)?, corner(9.0, 4.0)?, corner(9.0, 8.0)?])?;
//! let leg = MapSegment::new(corner(0.0, 2.0)?, corner(12.0, 2.0)?);
//! let margin = Clearance::new(2.0)?;
//! assert!(leg.compare_distance(&MapArea::from(school), margin).is_eq());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod area;
mod clearance;
mod distance;
mod east_north_up;
mod ecef;
mod ellipsoid;
mod error;
mod exact;
mod fit;
mod free_space;
mod map_point;
mod mercator;
mod pattern;
mod placement;
mod polygon;
mod polyline;
mod position;
mod segment;
mod shift;
mod transverse_mercator;
mod utm;
mod visibility;

pub use area::{MapArea, MapCircle};
pub use clearance::Clearance;
pub use east_north_up::{EnuFrame, EnuPosition};
pub use ecef::EcefPosition;
pub use error::{FitError, GeoError, ShapeError};
pub use fit::{FittedMap, MIN_FIT_PAIRS, ScaleChoice, fit_map};
pub use free_space::FreeSpace;
pub use map_point::{MAX_COORDINATE_M, MapPoint};
pub use mercator::{MAX_MERCATOR_LATITUDE_DEG, MAX_TILE_ZOOM, MercatorPosition, TileNumber};
pub use pattern::{MAX_PATTERN_POINTS, PatternError, SurveyLanes, sweep_area, sweep_corridor};
pub use placement::{MAX_MAP_REACH_M, MapPlacement};
pub use polygon::{MAX_CORNERS, MapPolygon, PointLocation};
pub use polyline::MapPolyline;
pub use position::GeoPosition;
pub use segment::MapSegment;
pub use shift::{MapShift, offset_line};
pub use utm::{UtmPosition, UtmZone};
pub use visibility::{MAX_BENDS, PathTree, ShortestPath, VisibilityGraph};
