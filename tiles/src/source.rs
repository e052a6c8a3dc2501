//! A source of pictures: a file, what it is, and its tiles.

use std::fs::File;
use std::io::Read;
use std::ops::RangeInclusive;
use std::path::Path;

use crate::error::{DecodeError, OpenError, OpenFault, PictureFault};
use crate::picture::{self, WholePicture};
use crate::pixels::PixelFormat;
use crate::reader::TileReader;
use crate::reference::{MapReference, PlaneBounds, PlanePoint};
use crate::tile::{TileId, TileImage};
use crate::{geojson, geotiff, map_server, mbtiles, pmtiles, svg_world};

/// The kind of file that a source is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SourceKind {
    /// A PNG with a world file.
    Png,
    /// A JPEG with a world file.
    Jpeg,
    /// A grid map of `map_server`: YAML and a picture.
    MapServer,
    /// An archive of tiles in SQLite.
    MbTiles,
    /// An archive of tiles, version 3.
    PmTiles,
    /// A TIFF with its place.
    GeoTiff,
    /// A drawing as the simulator reads it.
    SvgWorld,
    /// Shapes as GeoJSON.
    GeoJson,
}

/// An open file, whose tiles any thread may decode.
pub struct Source {
    file: String,
    kind: SourceKind,
    reference: MapReference,
    attribution: Option<String>,
    reader: Box<dyn TileReader>,
}

/// Bytes at the beginning that tell the kinds apart.
const HEAD_BYTES: u64 = 256;

impl Source {
    /// Opens a picture, whatever its kind; the content decides, not the name. Pixels are not
    /// decoded yet.
    ///
    /// # Errors
    /// A file that cannot be read, is of no kind that is supported, or whose place is not known;
    /// the error names the file and the place in it.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        let file = path.display().to_string();
        let mut head = Vec::new();
        File::open(path)
            .and_then(|opened| opened.take(HEAD_BYTES).read_to_end(&mut head))
            .map_err(|e| OpenError::new(&file, "", OpenFault::Unreadable(e.to_string())))?;
        let (kind, reference, attribution, reader) = open_by_content(path, &head)?;
        Ok(Self { file, kind, reference, attribution, reader })
    }

    /// The file, as the caller named it.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The kind of the file.
    pub fn kind(&self) -> SourceKind {
        self.kind
    }

    /// The plane of all its coordinates.
    pub fn reference(&self) -> MapReference {
        self.reference
    }

    /// Whom the file names as the authors of its picture.
    pub fn attribution(&self) -> Option<&str> {
        self.attribution.as_deref()
    }

    /// The extent of its picture.
    pub fn bounds(&self) -> PlaneBounds {
        self.reader.bounds()
    }

    /// The levels it has.
    pub fn levels(&self) -> RangeInclusive<u8> {
        let (first, last) = self.reader.levels();
        first..=last
    }

    /// Units of the plane for a pixel of the finest level.
    pub fn units_per_pixel(&self) -> f64 {
        self.reader.units_per_pixel()
    }

    /// The tiles that a view needs, from its middle outwards: of the level whose pixels are nearest
    /// to those of the screen, and at most [`MAX_WANTED_TILES`](crate::MAX_WANTED_TILES).
    ///
    /// `view` is in the plane of the source, with `pixels_per_unit` pixels of the screen for one of
    /// its units ([`MapReference::view_from_map`]).
    pub fn wanted(&self, view: PlaneBounds, pixels_per_unit: f64) -> Vec<TileId> {
        if view.intersection(self.bounds()).is_none() {
            return Vec::new();
        }
        self.reader.wanted(view, pixels_per_unit)
    }

    /// The tile of the next coarser level that contains a tile: what a view may draw until the tile
    /// is decoded.
    pub fn coarser(&self, id: TileId) -> Option<TileId> {
        self.reader.coarser(id)
    }

    /// The corners of a tile: top left, top right, bottom right, bottom left; nothing if there is
    /// no such tile.
    pub fn corners(&self, id: TileId) -> Option<[PlanePoint; 4]> {
        self.reader.corners(id)
    }

    /// Decodes a tile, on the caller's thread; `None` where the source has no picture there.
    ///
    /// # Errors
    /// A tile that does not exist, or whose bytes are damaged.
    pub fn decode(&self, id: TileId) -> Result<Option<TileImage>, DecodeError> {
        self.reader.decode(id).map_err(|fault| self.decode_error(id, fault))
    }

    pub(crate) fn decode_error(&self, tile: TileId, fault: PictureFault) -> DecodeError {
        DecodeError { file: self.file.clone(), tile, fault }
    }

    pub(crate) fn tile_bytes(&self) -> usize {
        self.reader.tile_bytes()
    }

    pub(crate) fn whole(&self) -> Option<&WholePicture> {
        self.reader.whole()
    }
}

