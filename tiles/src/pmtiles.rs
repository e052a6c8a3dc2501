//! PMTiles, version 3: a header, directories, and tiles in one file
//! (<https://github.com/protomaps/PMTiles>).

use std::collections::VecDeque;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use armor_geo::TileNumber;

use crate::attribution::shorten_attribution;
use crate::directory::{DirectoryEntry, TileDirectory, parse_directory};
use crate::error::{OpenError, OpenFault, PictureFault};
use crate::limits::{
    MAX_DIRECTORY_BYTES, MAX_DIRECTORY_DEPTH, MAX_KEPT_DIRECTORIES, MAX_METADATA_BYTES,
    MAX_TILE_BYTES,
};
use crate::web_tiles::{TileArchive, WebTiles, bounds_from_degrees, check_format, decompress_gzip};

/// How every file begins.
pub(crate) const MAGIC: &[u8] = b"PMTiles";
const HEADER_BYTES: usize = 127;

/// How a part of the archive is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PartCompression {
    None,
    Gzip,
}

/// A part of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ArchiveSection {
    offset: u64,
    len: u64,
}

/// An open archive.
pub(crate) struct PmTiles {
    file: File,
    root: Arc<TileDirectory>,
    leaves: ArchiveSection,
    data: ArchiveSection,
    directories_are: PartCompression,
    tiles_are: PartCompression,
    /// The directories that were used last, by their offsets.
    kept: Mutex<VecDeque<(u64, Arc<TileDirectory>)>>,
}

struct ArchiveHeader<'a>(&'a [u8]);

impl ArchiveHeader<'_> {
    fn byte(&self, at: usize) -> u8 {
        self.0.get(at).copied().unwrap_or_default()
    }

    fn long(&self, at: usize) -> u64 {
        let bytes = self.0.get(at..).and_then(|rest| rest.first_chunk());
        bytes.map_or(0, |bytes| u64::from_le_bytes(*bytes))
    }

    /// Degrees are stored in ten millionths.
    fn degrees(&self, at: usize) -> f64 {
        let bytes = self.0.get(at..).and_then(|rest| rest.first_chunk());
        f64::from(bytes.map_or(0, |bytes| i32::from_le_bytes(*bytes))) / 1e7
    }

    fn section(&self, at: usize) -> ArchiveSection {
        ArchiveSection { offset: self.long(at), len: self.long(at + 8) }
    }

    fn compression(&self, at: usize, of: &str) -> Result<PartCompression, (usize, OpenFault)> {
        let name = match self.byte(at) {
            1 => return Ok(PartCompression::None),
            2 => return Ok(PartCompression::Gzip),
            3 => "Brotli".to_owned(),
            4 => "Zstandard".to_owned(),
            other => format!("number {other}"),
        };
        let what = format!("its {of} are compressed by {name}");
        let remedy = "only gzip is decompressed: write the archive with it, or without compression";
        Err((at, OpenFault::NotSupported { what, remedy }))
    }
}

