//! A picture in memory: what comes in, and what is compressed.

use std::borrow::Cow;

/// Most pixels of a picture: 64 million, larger than any robot's camera takes.
const MAX_PIXELS: usize = 64 << 20;

/// What the bytes of a pixel are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelLayout {
    /// Red, green, blue.
    Rgb,
    /// Blue, green, red.
    Bgr,
    /// Grey.
    Mono,
}

impl PixelLayout {
    /// The layout that ROS calls by a name; `None` if JPEG has no place for it.
    fn of_encoding(encoding: &str) -> Option<Self> {
        match encoding {
            "rgb8" => Some(Self::Rgb),
            "bgr8" => Some(Self::Bgr),
            "mono8" => Some(Self::Mono),
            _ => None,
        }
    }

    /// Bytes of a pixel.
    pub fn pixel_len(self) -> usize {
        match self {
            Self::Rgb | Self::Bgr => 3,
            Self::Mono => 1,
        }
    }
}

/// Why something is no picture.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The pixels of a link are of a kind that JPEG does not hold.
    #[error("pictures of encoding `{0}` are not compressed here; give rgb8, bgr8 or mono8")]
    Encoding(String),
    /// It has no pixels, or too many.
    #[error("a picture of {0}x{1}; it must have 1 to 65535 columns and rows, and 64 Mi pixels")]
    Size(usize, usize),
    /// There are fewer bytes than pixels.
    #[error("{given} bytes for a picture that takes {wanted}")]
    Short {
        /// Bytes in the buffer.
        given: usize,
        /// Bytes that it takes.
        wanted: usize,
    },
    /// It ends before its end, as a file does that is still being written.
    #[error("it ends in the middle of the picture")]
    Unfinished,
    /// Not a file that is known here.
    #[error("neither a JPEG nor a PNG")]
    Unknown,
    /// A JPEG that cannot be read.
    #[error("not a JPEG that can be read: {0}")]
    Jpeg(String),
    /// A PNG that cannot be read.
    #[error("not a PNG that can be read: {0}")]
    Png(#[from] png::DecodingError),
    /// The picture could not be compressed.
    #[error("cannot be compressed: {0}")]
    Compress(#[from] jpeg_encoder::EncodingError),
}

/// Rows of pixels, the top one first, without gaps between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture<'a> {
    width: u16,
    height: u16,
    layout: PixelLayout,
    pixels: Cow<'a, [u8]>,
}

impl<'a> Picture<'a> {
    /// A picture of `width` x `height` pixels.
    ///
    /// # Errors
    /// If it has no pixels or too many, or if there are fewer bytes than that.
    pub fn new(
        width: usize,
        height: usize,
        layout: PixelLayout,
        pixels: impl Into<Cow<'a, [u8]>>,
    ) -> Result<Self, PictureError> {
        let (columns, rows) = check_sides(width, height)?;
        let (pixels, wanted) = (pixels.into(), width * height * layout.pixel_len());
        if pixels.len() < wanted {
            return Err(PictureError::Short { given: pixels.len(), wanted });
        }
        Ok(Self { width: columns, height: rows, layout, pixels })
    }

    /// A picture as a link brings it: rows of `step` bytes, whose pixels are of ROS's `encoding`.
    /// Copies nothing if there are no gaps between the rows.
    ///
    /// # Errors
    /// If the encoding is none of rgb8, bgr8 and mono8, and as [`Picture::new`].
    pub fn of_rows(
        encoding: &str,
        width: usize,
        height: usize,
        step: usize,
        data: &'a [u8],
    ) -> Result<Self, PictureError> {
        let layout = PixelLayout::of_encoding(encoding)
            .ok_or_else(|| PictureError::Encoding(encoding.to_owned()))?;
        check_sides(width, height)?;
        let row = width * layout.pixel_len();
        if step <= row {
            return Self::new(width, height, layout, data);
        }
        // The last row may end with its last pixel.
        let wanted = step.saturating_mul(height - 1).saturating_add(row);
        if data.len() < wanted {
            return Err(PictureError::Short { given: data.len(), wanted });
        }
        let rows: Vec<u8> =
            data.chunks(step).take(height).flat_map(|all| &all[..row]).copied().collect();
        Self::new(width, height, layout, rows)
    }

    /// Columns, from 1.
    pub fn width(&self) -> u16 {
        self.width
    }

    /// Rows, from 1.
    pub fn height(&self) -> u16 {
        self.height
    }

    /// What the bytes of a pixel are.
    pub fn layout(&self) -> PixelLayout {
        self.layout
    }

    /// The bytes of all pixels.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }
}

/// The sides of a picture, if there can be one of that size.
pub(crate) fn check_sides(width: usize, height: usize) -> Result<(u16, u16), PictureError> {
    let wrong = || PictureError::Size(width, height);
    let columns = u16::try_from(width).map_err(|_| wrong())?;
    let rows = u16::try_from(height).map_err(|_| wrong())?;
    let is_fine = (1..=MAX_PIXELS).contains(&(width * height));
    is_fine.then_some((columns, rows)).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_without_gaps_are_not_copied() {
        let data = [1, 2, 3, 4, 5, 6];
        let picture = Picture::of_rows("rgb8", 2, 1, 6, &data).expect("a picture");
        assert!(matches!(picture.pixels, Cow::Borrowed(_)));
        assert_eq!((picture.width(), picture.height()), (2, 1));
    }

    #[test]
    fn gaps_between_rows_are_left_out() {
        let data = [1, 2, 0, 0, 3, 4];
        let picture = Picture::of_rows("mono8", 2, 2, 4, &data).expect("a picture");
        assert_eq!(picture.pixels(), [1, 2, 3, 4]);
    }

    /// Checks that a picture is refused, with a reason.
    fn check(encoding: &str, (width, height, step): (usize, usize, usize), len: usize, word: &str) {
        let data = vec![0; len];
        let error = Picture::of_rows(encoding, width, height, step, &data).expect_err(word);
        assert!(error.to_string().contains(word), "{error}");
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        check("mono16", (2, 2, 4), 8, "`mono16`");
        check("rgb8", (2, 2, 6), 11, "11 bytes for a picture that takes 12");
        check("rgb8", (2, 2, 9), 14, "14 bytes for a picture that takes 15");
        check("rgb8", (0, 2, 0), 0, "0x2");
        check("rgb8", (2, 0, 6), 0, "2x0");
        check("mono8", (65_536, 1, 65_536), 65_536, "65536x1");
        check("mono8", (65_535, 65_535, usize::MAX), 1, "65535x65535");
        check("mono8", (60_000, 2, usize::MAX), 1, "1 bytes");
    }
}
