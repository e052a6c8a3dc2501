//! Triangles → pixels. A pixel belongs to a triangle if its centre does; on a shared edge to one of
//! both, so that nothing is painted twice (the top-left rule, in exact arithmetic: corners are
//! rounded to 1/256 of a pixel first, as GPUs do).

use egui::epaint::{ClippedPrimitive, Mesh, Primitive, Vertex, WHITE_UV};
use egui::{Color32, ColorImage, Pos2, Rect};

use super::pixels::{Pixels, Textures, sample_texture};

/// Steps of one pixel.
const STEPS: f32 = 256.0;
/// Farthest corner in pixels that is painted, so that products fit an `i64`.
const FARTHEST: f32 = 4_000_000.0;

/// Paints what egui has tessellated. Callbacks to a GPU are left out; our interfaces use none.
pub fn paint_primitives(
    pixels: &mut Pixels,
    primitives: &[ClippedPrimitive],
    textures: &Textures,
    pixels_per_point: f32,
) {
    for ClippedPrimitive { clip_rect, primitive } in primitives {
        let Primitive::Mesh(mesh) = primitive else { continue };
        let Some(clip) = ClipArea::of(*clip_rect, pixels_per_point, pixels) else { continue };
        let image = textures.image(mesh.texture_id);
        for corners in mesh.indices.chunks_exact(3) {
            if let Some(triangle) = PaintedTriangle::of(mesh, corners, pixels_per_point) {
                triangle.paint_onto(pixels, &clip, image);
            }
        }
    }
}

/// The pixels that may be painted: columns and rows, the last excluded.
struct ClipArea {
    left: i64,
    right: i64,
    top: i64,
    bottom: i64,
}

impl ClipArea {
    fn of(rect: Rect, pixels_per_point: f32, pixels: &Pixels) -> Option<Self> {
        let place =
            |at: f32, most: usize| (at * pixels_per_point).round().clamp(0.0, most as f32) as i64;
        let clip = Self {
            left: place(rect.left(), pixels.width),
            right: place(rect.right(), pixels.width),
            top: place(rect.top(), pixels.height),
            bottom: place(rect.bottom(), pixels.height),
        };
        (clip.left < clip.right && clip.top < clip.bottom).then_some(clip)
    }
}

type Corner = (i64, i64);

struct PaintedTriangle<'a> {
    corners: [Corner; 3],
    vertices: [&'a Vertex; 3],
    /// Twice the area, in steps; positive.
    area: i64,
}

impl<'a> PaintedTriangle<'a> {
    fn of(mesh: &'a Mesh, corners: &[u32], pixels_per_point: f32) -> Option<Self> {
        let vertex = |n: usize| mesh.vertices.get(corners[n] as usize);
        let mut vertices = [vertex(0)?, vertex(1)?, vertex(2)?];
        let place = |at: f32| -> Option<i64> {
            let at = at * pixels_per_point;
            (at.abs() <= FARTHEST).then_some((at * STEPS).round() as i64)
        };
        let corner = |v: &Vertex| Some((place(v.pos.x)?, place(v.pos.y)?));
        let mut corners = [corner(vertices[0])?, corner(vertices[1])?, corner(vertices[2])?];
        let mut area = cross_product(corners[0], corners[1], corners[2]);
        if area < 0 {
            corners.swap(1, 2);
            vertices.swap(1, 2);
            area = -area;
        }
        (area > 0).then_some(Self { corners, vertices, area })
    }

    fn paint_onto(&self, pixels: &mut Pixels, clip: &ClipArea, image: Option<&ColorImage>) {
        let steps = STEPS as i64;
        let (xs, ys) = (self.corners.map(|c| c.0), self.corners.map(|c| c.1));
        let span = |all: [i64; 3], low: i64, high: i64| {
            let first = all.iter().min().map_or(0, |at| at.div_euclid(steps));
            let last = all.iter().max().map_or(0, |at| at.div_euclid(steps) + 1);
            first.max(low)..last.min(high)
        };
        let columns = span(xs, clip.left, clip.right);
        let colour = self.flat_colour(image);
        for y in span(ys, clip.top, clip.bottom) {
            for x in columns.clone() {
                let centre = (x * steps + steps / 2, y * steps + steps / 2);
                let Some(weights) = self.corner_weights(centre) else { continue };
                let colour = colour.unwrap_or_else(|| self.blended_colour(weights, image));
                pixels.blend_pixel(x as usize, y as usize, colour);
            }
        }
    }

