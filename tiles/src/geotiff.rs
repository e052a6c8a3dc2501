//! GeoTIFF: pictures with their place, in one piece or as tiles with overviews.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use tiff::decoder::{ChunkType, Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{ColorType, TiffError};

use crate::error::{OpenError, OpenFault, PictureFault};
use crate::geo_keys::GeoTags;
use crate::limits::{MAX_DIRECTORIES, MAX_PICTURE_PIXELS, MAX_TIFF_CHUNK, MAX_TILE_SIDE};
use crate::picture::WholePicture;
use crate::pixel_placement::PixelPlacement;
use crate::pixels::Pixels;
use crate::reader::TileReader;
use crate::reference::{MapReference, PlaneBounds, PlanePoint};
use crate::tile::{TileId, TileImage, TileRange};

type TiffDecoder = Decoder<BufReader<File>>;

/// The picture, or one of its overviews.
struct TiffLevel {
    width: u32,
    height: u32,
    tile: (u32, u32),
    /// Columns of the picture for one of this level, and rows.
    scale: (f64, f64),
    /// It stands at this level's directory.
    decoder: Mutex<TiffDecoder>,
}

/// A picture whose tiles are decoded one by one.
pub(crate) struct TiledTiff {
    placement: PixelPlacement,
    /// The picture, then its overviews.
    levels: Vec<TiffLevel>,
}

/// What one directory of the file states.
struct DirectoryFacts {
    index: usize,
    width: u32,
    height: u32,
    chunk: (u32, u32),
    is_tiled: bool,
}

fn open_decoder(path: &Path) -> Result<TiffDecoder, PictureFault> {
    let file = File::open(path).map_err(|e| PictureFault::Unreadable(e.to_string()))?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_TIFF_CHUNK;
    limits.intermediate_buffer_size = MAX_TIFF_CHUNK;
    limits.ifd_value_size = 8 << 20;
    let decoder = Decoder::new(BufReader::new(file)).map_err(|e| tiff_fault(&e))?;
    Ok(decoder.with_limits(limits))
}

fn tiff_fault(error: &TiffError) -> PictureFault {
    PictureFault::Tiff(error.to_string())
}

/// Opens a picture, and states in which reference it is.
pub(crate) fn open_geotiff(path: &Path) -> Result<(Box<dyn TileReader>, MapReference), OpenError> {
    let file = path.display().to_string();
    let picture = |fault: PictureFault| OpenError::new(&file, "", fault.into());
    let in_tags = |fault| OpenError::new(&file, "its tags", fault);
    let mut decoder = open_decoder(path).map_err(picture)?;
    let tags = read_geo_tags(&mut decoder).map_err(|e| picture(tiff_fault(&e)))?;
    let placement = tags.placement().map_err(in_tags)?.ok_or_else(|| {
        let what = "its tags state no place (ModelTiepoint with ModelPixelScale, or \
                    ModelTransformation)";
        let remedy = "place it, for example with gdal_translate -a_srs … -a_ullr …";
        in_tags(OpenFault::NotSupported { what: what.to_owned(), remedy })
    })?;
    let reference = tags.reference().map_err(in_tags)?;
    let directories = read_directories(&mut decoder)
        .map_err(|(index, fault)| OpenError::new(&file, format!("directory {index}"), fault))?;
    let (full, overviews) = directories.split_first().ok_or_else(|| {
        OpenError::new(&file, "", OpenFault::Damaged("it has no picture".to_owned()))
    })?;
    let pixels = u64::from(full.width) * u64::from(full.height);
    let is_small = pixels <= MAX_PICTURE_PIXELS as u64;
    if is_small && (!full.is_tiled || overviews.is_empty()) {
        let picture_path = path.to_path_buf();
        let load = Box::new(move || load_whole(&picture_path));
        let whole = WholePicture::new((full.width, full.height), placement, load);
        return Ok((Box::new(whole.map_err(picture)?), reference));
    }
    let tiled = open_tiled(path, &directories, placement)
        .map_err(|(index, fault)| OpenError::new(&file, format!("directory {index}"), fault))?;
    Ok((Box::new(tiled), reference))
}

fn read_geo_tags(decoder: &mut TiffDecoder) -> Result<GeoTags, TiffError> {
    let mut doubles = |tag| match decoder.find_tag(tag)? {
        Some(value) => value.into_f64_vec(),
        None => Ok(Vec::new()),
    };
    let (pixel_scale, tie_points, transformation) = (
        doubles(Tag::ModelPixelScaleTag)?,
        doubles(Tag::ModelTiepointTag)?,
        doubles(Tag::ModelTransformationTag)?,
    );
    let keys = match decoder.find_tag(Tag::GeoKeyDirectoryTag)? {
        Some(value) => value.into_u16_vec()?,
        None => Vec::new(),
    };
    Ok(GeoTags { pixel_scale, tie_points, transformation, keys })
}

