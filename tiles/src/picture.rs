//! Pictures that are decoded as a whole, when their first tile is needed, and held in memory.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{OpenError, OpenFault, PictureFault};
use crate::limits::{MAX_PICTURE_BYTES, MAX_PICTURE_PIXELS, MAX_SIDECAR_BYTES};
use crate::pixel_placement::PixelPlacement;
use crate::pixels::{self, PixelFormat, Pixels};
use crate::projection::find_reference;
use crate::pyramid::{self, CUT_SIDE, Pyramid};
use crate::reader::TileReader;
use crate::reference::{MapReference, PlaneBounds, PlanePoint};
use crate::tile::{TileId, TileImage, TileRange};
use crate::world_file;

/// Reads all pixels of a picture.
pub(crate) type PixelLoader = Box<dyn Fn() -> Result<Pixels, PictureFault> + Send + Sync>;

/// A picture with its place.
pub(crate) struct WholePicture {
    width: u32,
    height: u32,
    placement: PixelPlacement,
    load: PixelLoader,
    loaded: Mutex<Option<Pyramid>>,
}

impl WholePicture {
    /// A picture of a size that is known; its pixels are read when they are needed.
    pub(crate) fn new(
        (width, height): (u32, u32),
        placement: PixelPlacement,
        load: PixelLoader,
    ) -> Result<Self, PictureFault> {
        pixels::check_size(width, height, MAX_PICTURE_PIXELS)?;
        Ok(Self { width, height, placement, load, loaded: Mutex::new(None) })
    }

    fn last_level(&self) -> u8 {
        pyramid::count_reductions(self.width, self.height)
    }

    /// The rectangle of a tile in the pixels of its level: left, top, width, height.
    fn rectangle(&self, id: TileId) -> Option<(u32, u32, u32, u32)> {
        if id.level > self.last_level() {
            return None;
        }
        let (width, height) = pyramid::reduced_size(self.width, self.height, id.level);
        let left = id.column.checked_mul(CUT_SIDE).filter(|left| *left < width)?;
        let top = id.row.checked_mul(CUT_SIDE).filter(|top| *top < height)?;
        Some((left, top, (width - left).min(CUT_SIDE), (height - top).min(CUT_SIDE)))
    }

    /// Bytes that the decoded picture has in memory now.
    pub(crate) fn resident_bytes(&self) -> usize {
        self.lock().as_ref().map_or(0, Pyramid::len_bytes)
    }

    /// Bytes that it has when it is decoded.
    pub(crate) fn decoded_bytes(&self) -> usize {
        pyramid::pyramid_bytes(self.width, self.height)
    }

    /// Drops the decoded picture; the next tile decodes it again.
    pub(crate) fn release(&self) {
        *self.lock() = None;
    }

