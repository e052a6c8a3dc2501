//! Grid maps of `map_server` as pictures: the YAML file places them.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use armor_map_file::{MapDescription, MapFileError, read_grey_picture};

use crate::error::{OpenError, OpenFault, PictureFault};
use crate::picture::{self, WholePicture};
use crate::pixel_placement::PixelPlacement;
use crate::pixels::{PixelFormat, Pixels};
use crate::reference::PlanePoint;

fn map_error(error: MapFileError) -> OpenError {
    let place = if error.line == 0 { String::new() } else { format!("line {}", error.line) };
    OpenError { file: error.file, place, fault: OpenFault::Map(error.fault.to_string()) }
}

/// Opens the map of a YAML file. Its picture is a PGM, or a PNG.
pub(crate) fn open_map(path: &Path) -> Result<WholePicture, OpenError> {
    let (description, picture_path) = MapDescription::read(path).map_err(map_error)?;
    let picture_file = picture_path.display().to_string();
    let mut head = Vec::new();
    File::open(&picture_path)
        .and_then(|opened| opened.take(16).read_to_end(&mut head))
        .map_err(|e| OpenError::new(&picture_file, "", OpenFault::Unreadable(e.to_string())))?;
    let is_negated = description.is_negated;
    let fault = |fault: PictureFault| OpenError::new(&picture_file, "", fault.into());
    if PixelFormat::of(&head) == Ok(PixelFormat::Png) {
        let size = picture::read_size(&picture_path, PixelFormat::Png).map_err(fault)?;
        let placement = place(&description, size.1);
        let placement = placement
            .ok_or_else(|| OpenError::new(&path.display().to_string(), "", OpenFault::Placement))?;
        let load = Box::new(move || {
            let mut pixels = picture::load_picture(&picture_path, PixelFormat::Png)?;
            if is_negated {
                pixels.rgba.as_chunks_mut::<4>().0.iter_mut().for_each(invert_color);
            }
            Ok(pixels)
        });
        return WholePicture::new(size, placement, load).map_err(fault);
    }
    // A PGM has at most 16 million pixels, and is read to learn its size.
    let grey = read_grey_picture(&picture_path).map_err(map_error)?;
    let size = (grey.width as u32, grey.height as u32);
    let placement = place(&description, size.1)
        .ok_or_else(|| OpenError::new(&path.display().to_string(), "", OpenFault::Placement))?;
    let load = Box::new(move || load_grey(&picture_path, is_negated));
    WholePicture::new(size, placement, load).map_err(fault)
}

/// The origin is the lower left corner, and its yaw turns the picture about it.
fn place(description: &MapDescription, rows: u32) -> Option<PixelPlacement> {
    let side = description.resolution_m;
    let (sin, cos) = description.origin.yaw_rad.sin_cos();
    let (column, down) =
        (PlanePoint::new(side * cos, side * sin), PlanePoint::new(side * sin, -side * cos));
    let rows = f64::from(rows);
    let origin = PlanePoint::new(
        description.origin.x_m - rows * down.x,
        description.origin.y_m - rows * down.y,
    );
    PixelPlacement::new(origin, column, down)
}

fn invert_color(pixel: &mut [u8; 4]) {
    pixel[..3].iter_mut().for_each(|value| *value = 255 - *value);
}

fn load_grey(path: &Path, is_negated: bool) -> Result<Pixels, PictureFault> {
    let grey =
        read_grey_picture(path).map_err(|e| PictureFault::Unreadable(e.fault.to_string()))?;
    let white = u32::from(grey.white.max(1));
    let rgba = grey
        .pixels
        .iter()
        .flat_map(|&pixel| {
            let bright = (u32::from(pixel) * 255 / white) as u8;
            let value = if is_negated { 255 - bright } else { bright };
            [value, value, value, 255]
        })
        .collect();
    Ok(Pixels { width: grey.width as u32, height: grey.height as u32, rgba })
}