/// The picture and its overviews, the largest first. Masks and pages of another shape are left out.
fn read_directories(decoder: &mut TiffDecoder) -> Result<Vec<DirectoryFacts>, (usize, OpenFault)> {
    let mut found: Vec<DirectoryFacts> = Vec::new();
    for index in 0..MAX_DIRECTORIES {
        let at = |e: TiffError| (index, OpenFault::Picture(tiff_fault(&e)));
        if index > 0 {
            if !decoder.more_images() {
                break;
            }
            decoder.next_image().map_err(at)?;
        }
        let kind: u32 =
            decoder.find_tag_unsigned(Tag::NewSubfileType).map_err(at)?.unwrap_or_default();
        // Bit 0: an overview; bit 2: a mask.
        let is_overview = kind & 1 == 1;
        if kind & 4 != 0 || (index > 0 && !is_overview) {
            continue;
        }
        let (width, height) = decoder.dimensions().map_err(at)?;
        if width == 0 || height == 0 || width > 1 << 24 || height > 1 << 24 {
            let fault = PictureFault::TooManyPixels { width, height };
            return Err((index, fault.into()));
        }
        if let Some(full) = found.first() {
            let shape = f64::from(full.width) / f64::from(full.height);
            let is_same = (f64::from(width) / f64::from(height) / shape - 1.0).abs() < 0.1
                || width.min(height) < 16;
            let is_smaller = found.last().is_none_or(|last| width < last.width);
            if !is_same || !is_smaller {
                continue;
            }
        }
        check_colors(decoder).map_err(|fault| (index, fault))?;
        let is_tiled = decoder.get_chunk_type() == ChunkType::Tile;
        let chunk = decoder.chunk_dimensions();
        found.push(DirectoryFacts { index, width, height, chunk, is_tiled });
    }
    Ok(found)
}

/// Refuses pixels that have no meaning as colours here.
fn check_colors(decoder: &mut TiffDecoder) -> Result<(), OpenFault> {
    let refused = |what: String| {
        let remedy = "write it with 8-bit grey or RGB pixels, interleaved: gdal_translate -ot Byte, \
                      with -expand rgb for a palette and -co PHOTOMETRIC=RGB for JPEG";
        Err(OpenFault::NotSupported { what, remedy })
    };
    let color = decoder.colortype().map_err(|e| OpenFault::Picture(tiff_fault(&e)))?;
    let planar: u16 = decoder
        .find_tag_unsigned(Tag::PlanarConfiguration)
        .map_err(|e| OpenFault::Picture(tiff_fault(&e)))?
        .unwrap_or(1);
    let format: u16 = decoder
        .find_tag_unsigned_vec(Tag::SampleFormat)
        .map_err(|e| OpenFault::Picture(tiff_fault(&e)))?
        .and_then(|formats: Vec<u16>| formats.first().copied())
        .unwrap_or(1);
    if count_samples(color).is_none() {
        return refused(format!("its pixels are {color:?}"));
    }
    if format != 1 {
        return refused("its pixels are signed numbers or fractions, such as heights".to_owned());
    }
    if planar != 1 && count_samples(color) != Some(1) {
        return refused("its colours are stored in separate planes".to_owned());
    }
    Ok(())
}

/// Samples of a pixel, of the colours that are supported.
fn count_samples(color: ColorType) -> Option<usize> {
    match color {
        ColorType::Gray(8 | 16) => Some(1),
        ColorType::GrayA(8 | 16) | ColorType::Multiband { bit_depth: 8 | 16, num_samples: 2 } => {
            Some(2)
        }
        ColorType::RGB(8 | 16) | ColorType::YCbCr(8) => Some(3),
        ColorType::RGBA(8 | 16) => Some(4),
        _ => None,
    }
}

