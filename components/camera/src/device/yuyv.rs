//! YUYV, what cameras give that do not compress: two pixels in four bytes, which share their
//! colour.

use crate::picture::{Picture, PictureError, PixelLayout, check_sides};

/// Makes a picture of rows of `step` bytes, in which two pixels are brightness, blue, brightness,
/// red: ITU-R BT.601, brightness 16 to 235, as USB cameras give it.
pub(super) fn convert_picture(
    width: usize,
    height: usize,
    step: usize,
    data: &[u8],
) -> Result<Picture<'static>, PictureError> {
    check_sides(width, height)?;
    let row_len = width.div_ceil(2) * 4;
    let step = step.max(row_len);
    let wanted = step * (height - 1) + row_len;
    if data.len() < wanted {
        return Err(PictureError::Short { given: data.len(), wanted });
    }
    let mut pixels = Vec::with_capacity(width * height * 3);
    for row in data.chunks(step).take(height) {
        let end = pixels.len() + width * 3;
        for pair in row[..row_len].chunks_exact(4) {
            pixels.extend(convert_pixel(pair[0], pair[1], pair[3]));
            pixels.extend(convert_pixel(pair[2], pair[1], pair[3]));
        }
        // An odd last pixel has no second one.
        pixels.truncate(end);
    }
    Picture::new(width, height, PixelLayout::Rgb, pixels)
}

/// ITU-R BT.601 in units of 1/256.
fn convert_pixel(brightness: u8, blue: u8, red: u8) -> [u8; 3] {
    let grey = 298 * (i32::from(brightness) - 16) + 128;
    let (blue, red) = (i32::from(blue) - 128, i32::from(red) - 128);
    [grey + 409 * red, grey - 100 * blue - 208 * red, grey + 516 * blue]
        .map(|value| (value >> 8).clamp(0, 255) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours_come_out() {
        // Colour bars of BT.601, at full saturation.
        let check = |(y, u, v), wanted: [u8; 3]| {
            let got = convert_pixel(y, u, v);
            let off = got.iter().zip(&wanted).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(off <= Some(2), "{got:?} for {wanted:?}");
        };
        check((16, 128, 128), [0, 0, 0]);
        check((235, 128, 128), [255, 255, 255]);
        check((81, 90, 240), [255, 0, 0]);
        check((145, 54, 34), [0, 255, 0]);
        check((41, 240, 110), [0, 0, 255]);
        check((0, 0, 0), [0, 135, 0]);
    }

    #[test]
    fn two_pixels_share_a_colour_and_gaps_are_left_out() {
        let row = [235, 128, 16, 128, 235, 128, 99, 128, 7, 7];
        let data = [row, row].concat();
        let picture = convert_picture(3, 2, 10, &data).expect("a picture");
        let row = [[255; 3], [0; 3], [255; 3]].concat();
        assert_eq!(picture.pixels(), [row.clone(), row].concat());
    }

    #[test]
    fn too_few_bytes_are_refused() {
        assert!(convert_picture(2, 2, 4, &[0; 7]).is_err());
        assert!(convert_picture(0, 2, 4, &[0; 8]).is_err());
    }
}