/// What opening a file returns: kind, reference, attribution and tiles.
type Opened = (SourceKind, MapReference, Option<String>, Box<dyn TileReader>);

/// Distinguishes the kinds by their first bytes, and texts by their first character.
fn open_by_content(path: &Path, head: &[u8]) -> Result<Opened, OpenError> {
    if let Ok(format) = PixelFormat::of(head) {
        let (picture, reference) = picture::open_with_world_file(path, format)?;
        let kind = match format {
            PixelFormat::Png => SourceKind::Png,
            PixelFormat::Jpeg => SourceKind::Jpeg,
        };
        return Ok((kind, reference, None, Box::new(picture)));
    }
    if head.starts_with(pmtiles::MAGIC) {
        let (tiles, attribution) = pmtiles::open_pmtiles(path)?;
        return Ok((SourceKind::PmTiles, MapReference::WebMercator, attribution, Box::new(tiles)));
    }
    if head.starts_with(mbtiles::MAGIC) {
        let (tiles, attribution) = mbtiles::open_mbtiles(path)?;
        return Ok((SourceKind::MbTiles, MapReference::WebMercator, attribution, Box::new(tiles)));
    }
    if matches!(head, [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..]) {
        let (reader, reference) = geotiff::open_geotiff(path)?;
        return Ok((SourceKind::GeoTiff, reference, None, reader));
    }
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let is_yaml = path.extension().is_some_and(|it| it == "yaml" || it == "yml");
    match text.iter().find(|byte| !byte.is_ascii_whitespace()) {
        Some(b'<') => {
            let world = svg_world::open_world(path)?;
            Ok((SourceKind::SvgWorld, MapReference::Local, None, Box::new(world)))
        }
        Some(b'{') => {
            let (plan, reference) = geojson::open_geojson(path)?;
            Ok((SourceKind::GeoJson, reference, None, Box::new(plan)))
        }
        _ if is_yaml => {
            let map = map_server::open_map(path)?;
            Ok((SourceKind::MapServer, MapReference::Local, None, Box::new(map)))
        }
        _ => {
            let file = path.display().to_string();
            Err(OpenError::new(&file, "", OpenFault::UnknownKind))
        }
    }
}

impl std::fmt::Debug for Source {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Source")
            .field("file", &self.file)
            .field("kind", &self.kind)
            .field("reference", &self.reference)
            .field("bounds", &self.bounds())
            .field("levels", &self.levels())
            .finish_non_exhaustive()
    }
}

impl std::fmt::Display for SourceKind {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Self::Png => "PNG with a world file",
            Self::Jpeg => "JPEG with a world file",
            Self::MapServer => "grid map of map_server",
            Self::MbTiles => "MBTiles",
            Self::PmTiles => "PMTiles",
            Self::GeoTiff => "GeoTIFF",
            Self::SvgWorld => "SVG world",
            Self::GeoJson => "GeoJSON",
        })
    }
}