fn open_tiled(
    path: &Path,
    directories: &[DirectoryFacts],
    placement: PixelPlacement,
) -> Result<TiledTiff, (usize, OpenFault)> {
    let full = &directories[0];
    let mut levels = Vec::new();
    for facts in directories {
        let (chunk_width, chunk_height) = facts.chunk;
        let is_fine = facts.is_tiled
            && (16..=MAX_TILE_SIDE).contains(&chunk_width)
            && (16..=MAX_TILE_SIDE).contains(&chunk_height);
        if !is_fine {
            let form = if facts.is_tiled { "tiles" } else { "strips" };
            let what = format!("it is large and has {form} of {chunk_width} × {chunk_height}");
            let remedy = "write it as tiles of 256 or 512 pixels: gdal_translate -co TILED=YES, \
                          then gdaladdo";
            return Err((facts.index, OpenFault::NotSupported { what, remedy }));
        }
        let mut decoder = open_decoder(path).map_err(|fault| (facts.index, fault.into()))?;
        for _ in 0..facts.index {
            decoder.next_image().map_err(|e| (facts.index, OpenFault::Picture(tiff_fault(&e))))?;
        }
        levels.push(TiffLevel {
            width: facts.width,
            height: facts.height,
            tile: facts.chunk,
            scale: (
                f64::from(full.width) / f64::from(facts.width),
                f64::from(full.height) / f64::from(facts.height),
            ),
            decoder: Mutex::new(decoder),
        });
    }
    let last = levels.last().map_or(0, |last| u64::from(last.width) * u64::from(last.height));
    if last > MAX_PICTURE_PIXELS as u64 {
        let what = "it is large and has no small overview".to_owned();
        let remedy = "add overviews: gdaladdo FILE 2 4 8 16 32";
        return Err((full.index, OpenFault::NotSupported { what, remedy }));
    }
    Ok(TiledTiff { placement, levels })
}

/// Decodes all strips or tiles of the first picture.
fn load_whole(path: &Path) -> Result<Pixels, PictureFault> {
    let mut decoder = open_decoder(path)?;
    let (width, height) = decoder.dimensions().map_err(|e| tiff_fault(&e))?;
    crate::pixels::check_size(width, height, MAX_PICTURE_PIXELS)?;
    let (chunk_width, chunk_height) = decoder.chunk_dimensions();
    let (columns, rows) =
        (width.div_ceil(chunk_width.max(1)), height.div_ceil(chunk_height.max(1)));
    let mut rgba = vec![0; width as usize * height as usize * 4];
    for row in 0..rows {
        for column in 0..columns {
            let part = read_chunk(&mut decoder, column, row, columns)?;
            let (left, top) = (column * chunk_width, row * chunk_height);
            let part_width = part.width.min(width - left) as usize;
            for (line, from) in (top..height).zip(part.rgba.chunks(part.width as usize * 4)) {
                let at = (line as usize * width as usize + left as usize) * 4;
                rgba[at..at + part_width * 4].copy_from_slice(&from[..part_width * 4]);
            }
        }
    }
    Ok(Pixels { width, height, rgba })
}

/// Decodes a strip or tile, without what it has beyond the picture.
fn read_chunk(
    decoder: &mut TiffDecoder,
    column: u32,
    row: u32,
    columns: u32,
) -> Result<Pixels, PictureFault> {
    let index = row.checked_mul(columns).and_then(|first| first.checked_add(column));
    let index = index.ok_or(PictureFault::NoSuchTile)?;
    let color = decoder.colortype().map_err(|e| tiff_fault(&e))?;
    let samples = count_samples(color);
    let samples = samples.ok_or_else(|| PictureFault::Tiff(format!("{color:?}")))?;
    let (width, height) = decoder.chunk_data_dimensions(index);
    let bytes = match decoder.read_chunk(index).map_err(|e| tiff_fault(&e))? {
        DecodingResult::U8(bytes) => bytes,
        // The upper half of each sample.
        DecodingResult::U16(samples) => samples.into_iter().map(|it| (it >> 8) as u8).collect(),
        _ => return Err(PictureFault::Tiff("its samples have another size".to_owned())),
    };
    if bytes.len() != width as usize * height as usize * samples {
        return Err(PictureFault::Tiff("a part of it has another size".to_owned()));
    }
    let is_luma = matches!(color, ColorType::YCbCr(_));
    let rgba = bytes
        .chunks_exact(samples)
        .flat_map(|pixel| match *pixel {
            [grey] => [grey, grey, grey, 255],
            [grey, alpha] => [grey, grey, grey, alpha],
            [luma, blue, red] if is_luma => rgb_from_luma(luma, blue, red),
            [red, green, blue] => [red, green, blue, 255],
            [red, green, blue, alpha] => [red, green, blue, alpha],
            _ => [0; 4],
        })
        .collect();
    Ok(Pixels { width, height, rgba })
}