/// Opens an archive; returns it with its attribution.
pub(crate) fn open_pmtiles(path: &Path) -> Result<(WebTiles<PmTiles>, Option<String>), OpenError> {
    let name = path.display().to_string();
    let error = |place: String, fault| OpenError::new(&name, place, fault);
    let unreadable = |e: std::io::Error| error(String::new(), OpenFault::Unreadable(e.to_string()));
    let file = File::open(path).map_err(unreadable)?;
    let file_len = file.metadata().map_err(unreadable)?.len();
    let mut bytes = [0; HEADER_BYTES];
    file.read_exact_at(&mut bytes, 0)
        .map_err(|_| error(String::new(), OpenFault::Damaged("its header is not whole".into())))?;
    let at_byte = |(at, fault): (usize, OpenFault)| error(format!("byte {at}"), fault);
    let header = ArchiveHeader(&bytes);
    let version = header.byte(MAGIC.len());
    if version != 3 {
        let what = format!("it has version {version} of PMTiles");
        let remedy = "only version 3 is read: convert it with `pmtiles convert`";
        return Err(at_byte((7, OpenFault::NotSupported { what, remedy })));
    }
    let directories_are = header.compression(97, "directories").map_err(at_byte)?;
    let tiles_are = header.compression(98, "tiles").map_err(at_byte)?;
    let format = match header.byte(99) {
        1 => "mvt".to_owned(),
        2 => "png".to_owned(),
        3 => "jpg".to_owned(),
        4 => "webp".to_owned(),
        5 => "avif".to_owned(),
        6 => "mlt".to_owned(),
        other => format!("type {other}"),
    };
    check_format(&format).map_err(|fault| at_byte((99, fault)))?;
    for (at, part) in [(8, "root directory"), (40, "leaf directories"), (56, "tiles")] {
        let ArchiveSection { offset, len } = header.section(at);
        if offset.checked_add(len).is_none_or(|end| end > file_len) {
            let what = format!("its {part} end after the file, which has {file_len} bytes");
            return Err(at_byte((at, OpenFault::Damaged(what))));
        }
    }
    let zooms = (header.byte(100), header.byte(101));
    let degrees = [102, 106, 110, 114].map(|at| header.degrees(at));
    // No extent is that of the world.
    let bounds = if degrees == [0.0; 4] { None } else { Some(bounds_from_degrees(degrees)) };
    let bounds = bounds.transpose().map_err(|fault| at_byte((102, fault)))?;
    let root = header.section(8);
    let root = read_directory(&file, root.offset, root.len, directories_are)
        .map_err(|fault| at_byte((root.offset as usize, OpenFault::Picture(fault))))?;
    let attribution = read_attribution(&file, header.section(24), directories_are);
    let (leaves, data) = (header.section(40), header.section(56));
    let kept = Mutex::default();
    let root = Arc::new(root);
    let archive = PmTiles { file, root, leaves, data, directories_are, tiles_are, kept };
    let tiles = WebTiles::new(archive, bounds, zooms).map_err(|fault| at_byte((100, fault)))?;
    Ok((tiles, attribution))
}

fn damaged(what: impl Into<String>) -> PictureFault {
    PictureFault::Damaged(what.into())
}

fn read_directory(
    file: &File,
    offset: u64,
    len: u64,
    compression: PartCompression,
) -> Result<TileDirectory, PictureFault> {
    if len > MAX_DIRECTORY_BYTES as u64 {
        return Err(damaged(format!("the directory at byte {offset} has {len} bytes")));
    }
    let mut bytes = vec![0; len as usize];
    file.read_exact_at(&mut bytes, offset)
        .map_err(|_| damaged(format!("the directory at byte {offset} is not whole")))?;
    if compression == PartCompression::Gzip {
        bytes = decompress_gzip(&bytes, MAX_DIRECTORY_BYTES).ok_or_else(|| {
            damaged(format!("the directory at byte {offset} cannot be decompressed"))
        })?;
    }
    parse_directory(&bytes)
        .map_err(|what| damaged(format!("the directory at byte {offset}: {what}")))
}

/// The attribution of the metadata. It serves no other purpose, so what is not readable is left
/// out.
fn read_attribution(
    file: &File,
    metadata: ArchiveSection,
    compression: PartCompression,
) -> Option<String> {
    let len = usize::try_from(metadata.len).ok().filter(|len| *len <= MAX_METADATA_BYTES)?;
    let mut bytes = vec![0; len];
    file.read_exact_at(&mut bytes, metadata.offset).ok()?;
    if compression == PartCompression::Gzip {
        bytes = decompress_gzip(&bytes, MAX_METADATA_BYTES)?;
    }
    let value: serde_json::Value = serde_json::from_slice(&bytes).ok()?;
    shorten_attribution(value.get("attribution")?.as_str()?)
}

