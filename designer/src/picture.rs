//! Pictures without a window: what egui would show, as pixels painted by ourselves or as an SVG.
//! No display and no GPU are needed, and the same shapes give the same bytes on every machine.

mod drawing;
mod pixels;
mod png;
mod raster;
mod stage;
pub mod svg;

pub use drawing::{ExportError, export};
pub use pixels::{Pixels, Textures};
pub use png::{PngError, save_png};
pub use raster::paint;
pub use stage::Stage;

/// What a picture is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Lines and text.
    Svg,
    /// Pixels.
    Png,
}

impl Format {
    /// As the ending of the file's name says.
    pub fn of(path: &std::path::Path) -> Option<Self> {
        let ending = path.extension()?;
        match () {
            () if ending.eq_ignore_ascii_case("svg") => Some(Self::Svg),
            () if ending.eq_ignore_ascii_case("png") => Some(Self::Png),
            () => None,
        }
    }
}
