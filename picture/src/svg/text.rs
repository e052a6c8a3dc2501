//! Text in an SVG: each row, each colour of it, as text of the same width, whatever font the viewer
//! has.

use std::fmt::Write;

use egui::epaint::TextShape;
use egui::epaint::text::{Galley, Glyph, PlacedRow};
use egui::{Color32, FontFamily};

use super::{fill, number};

pub(super) fn add(out: &mut String, text: &TextShape) {
    let (x, y) = (number(text.pos.x), number(text.pos.y));
    let turn = match text.angle {
        0.0 => String::new(),
        angle => format!(" rotate({})", number(angle.to_degrees())),
    };
    // Writing to a string cannot fail.
    let _ = writeln!(out, "<g transform=\"translate({x} {y}){turn}\"{}>", font(&text.galley));
    for row in &text.galley.rows {
        let runs = row.glyphs.chunk_by(|a, b| colour(text, row, a) == colour(text, row, b));
        runs.for_each(|run| add_run(out, text, row, run));
    }
    out.push_str("</g>\n");
}

/// Glyphs of one colour beside each other.
fn add_run(out: &mut String, text: &TextShape, row: &PlacedRow, run: &[Glyph]) {
    let (Some(first), Some(last)) = (run.first(), run.last()) else { return };
    let letters: String = run.iter().map(|glyph| glyph.chr).collect();
    if letters.trim().is_empty() {
        return;
    }
    let (x, y) = (number(row.pos.x + first.pos.x), number(row.pos.y + first.pos.y));
    let width = number(last.pos.x + last.advance_width - first.pos.x);
    let fill = fill(colour(text, row, first).gamma_multiply(text.opacity_factor));
    let letters = escaped(&letters);
    let _ = writeln!(
        out,
        "<text x=\"{x}\" y=\"{y}\" textLength=\"{width}\" lengthAdjust=\"spacingAndGlyphs\" \
         xml:space=\"preserve\"{fill}>{letters}</text>"
    );
}

/// As painted: the galley's own, but for what the shape says of it.
fn colour(text: &TextShape, row: &PlacedRow, glyph: &Glyph) -> Color32 {
    if let Some(colour) = text.override_text_color {
        return colour;
    }
    // A space has no picture, and the vertex named is another's or none.
    let vertex = row.visuals.mesh.vertices.get(glyph.first_vertex as usize);
    match vertex.map(|vertex| vertex.color) {
        Some(colour) if colour != Color32::PLACEHOLDER => colour,
        _ => text.fallback_color,
    }
}

fn font(galley: &Galley) -> String {
    let Some(font) = galley.job.sections.first().map(|section| &section.format.font_id) else {
        return String::new();
    };
    let family = match font.family {
        FontFamily::Monospace => "Hack, DejaVu Sans Mono, monospace",
        _ => "Ubuntu, Noto Sans, sans-serif",
    };
    format!(" font-family=\"{family}\" font-size=\"{}\"", number(font.size))
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            // XML has no place for them.
            letter if letter.is_control() => out.push(' '),
            letter => out.push(letter),
        }
    }
    out
}