impl PmTiles {
    /// The directory at an offset of the leaves.
    fn leaf(&self, entry: DirectoryEntry) -> Result<Arc<TileDirectory>, PictureFault> {
        let end = entry.offset.checked_add(entry.len.into());
        if end.is_none_or(|end| end > self.leaves.len) {
            return Err(damaged("a directory lies outside the leaf directories"));
        }
        let offset = self.leaves.offset + entry.offset;
        let lock = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = lock().iter().find(|(at, _)| *at == offset) {
            return Ok(found.clone());
        }
        let read =
            Arc::new(read_directory(&self.file, offset, entry.len.into(), self.directories_are)?);
        let mut kept = lock();
        kept.push_back((offset, read.clone()));
        if kept.len() > MAX_KEPT_DIRECTORIES {
            kept.pop_front();
        }
        Ok(read)
    }
}

impl TileArchive for PmTiles {
    fn read_tile(&self, tile: TileNumber) -> Result<Option<Vec<u8>>, PictureFault> {
        let id = tile_id(tile);
        let mut directory = self.root.clone();
        for _ in 0..MAX_DIRECTORY_DEPTH {
            let Some(entry) = directory.find(id) else { return Ok(None) };
            if entry.is_leaf() {
                directory = self.leaf(entry)?;
                continue;
            }
            if entry.len as usize > MAX_TILE_BYTES {
                return Err(PictureFault::LongTile);
            }
            let end = entry.offset.checked_add(entry.len.into());
            if end.is_none_or(|end| end > self.data.len) {
                return Err(damaged("the tile lies outside the tiles of the archive"));
            }
            let mut bytes = vec![0; entry.len as usize];
            self.file
                .read_exact_at(&mut bytes, self.data.offset + entry.offset)
                .map_err(|e| PictureFault::Unreadable(e.to_string()))?;
            if self.tiles_are == PartCompression::Gzip {
                let plain = decompress_gzip(&bytes, MAX_TILE_BYTES);
                bytes = plain.ok_or_else(|| damaged("the tile cannot be decompressed"))?;
            }
            return Ok(Some(bytes));
        }
        Err(damaged(format!("its directories are nested deeper than {MAX_DIRECTORY_DEPTH}")))
    }
}

/// The number of a tile along Hilbert's curve, after those of all smaller zooms.
pub(crate) fn tile_id(tile: TileNumber) -> u64 {
    let (mut x, mut y) = (tile.x(), tile.y());
    let before = ((1_u64 << (2 * tile.zoom())) - 1) / 3;
    let mut along = 0;
    let mut side = (1_u32 << tile.zoom()) / 2;
    while side > 0 {
        let (right, down) = (u64::from(x & side > 0), u64::from(y & side > 0));
        along += u64::from(side) * u64::from(side) * ((3 * right) ^ down);
        if down == 0 {
            if right == 1 {
                // Only the bits below `side` matter from now on.
                x = (side - 1).wrapping_sub(x);
                y = (side - 1).wrapping_sub(y);
            }
            std::mem::swap(&mut x, &mut y);
        }
        side /= 2;
    }
    before + along
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_numbered_as_the_format_states() {
        let check = |zoom, x, y, expected| {
            assert_eq!(tile_id(TileNumber::new(zoom, x, y).unwrap()), expected);
        };
        check(0, 0, 0, 0);
        check(1, 0, 0, 1);
        check(1, 0, 1, 2);
        check(1, 1, 1, 3);
        check(1, 1, 0, 4);
        check(2, 0, 0, 5);
        check(12, 3423, 1763, 19_078_479);
    }

    #[test]
    fn neighbours_along_the_curve_are_neighbours_on_the_map() {
        let mut by_id: Vec<(u64, u32, u32)> = (0..32)
            .flat_map(|x| (0..32).map(move |y| (x, y)))
            .map(|(x, y)| (tile_id(TileNumber::new(5, x, y).unwrap()), x, y))
            .collect();
        by_id.sort_unstable();
        assert!(by_id.windows(2).all(|pair| {
            let [(a, ax, ay), (b, bx, by)] = [pair[0], pair[1]];
            b == a + 1 && ax.abs_diff(bx) + ay.abs_diff(by) == 1
        }));
    }
}
