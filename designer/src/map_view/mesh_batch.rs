//! Shapes painted one after the other as one mesh. What is shown many times, a symbol or a dash, is cut
//! into triangles once, and copied to every place: with thousands of them, that is most of a frame.

use std::collections::HashMap;
use std::sync::Arc;

use eframe::egui::epaint::shape_transform::adjust_colors;
use eframe::egui::epaint::{Mesh, Tessellator, Vertex};
use eframe::egui::{Color32, Painter, Pos2, Rect, Shape, Stroke, Vec2};

use crate::map_view::leg_labels::shares_within;
use crate::map_view::symbol_picture::SymbolPicture;

/// A mesh has about so many vertices at most, then another one begins: a larger one would be copied each
/// time it has outgrown its memory.
const PIECE: usize = 8_192;

/// Lines, areas and symbols, from back to front. Texts and filled circles need textures: they are
/// painted otherwise.
pub struct MeshBatch {
    /// None leaves lines as lines, for a picture that is made of them.
    tessellator: Option<Tessellator>,
    /// What is not in it is left out.
    window: Rect,
    /// The triangles of each symbol around the origin, by the address of its drawing and its height.
    symbols: HashMap<(*const SymbolPicture, u32), Mesh>,
    /// What is not painted yet: the shapes, and in front of them the mesh.
    shapes: Vec<Shape>,
    mesh: Mesh,
}

impl MeshBatch {
    /// Begins with nothing; with `keeps_lines` each shape is painted as what it is.
    pub fn new(painter: &Painter, keeps_lines: bool) -> Self {
        let options = painter.ctx().tessellation_options(|options| *options);
        let tessellator = Tessellator::new(painter.pixels_per_point(), options, [1, 1], Vec::new());
        Self {
            tessellator: (!keeps_lines).then_some(tessellator),
            window: painter.clip_rect(),
            symbols: HashMap::new(),
            shapes: Vec::new(),
            mesh: Mesh::default(),
        }
    }

    /// Adds lines or an area; `visibility` 0 is invisible.
    pub fn add_shape(&mut self, mut shape: Shape, visibility: f32) {
        if visibility < 1.0 {
            let fade = move |colour: &mut Color32| *colour = colour.gamma_multiply(visibility);
            adjust_colors(&mut shape, fade);
        }
        match &mut self.tessellator {
            Some(tessellator) => {
                tessellator.set_clip_rect(self.window);
                tessellator.tessellate_shape(shape, &mut self.mesh);
                self.cut();
            }
            None => self.shapes.push(shape),
        }
    }

    /// Adds lines or areas.
    pub fn add_shapes(&mut self, shapes: impl IntoIterator<Item = Shape>) {
        shapes.into_iter().for_each(|shape| self.add_shape(shape, 1.0));
    }

    /// Adds a symbol with an octagon so high.
    pub fn add_symbol(
        &mut self,
        picture: &Arc<SymbolPicture>,
        at: Pos2,
        height: f32,
        visibility: f32,
    ) {
        let Some(tessellator) = &mut self.tessellator else {
            let mut shapes = Vec::new();
            picture.shapes(at, height, &mut shapes);
            return shapes.into_iter().for_each(|shape| self.add_shape(shape, visibility));
        };
        let symbol = self.symbols.entry((Arc::as_ptr(picture), height.to_bits()));
        let symbol = symbol.or_insert_with(|| {
            let (mut shapes, mut mesh) = (Vec::new(), Mesh::default());
            tessellator.set_clip_rect(Rect::EVERYTHING);
            picture.shapes(Pos2::ZERO, height, &mut shapes);
            shapes.into_iter().for_each(|shape| tessellator.tessellate_shape(shape, &mut mesh));
            mesh
        });
        let first = self.mesh.vertices.len();
        append(&mut self.mesh, symbol, at.to_vec2());
        if visibility < 1.0 {
            for vertex in &mut self.mesh.vertices[first..] {
                vertex.color = vertex.color.gamma_multiply(visibility);
            }
        }
        self.cut();
    }

    /// Adds a dashed line.
    pub fn add_dashes(&mut self, [from, to]: [Pos2; 2], stroke: Stroke, dash: f32, gap: f32) {
        let (way, length) = (to - from, (to - from).length());
        let (Some(tessellator), true) = (&mut self.tessellator, way.x != 0.0 && way.y != 0.0)
        else {
            // A line along an axis is rounded to pixels, each dash on its own.
            let dashes = Shape::dashed_line(&[from, to], stroke, dash, gap);
            return dashes.into_iter().for_each(|shape| self.add_shape(shape, 1.0));
        };
        let reached = self.window.expand(stroke.width + dash);
        let Some([first, last]) = shares_within(reached, [from, to]) else { return };
        let at = |along: f32| from + way * (along / length);
        let line = |begin: Pos2, end: Pos2| Shape::line_segment([begin, end], stroke);
        let mut whole = Mesh::default();
        tessellator.set_clip_rect(Rect::EVERYTHING);
        tessellator.tessellate_shape(line(Pos2::ZERO, at(dash) - from.to_vec2()), &mut whole);
        let whole = without_flat_parts(&whole);
        let begin = (first * length / (dash + gap)).floor() as usize;
        let end = (last * length / (dash + gap)).floor() as usize;
        for number in begin..=end {
            let along = number as f32 * (dash + gap);
            if along + dash <= length {
                append(&mut self.mesh, &whole, at(along).to_vec2());
            } else if along < length {
                tessellator.tessellate_shape(line(at(along), to), &mut self.mesh);
            }
        }
        self.cut();
    }

    /// Paints what was added, before something else that is in front of it.
    pub fn paint(&mut self, painter: &Painter) {
        self.end_mesh();
        painter.extend(self.shapes.drain(..));
    }

