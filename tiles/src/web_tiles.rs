//! Archives of square tiles of Web Mercator: which tiles a view needs, and their pixels.

use std::io::Read;

use armor_geo::{GeoPosition, MAX_MERCATOR_LATITUDE_DEG, MercatorPosition, TileNumber};
use flate2::bufread::GzDecoder;

use crate::error::{OpenFault, PictureFault};
use crate::limits::{MAX_TILE_BYTES, MAX_TILE_SIDE};
use crate::pixels;
use crate::reader::TileReader;
use crate::reference::{PlaneBounds, PlanePoint};
use crate::tile::{TileId, TileImage, TileRange};

/// Pixels of a tile's side, for the choice of the zoom; larger tiles are then sharper.
const USUAL_SIDE: u32 = 256;
/// The deepest zoom of an archive: a tile of it is 60 cm wide.
const MAX_ZOOM: u8 = 26;

/// Finds the bytes of a tile in an archive.
pub(crate) trait TileArchive: Send + Sync {
    /// The compressed picture of a tile; nothing where the archive has none.
    fn read_tile(&self, tile: TileNumber) -> Result<Option<Vec<u8>>, PictureFault>;
}

/// An archive with its extent.
pub(crate) struct WebTiles<A> {
    archive: A,
    bounds: PlaneBounds,
    zooms: (u8, u8),
}

/// The extent that an archive states, in degrees: west, south, east, north.
pub(crate) fn bounds_from_degrees(degrees: [f64; 4]) -> Result<PlaneBounds, OpenFault> {
    let [west, south, east, north] = degrees;
    let is_area = west < east
        && south < north
        && (-180.0..=180.0).contains(&west)
        && (-180.0..=180.0).contains(&east)
        && (-90.0..=90.0).contains(&south)
        && (-90.0..=90.0).contains(&north);
    if !is_area {
        let what = format!("its extent {west}, {south}, {east}, {north} is no area in degrees");
        return Err(OpenFault::Damaged(what));
    }
    // 180° would become -180°.
    let corner = |latitude_deg: f64, longitude_deg: f64| {
        let limit = MAX_MERCATOR_LATITUDE_DEG;
        let latitude_deg = latitude_deg.clamp(-limit, limit);
        let position = GeoPosition::new(latitude_deg, longitude_deg.min(179.999_999_99), 0.0);
        position.and_then(MercatorPosition::try_from)
    };
    match (corner(south, west), corner(north, east)) {
        (Ok(low), Ok(high)) => Ok(PlaneBounds::new(low.x_m, low.y_m, high.x_m, high.y_m)),
        (Err(error), _) | (_, Err(error)) => Err(OpenFault::Damaged(error.to_string())),
    }
}

/// The whole plane of Web Mercator.
fn world_bounds() -> PlaneBounds {
    match TileNumber::new(0, 0, 0) {
        Ok(world) => {
            let (low, high) = (world.mercator_at(0.0, 1.0), world.mercator_at(1.0, 0.0));
            PlaneBounds::new(low.x_m, low.y_m, high.x_m, high.y_m)
        }
        // There is such a tile.
        Err(_) => PlaneBounds::new(0.0, 0.0, 0.0, 0.0),
    }
}

impl<A: TileArchive> WebTiles<A> {
    /// An archive that has tiles of the zooms from the first to the last one; without an extent,
    /// all over the world.
    pub(crate) fn new(
        archive: A,
        bounds: Option<PlaneBounds>,
        zooms: (u8, u8),
    ) -> Result<Self, OpenFault> {
        if zooms.0 > zooms.1 || zooms.1 > MAX_ZOOM {
            let (first, last) = zooms;
            let what = format!("its zooms {first} to {last} are not within 0 to {MAX_ZOOM}");
            return Err(OpenFault::Damaged(what));
        }
        Ok(Self { archive, bounds: bounds.unwrap_or_else(world_bounds), zooms })
    }

    fn number_of(&self, id: TileId) -> Option<TileNumber> {
        let has_zoom = (self.zooms.0..=self.zooms.1).contains(&id.level);
        TileNumber::new(id.level, id.column, id.row).ok().filter(|_| has_zoom)
    }
}

