//! Text in an SVG: each row, each colour of it, as text of the same width, whatever font the viewer
//! has.

use std::fmt::Write;

use egui::epaint::TextShape;
use egui::epaint::text::{Galley, Glyph, PlacedRow};
use egui::{Color32, FontFamily};

use super::{format_fill, format_number};

pub(super) fn write_text_shape(out: &mut String, text: &TextShape) {
    let (x, y) = (format_number(text.pos.x), format_number(text.pos.y));
    let turn = match text.angle {
        0.0 => String::new(),
        angle => format!(" rotate({})", format_number(angle.to_degrees())),
    };
    // Writing to a string cannot fail.
    let _ =
        writeln!(out, "<g transform=\"translate({x} {y}){turn}\"{}>", format_font(&text.galley));
    for row in &text.galley.rows {
        let runs = row.glyphs.chunk_by(|a, b| colour_of(text, row, a) == colour_of(text, row, b));
        runs.for_each(|run| add_run(out, text, row, run));
    }
    out.push_str("</g>\n");
}

/// Writes adjacent glyphs of one colour.
fn add_run(out: &mut String, text: &TextShape, row: &PlacedRow, run: &[Glyph]) {
    let (Some(first), Some(last)) = (run.first(), run.last()) else { return };
    let letters: String = run.iter().map(|glyph| glyph.chr).collect();
    if letters.trim().is_empty() {
        return;
    }
    let (x, y) = (format_number(row.pos.x + first.pos.x), format_number(row.pos.y + first.pos.y));
    let width = format_number(last.pos.x + last.advance_width - first.pos.x);
    let fill = format_fill(colour_of(text, row, first).gamma_multiply(text.opacity_factor));
    let letters = escape_text(&letters);
    let _ = writeln!(
        out,
        "<text x=\"{x}\" y=\"{y}\" textLength=\"{width}\" lengthAdjust=\"spacingAndGlyphs\" \
         xml:space=\"preserve\"{fill}>{letters}</text>"
    );
}

/// Returns the colour as painted: the galley's own, unless the shape overrides it.
fn colour_of(text: &TextShape, row: &PlacedRow, glyph: &Glyph) -> Color32 {
    if let Some(colour) = text.override_text_color {
        return colour;
    }
    // A space has no vertices: the index is another glyph's, or out of range.
    let vertex = row.visuals.mesh.vertices.get(glyph.first_vertex as usize);
    match vertex.map(|vertex| vertex.color) {
        Some(colour) if colour != Color32::PLACEHOLDER => colour,
        _ => text.fallback_color,
    }
}

fn format_font(galley: &Galley) -> String {
    let Some(font) = galley.job.sections.first().map(|section| &section.format.font_id) else {
        return String::new();
    };
    let family = match font.family {
        FontFamily::Monospace => "Hack, DejaVu Sans Mono, monospace",
        _ => "Ubuntu, Noto Sans, sans-serif",
    };
    format!(" font-family=\"{family}\" font-size=\"{}\"", format_number(font.size))
}

fn escape_text(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            // XML does not allow them.
            letter if letter.is_control() => out.push(' '),
            letter => out.push(letter),
        }
    }
    out
}