    fn cut(&mut self) {
        if self.mesh.vertices.len() >= PIECE {
            self.end_mesh();
            self.mesh.vertices.reserve(PIECE);
            self.mesh.indices.reserve(2 * PIECE);
        }
    }

    fn end_mesh(&mut self) {
        let mesh = std::mem::take(&mut self.mesh);
        if !mesh.is_empty() {
            self.shapes.push(Shape::mesh(mesh));
        }
    }
}

/// Adds a copy of a part, moved by an offset.
fn append(mesh: &mut Mesh, part: &Mesh, offset: Vec2) {
    let first = mesh.vertices.len() as u32;
    mesh.indices.extend(part.indices.iter().map(|index| first + index));
    let moved = |vertex: &Vertex| Vertex { pos: vertex.pos + offset, ..*vertex };
    mesh.vertices.extend(part.vertices.iter().map(moved));
}

/// The same without triangles that have no area: a line as wide as a pixel has no solid middle.
fn without_flat_parts(mesh: &Mesh) -> Mesh {
    let mut kept = Mesh::default();
    let numbers: Vec<u32> = mesh
        .vertices
        .iter()
        .map(|vertex| {
            let known = kept.vertices.iter().position(|it| it == vertex);
            known.unwrap_or_else(|| {
                kept.vertices.push(*vertex);
                kept.vertices.len() - 1
            }) as u32
        })
        .collect();
    for corners in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|n| numbers[corners[n] as usize]);
        if a != b && b != c && c != a {
            kept.indices.extend([a, b, c]);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use armor_symbols::Symbol;
    use eframe::egui::{Context, LayerId, pos2};

    use super::*;

    const WINDOW: Rect = Rect { min: Pos2::ZERO, max: Pos2::new(200.0, 100.0) };

    fn painter() -> Painter {
        Painter::new(Context::default(), LayerId::background(), WINDOW)
    }

    /// The triangles with an area that touch the window.
    fn triangles(mesh: &Mesh) -> Vec<[Vertex; 3]> {
        let all = mesh.indices.chunks_exact(3);
        let all = all.map(|corners| [0, 1, 2].map(|n| mesh.vertices[corners[n] as usize]));
        let is_shown = |corners: &[Vertex; 3]| {
            let [a, b, c] = corners.map(|corner| corner.pos);
            let is_flat = (b - a).rot90().dot(c - a).abs() < 1e-4;
            !is_flat && Rect::from_points(&[a, b, c]).intersects(WINDOW)
        };
        all.filter(is_shown).collect()
    }

    /// Compares a batch with the same shapes cut into triangles one by one.
    fn check(batch: &MeshBatch, shapes: Vec<Shape>) {
        let mut one_by_one = MeshBatch::new(&painter(), false);
        one_by_one.add_shapes(shapes);
        let (found, expected) = (triangles(&batch.mesh), triangles(&one_by_one.mesh));
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!(found.pos.distance(expected.pos) < 0.01, "{found:?} {expected:?}");
            assert_eq!((found.color, found.uv), (expected.color, expected.uv));
        }
    }

    #[test]
    fn dashes_are_where_they_would_be_one_by_one() {
        for (width, from, to) in [
            (1.0, pos2(10.0, 10.0), pos2(150.0, 90.0)),
            (2.0, pos2(190.0, 95.0), pos2(15.0, 3.0)),
            (1.0, pos2(-5000.0, -3200.0), pos2(9000.0, 6000.0)),
            (1.0, pos2(20.3, 10.0), pos2(20.3, 80.0)),
            (1.0, pos2(20.0, 10.0), pos2(21.0, 11.0)),
            (1.0, pos2(20.0, 10.0), pos2(20.0, 10.0)),
            (1.0, pos2(300.0, 10.0), pos2(400.0, 80.0)),
        ] {
            let stroke = Stroke::new(width, Color32::RED);
            let mut batch = MeshBatch::new(&painter(), false);
            batch.add_dashes([from, to], stroke, 3.0, 4.0);
            check(&batch, Shape::dashed_line(&[from, to], stroke, 3.0, 4.0));
            let has_some = WINDOW.contains(from) && from != to || from.x < 0.0;
            assert_eq!(!batch.mesh.is_empty(), has_some, "{from} to {to}");
        }
    }

    #[test]
    fn symbols_have_the_triangles_of_their_shapes() {
        let symbol = Symbol::parse("10031000001211000000").expect("a valid code");
        let picture = Arc::new(SymbolPicture::of(&symbol));
        let (mut batch, mut shapes) = (MeshBatch::new(&painter(), false), Vec::new());
        for (at, height, visibility) in [
            (pos2(50.0, 50.0), 34.0, 1.0),
            (pos2(60.0, 52.0), 34.0, 0.5),
            (pos2(9.0, 9.0), 28.0, 1.0),
        ] {
            batch.add_symbol(&picture, at, height, visibility);
            let first = shapes.len();
            picture.shapes(at, height, &mut shapes);
            for shape in &mut shapes[first..] {
                let fade = move |colour: &mut Color32| *colour = colour.gamma_multiply(visibility);
                adjust_colors(shape, fade);
            }
        }
        check(&batch, shapes);
    }

    #[test]
    fn a_picture_of_lines_keeps_them() {
        let mut batch = MeshBatch::new(&painter(), true);
        batch.add_dashes(
            [pos2(10.0, 10.0), pos2(30.0, 40.0)],
            Stroke::new(1.0, Color32::RED),
            3.0,
            4.0,
        );
        assert!(batch.mesh.is_empty() && batch.shapes.len() == 6, "{:?}", batch.shapes);
    }
}