    /// Returns the weight of each corner at a point, if the point is inside.
    fn corner_weights(&self, at: Corner) -> Option<[f32; 3]> {
        let [a, b, c] = self.corners;
        let mut weights = [0.0; 3];
        for (n, (from, to)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
            let side = cross_product(from, to, at);
            // An edge that two triangles share belongs to the triangle of which it is the top or
            // left one.
            let is_top_left = from.1 == to.1 && to.0 > from.0 || to.1 < from.1;
            if side < 0 || side == 0 && !is_top_left {
                return None;
            }
            weights[n] = side as f32 / self.area as f32;
        }
        Some(weights)
    }

    /// Returns the colour if it is the same everywhere, as in most of a window.
    fn flat_colour(&self, image: Option<&ColorImage>) -> Option<Color32> {
        let [a, b, c] = self.vertices;
        let is_one = a.color == b.color && b.color == c.color && a.uv == b.uv && b.uv == c.uv;
        let is_plain = image.is_none() || a.uv == WHITE_UV;
        (is_one && is_plain).then_some(a.color)
    }

    fn blended_colour(&self, weights: [f32; 3], image: Option<&ColorImage>) -> Color32 {
        let mix = |of: [f32; 3]| of[0] * weights[0] + of[1] * weights[1] + of[2] * weights[2];
        let colours = self.vertices.map(|vertex| vertex.color.to_array().map(f32::from));
        let mut mixed: [f32; 4] =
            std::array::from_fn(|n| mix([colours[0][n], colours[1][n], colours[2][n]]));
        if let Some(image) = image {
            let uvs = self.vertices.map(|vertex| vertex.uv);
            let uv = Pos2::new(mix(uvs.map(|uv| uv.x)), mix(uvs.map(|uv| uv.y)));
            let texel = sample_texture(image, uv);
            mixed = std::array::from_fn(|n| mixed[n] * texel[n] / 255.0);
        }
        let [r, g, b, a] = mixed.map(|part| part.round().clamp(0.0, 255.0) as u8);
        Color32::from_rgba_premultiplied(r, g, b, a)
    }
}

/// Returns twice the area of the triangle; positive if `at` is on the right of the line from `a` to
/// `b`, y pointing down.
fn cross_product(a: Corner, b: Corner, at: Corner) -> i64 {
    (b.0 - a.0) * (at.1 - a.1) - (b.1 - a.1) * (at.0 - a.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn painted(size: usize, triangles: &[[(f32, f32); 3]]) -> Pixels {
        let mut mesh = Mesh::default();
        for (n, corner) in triangles.iter().flatten().enumerate() {
            let colour = Color32::from_rgba_premultiplied(100, 0, 0, 100);
            mesh.vertices.push(Vertex::untextured(Pos2::new(corner.0, corner.1), colour));
            mesh.indices.push(n as u32);
        }
        let everything = Rect::from_min_max(Pos2::ZERO, Pos2::new(1e6, 1e6));
        let primitive =
            ClippedPrimitive { clip_rect: everything, primitive: Primitive::Mesh(mesh) };
        let mut pixels = Pixels::filled(size, size, Color32::TRANSPARENT);
        paint_primitives(&mut pixels, &[primitive], &Textures::default(), 1.0);
        pixels
    }

    #[test]
    fn two_triangles_share_their_edge_without_gap_or_overlap() {
        let (a, b, c, d) = ((0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0));
        for triangles in [[[a, b, c], [a, c, d]], [[a, c, b], [c, a, d]], [[b, c, d], [d, b, a]]] {
            let pixels = painted(9, &triangles);
            let once = Color32::from_rgba_premultiplied(100, 0, 0, 100);
            assert!(pixels.colours.iter().all(|colour| *colour == once));
        }
    }

    #[test]
    fn only_pixels_whose_centre_is_inside_are_painted() {
        let pixels = painted(4, &[[(0.0, 0.0), (2.0, 0.0), (0.0, 2.0)]]);
        let count = pixels.colours.iter().filter(|colour| colour.a() > 0).count();
        assert_eq!(count, 1, "of the centres on the diagonal the other side has both");
    }

    #[test]
    fn corners_far_away_are_left_out_and_odd_numbers_are_no_harm() {
        painted(
            4,
            &[[(f32::NAN, 0.0), (2.0, 0.0), (0.0, 2.0)], [(0.0, 0.0), (1e30, 0.0), (0.0, 2.0)]],
        );
    }
}
