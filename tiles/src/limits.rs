//! What a source may hold: the limits of all kinds, with their reasons.

/// Memory of a [`Tiles`](crate::Tiles): decoded tiles, pictures that are held whole, and what is
/// being decoded.
pub const MAX_TILE_MEMORY: usize = 256 << 20;
/// Of that, pictures that are held whole, with their reductions, while one is decoded.
pub(crate) const PICTURE_MEMORY: usize = 144 << 20;
/// Of that, tiles that are being decoded, or wait to be received: eight of the largest.
pub(crate) const IN_FLIGHT_MEMORY: usize = 32 << 20;
/// Pixels of a picture that is decoded as a whole: 96 MiB, and a third of it for its reductions.
pub(crate) const MAX_PICTURE_PIXELS: usize = 24 << 20;
/// Bytes of a JPEG or PGM, which are in memory while it is decoded.
pub(crate) const MAX_PICTURE_BYTES: u64 = 48 << 20;
/// Longest side of a picture: that of a JPEG.
pub(crate) const MAX_SIDE: u32 = 65_535;
/// Pixels of a progressive JPEG: its decoder holds six bytes more for each.
pub(crate) const MAX_PROGRESSIVE_PIXELS: usize = 8 << 20;
/// What a PNG may need next to its pixels: a row, its palette, its texts.
pub(crate) const PNG_OVERHEAD: usize = 4 << 20;
/// Bytes of the small texts next to a picture: world files have six lines, projections one.
pub(crate) const MAX_SIDECAR_BYTES: u64 = 64 << 10;
/// Longest side of a tile in an archive, in pixels: eight of them are `IN_FLIGHT_MEMORY`.
pub(crate) const MAX_TILE_SIDE: u32 = 1_024;
/// Bytes of a compressed tile: more than its pixels.
pub(crate) const MAX_TILE_BYTES: usize = 4 << 20;
/// Bytes of a directory of PMTiles, compressed or not: the largest known have a tenth of it.
pub(crate) const MAX_DIRECTORY_BYTES: usize = 8 << 20;
/// Entries of a directory of PMTiles: 6 MiB.
pub(crate) const MAX_DIRECTORY_ENTRIES: usize = 1 << 18;
/// Directories from the root to a tile; the format recommends two.
pub(crate) const MAX_DIRECTORY_DEPTH: usize = 4;
/// Directories that are kept next to the root: those around a view.
pub(crate) const MAX_KEPT_DIRECTORIES: usize = 8;
/// Bytes of the metadata of an archive; longer ones are left out.
pub(crate) const MAX_METADATA_BYTES: usize = 1 << 20;
/// Steps of SQLite's machine for one query, in thousands: an indexed query has a few hundred steps,
/// and a view that never ends is stopped after a second.
pub(crate) const MAX_QUERY_KILOSTEPS: u32 = 50_000;
/// Directories of a TIFF: the picture, its overviews and their masks.
pub(crate) const MAX_DIRECTORIES: usize = 64;
/// Bytes of a strip or tile of a TIFF: a picture in one strip, of `MAX_PICTURE_PIXELS` in RGB, is
/// larger and is refused.
pub(crate) const MAX_TIFF_CHUNK: usize = 32 << 20;
/// Bytes of a GeoJSON file: read, it takes up to 16 times as much for a moment.
pub(crate) const MAX_GEOJSON_BYTES: u64 = 8 << 20;
/// Points of a plan, as many as walls of a drawn world.
pub(crate) const MAX_PLAN_POINTS: usize = 200_000;
