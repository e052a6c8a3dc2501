//! Pixels → a PNG file on the disk.

use std::path::Path;

use armor_picture::{Pixels, PixelsPngError};

/// Why a picture was not saved.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// It is empty, or too large for the format.
    #[error(transparent)]
    Encode(#[from] PixelsPngError),
    /// The file cannot be written.
    #[error(transparent)]
    Save(#[from] armor_files::SaveError),
}

/// Saves a picture as the file at `path`, whole or not at all.
///
/// # Errors
/// If it cannot be encoded, or the file cannot be written.
pub fn save_png(pixels: &Pixels, path: &Path) -> Result<(), PngError> {
    Ok(armor_files::save_atomically(path, &pixels.png()?)?)
}
