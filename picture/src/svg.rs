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
    let (left, top) = (format_number(area.left()), format_number(area.top()));
    let (width, height) = (format_number(area.width()), format_number(area.height()));
    out.write_text(format_args!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"{left} {top} {width} {height}\">\n"
    ));
    if under != Color32::TRANSPARENT {
        let fill = format_fill(under);
        out.write_text(format_args!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\"{fill}/>\n"
        ));
    }
    for run in shapes.chunk_by(|a, b| a.clip_rect == b.clip_rect) {
        out.write_clipped(run);
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
    fn write_text(&mut self, what: std::fmt::Arguments<'_>) {
        let _ = self.text.write_fmt(what);
    }

    fn write_clipped(&mut self, run: &[ClippedShape]) {
        let Some(first) = run.first() else { return };
        let visible = first.clip_rect.intersect(self.area);
        if !visible.is_positive() {
            return;
        }
        let is_cut = visible != self.area;
        if is_cut {
            self.clips += 1;
            let (id, rect) = (self.clips, attributes_of(visible));
            self.write_text(format_args!(
                "<clipPath id=\"clip{id}\"><rect{rect}/></clipPath>\n<g clip-path=\"url(#clip{id})\">\n"
            ));
        }
        for clipped in run {
            self.write_transformed(&clipped.shape, clipped.transform_after_tessellation);
        }
        if is_cut {
            self.text += "</g>\n";
        }
    }

    fn write_transformed(&mut self, shape: &Shape, transform: TSTransform) {
        if transform == TSTransform::IDENTITY {
            return self.write_shape(shape);
        }
        let (x, y) =
            (format_number(transform.translation.x), format_number(transform.translation.y));
        let scale = transform.scaling;
        self.write_text(format_args!("<g transform=\"translate({x} {y}) scale({scale})\">\n"));
        self.write_shape(shape);
        self.text += "</g>\n";
    }

    fn write_shape(&mut self, shape: &Shape) {
        match shape {
            // Something for a GPU alone; there is none in the drawings.
            Shape::Noop | Shape::Callback(_) => {}
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| self.write_shape(shape)),
            Shape::Circle(circle) => self.write_circle(circle),
            Shape::Ellipse(ellipse) => self.write_ellipse(ellipse),
            Shape::LineSegment { points, stroke } => self.write_line(*points, stroke),
            Shape::Path(path) => self.write_path(path),
            Shape::Rect(rect) => self.write_rect(rect),
            Shape::Text(text) => text::write_text_shape(&mut self.text, text),
            Shape::Mesh(mesh) => self.write_mesh(mesh),
            Shape::QuadraticBezier(curve) => self.write_quadratic(curve),
            Shape::CubicBezier(curve) => self.write_cubic(curve),
            Shape::Band(band) => self.write_shape(&Shape::from(band_outline(band))),
        }
    }

    fn write_circle(&mut self, circle: &CircleShape) {
        let CircleShape { center, radius, fill: inside, stroke } = circle;
        let (x, y, r) = (format_number(center.x), format_number(center.y), format_number(*radius));
        let (fill, stroke) = (format_fill(*inside), format_stroke(stroke));
        self.write_text(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{fill}{stroke}/>\n"));
    }

    fn write_ellipse(&mut self, ellipse: &EllipseShape) {
        let EllipseShape { center, radius, fill: inside, stroke, angle } = ellipse;
        let (x, y) = (format_number(center.x), format_number(center.y));
        let (rx, ry, turn) =
            (format_number(radius.x), format_number(radius.y), format_number(angle.to_degrees()));
        let (fill, stroke) = (format_fill(*inside), format_stroke(stroke));
        self.write_text(format_args!(
            "<ellipse cx=\"{x}\" cy=\"{y}\" rx=\"{rx}\" ry=\"{ry}\" \
             transform=\"rotate({turn} {x} {y})\"{fill}{stroke}/>\n"
        ));
    }

    fn write_line(&mut self, [a, b]: [Pos2; 2], stroke: &Stroke) {
        let (x1, y1, x2, y2) =
            (format_number(a.x), format_number(a.y), format_number(b.x), format_number(b.y));
        let stroke = format_stroke(stroke);
        self.write_text(format_args!(
            "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"{stroke}/>\n"
        ));
    }

    fn write_path(&mut self, path: &PathShape) {
        let element = if path.closed { "polygon" } else { "polyline" };
        let points: Vec<_> = path.points.iter().map(format_point).collect();
        let (points, fill) = (points.join(" "), format_fill(path.fill));
        let stroke = format_stroke(&to_plain_stroke(&path.stroke));
        self.write_text(format_args!("<{element} points=\"{points}\"{fill}{stroke}/>\n"));
    }

    fn write_rect(&mut self, rect: &RectShape) {
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
        let radius = format_number((radius + half).max(0.0));
        let (fill, stroke) = (format_fill(rect.fill), format_stroke(&rect.stroke));
        self.write_text(format_args!("<rect{place} rx=\"{radius}\"{fill}{stroke}/>\n"));
    }

    fn write_quadratic(&mut self, curve: &QuadraticBezierShape) {
        let [a, b, c] = curve.points.each_ref().map(format_point);
        let end = if curve.closed { " Z" } else { "" };
        let (fill, stroke) =
            (format_fill(curve.fill), format_stroke(&to_plain_stroke(&curve.stroke)));
        self.write_text(format_args!("<path d=\"M{a} Q{b} {c}{end}\"{fill}{stroke}/>\n"));
    }

    fn write_cubic(&mut self, curve: &CubicBezierShape) {
        let [a, b, c, d] = curve.points.each_ref().map(format_point);
        let end = if curve.closed { " Z" } else { "" };
        let (fill, stroke) =
            (format_fill(curve.fill), format_stroke(&to_plain_stroke(&curve.stroke)));
        self.write_text(format_args!("<path d=\"M{a} C{b} {c} {d}{end}\"{fill}{stroke}/>\n"));
    }

    /// Triangles, each in the mean of its corners' colours.
    fn write_mesh(&mut self, mesh: &Mesh) {
        for corners in mesh.indices.chunks_exact(3) {
            let vertex = |n: usize| mesh.vertices.get(corners[n] as usize);
            let (Some(a), Some(b), Some(c)) = (vertex(0), vertex(1), vertex(2)) else { continue };
            let parts = [a, b, c].map(|vertex| vertex.color.to_array().map(u16::from));
            let mean = |n: usize| {
                u8::try_from((parts[0][n] + parts[1][n] + parts[2][n]) / 3).unwrap_or(u8::MAX)
            };
            let colour = Color32::from_rgba_premultiplied(mean(0), mean(1), mean(2), mean(3));
            let points = [a, b, c].map(|vertex| format_point(&vertex.pos)).join(" ");
            let fill = format_fill(colour);
            self.write_text(format_args!("<polygon points=\"{points}\"{fill}/>\n"));
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

fn to_plain_stroke(stroke: &PathStroke) -> Stroke {
    let colour = match &stroke.color {
        ColorMode::Solid(colour) => *colour,
        ColorMode::UV(colour_at) => colour_at(Rect::ZERO, Pos2::ZERO),
    };
    Stroke::new(stroke.width, colour)
}

/// A length to a hundredth, which no screen shows finer.
pub(super) fn format_number(value: f32) -> String {
    let rounded = (f64::from(value) * 100.0).round() / 100.0;
    // Adding zero makes -0 a 0; what is not a number is nowhere.
    if rounded.is_finite() { (rounded + 0.0).to_string() } else { "0".to_owned() }
}

fn format_point(at: &Pos2) -> String {
    format!("{},{}", format_number(at.x), format_number(at.y))
}

fn attributes_of(rect: Rect) -> String {
    let (x, y) = (format_number(rect.left()), format_number(rect.top()));
    let (width, height) =
        (format_number(rect.width().max(0.0)), format_number(rect.height().max(0.0)));
    format!(" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"")
}

/// ` fill="#rrggbb"`, with an opacity if it is not opaque.
pub(super) fn format_fill(colour: Color32) -> String {
    if colour == Color32::TRANSPARENT {
        " fill=\"none\"".to_owned()
    } else {
        format_paint("fill", colour)
    }
}

fn format_stroke(stroke: &Stroke) -> String {
    if stroke.is_empty() {
        return String::new();
    }
    let width = format_number(stroke.width);
    format!("{} stroke-width=\"{width}\"", format_paint("stroke", stroke.color))
}

fn format_paint(what: &str, colour: Color32) -> String {
    let [r, g, b, a] = colour.to_srgba_unmultiplied();
    let mut out = format!(" {what}=\"#{r:02x}{g:02x}{b:02x}\"");
    if a < u8::MAX {
        out += &format!(" {what}-opacity=\"{}\"", format_number(f32::from(a) / 255.0));
    }
    out
}

#[cfg(test)]
mod tests;
