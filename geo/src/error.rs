//! Why a position, a shape or a fit is refused.

use thiserror::Error;

/// A position that does not exist, or that a conversion does not cover.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum GeoError {
    /// A number is infinite or not a number.
    #[error("{what} is {value}; it must be a finite number")]
    NotFinite {
        /// The number's name.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A latitude beyond a pole.
    #[error("latitude {latitude_deg}° is not between -90° and 90°")]
    Latitude {
        /// The latitude.
        latitude_deg: f64,
    },
    /// A longitude of more than one turn.
    #[error("longitude {longitude_deg}° is not between -360° and 360°")]
    Longitude {
        /// The longitude.
        longitude_deg: f64,
    },
    /// A height so low or high that no robot is there.
    #[error("height {height_m} m is not between -100,000 m and 100,000,000 m")]
    Height {
        /// The height above the ellipsoid.
        height_m: f64,
    },
    /// A place near the Earth's centre, where latitude and height have no meaning.
    #[error("the position is {distance_m} m from the Earth's centre; it must be at least 6,200 km")]
    TooDeep {
        /// The distance from the centre.
        distance_m: f64,
    },
    /// A latitude that UTM leaves to the polar grids.
    #[error("UTM covers latitudes from -80° to 84°, not {latitude_deg}°")]
    OutsideUtm {
        /// The latitude.
        latitude_deg: f64,
    },
    /// A UTM zone number that does not exist.
    #[error("UTM zone {number} does not exist; zones are 1 to 60")]
    UtmZoneNumber {
        /// The number.
        number: u8,
    },
    /// A position too far from its zone's central meridian.
    #[error(
        "easting {easting_m} m, northing {northing_m} m is too far outside UTM zone {number}; \
         choose the zone of the position"
    )]
    FarFromUtmZone {
        /// The easting.
        easting_m: f64,
        /// The northing.
        northing_m: f64,
        /// The zone.
        number: u8,
    },
    /// A latitude that Web Mercator leaves out.
    #[error("Web Mercator covers latitudes up to 85.0511°, not {latitude_deg}°")]
    OutsideMercator {
        /// The latitude.
        latitude_deg: f64,
    },
    /// A tile that does not exist at its zoom.
    #[error("tile {zoom}/{x}/{y} does not exist; zoom is 0 to 30, x and y are below 2^zoom")]
    Tile {
        /// The zoom.
        zoom: u8,
        /// The column.
        x: u32,
        /// The row.
        y: u32,
    },
    /// A scale that is not a positive number.
    #[error("scale {scale} is not between 0.001 and 1000")]
    Scale {
        /// Metres in the world for one metre of the map.
        scale: f64,
    },
    /// A position too far from the map's origin for a plane map.
    #[error("the position is {distance_m} m from the map's origin; a map reaches 1,000 km")]
    TooFar {
        /// The distance from the map's origin.
        distance_m: f64,
    },
}

/// A point, length or shape in the map that does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ShapeError {
    /// A coordinate is not finite, or beyond [`MAX_COORDINATE_M`](crate::MAX_COORDINATE_M).
    #[error("coordinate {value} is not between -100,000,000 m and 100,000,000 m")]
    Coordinate {
        /// The coordinate.
        value: f64,
    },
    /// A length is negative, not finite, or too large.
    #[error("length {value} is not between 0 m and 100,000,000 m")]
    Length {
        /// The length.
        value: f64,
    },
    /// A circle without an inside.
    #[error("a circle's radius must be more than 0 m")]
    Radius,
    /// A polygon or line with too few points.
    #[error("the shape has {found} points; it needs at least {needed}")]
    TooFewPoints {
        /// The number of points.
        found: usize,
        /// The number that is needed.
        needed: usize,
    },
    /// A polygon or line with more points than [`MAX_CORNERS`](crate::MAX_CORNERS).
    #[error("the shape has {found} points; at most {max} are allowed")]
    TooManyPoints {
        /// The number of points.
        found: usize,
        /// The limit.
        max: usize,
    },
    /// Two successive points are the same.
    #[error("point {index} is the same as the next one")]
    RepeatedPoint {
        /// The first of the two, counted from 1.
        index: usize,
    },
    /// Two edges of a polygon cross or touch.
    #[error("the edges after points {first} and {second} cross or touch")]
    CrossingEdges {
        /// The point before the first edge, counted from 1.
        first: usize,
        /// The point before the second edge, counted from 1.
        second: usize,
    },
    /// A corner that is too sharp to be offset.
    #[error("corner {index} is too sharp: offset, it would be more than eight times as far away")]
    SharpCorner {
        /// The corner, counted from 1.
        index: usize,
    },
    /// A side of which an offset leaves nothing.
    #[error("the side after point {index} is too short for this offset")]
    SideTooShort {
        /// The point before it, counted from 1.
        index: usize,
    },
}

/// Why a map cannot be fitted to the world.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum FitError {
    /// Fewer than two pairs.
    #[error("a map is fitted by at least 2 pairs of points, not {found}")]
    TooFewPairs {
        /// The number of pairs.
        found: usize,
    },
    /// The points of the map or of the world are all the same.
    #[error("the points are less than 1 mm apart; choose points far from each other")]
    NoSpread,
    /// No turn of the map is better than another.
    #[error("the pairs do not determine how the map is turned; check which point belongs to which")]
    NoDirection,
    /// A position cannot be converted.
    #[error(transparent)]
    Position(#[from] GeoError),
}