fn world_width() -> f64 {
    world_bounds().width()
}

impl<A: TileArchive> TileReader for WebTiles<A> {
    fn bounds(&self) -> PlaneBounds {
        self.bounds
    }

    fn levels(&self) -> (u8, u8) {
        self.zooms
    }

    fn units_per_pixel(&self) -> f64 {
        world_width() / f64::from(USUAL_SIDE) / f64::from(1_u32 << self.zooms.1)
    }

    fn wanted(&self, view: PlaneBounds, pixels_per_unit: f64) -> Vec<TileId> {
        let Some(view) = view.intersection(self.bounds) else { return Vec::new() };
        let world = world_bounds();
        let pixels = world.width() * pixels_per_unit / f64::from(USUAL_SIDE);
        // A cast saturates.
        let zoom = (pixels.log2().round().max(0.0) as u8).clamp(self.zooms.0, self.zooms.1);
        let count = 1_u32 << zoom;
        let scale = f64::from(count) / world.width();
        let area = PlaneBounds::new(
            (view.min.x - world.min.x) * scale,
            (world.max.y - view.max.y) * scale,
            (view.max.x - world.min.x) * scale,
            (world.max.y - view.min.y) * scale,
        );
        let range = TileRange::touching(zoom, area, count, count);
        range.map(TileRange::list_from_middle).unwrap_or_default()
    }

    fn coarser(&self, id: TileId) -> Option<TileId> {
        let level = id.level.checked_sub(1).filter(|level| *level >= self.zooms.0)?;
        Some(TileId { level, column: id.column / 2, row: id.row / 2 })
    }

    fn corners(&self, id: TileId) -> Option<[PlanePoint; 4]> {
        let number = self.number_of(id)?;
        Some([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(right, down)| {
            let at = number.mercator_at(right, down);
            PlanePoint::new(at.x_m, at.y_m)
        }))
    }

    fn decode(&self, id: TileId) -> Result<Option<TileImage>, PictureFault> {
        let (number, corners) =
            self.number_of(id).zip(self.corners(id)).ok_or(PictureFault::NoSuchTile)?;
        let Some(bytes) = self.archive.read_tile(number)? else { return Ok(None) };
        let picture = decode_tile(&bytes)?;
        let pixels::Pixels { width, height, rgba } = picture;
        Ok(Some(TileImage { width, height, rgba, corners }))
    }

    fn tile_bytes(&self) -> usize {
        (USUAL_SIDE * USUAL_SIDE) as usize * 4
    }
}

/// Decodes the picture of a tile.
fn decode_tile(bytes: &[u8]) -> Result<pixels::Pixels, PictureFault> {
    if bytes.len() > MAX_TILE_BYTES {
        return Err(PictureFault::LongTile);
    }
    let side = MAX_TILE_SIDE as usize;
    let picture = pixels::decode_bytes(bytes, side * side);
    match picture {
        Err(PictureFault::TooManyPixels { width, height }) => {
            Err(PictureFault::LargeTile { width, height })
        }
        picture => picture,
    }
}

/// Decompresses gzip, up to a number of bytes; nothing if there are more, or the data is damaged.
pub(crate) fn decompress_gzip(bytes: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut plain = Vec::new();
    GzDecoder::new(bytes).take(most as u64 + 1).read_to_end(&mut plain).ok()?;
    (plain.len() <= most).then_some(plain)
}

/// Refuses the formats of tiles that have no decoder here, by name.
pub(crate) fn check_format(name: &str) -> Result<(), OpenFault> {
    let what = match name {
        "png" | "jpg" | "jpeg" => return Ok(()),
        "pbf" | "mvt" => "its tiles are vectors (MVT)".to_owned(),
        "mlt" => "its tiles are vectors (MLT)".to_owned(),
        "webp" => "its tiles are WebP".to_owned(),
        "avif" => "its tiles are AVIF".to_owned(),
        other => {
            let shown: String = other.chars().take(40).collect();
            format!("its tiles are `{shown}`")
        }
    };
    let remedy = "only PNG and JPEG are decoded: write the archive with tiles of one of these";
    Err(OpenFault::NotSupported { what, remedy })
}
