//! JPEG files, written and read.

use jpeg_encoder::{ColorType, Encoder};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::picture::{Picture, PictureError, PixelLayout, check_sides};

/// How every JPEG file begins and ends.
const BEGIN: [u8; 3] = [0xff, 0xd8, 0xff];
const END: [u8; 2] = [0xff, 0xd9];

/// Compresses a picture. `quality` is 1 to 100, as cameras and `cjpeg` count it; below 90 the
/// colours are stored at half the resolution.
pub(crate) fn encode(picture: &Picture<'_>, quality: u8) -> Result<Vec<u8>, PictureError> {
    let colours = match picture.layout() {
        PixelLayout::Rgb => ColorType::Rgb,
        PixelLayout::Bgr => ColorType::Bgr,
        PixelLayout::Mono => ColorType::Luma,
    };
    let mut file = Vec::with_capacity(picture.pixels().len() / 8);
    let encoder = Encoder::new(&mut file, quality);
    encoder.encode(picture.pixels(), picture.width(), picture.height(), colours)?;
    Ok(file)
}

/// Returns whether a file begins as a JPEG does.
pub(crate) fn is_jpeg(file: &[u8]) -> bool {
    file.starts_with(&BEGIN)
}

/// The width and height of a file, which is looked at but not decoded.
pub(crate) fn size(file: &[u8]) -> Result<(u16, u16), PictureError> {
    // Some cameras fill up what they write; the end is near the end.
    if !file.windows(END.len()).rev().any(|bytes| bytes == END) {
        return Err(PictureError::Unfinished);
    }
    let mut decoder = JpegDecoder::new(ZCursor::new(file));
    decoder.decode_headers().map_err(describe_failure)?;
    let info = decoder.info().ok_or(PictureError::Unknown)?;
    Ok((info.width, info.height))
}

/// Reads a file.
pub(crate) fn decode(file: &[u8]) -> Result<Picture<'static>, PictureError> {
    let mut decoder = JpegDecoder::new(ZCursor::new(file));
    decoder.decode_headers().map_err(describe_failure)?;
    let (space, layout) = match decoder.input_colorspace() {
        Some(ColorSpace::Luma) => (ColorSpace::Luma, PixelLayout::Mono),
        _ => (ColorSpace::RGB, PixelLayout::Rgb),
    };
    decoder.set_options(DecoderOptions::default().jpeg_set_out_colorspace(space));
    let info = decoder.info().ok_or(PictureError::Unknown)?;
    let (width, height) = (info.width.into(), info.height.into());
    // Before there is memory for it: a header is quickly written.
    check_sides(width, height)?;
    Picture::new(width, height, layout, decoder.decode().map_err(describe_failure)?)
}

fn describe_failure(error: zune_jpeg::errors::DecodeErrors) -> PictureError {
    PictureError::Jpeg(error.to_string())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A picture of smooth colours.
    pub(crate) fn gradient(width: u16, height: u16, layout: PixelLayout) -> Picture<'static> {
        let pixel = |x: u16, y: u16| {
            let rgb = [x * 3 % 200, y * 5 % 200, (x + y) % 200].map(|value| value as u8);
            match layout {
                PixelLayout::Rgb => rgb.to_vec(),
                PixelLayout::Bgr => rgb.into_iter().rev().collect(),
                PixelLayout::Mono => vec![rgb[0]],
            }
        };
        let pixels: Vec<u8> =
            (0..height).flat_map(|y| (0..width).flat_map(move |x| pixel(x, y))).collect();
        Picture::new(width.into(), height.into(), layout, pixels).expect("a picture")
    }

    /// The largest difference between two pictures, in steps of 255.
    fn difference(one: &Picture<'_>, other: &Picture<'_>) -> u8 {
        assert_eq!((one.width(), one.height()), (other.width(), other.height()));
        let pairs = one.pixels().iter().zip(other.pixels());
        pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
    }

    #[test]
    fn what_is_written_is_read_again() {
        for layout in [PixelLayout::Rgb, PixelLayout::Bgr, PixelLayout::Mono] {
            let file = encode(&gradient(60, 39, layout), 95).expect("a file");
            assert!(is_jpeg(&file));
            assert_eq!(size(&file).expect("a JPEG"), (60, 39));
            let read = decode(&file).expect("a JPEG");
            // What was blue, green, red is read as red, green, blue.
            let wanted =
                if layout == PixelLayout::Mono { PixelLayout::Mono } else { PixelLayout::Rgb };
            let difference = difference(&read, &gradient(60, 39, wanted));
            assert!(read.layout() == wanted && difference < 12, "{layout:?}: {difference}");
        }
    }

    #[test]
    fn lower_quality_takes_fewer_bytes() {
        let len =
            |quality| encode(&gradient(64, 48, PixelLayout::Rgb), quality).expect("a file").len();
        assert!(len(10) < len(80) && len(80) < len(100));
    }

    #[test]
    fn no_byte_too_few_or_changed_is_a_panic() {
        let file = encode(&gradient(24, 16, PixelLayout::Rgb), 80).expect("a file");
        for end in 0..file.len() {
            assert!(size(&file[..end]).is_err(), "{end} of {} bytes", file.len());
            let _ = decode(&file[..end]);
        }
        for at in 0..file.len() {
            for bit in 0..8 {
                let mut file = file.clone();
                file[at] ^= 1 << bit;
                let _ = (size(&file), decode(&file));
            }
        }
    }
}
