//! Text on the drawing. Sizes are rounded to half a point, so that letters are sharp at every zoom
//! and there are few of them; egui keeps what it has laid out from frame to frame.

use std::borrow::Cow;
use std::sync::Arc;

use eframe::egui::text::{LayoutJob, TextWrapping};
use eframe::egui::{self, Align2, Color32, FontId, Galley, Painter, Pos2, Rect, Vec2};

use armor_picture::theme::LEAST_TEXT;

/// The room of a text that stands alone as soon as those around it are not drawn.
pub(super) const ALONE: f32 = 34.0;
/// The room of the name of a port, and of the text of a link: from port to port of a block.
pub(super) const PORT_ROOM: f32 = 20.0;
/// From this zoom on the names of ports and the texts of links are drawn.
pub const LABELLED: f32 = (LEAST_TEXT - ROUNDED) / PORT_ROOM;
/// Sizes of text are rounded by so much at most.
const ROUNDED: f32 = 0.5;
/// A smaller note is not drawn.
pub(super) const SMALLEST: f32 = 5.0;

/// A text to be drawn: what, at which size in the drawing, at most how wide in the window.
#[derive(Clone, Copy)]
pub(super) struct Label<'a> {
    pub(super) text: &'a str,
    pub(super) size: f32,
    /// Height in the drawing that the text may take before it covers another one.
    pub(super) room: f32,
    pub(super) width: f32,
    pub(super) colour: Color32,
    pub(super) anchor: Align2,
}

/// Draws a text at a point of the window; returns where it is.
pub(super) fn draw(painter: &Painter, zoom: f32, at: Pos2, label: Label<'_>) -> Option<Rect> {
    let galley = lay_out(painter, zoom, label)?;
    let rect = label.anchor.anchor_size(at, galley.size());
    if painter.clip_rect().intersects(rect) {
        painter.galley(rect.min, galley, label.colour);
    }
    Some(rect)
}

/// The size of a text in the window; none if it is not drawn.
pub(super) fn measure(painter: &Painter, zoom: f32, label: Label<'_>) -> Option<Vec2> {
    Some(lay_out(painter, zoom, label)?.size())
}

fn lay_out(painter: &Painter, zoom: f32, label: Label<'_>) -> Option<Arc<Galley>> {
    let size = (label.size * zoom * 2.0).round() / 2.0;
    // Text that can be read needs this height, however small the drawing is.
    if label.room * zoom < LEAST_TEXT - ROUNDED || label.text.is_empty() {
        return None;
    }
    let size = size.max(LEAST_TEXT);
    let text = paintable(painter.ctx(), label.text).into_owned();
    let mut job =
        LayoutJob::simple_singleline(text, FontId::proportional(size), Color32::PLACEHOLDER);
    job.wrap = TextWrapping::truncate_at_width(label.width.max(size));
    Some(painter.layout_job(job))
}

/// The text with `?` for every character that no font has and with spaces for control characters.
/// What a file states may be anything; a box for each unknown character would carry no information.
pub fn paintable<'a>(ctx: &egui::Context, text: &'a str) -> Cow<'a, str> {
    if text.bytes().all(|b| (b' '..=b'~').contains(&b)) {
        return Cow::Borrowed(text);
    }
    let font = FontId::proportional(14.0);
    let shown = |c: char| match c {
        '\n' => c,
        c if c.is_control() => ' ',
        c if ctx.fonts_mut(|fonts| fonts.has_glyph(&font, c)) => c,
        _ => '?',
    };
    Cow::Owned(text.chars().map(shown).collect())
}
