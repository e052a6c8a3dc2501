//! Web Mercator (EPSG 3857) and its square tiles, as map servers and PMTiles number them.

use std::f64::consts::PI;

use crate::ellipsoid::A_M;
use crate::error::GeoError;
use crate::position::{GeoPosition, check_finite};

/// Where the projection is cut off, so that the world is a square.
pub const MAX_MERCATOR_LATITUDE_DEG: f64 = 85.051_128_779_806_59;
/// A tile of zoom 30 is 4 cm wide.
pub const MAX_TILE_ZOOM: u8 = 30;

/// A position in the plane of the projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MercatorPosition {
    /// Metres to the east of 0° E, stretched by 1 / cos(latitude).
    pub x_m: f64,
    /// Metres to the north of the equator, stretched likewise.
    pub y_m: f64,
}

impl TryFrom<GeoPosition> for MercatorPosition {
    type Error = GeoError;

    /// # Errors
    /// A latitude beyond [`MAX_MERCATOR_LATITUDE_DEG`].
    fn try_from(position: GeoPosition) -> Result<Self, GeoError> {
        let latitude_deg = position.latitude_deg();
        if latitude_deg.abs() > MAX_MERCATOR_LATITUDE_DEG {
            return Err(GeoError::OutsideMercator { latitude_deg });
        }
        Ok(Self {
            x_m: A_M * position.longitude_deg().to_radians(),
            y_m: A_M * latitude_deg.to_radians().tan().asinh(),
        })
    }
}

impl TryFrom<MercatorPosition> for GeoPosition {
    type Error = GeoError;

    /// The position, at height 0.
    ///
    /// # Errors
    /// A number that is not finite; more than one turn to the east or west.
    fn try_from(position: MercatorPosition) -> Result<Self, GeoError> {
        check_finite("x", position.x_m)?;
        check_finite("y", position.y_m)?;
        let latitude_deg = (position.y_m / A_M).sinh().atan().to_degrees();
        Self::new(latitude_deg, (position.x_m / A_M).to_degrees(), 0.0)
    }
}

/// A tile: column `x` counts from 180° W to the east, row `y` from the north.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TileNumber {
    zoom: u8,
    x: u32,
    y: u32,
}

impl TileNumber {
    /// The tile with these numbers.
    ///
    /// # Errors
    /// A zoom above [`MAX_TILE_ZOOM`]; a column or row that does not exist at this zoom.
    pub fn new(zoom: u8, x: u32, y: u32) -> Result<Self, GeoError> {
        let exists = zoom <= MAX_TILE_ZOOM && x < 1 << zoom && y < 1 << zoom;
        if exists { Ok(Self { zoom, x, y }) } else { Err(GeoError::Tile { zoom, x, y }) }
    }

    /// The tile that contains a position, and where in it: 0 to 1 from its west and north edges.
    ///
    /// # Errors
    /// A zoom above [`MAX_TILE_ZOOM`]; a latitude beyond [`MAX_MERCATOR_LATITUDE_DEG`].
    pub fn containing(position: GeoPosition, zoom: u8) -> Result<(Self, f64, f64), GeoError> {
        if zoom > MAX_TILE_ZOOM {
            return Err(GeoError::Tile { zoom, x: 0, y: 0 });
        }
        let plane = MercatorPosition::try_from(position)?;
        let tiles = f64::from(1_u32 << zoom);
        let half_turn_m = A_M * PI;
        let column = (plane.x_m + half_turn_m) / (2.0 * half_turn_m) * tiles;
        let row = (half_turn_m - plane.y_m) / (2.0 * half_turn_m) * tiles;
        // The southernmost latitude is the lower edge of the last row.
        let (x, y) = (column.floor().clamp(0.0, tiles - 1.0), row.floor().clamp(0.0, tiles - 1.0));
        let tile = Self { zoom, x: x as u32, y: y as u32 };
        Ok((tile, column - x, row - y))
    }

    /// The zoom.
    pub fn zoom(self) -> u8 {
        self.zoom
    }

    /// The column.
    pub fn x(self) -> u32 {
        self.x
    }

    /// The row.
    pub fn y(self) -> u32 {
        self.y
    }

    /// The plane's position at a share of the tile's width and height from its north-west corner.
    pub fn mercator_at(self, right: f64, down: f64) -> MercatorPosition {
        let tiles = f64::from(1_u32 << self.zoom);
        let half_turn_m = A_M * PI;
        MercatorPosition {
            x_m: ((f64::from(self.x) + right) / tiles * 2.0 - 1.0) * half_turn_m,
            y_m: (1.0 - (f64::from(self.y) + down) / tiles * 2.0) * half_turn_m,
        }
    }
}
