//! A compressed image → pixels. Any bytes give an image or an error.

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Widest and highest image shown, in pixels.
const MAX_SIDE: usize = 4096;

/// Why an image is not shown.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PhotoError {
    /// The bytes do not fit the format.
    #[error("the image is no {format}: {reason}")]
    Broken {
        /// The expected format.
        format: &'static str,
        /// The reason.
        reason: String,
    },
    /// An unknown format.
    #[error("images are shown as jpeg or png, not as `{0}`")]
    Format(String),
}

/// An image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Photo {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Red, green, blue of each pixel, row by row.
    pub rgb: Vec<u8>,
}

/// Reads an image of a format, `jpeg` or `png`.
///
/// # Errors
/// If the format is another one, or the bytes are not of it.
pub fn decode_photo(format: &str, bytes: &[u8]) -> Result<Photo, PhotoError> {
    let name: String = format.chars().take(40).collect();
    match name.to_ascii_lowercase().as_str() {
        "jpeg" | "jpg" => {
            decode_jpeg(bytes).map_err(|reason| PhotoError::Broken { format: "JPEG", reason })
        }
        "png" => decode_png(bytes).map_err(|reason| PhotoError::Broken { format: "PNG", reason }),
        _ => Err(PhotoError::Format(name)),
    }
}

fn decode_jpeg(bytes: &[u8]) -> Result<Photo, String> {
    let options = DecoderOptions::new_safe()
        .set_max_width(MAX_SIDE)
        .set_max_height(MAX_SIDE)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let rgb = decoder.decode().map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    check_size([width, height], rgb)
}

fn decode_png(bytes: &[u8]) -> Result<Photo, String> {
    let mut decoder = ::png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(::png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let size = [reader.info().width as usize, reader.info().height as usize];
    if size.iter().any(|side| *side > MAX_SIDE) {
        return Err(format!("{} × {} pixels are too many", size[0], size[1]));
    }
    let mut samples = vec![0; reader.output_buffer_size().ok_or("it is too large")?];
    let frame = reader.next_frame(&mut samples).map_err(|error| error.to_string())?;
    samples.truncate(frame.buffer_size());
    let rgb = match frame.color_type.samples() {
        1 => samples.iter().flat_map(|grey| [*grey; 3]).collect(),
        2 => samples.chunks_exact(2).flat_map(|pixel| [pixel[0]; 3]).collect(),
        3 => samples,
        _ => samples.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect(),
    };
    check_size(size, rgb)
}

fn check_size(size: [usize; 2], rgb: Vec<u8>) -> Result<Photo, String> {
    let is_whole = rgb.len() == size[0] * size[1] * 3 && !rgb.is_empty();
    if is_whole { Ok(Photo { size, rgb }) } else { Err("it is not whole".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jpeg_of(width: u16, height: u16) -> Vec<u8> {
        let mut bytes = Vec::new();
        let rgb = [200, 30, 30].repeat(usize::from(width) * usize::from(height));
        let encoder = jpeg_encoder::Encoder::new(&mut bytes, 90);
        encoder.encode(&rgb, width, height, jpeg_encoder::ColorType::Rgb).unwrap();
        bytes
    }

    fn png_of(colour: ::png::ColorType, samples: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(colour);
        encoder.write_header().unwrap().write_image_data(samples).unwrap();
        bytes
    }

    #[test]
    fn jpegs_and_pngs_are_read() {
        let photo = decode_photo("jpeg", &jpeg_of(16, 8)).unwrap();
        assert_eq!(photo.size, [16, 8]);
        assert!(photo.rgb[0] > 180 && photo.rgb[1] < 60, "{:?}", &photo.rgb[..3]);
        let grey = decode_photo("PNG", &png_of(::png::ColorType::Grayscale, &[7, 9])).unwrap();
        assert_eq!(grey, Photo { size: [2, 1], rgb: vec![7, 7, 7, 9, 9, 9] });
        let clear = decode_photo("png", &png_of(::png::ColorType::Rgba, &[1, 2, 3, 0, 4, 5, 6, 9]));
        assert_eq!(clear.unwrap().rgb, [1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn other_bytes_are_an_error_with_the_reason() {
        let whole = jpeg_of(64, 64);
        let (empty, text): (&[u8], &[u8]) = (&[], b"no image");
        for bytes in [empty, text, &whole[2..]] {
            let error = decode_photo("jpeg", bytes).unwrap_err().to_string();
            assert!(error.starts_with("the image is no JPEG: "), "{error}");
        }
        assert!(matches!(
            decode_photo("png", &whole),
            Err(PhotoError::Broken { format: "PNG", .. })
        ));
        assert_eq!(decode_photo("h264", &whole), Err(PhotoError::Format("h264".into())));
    }

    #[test]
    fn no_cut_or_bent_image_is_a_panic() {
        let whole = jpeg_of(48, 40);
        for end in 0..whole.len() {
            let _ = decode_photo("jpeg", &whole[..end]);
            let mut bent = whole.clone();
            bent[end] ^= 0x5a;
            let _ = decode_photo("jpeg", &bent);
        }
    }
}