    fn lock(&self) -> MutexGuard<'_, Option<Pyramid>> {
        // A decoder that panicked has left nothing half written.
        self.loaded.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl TileReader for WholePicture {
    fn bounds(&self) -> PlaneBounds {
        let corners = self.placement.corners_of(0.0, 0.0, self.width.into(), self.height.into());
        // Four points have bounds.
        PlaneBounds::containing(corners).unwrap_or(PlaneBounds::new(0.0, 0.0, 0.0, 0.0))
    }

    fn levels(&self) -> (u8, u8) {
        (0, self.last_level())
    }

    fn units_per_pixel(&self) -> f64 {
        self.placement.units_per_pixel()
    }

    fn wanted(&self, view: PlaneBounds, pixels_per_unit: f64) -> Vec<TileId> {
        let reduction = (1.0 / (self.units_per_pixel() * pixels_per_unit)).log2().round();
        // A cast saturates.
        let level = (reduction.max(0.0) as u8).min(self.last_level());
        let (width, height) = pyramid::reduced_size(self.width, self.height, level);
        let area = self.placement.pixels_around(view);
        let side = f64::from(CUT_SIDE) * f64::from(1_u32 << level);
        let area = PlaneBounds::new(
            area.min.x / side,
            area.min.y / side,
            area.max.x / side,
            area.max.y / side,
        );
        let (columns, rows) = (width.div_ceil(CUT_SIDE), height.div_ceil(CUT_SIDE));
        let range = TileRange::touching(level, area, columns, rows);
        range.map(TileRange::list_from_middle).unwrap_or_default()
    }

    fn coarser(&self, id: TileId) -> Option<TileId> {
        let level = id.level.checked_add(1).filter(|level| *level <= self.last_level())?;
        Some(TileId { level, column: id.column / 2, row: id.row / 2 })
    }

    fn corners(&self, id: TileId) -> Option<[PlanePoint; 4]> {
        let (left, top, width, height) = self.rectangle(id)?;
        let scale = f64::from(1_u32 << id.level);
        // The last pixel of a reduction may reach beyond an edge with an odd number of pixels; so
        // does its corner, and all others stay in their places.
        let [left, top, right, bottom] =
            [left, top, left + width, top + height].map(|value| f64::from(value) * scale);
        Some(self.placement.corners_of(left, top, right, bottom))
    }

    fn decode(&self, id: TileId) -> Result<Option<TileImage>, PictureFault> {
        let rectangle = self.rectangle(id).zip(self.corners(id));
        let ((left, top, width, height), corners) = rectangle.ok_or(PictureFault::NoSuchTile)?;
        let mut loaded = self.lock();
        if loaded.is_none() {
            let full = (self.load)()?;
            if (full.width, full.height) != (self.width, self.height) {
                let what = "its size has changed since it was opened";
                return Err(PictureFault::Unreadable(what.to_owned()));
            }
            *loaded = Some(Pyramid::new(full));
        }
        let pyramid = loaded.as_ref().ok_or(PictureFault::NoSuchTile)?;
        let Pixels { width, height, rgba } = pyramid.cut(id.level, left, top, width, height);
        Ok(Some(TileImage { width, height, rgba, corners }))
    }

    fn tile_bytes(&self) -> usize {
        (CUT_SIDE.min(self.width) * CUT_SIDE.min(self.height)) as usize * 4
    }

    fn whole(&self) -> Option<&WholePicture> {
        Some(self)
    }
}

/// Opens a PNG or JPEG that has a world file next to it, and states in which reference that is.
pub(crate) fn open_with_world_file(
    path: &Path,
    format: PixelFormat,
) -> Result<(WholePicture, MapReference), OpenError> {
    let file = path.display().to_string();
    let kind = if format == PixelFormat::Png { "png" } else { "jpg" };
    let extensions = world_file::extensions_for(kind);
    let world = world_file::find_next_to(path, extensions).ok_or_else(|| {
        let usual = path.with_extension(extensions[0]).display().to_string();
        OpenError::new(&file, "", OpenFault::NoWorldFile(usual))
    })?;
    let world_name = world.display().to_string();
    let text = read_sidecar(&world)?;
    let placement = world_file::parse_world_file(&text).map_err(|(line, fault)| {
        let place = if line == 0 { String::new() } else { format!("line {line}") };
        OpenError::new(&world_name, place, fault)
    })?;
    let reference = match world_file::find_next_to(path, &["prj", "PRJ"]) {
        None => MapReference::Local,
        Some(projection) => find_reference(&read_sidecar(&projection)?).map_err(|what| {
            OpenError::new(&projection.display().to_string(), "", OpenFault::Reference(what))
        })?,
    };
    let fault = |fault: PictureFault| OpenError::new(&file, "", fault.into());
    let size = read_size(path, format).map_err(fault)?;
    let picture = path.to_path_buf();
    let load = Box::new(move || load_picture(&picture, format));
    Ok((WholePicture::new(size, placement, load).map_err(fault)?, reference))
}

/// The text of a small file next to a picture.
pub(crate) fn read_sidecar(path: &Path) -> Result<String, OpenError> {
    let file = path.display().to_string();
    let error = |fault| OpenError::new(&file, "", fault);
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|opened| opened.take(MAX_SIDECAR_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|e| error(OpenFault::Unreadable(e.to_string())))?;
    if bytes.len() as u64 > MAX_SIDECAR_BYTES {
        let remedy = "it has a few lines; replace it by the right file";
        return Err(error(OpenFault::TooLarge { most: MAX_SIDECAR_BYTES, remedy }));
    }
    String::from_utf8(bytes).map_err(|_| error(OpenFault::Damaged("it is not text".to_owned())))
}

fn unreadable(error: &std::io::Error) -> PictureFault {
    PictureFault::Unreadable(error.to_string())
}

/// The bytes of a picture, of at most [`MAX_PICTURE_BYTES`].
pub(crate) fn read_picture_bytes(path: &Path) -> Result<Vec<u8>, PictureFault> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|opened| opened.take(MAX_PICTURE_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|e| unreadable(&e))?;
    if bytes.len() as u64 > MAX_PICTURE_BYTES { Err(PictureFault::TooLarge) } else { Ok(bytes) }
}

/// The size of a picture, without its pixels.
pub(crate) fn read_size(path: &Path, format: PixelFormat) -> Result<(u32, u32), PictureFault> {
    match format {
        PixelFormat::Png => {
            pixels::read_png_size(BufReader::new(File::open(path).map_err(|e| unreadable(&e))?))
        }
        PixelFormat::Jpeg => {
            let frame = pixels::read_jpeg_frame(&read_picture_bytes(path)?)?;
            pixels::check_jpeg(frame, MAX_PICTURE_PIXELS)?;
            Ok((frame.width, frame.height))
        }
    }
}

/// Decodes a picture that is held whole.
pub(crate) fn load_picture(path: &Path, format: PixelFormat) -> Result<Pixels, PictureFault> {
    match format {
        PixelFormat::Png => {
            let file = File::open(path).map_err(|e| unreadable(&e))?;
            pixels::decode_png(BufReader::new(file), MAX_PICTURE_PIXELS)
        }
        PixelFormat::Jpeg => pixels::decode_bytes(&read_picture_bytes(path)?, MAX_PICTURE_PIXELS),
    }
}
