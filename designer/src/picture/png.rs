//! Pixels → a PNG file.

use std::path::Path;

use eframe::egui::Color32;

use super::pixels::Pixels;

/// Why a picture was not saved.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// It is empty, or too large for the format.
    #[error("a picture of {width} x {height} pixels cannot be written: {reason}")]
    Encoding {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Why.
        reason: String,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Save(#[from] armor_missions::SaveError),
}

/// Saves a picture as the file at `path`, whole or not at all.
///
/// # Errors
/// If it cannot be encoded, or the file cannot be written.
pub fn save_png(pixels: &Pixels, path: &Path) -> Result<(), PngError> {
    let bytes = encode(pixels).map_err(|reason| PngError::Encoding {
        width: pixels.width,
        height: pixels.height,
        reason,
    })?;
    Ok(armor_missions::save(path, &bytes)?)
}

/// Without an alpha channel if nothing shines through.
fn encode(pixels: &Pixels) -> Result<Vec<u8>, String> {
    let (width, height) = (u32::try_from(pixels.width), u32::try_from(pixels.height));
    let (Ok(width), Ok(height)) = (width, height) else { return Err("it is too large".into()) };
    let is_opaque = pixels.colours.iter().all(Color32::is_opaque);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(if is_opaque { png::ColorType::Rgb } else { png::ColorType::Rgba });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let samples: Vec<u8> = if is_opaque {
        pixels.colours.iter().flat_map(|colour| [colour.r(), colour.g(), colour.b()]).collect()
    } else {
        pixels.colours.iter().flat_map(Color32::to_srgba_unmultiplied).collect()
    };
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(&samples)?;
        writer.finish()
    });
    written.map_err(|error| error.to_string())?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_read_back_as_it_was() {
        let mut pixels = Pixels::filled(3, 2, Color32::from_rgb(1, 2, 3));
        pixels.colours[4] = Color32::from_rgb(250, 0, 9);
        let bytes = encode(&pixels).expect("encoded");
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
        let mut read = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut read).expect("a frame");
        let expected: Vec<u8> = pixels.colours.iter().flat_map(|c| [c.r(), c.g(), c.b()]).collect();
        assert_eq!(read, expected);
    }

    #[test]
    fn an_empty_picture_is_refused() {
        assert!(encode(&Pixels::filled(0, 5, Color32::BLACK)).is_err());
    }
}
