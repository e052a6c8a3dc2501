//! Pixels → the bytes of a PNG file.

use egui::Color32;

use crate::pixels::Pixels;

/// An image is empty, or too large for the format.
#[derive(Debug, thiserror::Error)]
#[error("a picture of {width} x {height} pixels cannot be written: {reason}")]
pub struct PixelsPngError {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The reason.
    pub reason: String,
}

impl Pixels {
    /// Returns the image as a PNG file, without an alpha channel if it is opaque.
    ///
    /// # Errors
    /// If it is empty, or too large for the format.
    pub fn png(&self) -> Result<Vec<u8>, PixelsPngError> {
        let (width, height) = (self.width, self.height);
        encode_pixels(self).map_err(|reason| PixelsPngError { width, height, reason })
    }
}

fn encode_pixels(pixels: &Pixels) -> Result<Vec<u8>, String> {
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
        let bytes = pixels.png().expect("encoded");
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
        let mut read = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut read).expect("a frame");
        let expected: Vec<u8> = pixels.colours.iter().flat_map(|c| [c.r(), c.g(), c.b()]).collect();
        assert_eq!(read, expected);
    }

    #[test]
    fn an_empty_picture_is_refused() {
        assert!(Pixels::filled(0, 5, Color32::BLACK).png().is_err());
    }
}
