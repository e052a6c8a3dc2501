//! Pictures made smaller: each new pixel is the mean of the old ones that it covers.

use crate::picture::{Picture, PictureError};

/// The most columns and rows that a picture may have; 0: any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SizeLimits {
    /// Most columns.
    pub width: u16,
    /// Most rows.
    pub height: u16,
}

impl SizeLimits {
    /// The size within the limits that keeps the proportions; nothing grows.
    pub(crate) fn fit_size(self, (width, height): (u16, u16)) -> (u16, u16) {
        let share = |most: u16, of: u16| match most {
            0 => 1.0,
            most => f64::from(most) / f64::from(of.max(1)),
        };
        let scale = share(self.width, width).min(share(self.height, height));
        if scale >= 1.0 {
            return (width, height);
        }
        let side = |of: u16| (f64::from(of) * scale).round().max(1.0) as u16;
        (side(width), side(height))
    }
}

/// Returns the picture within the limits: itself, if it is.
pub(crate) fn shrink_picture(
    picture: Picture<'_>,
    limits: SizeLimits,
) -> Result<Picture<'_>, PictureError> {
    let (width, height) = limits.fit_size((picture.width(), picture.height()));
    if (width, height) == (picture.width(), picture.height()) {
        return Ok(picture);
    }
    let (columns, rows) =
        (split_into_spans(picture.width(), width), split_into_spans(picture.height(), height));
    let layout = picture.layout();
    let row_len = usize::from(picture.width()) * layout.pixel_len();
    let mut pixels = Vec::with_capacity(columns.len() * rows.len() * layout.pixel_len());
    for &(top, bottom) in &rows {
        let rows = &picture.pixels()[top * row_len..bottom * row_len];
        for &(left, right) in &columns {
            let count = ((right - left) * (bottom - top)) as u32;
            for part in 0..layout.pixel_len() {
                let of_row = |row: &[u8]| {
                    let covered = &row[left * layout.pixel_len()..right * layout.pixel_len()];
                    covered
                        .iter()
                        .skip(part)
                        .step_by(layout.pixel_len())
                        .map(|&v| u32::from(v))
                        .sum::<u32>()
                };
                let sum: u32 = rows.chunks_exact(row_len).map(of_row).sum();
                pixels.push(((sum + count / 2) / count) as u8);
            }
        }
    }
    Picture::new(width.into(), height.into(), layout, pixels)
}

/// Which of `from` old pixels each of `to` new ones covers, also in part: first, and one past the
/// last.
fn split_into_spans(from: u16, to: u16) -> Vec<(usize, usize)> {
    let (from, to) = (usize::from(from), usize::from(to));
    (0..to).map(|at| (at * from / to, ((at + 1) * from).div_ceil(to))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::PixelLayout;

    #[test]
    fn a_picture_keeps_its_proportions_and_never_grows() {
        let fit = |width, height, size| SizeLimits { width, height }.fit_size(size);
        assert_eq!(fit(0, 0, (640, 480)), (640, 480));
        assert_eq!(fit(320, 0, (640, 480)), (320, 240));
        assert_eq!(fit(0, 120, (640, 480)), (160, 120));
        assert_eq!(fit(320, 120, (640, 480)), (160, 120));
        assert_eq!(fit(1000, 1000, (640, 480)), (640, 480));
        assert_eq!(fit(1, 0, (60_000, 2)), (1, 1));
    }

    #[test]
    fn a_new_pixel_is_the_mean_of_those_that_it_covers() {
        let grey = Picture::new(4, 2, PixelLayout::Mono, vec![0, 10, 100, 100, 20, 30, 100, 101])
            .expect("a picture");
        let small = shrink_picture(grey, SizeLimits { width: 2, height: 0 }).expect("a picture");
        assert_eq!((small.width(), small.height(), small.pixels()), (2, 1, &[15, 100][..]));
    }

    #[test]
    fn colours_do_not_mix_and_odd_sizes_cover_everything() {
        let rgb = [[90, 0, 3], [0, 90, 3], [90, 0, 3]].concat();
        let colour = Picture::new(3, 1, PixelLayout::Rgb, rgb).expect("a picture");
        let small = shrink_picture(colour, SizeLimits { width: 2, height: 0 }).expect("a picture");
        assert_eq!(small.pixels(), [45, 45, 3, 45, 45, 3]);
        assert_eq!(split_into_spans(5, 3), [(0, 2), (1, 4), (3, 5)]);
    }
}
