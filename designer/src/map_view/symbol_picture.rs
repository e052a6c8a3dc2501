//! A military symbol as triangles and lines that the window paints: curves are divided and areas
//! cut once, when the file has changed.

use std::collections::HashMap;
use std::sync::Arc;

use armor_symbols::{PaintRole, PathStep, Symbol, SymbolShape};
use eframe::egui::epaint::{Mesh, Vertex, WHITE_UV};
use eframe::egui::{Color32, Pos2, Shape, Stroke, Vec2};

use crate::map_view::triangles::triangulate;

/// Lines that a curve is divided into.
const CURVE_PIECES: usize = 8;

/// Drawings of codes, each made once: the map is drawn again with every step of a drag.
#[derive(Default)]
pub struct SymbolPictures(HashMap<String, Option<Arc<SymbolPicture>>>);

impl SymbolPictures {
    /// Most codes that are kept: as many as a map has symbols.
    const MAX_CODES: usize = 4_096;

    /// The drawing of a code; none if it means nothing.
    pub fn find(&mut self, code: &str) -> Option<Arc<SymbolPicture>> {
        if let Some(known) = self.0.get(code) {
            return known.clone();
        }
        if self.0.len() >= Self::MAX_CODES {
            self.0.clear();
        }
        let picture = Symbol::parse(code).ok().map(|it| Arc::new(SymbolPicture::of(&it)));
        self.0.insert(code.to_owned(), picture.clone());
        picture
    }
}

/// A symbol, its middle at the origin, with an octagon of the height 1.
pub struct SymbolPicture {
    /// What it means.
    pub name: &'static str,
    parts: Vec<Part>,
    /// Its area.
    low: Vec2,
    high: Vec2,
}

/// An area or lines of one colour.
enum Part {
    Area { colour: Color32, corners: Vec<Vec2>, triangles: Vec<[u32; 3]> },
    Line { colour: Color32, width: f32, points: Vec<Vec2> },
}

impl SymbolPicture {
    /// Draws a symbol in the colours of the standard.
    pub fn of(symbol: &Symbol) -> Self {
        let colour = |role: PaintRole| {
            let [red, green, blue] = symbol.color(role);
            Color32::from_rgb(red, green, blue)
        };
        let mut parts = Vec::new();
        for shape in symbol.shapes() {
            for (points, is_closed) in outlines(&shape) {
                if let Some(role) = shape.fill {
                    let triangles = triangulate(&points);
                    let corners = points.clone();
                    parts.push(Part::Area { colour: colour(role), corners, triangles });
                }
                if let Some(line) = &shape.line {
                    let mut points = points;
                    if is_closed {
                        points.extend(points.first().copied());
                    }
                    let width = unit(line.width);
                    parts.push(Part::Line { colour: colour(line.role), width, points });
                }
            }
        }
        let [low, high] = symbol.bounds().map(|[x, y]| Vec2::new(unit(x), unit(y)));
        Self { name: symbol.name(), parts, low, high }
    }

    /// Its area around `at`, if its octagon is this high.
    pub fn area(&self, at: Pos2, height: f32) -> eframe::egui::Rect {
        eframe::egui::Rect::from_min_max(at + self.low * height, at + self.high * height)
    }

    /// Its shapes in the window.
    pub fn shapes(&self, at: Pos2, height: f32, out: &mut Vec<Shape>) {
        for part in &self.parts {
            match part {
                Part::Area { colour, corners, triangles } => {
                    let mut mesh = Mesh::default();
                    mesh.vertices.extend(corners.iter().map(|corner| Vertex {
                        pos: at + *corner * height,
                        uv: WHITE_UV,
                        color: *colour,
                    }));
                    mesh.indices.extend(triangles.iter().flatten());
                    out.push(Shape::mesh(mesh));
                }
                Part::Line { colour, width, points } => {
                    let points = points.iter().map(|point| at + *point * height).collect();
                    out.push(Shape::line(points, Stroke::new(width * height, *colour)));
                }
            }
        }
    }
}

fn unit(value: f64) -> f32 {
    (value / armor_symbols::OCTAGON) as f32
}

/// The outlines of a shape as points, and whether each is closed.
fn outlines(shape: &SymbolShape) -> Vec<(Vec<Vec2>, bool)> {
    let place = |[x, y]: [f64; 2]| Vec2::new(unit(x), unit(y));
    let mut found: Vec<(Vec<Vec2>, bool)> = Vec::new();
    for step in &shape.steps {
        match (*step, found.last_mut()) {
            (PathStep::Move(to), _) => found.push((vec![place(to)], false)),
            (PathStep::Line(to), Some((points, _))) => points.push(place(to)),
            (PathStep::Curve(first, second, to), Some((points, _))) => {
                let start = points.last().copied().unwrap_or_default();
                let curve = [start, place(first), place(second), place(to)];
                let shares = (1..=CURVE_PIECES).map(|n| n as f32 / CURVE_PIECES as f32);
                points.extend(shares.map(|share| curve_point(curve, share)));
            }
            (PathStep::Close, Some((_, is_closed))) => *is_closed = true,
            (_, None) => {}
        }
    }
    found
}

fn curve_point([start, first, second, end]: [Vec2; 4], share: f32) -> Vec2 {
    let rest = 1.0 - share;
    start * rest.powi(3)
        + first * (3.0 * rest * rest * share)
        + second * (3.0 * rest * share * share)
        + end * share.powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_symbol_of_the_frames_becomes_shapes_of_its_area() {
        for identity in 0..7 {
            let code = format!("100{identity}1000001211000000");
            let code = format!("{code:0<20}");
            let symbol = Symbol::parse(&code).expect("a valid code");
            let picture = SymbolPicture::of(&symbol);
            let mut shapes = Vec::new();
            picture.shapes(Pos2::new(100.0, 100.0), 40.0, &mut shapes);
            assert!(!shapes.is_empty(), "{code}");
            let area = picture.area(Pos2::new(100.0, 100.0), 40.0).expand(3.0);
            for shape in &shapes {
                assert!(area.contains_rect(shape.visual_bounding_rect()), "{code}");
            }
        }
    }
}
