//! Files of what the window shows: the drawing or the window as a picture, made without a display
//! (`armor-picture`).

mod drawing;
mod saving;

pub use armor_picture::Stage;
pub use drawing::{ExportError, export, export_shown};
pub use saving::{PngError, save_png};

/// What a picture is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Lines and text.
    Svg,
    /// Pixels.
    Png,
}

impl Format {
    /// As the ending of the file's name states.
    pub fn of(path: &std::path::Path) -> Option<Self> {
        let ending = path.extension()?;
        match () {
            () if ending.eq_ignore_ascii_case("svg") => Some(Self::Svg),
            () if ending.eq_ignore_ascii_case("png") => Some(Self::Png),
            () => None,
        }
    }
}
