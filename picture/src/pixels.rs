//! An image being painted, and the textures that it is painted with.

use std::collections::HashMap;

use egui::epaint::textures::TexturesDelta;
use egui::{Color32, ColorImage, ImageData, Pos2, TextureId};

/// An image with premultiplied colours, row by row.
pub struct Pixels {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` colours.
    pub colours: Vec<Color32>,
}

impl Pixels {
    /// Makes an image of one colour.
    pub fn filled(width: usize, height: usize, colour: Color32) -> Self {
        Self { width, height, colours: vec![colour; width * height] }
    }

    /// Puts a premultiplied colour over a pixel, as egui's GPU painters do: in gamma space.
    pub(super) fn blend_pixel(&mut self, x: usize, y: usize, colour: Color32) {
        let under = &mut self.colours[y * self.width + x];
        let rest = 255 - u32::from(colour.a());
        if rest == 0 {
            *under = colour;
            return;
        }
        let [r, g, b, a] = under.to_array();
        let over = |under: u8, over: u8| {
            let sum = u32::from(over) + (u32::from(under) * rest + 127) / 255;
            u8::try_from(sum).unwrap_or(u8::MAX)
        };
        *under = Color32::from_rgba_premultiplied(
            over(r, colour.r()),
            over(g, colour.g()),
            over(b, colour.b()),
            over(a, colour.a()),
        );
    }
}

/// The textures that egui has sent so far: its fonts, and images.
#[derive(Default)]
pub struct Textures {
    images: HashMap<TextureId, ColorImage>,
}

impl Textures {
    /// Takes the new and changed textures of a frame.
    pub fn set(&mut self, delta: &TexturesDelta) {
        for (id, changes) in &delta.set {
            for change in changes {
                let ImageData::Color(image) = &change.image;
                match change.pos {
                    None => {
                        self.images.insert(*id, ColorImage::clone(image));
                    }
                    Some(at) => {
                        if let Some(whole) = self.images.get_mut(id) {
                            copy_part(image, whole, at);
                        }
                    }
                }
            }
        }
    }

    /// Drops the textures that no later frame needs.
    pub fn free(&mut self, delta: &TexturesDelta) {
        for id in &delta.free {
            self.images.remove(id);
        }
    }

    pub(super) fn image(&self, id: TextureId) -> Option<&ColorImage> {
        self.images.get(&id).filter(|image| !image.pixels.is_empty())
    }
}

/// Copies the part of an image that lies within the whole.
fn copy_part(part: &ColorImage, whole: &mut ColorImage, [left, top]: [usize; 2]) {
    let ([width, height], [all_width, all_height]) = (part.size, whole.size);
    let width_inside = width.min(all_width.saturating_sub(left));
    for row in 0..height.min(all_height.saturating_sub(top)) {
        let from = &part.pixels[row * width..][..width_inside];
        whole.pixels[(top + row) * all_width + left..][..width_inside].copy_from_slice(from);
    }
}

/// The colour of a texture at `uv`, between the four texels around it.
pub(super) fn sample_texture(image: &ColorImage, uv: Pos2) -> [f32; 4] {
    let [width, height] = image.size;
    let place = |at: f32, size: usize| {
        let at = (at * size as f32 - 0.5).clamp(0.0, (size - 1) as f32);
        let low = at.floor();
        (low as usize, (low as usize + 1).min(size - 1), at - low)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (place(uv.x, width), place(uv.y, height));
    let texel = |x: usize, y: usize| image.pixels[y * width + x].to_array().map(f32::from);
    let (a, b, c, d) = (texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1));
    std::array::from_fn(|n| {
        let (upper, lower) = (a[n] + (b[n] - a[n]) * fx, c[n] + (d[n] - c[n]) * fx);
        upper + (lower - upper) * fy
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_covers_by_its_alpha() {
        let mut pixels = Pixels::filled(2, 1, Color32::WHITE);
        pixels.blend_pixel(0, 0, Color32::from_rgba_premultiplied(100, 0, 0, 128));
        pixels.blend_pixel(1, 0, Color32::BLACK);
        assert_eq!(pixels.colours[0], Color32::from_rgb(227, 127, 127));
        assert_eq!(pixels.colours[1], Color32::BLACK);
    }

    #[test]
    fn a_texture_is_sampled_between_its_texels() {
        let image = ColorImage::new([2, 1], vec![Color32::BLACK, Color32::WHITE]);
        assert_eq!(sample_texture(&image, Pos2::new(0.25, 0.5))[0], 0.0);
        assert_eq!(sample_texture(&image, Pos2::new(0.5, 0.5))[0], 127.5);
        assert_eq!(sample_texture(&image, Pos2::new(2.0, -1.0))[0], 255.0);
    }
}
