//! An RGB image in memory with the few shapes that maps and plots need. Positions are in pixels
//! from the top left corner; what lies outside the image is not drawn.

use font8x8::legacy::BASIC_LEGACY;

/// Red, green, blue.
pub type RgbColour = [u8; 3];

/// Letters are drawn this many times the size of the font, which is 8 pixels.
const LETTER_SCALE: i32 = 2;
/// Width and height of a letter, in pixels.
pub const LETTER: i32 = 8 * LETTER_SCALE;

/// An RGB image of `width` × `height` pixels.
#[derive(Debug)]
pub struct RgbCanvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl RgbCanvas {
    /// Makes an image of one colour.
    pub fn new(width: usize, height: usize, background: RgbColour) -> Self {
        Self { width, height, rgb: background.repeat(width * height) }
    }

    /// Sets the colour of a pixel.
    pub fn set_pixel(&mut self, x: i32, y: i32, colour: RgbColour) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
        if x < self.width && y < self.height {
            let at = (y * self.width + x) * 3;
            self.rgb[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Fills a rectangle from its top left corner.
    pub fn fill_rectangle(&mut self, x: i32, y: i32, width: i32, height: i32, colour: RgbColour) {
        for row in y..y + height {
            for column in x..x + width {
                self.set_pixel(column, row, colour);
            }
        }
    }

    /// Fills a circle.
    pub fn fill_disc(&mut self, x: i32, y: i32, radius: i32, colour: RgbColour) {
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                if dx * dx + dy * dy <= radius * radius + radius / 2 {
                    self.set_pixel(x + dx, y + dy, colour);
                }
            }
        }
    }

    /// Draws a line with a round pen.
    pub fn draw_line(&mut self, from: (f64, f64), to: (f64, f64), pen: i32, colour: RgbColour) {
        let length = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0);
        for step in 0..=length as u32 {
            let along = f64::from(step) / length;
            let x = from.0 + (to.0 - from.0) * along;
            let y = from.1 + (to.1 - from.1) * along;
            self.fill_disc(x.round() as i32, y.round() as i32, pen, colour);
        }
    }

    /// Writes ASCII text from its top left corner.
    pub fn draw_text(&mut self, x: i32, y: i32, text: &str, colour: RgbColour) {
        for (position, letter) in (0_i32..).zip(text.bytes()) {
            let Some(glyph) = BASIC_LEGACY.get(usize::from(letter)) else { continue };
            for (row, bits) in (0_i32..).zip(glyph) {
                for column in (0..8).filter(|column| bits >> column & 1 == 1) {
                    let left = x + position * LETTER + column * LETTER_SCALE;
                    let top = y + row * LETTER_SCALE;
                    self.fill_rectangle(left, top, LETTER_SCALE, LETTER_SCALE, colour);
                }
            }
        }
    }

    /// Returns the image as a PNG file.
    ///
    /// # Errors
    /// If the image has no pixels.
    pub fn encode_png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        encoder.write_header()?.write_image_data(&self.rgb)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws on a small canvas and compares it with a drawing: `#` where it is not white.
    fn check(draw: impl Fn(&mut RgbCanvas), expected: &[&str]) {
        let mut canvas = RgbCanvas::new(expected[0].len(), expected.len(), [255; 3]);
        draw(&mut canvas);
        let row = |pixels: &[u8]| -> String {
            pixels.chunks(3).map(|p| if p == [255; 3] { '.' } else { '#' }).collect()
        };
        let drawn: Vec<String> = canvas.rgb.chunks(canvas.width * 3).map(row).collect();
        assert_eq!(drawn, expected);
    }

    #[test]
    fn shapes_end_at_the_edge() {
        check(|c| c.fill_rectangle(-1, 1, 3, 9, [0; 3]), &["....", "##..", "##.."]);
    }

    #[test]
    fn a_line_reaches_both_ends() {
        check(|c| c.draw_line((0.0, 2.0), (3.0, 0.0), 0, [0; 3]), &["...#", ".##.", "#..."]);
    }

    #[test]
    fn a_disc_is_round() {
        check(|c| c.fill_disc(2, 2, 2, [0; 3]), &[".###.", "#####", "#####", "#####", ".###."]);
    }

    #[test]
    fn letters_are_upright_and_twice_the_size_of_the_font() {
        let mut canvas = RgbCanvas::new(16, 16, [255; 3]);
        canvas.draw_text(0, 0, "L", [0; 3]);
        let dark = |row: usize| {
            canvas.rgb[row * 48..(row + 1) * 48].chunks(3).filter(|p| *p == [0; 3]).count()
        };
        assert!(dark(12) > dark(4), "an L is wider at its foot");
    }
}
