//! What is done to every picture before it leaves: made smaller, and compressed. What is a JPEG of
//! that size already is not touched.

use crate::jpeg;
use crate::picture::{Picture, PictureError, PixelLayout, check_sides};
use crate::scale::{SizeLimits, shrink_picture};

/// How every PNG file begins.
const PNG: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// How pictures leave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finish {
    /// How large they may be.
    pub limits: SizeLimits,
    /// JPEG's quality, 1 to 100.
    pub quality: u8,
}

impl Finish {
    /// The JPEG file of a picture in memory.
    ///
    /// # Errors
    /// If it cannot be compressed.
    pub fn picture(&self, picture: Picture<'_>) -> Result<Vec<u8>, PictureError> {
        jpeg::encode(&shrink_picture(picture, self.limits)?, self.quality)
    }

    /// The JPEG file of a JPEG or PNG file: itself, if it is a JPEG within the limits.
    ///
    /// # Errors
    /// If it is neither, or is damaged. Of a JPEG that need not be decoded only the headers and the
    /// end are looked at.
    pub fn file(&self, file: Vec<u8>) -> Result<Vec<u8>, PictureError> {
        if jpeg::is_jpeg(&file) {
            let size = jpeg::size(&file)?;
            if self.limits.fit_size(size) == size {
                return Ok(file);
            }
        }
        self.picture(read(&file)?)
    }
}

/// Reads a JPEG or PNG file.
///
/// # Errors
/// If it is neither, is damaged, or is larger than a picture may be.
pub fn read(file: &[u8]) -> Result<Picture<'static>, PictureError> {
    if file.starts_with(&PNG) {
        read_png(file)
    } else if jpeg::is_jpeg(file) {
        jpeg::decode(file)
    } else {
        Err(PictureError::Unknown)
    }
}

/// Reads a PNG of any kind; what shines through is left out.
fn read_png(file: &[u8]) -> Result<Picture<'static>, PictureError> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(file));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info()?;
    let (width, height) = reader.info().size();
    let (width, height) = (width as usize, height as usize);
    // Before there is memory for it: a header may claim any size.
    check_sides(width, height)?;
    let len = reader.output_buffer_size().ok_or(PictureError::Size(width, height))?;
    let mut pixels = vec![0; len];
    let frame = reader.next_frame(&mut pixels)?;
    let (layout, pixel_len) = match frame.color_type {
        png::ColorType::Grayscale => (PixelLayout::Mono, 1),
        png::ColorType::GrayscaleAlpha => (PixelLayout::Mono, 2),
        png::ColorType::Rgba => (PixelLayout::Rgb, 4),
        png::ColorType::Rgb | png::ColorType::Indexed => (PixelLayout::Rgb, 3),
    };
    if pixel_len != layout.pixel_len() {
        let opaque = |pixel: &[u8]| pixel[..layout.pixel_len()].to_vec();
        pixels = pixels.chunks_exact(pixel_len).flat_map(opaque).collect();
    }
    Picture::new(width, height, layout, pixels)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::jpeg::tests::gradient;

    pub(crate) const AS_IT_IS: Finish =
        Finish { limits: SizeLimits { width: 0, height: 0 }, quality: 80 };

    /// A PNG file.
    pub(crate) fn png(
        width: u32,
        height: u32,
        colours: png::ColorType,
        depth: png::BitDepth,
        data: &[u8],
    ) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, width, height);
        encoder.set_color(colours);
        encoder.set_depth(depth);
        if colours == png::ColorType::Indexed {
            encoder.set_palette(vec![200, 100, 50, 0, 0, 0]);
        }
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(data).expect("pixels");
        drop(writer);
        file
    }

    #[test]
    fn a_jpeg_leaves_as_it_came_unless_it_is_too_large() {
        let file = jpeg::encode(&gradient(64, 48, PixelLayout::Rgb), 60).expect("a file");
        assert_eq!(AS_IT_IS.file(file.clone()).expect("a JPEG"), file);
        let small = Finish { limits: SizeLimits { width: 32, height: 0 }, quality: 60 };
        let smaller = small.file(file.clone()).expect("a JPEG");
        assert_eq!(jpeg::size(&smaller).expect("a JPEG"), (32, 24));
        let large = Finish { limits: SizeLimits { width: 64, height: 48 }, quality: 1 };
        assert_eq!(large.file(file.clone()).expect("a JPEG"), file);
    }

    #[test]
    fn pngs_of_every_kind_become_jpegs() {
        use png::{BitDepth, ColorType};
        let check = |colours, depth, data: &[u8], layout, first: &[u8]| {
            let picture = read(&png(2, 1, colours, depth, data)).expect("a PNG");
            assert_eq!((picture.width(), picture.height(), picture.layout()), (2, 1, layout));
            assert_eq!(&picture.pixels()[..layout.pixel_len()], first, "{colours:?}");
            AS_IT_IS.picture(picture).expect("a JPEG");
        };
        check(ColorType::Rgb, BitDepth::Eight, &[1, 2, 3, 4, 5, 6], PixelLayout::Rgb, &[1, 2, 3]);
        check(
            ColorType::Rgba,
            BitDepth::Eight,
            &[1, 2, 3, 0, 5, 6, 7, 8],
            PixelLayout::Rgb,
            &[1, 2, 3],
        );
        check(ColorType::Grayscale, BitDepth::Sixteen, &[7, 0, 9, 0], PixelLayout::Mono, &[7]);
        check(ColorType::GrayscaleAlpha, BitDepth::Eight, &[7, 0, 9, 0], PixelLayout::Mono, &[7]);
        check(ColorType::Indexed, BitDepth::One, &[0b0100_0000], PixelLayout::Rgb, &[200, 100, 50]);
    }

    #[test]
    fn what_is_no_picture_is_an_error() {
        let refusal = |file: &[u8]| AS_IT_IS.file(file.to_vec()).expect_err("refused").to_string();
        assert!(refusal(b"GIF89a").contains("neither a JPEG nor a PNG"));
        assert!(refusal(b"").contains("neither"));
        let file = jpeg::encode(&gradient(64, 48, PixelLayout::Rgb), 60).expect("a file");
        assert!(refusal(&file[..file.len() / 2]).contains("ends in the middle"));
        let file = png(2, 1, png::ColorType::Rgb, png::BitDepth::Eight, &[9; 6]);
        assert!(refusal(&file[..file.len() / 2]).contains("PNG"));
    }
}
