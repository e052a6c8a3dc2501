//! egui's shapes → an SVG: lines stay lines and text stays text, so that it can be searched,
//! scaled and edited elsewhere.

mod text;

use std::fmt::Write;

use egui::emath::TSTransform;
use egui::epaint::{
    CircleShape, ClippedShape, ColorMode, CubicBezierShape, EllipseShape, Mesh, PathShape,
    PathStroke, QuadraticBezierShape, RectShape, StrokeKind,
};
use egui::{Color32, Pos2, Rect, Shape, Stroke};

/// The shapes inside `area` as a whole SVG file over a colour. One point is one unit of it.
pub fn svg(shapes: &[ClippedShape], area: Rect, under: Color32) -> String {
    let mut out = Svg { text: String::new(), area, clips: 0 };
    let (left, top) = (number(area.left()), number(area.top()));
    let (width, height) = (number(area.width()), number(area.height()));
    out.add(format_args!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"{left} {top} {width} {height}\">\n"
    ));
    if under != Color32::TRANSPARENT {
        let fill = fill(under);
        out.add(format_args!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\"{fill}/>\n"
        ));
    }
    for run in shapes.chunk_by(|a, b| a.clip_rect == b.clip_rect) {
        out.clipped(run);
    }
    out.text += "</svg>\n";
    out.text
}

struct Svg {
    text: String,
    area: Rect,
    clips: usize,
}

impl Svg {
    /// Writing to a string cannot fail.
    fn add(&mut self, what: std::fmt::Arguments<'_>) {
        let _ = self.text.write_fmt(what);
    }

    fn clipped(&mut self, run: &[ClippedShape]) {
        let Some(first) = run.first() else { return };
        let visible = first.clip_rect.intersect(self.area);
        if !visible.is_positive() {
            return;
        }
        let is_cut = visible != self.area;
        if is_cut {
            self.clips += 1;
            let (id, rect) = (self.clips, attributes_of(visible));
            self.add(format_args!(
                "<clipPath id=\"clip{id}\"><rect{rect}/></clipPath>\n<g clip-path=\"url(#clip{id})\">\n"
            ));
        }
        for clipped in run {
            self.transformed(&clipped.shape, clipped.transform_after_tessellation);
        }
        if is_cut {
            self.text += "</g>\n";
        }
    }

    fn transformed(&mut self, shape: &Shape, transform: TSTransform) {
        if transform == TSTransform::IDENTITY {
            return self.shape(shape);
        }
        let (x, y) = (number(transform.translation.x), number(transform.translation.y));
        let scale = transform.scaling;
        self.add(format_args!("<g transform=\"translate({x} {y}) scale({scale})\">\n"));
        self.shape(shape);
        self.text += "</g>\n";
    }

