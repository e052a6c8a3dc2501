//! What can be wrong with a source: each fault states its cause and a remedy.

use crate::limits::{
    MAX_PICTURE_BYTES, MAX_PICTURE_PIXELS, MAX_PLAN_POINTS, MAX_PROGRESSIVE_PIXELS, MAX_SIDE,
    MAX_TILE_BYTES, MAX_TILE_SIDE,
};
use crate::tile::TileId;

/// A file that is no source of pictures, with the place where that shows.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}{}: {fault}", describe_place(place))]
pub struct OpenError {
    /// The file: the one that was opened, or one that belongs to it.
    pub file: String,
    /// The place in the file, such as `line 3` or `byte 102`; empty for the file as a whole.
    pub place: String,
    /// What is wrong there.
    pub fault: OpenFault,
}

/// A tile that cannot be decoded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}, tile {tile}: {fault}")]
pub struct DecodeError {
    /// The file of the source.
    pub file: String,
    /// The tile.
    pub tile: TileId,
    /// What is wrong with it.
    pub fault: PictureFault,
}

fn describe_place(place: &str) -> String {
    if place.is_empty() { String::new() } else { format!(", {place}") }
}

/// What is wrong with a file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OpenFault {
    /// The file cannot be opened or read.
    #[error("cannot read it: {0}; check the path and its permissions")]
    Unreadable(String),
    /// A file that is larger than its kind needs to be.
    #[error("it has more than {most} bytes; {remedy}")]
    TooLarge {
        /// The limit of its kind.
        most: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// No kind of picture that is read here.
    #[error(
        "it is none of the pictures that a map can show: PNG or JPEG with a world file, GeoTIFF, \
         PMTiles, MBTiles, map_server's YAML, an SVG world, GeoJSON; convert it to one of these"
    )]
    UnknownKind,
    /// A picture whose place is not known.
    #[error(
        "its place is not known: there is no world file next to it; write {0} with the six lines of \
         a world file, or name a map.yaml"
    )]
    NoWorldFile(String),
    /// A line of a world file that is no number.
    #[error(
        "`{0}` is not a number; a world file has six: the step of a column in x and y is on lines 1 \
         and 2, that of a row on lines 3 and 4, the centre of the top left pixel on lines 5 and 6"
    )]
    WorldFileLine(String),
    /// A placement that spans no area.
    #[error("its pixels have no area, or lie beyond the Earth; correct the numbers of its place")]
    Placement,
    /// A reference that is not supported.
    #[error(
        "its reference is {0}; supported are EPSG 4326, 3857, 32601 to 32660 and 32701 to 32760: \
         reproject it, for example with gdalwarp -t_srs EPSG:3857"
    )]
    Reference(String),
    /// The content contradicts its format.
    #[error("{0}; the file is damaged or not of this format: write it again")]
    Damaged(String),
    /// A part of the format that is not read here.
    #[error("{what}; {remedy}")]
    NotSupported {
        /// What is not read.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A plan without an area or a line.
    #[error("it has no area and no line; draw the plan as polygons and lines")]
    NoShapes,
    /// A plan of more points than are painted in time.
    #[error("it has more than {MAX_PLAN_POINTS} points; simplify the plan")]
    TooManyPoints,
    /// The YAML of a map, or its picture.
    #[error("{0}")]
    Map(String),
    /// A drawn world.
    #[error("{0}")]
    Drawing(String),
    /// The picture cannot be decoded.
    #[error(transparent)]
    Picture(#[from] PictureFault),
}

/// What is wrong with the pixels of a picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PictureFault {
    /// The file cannot be read any more.
    #[error("cannot read it: {0}; check that it was not moved or changed")]
    Unreadable(String),
    /// A PNG that breaks its format.
    #[error("the PNG is not readable: {0}; save it again")]
    Png(String),
    /// A JPEG that breaks its format.
    #[error("the JPEG is not readable: {0}; save it again")]
    Jpeg(String),
    /// A TIFF that breaks its format, or uses a part of it that is not read here.
    #[error("the TIFF is not readable: {0}; write it again, for example with gdal_translate")]
    Tiff(String),
    /// A tile of more pixels than tiles have.
    #[error(
        "the tile has {width} × {height} pixels; at most {} on a side are decoded: write the \
         archive with tiles of 256 or 512",
        MAX_TILE_SIDE
    )]
    LargeTile {
        /// Its width.
        width: u32,
        /// Its height.
        height: u32,
    },
    /// A tile that is longer than its pixels could be.
    #[error("the tile has more than {MAX_TILE_BYTES} bytes; write the archive with smaller tiles")]
    LongTile,
    /// Another kind of picture.
    #[error("the picture is {0}; only PNG and JPEG are decoded: convert it to one of them")]
    UnknownFormat(&'static str),
    /// A picture without pixels.
    #[error("the picture has no pixels")]
    Empty,
    /// More pixels than are held in memory at a time.
    #[error(
        "it has {width} × {height} pixels; at most {} million are shown, and {} on a side: reduce \
         it, or cut it into tiles (PMTiles, MBTiles, GeoTIFF with overviews)",
        MAX_PICTURE_PIXELS >> 20, MAX_SIDE
    )]
    TooManyPixels {
        /// Its width.
        width: u32,
        /// Its height.
        height: u32,
    },
    /// A progressive JPEG needs three times the memory of others.
    #[error(
        "it is a progressive JPEG of more than {} million pixels; save it without this option",
        MAX_PROGRESSIVE_PIXELS >> 20
    )]
    Progressive,
    /// A compressed picture that is longer than its pixels could be.
    #[error("it has more than {MAX_PICTURE_BYTES} bytes; reduce the picture")]
    TooLarge,
    /// A tile that its source does not have.
    #[error("there is no such tile")]
    NoSuchTile,
    /// The archive contradicts its format here.
    #[error("{0}; the file is damaged: copy it again")]
    Damaged(String),
}

impl OpenError {
    pub(crate) fn new(file: &str, place: impl Into<String>, fault: OpenFault) -> Self {
        Self { file: file.to_owned(), place: place.into(), fault }
    }
}