/// ITU-R BT.601, as JPEG uses it.
fn rgb_from_luma(luma: u8, blue: u8, red: u8) -> [u8; 4] {
    let (y, b, r) = (f32::from(luma), f32::from(blue) - 128.0, f32::from(red) - 128.0);
    // A cast saturates.
    let [red, green, blue] = [y + 1.402 * r, y - 0.344_136 * b - 0.714_136 * r, y + 1.772 * b]
        .map(|value| value.round() as u8);
    [red, green, blue, 255]
}

impl TiledTiff {
    fn level(&self, id: TileId) -> Option<&TiffLevel> {
        let level = self.levels.get(usize::from(id.level))?;
        let (columns, rows) = level.count_tiles();
        (id.column < columns && id.row < rows).then_some(level)
    }
}

impl TiffLevel {
    fn count_tiles(&self) -> (u32, u32) {
        (self.width.div_ceil(self.tile.0), self.height.div_ceil(self.tile.1))
    }
}

impl TileReader for TiledTiff {
    fn bounds(&self) -> PlaneBounds {
        let (width, height) = self.levels.first().map_or((0, 0), |it| (it.width, it.height));
        let corners = self.placement.corners_of(0.0, 0.0, width.into(), height.into());
        PlaneBounds::containing(corners).unwrap_or(PlaneBounds::new(0.0, 0.0, 0.0, 0.0))
    }

    fn levels(&self) -> (u8, u8) {
        (0, (self.levels.len() - 1) as u8)
    }

    fn units_per_pixel(&self) -> f64 {
        self.placement.units_per_pixel()
    }

    fn wanted(&self, view: PlaneBounds, pixels_per_unit: f64) -> Vec<TileId> {
        let screen_scale = 1.0 / (self.units_per_pixel() * pixels_per_unit);
        let distance = |level: &TiffLevel| (level.scale.0 / screen_scale).ln().abs();
        let nearest =
            (0_u8..).zip(&self.levels).min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        let Some((number, level)) = nearest else { return Vec::new() };
        let area = self.placement.pixels_around(view);
        let (tile_width, tile_height) =
            (f64::from(level.tile.0) * level.scale.0, f64::from(level.tile.1) * level.scale.1);
        let area = PlaneBounds::new(
            area.min.x / tile_width,
            area.min.y / tile_height,
            area.max.x / tile_width,
            area.max.y / tile_height,
        );
        let (columns, rows) = level.count_tiles();
        let range = TileRange::touching(number, area, columns, rows);
        range.map(TileRange::list_from_middle).unwrap_or_default()
    }

    fn coarser(&self, id: TileId) -> Option<TileId> {
        let (fine, coarse) = (self.level(id)?, self.levels.get(usize::from(id.level) + 1)?);
        // The tile at this one's middle.
        let place = |at: u32, tile: u32, scale: f64, other: u32, other_scale: f64| {
            ((f64::from(at) + 0.5) * f64::from(tile) * scale / other_scale / f64::from(other))
                as u32
        };
        let column = place(id.column, fine.tile.0, fine.scale.0, coarse.tile.0, coarse.scale.0);
        let row = place(id.row, fine.tile.1, fine.scale.1, coarse.tile.1, coarse.scale.1);
        let (columns, rows) = coarse.count_tiles();
        let (column, row) = (column.min(columns - 1), row.min(rows - 1));
        Some(TileId { level: id.level + 1, column, row })
    }

    fn corners(&self, id: TileId) -> Option<[PlanePoint; 4]> {
        let level = self.level(id)?;
        let (left, top) = (id.column * level.tile.0, id.row * level.tile.1);
        let right = (left + level.tile.0).min(level.width);
        let bottom = (top + level.tile.1).min(level.height);
        let (x, y) = level.scale;
        Some(self.placement.corners_of(
            f64::from(left) * x,
            f64::from(top) * y,
            f64::from(right) * x,
            f64::from(bottom) * y,
        ))
    }

    fn decode(&self, id: TileId) -> Result<Option<TileImage>, PictureFault> {
        let (level, corners) =
            self.level(id).zip(self.corners(id)).ok_or(PictureFault::NoSuchTile)?;
        let mut decoder = level.decoder.lock().unwrap_or_else(PoisonError::into_inner);
        let (columns, _) = level.count_tiles();
        let Pixels { width, height, rgba } = read_chunk(&mut decoder, id.column, id.row, columns)?;
        Ok(Some(TileImage { width, height, rgba, corners }))
    }

    fn tile_bytes(&self) -> usize {
        let largest = self.levels.iter().map(|level| level.tile.0 * level.tile.1).max();
        largest.unwrap_or_default() as usize * 4
    }
}