    fn shape(&mut self, shape: &Shape) {
        match shape {
            // Something for a GPU alone; there is none in the drawings.
            Shape::Noop | Shape::Callback(_) => {}
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| self.shape(shape)),
            Shape::Circle(circle) => self.circle(circle),
            Shape::Ellipse(ellipse) => self.ellipse(ellipse),
            Shape::LineSegment { points, stroke } => self.line(*points, stroke),
            Shape::Path(path) => self.path(path),
            Shape::Rect(rect) => self.rect(rect),
            Shape::Text(text) => text::add(&mut self.text, text),
            Shape::Mesh(mesh) => self.mesh(mesh),
            Shape::QuadraticBezier(curve) => self.quadratic(curve),
            Shape::CubicBezier(curve) => self.cubic(curve),
            Shape::Band(band) => self.shape(&Shape::from(band_outline(band))),
        }
    }

    fn circle(&mut self, circle: &CircleShape) {
        let CircleShape { center, radius, fill: inside, stroke } = circle;
        let (x, y, r) = (number(center.x), number(center.y), number(*radius));
        let (fill, stroke) = (fill(*inside), stroked(stroke));
        self.add(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{fill}{stroke}/>\n"));
    }

    fn ellipse(&mut self, ellipse: &EllipseShape) {
        let EllipseShape { center, radius, fill: inside, stroke, angle } = ellipse;
        let (x, y) = (number(center.x), number(center.y));
        let (rx, ry, turn) = (number(radius.x), number(radius.y), number(angle.to_degrees()));
        let (fill, stroke) = (fill(*inside), stroked(stroke));
        self.add(format_args!(
            "<ellipse cx=\"{x}\" cy=\"{y}\" rx=\"{rx}\" ry=\"{ry}\" \
             transform=\"rotate({turn} {x} {y})\"{fill}{stroke}/>\n"
        ));
    }

    fn line(&mut self, [a, b]: [Pos2; 2], stroke: &Stroke) {
        let (x1, y1, x2, y2) = (number(a.x), number(a.y), number(b.x), number(b.y));
        let stroke = stroked(stroke);
        self.add(format_args!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"{stroke}/>\n"));
    }

    fn path(&mut self, path: &PathShape) {
        let element = if path.closed { "polygon" } else { "polyline" };
        let points: Vec<_> = path.points.iter().map(point).collect();
        let (points, fill) = (points.join(" "), fill(path.fill));
        let stroke = stroked(&plain(&path.stroke));
        self.add(format_args!("<{element} points=\"{points}\"{fill}{stroke}/>\n"));
    }

    fn rect(&mut self, rect: &RectShape) {
        let half = match rect.stroke_kind {
            _ if rect.stroke.is_empty() => 0.0,
            StrokeKind::Inside => -rect.stroke.width / 2.0,
            StrokeKind::Middle => 0.0,
            StrokeKind::Outside => rect.stroke.width / 2.0,
        };
        // A GPU picture is in a mesh or a brush; the fill alone would hide what is below.
        if rect.brush.is_some() {
            return;
        }
        let place = attributes_of(rect.rect.expand(half));
        let corners = rect.corner_radius;
        let radius = f32::from(corners.nw.max(corners.ne).max(corners.sw).max(corners.se));
        let radius = number((radius + half).max(0.0));
        let (fill, stroke) = (fill(rect.fill), stroked(&rect.stroke));
        self.add(format_args!("<rect{place} rx=\"{radius}\"{fill}{stroke}/>\n"));
    }

    fn quadratic(&mut self, curve: &QuadraticBezierShape) {
        let [a, b, c] = curve.points.each_ref().map(point);
        let end = if curve.closed { " Z" } else { "" };
        let (fill, stroke) = (fill(curve.fill), stroked(&plain(&curve.stroke)));
        self.add(format_args!("<path d=\"M{a} Q{b} {c}{end}\"{fill}{stroke}/>\n"));
    }

    fn cubic(&mut self, curve: &CubicBezierShape) {
        let [a, b, c, d] = curve.points.each_ref().map(point);
        let end = if curve.closed { " Z" } else { "" };
        let (fill, stroke) = (fill(curve.fill), stroked(&plain(&curve.stroke)));
        self.add(format_args!("<path d=\"M{a} C{b} {c} {d}{end}\"{fill}{stroke}/>\n"));
    }

    /// Triangles, each in the mean of its corners' colours.
    fn mesh(&mut self, mesh: &Mesh) {
        for corners in mesh.indices.chunks_exact(3) {
            let vertex = |n: usize| mesh.vertices.get(corners[n] as usize);
            let (Some(a), Some(b), Some(c)) = (vertex(0), vertex(1), vertex(2)) else { continue };
            let parts = [a, b, c].map(|vertex| vertex.color.to_array().map(u16::from));
            let mean = |n: usize| {
                u8::try_from((parts[0][n] + parts[1][n] + parts[2][n]) / 3).unwrap_or(u8::MAX)
            };
            let colour = Color32::from_rgba_premultiplied(mean(0), mean(1), mean(2), mean(3));
            let points = [a, b, c].map(|vertex| point(&vertex.pos)).join(" ");
            let fill = fill(colour);
            self.add(format_args!("<polygon points=\"{points}\"{fill}/>\n"));
        }
    }
}

fn band_outline(band: &egui::epaint::BandShape) -> PathShape {
    let upper = band.points.iter().map(|sample| Pos2::new(sample.x, sample.y.min));
    let lower = band.points.iter().rev().map(|sample| Pos2::new(sample.x, sample.y.max));
    PathShape {
        points: upper.chain(lower).collect(),
        closed: true,
        fill: band.fill,
        stroke: band.stroke.into(),
    }
}

fn plain(stroke: &PathStroke) -> Stroke {
    let colour = match &stroke.color {
        ColorMode::Solid(colour) => *colour,
        ColorMode::UV(colour_at) => colour_at(Rect::ZERO, Pos2::ZERO),
    };
    Stroke::new(stroke.width, colour)
}

/// A length to a hundredth, which no screen shows finer.
pub(super) fn number(value: f32) -> String {
    let rounded = (f64::from(value) * 100.0).round() / 100.0;
    // Adding zero makes -0 a 0; what is not a number is nowhere.
    if rounded.is_finite() { (rounded + 0.0).to_string() } else { "0".to_owned() }
}

fn point(at: &Pos2) -> String {
    format!("{},{}", number(at.x), number(at.y))
}

fn attributes_of(rect: Rect) -> String {
    let (x, y) = (number(rect.left()), number(rect.top()));
    let (width, height) = (number(rect.width().max(0.0)), number(rect.height().max(0.0)));
    format!(" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"")
}

/// ` fill="#rrggbb"`, with an opacity if it is not opaque.
pub(super) fn fill(colour: Color32) -> String {
    if colour == Color32::TRANSPARENT { " fill=\"none\"".to_owned() } else { paint("fill", colour) }
}

fn stroked(stroke: &Stroke) -> String {
    if stroke.is_empty() {
        return String::new();
    }
    let width = number(stroke.width);
    format!("{} stroke-width=\"{width}\"", paint("stroke", stroke.color))
}

fn paint(what: &str, colour: Color32) -> String {
    let [r, g, b, a] = colour.to_srgba_unmultiplied();
    let mut out = format!(" {what}=\"#{r:02x}{g:02x}{b:02x}\"");
    if a < u8::MAX {
        out += &format!(" {what}-opacity=\"{}\"", number(f32::from(a) / 255.0));
    }
    out
}

#[cfg(test)]
mod tests;
