//! A whole drawing at its own size, as a file for documents.

use std::path::{Path, PathBuf};

use armor_picture::svg;
use eframe::egui::{CentralPanel, Context, Frame, Rect, ThemePreference, Ui, Vec2};

use super::{Format, PngError, Stage, save_png};
use crate::canvas::{Canvas, Diagram, JoinRules, PortAt};
use crate::item::Item;
use armor_picture::theme::{self, Pointing, ThemeColours};

/// Points around the drawing; wires reach a little beyond the blocks.
const MARGIN: f32 = 60.0;
/// Frames until the canvas has found its place.
const FRAMES: usize = 4;
/// Most pixels in a row or column of a PNG.
const MAX_PIXELS: f32 = 16_384.0;

/// Why a drawing was not exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The name states no format.
    #[error("{path} does not end in .svg or .png", path = path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// There is nothing to be seen.
    #[error("the drawing is empty")]
    Empty,
    /// As pixels it would be giant.
    #[error(
        "the drawing has {side} pixels from edge to edge, a PNG may have 16384: export it as .svg"
    )]
    TooLarge {
        /// Its longer side.
        side: u32,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Png(#[from] PngError),
    /// The file cannot be written.
    #[error(transparent)]
    Save(#[from] armor_files::SaveError),
}

/// Saves the drawing as the file at `path`, in the format that its ending states, with `scale`
/// pixels of a PNG for each point.
///
/// # Errors
/// If the ending states no format, there is nothing to be seen, or the file cannot be written.
pub fn export(
    diagram: &Diagram<Item>,
    path: &Path,
    is_dark: bool,
    scale: f32,
) -> Result<(), ExportError> {
    let bounds = diagram.extent().ok_or(ExportError::Empty)?;
    let size = (bounds.size() + 2.0 * Vec2::splat(MARGIN)).ceil();
    let mut canvas = Canvas::new("drawing");
    canvas.minimap = false;
    canvas.is_editable = false;
    canvas.has_dots = false;
    canvas.drawing_changed(diagram);
    export_shown(size, path, is_dark, scale, |ui| {
        canvas.show(ui, diagram, &Still);
    })
}

/// The same of what `show` shows in a window of this size.
///
/// # Errors
/// As [`export`].
pub fn export_shown(
    size: Vec2,
    path: &Path,
    is_dark: bool,
    scale: f32,
    mut show: impl FnMut(&mut Ui),
) -> Result<(), ExportError> {
    let format = Format::of(path).ok_or_else(|| ExportError::Format { path: path.into() })?;
    let pixels = size * scale;
    if format == Format::Png && pixels.max_elem() > MAX_PIXELS {
        return Err(ExportError::TooLarge { side: pixels.max_elem() as u32 });
    }
    let context = Context::default();
    theme::apply(&context, Pointing::Mouse);
    context.set_theme(if is_dark { ThemePreference::Dark } else { ThemePreference::Light });
    let mut stage =
        Stage::new(context, pixels.x.round() as usize, pixels.y.round() as usize, scale);
    stage.settle(FRAMES, |ui| {
        CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
            show(ui);
        });
    });
    let under = ThemeColours::of_theme(!is_dark).background;
    match format {
        Format::Png => save_png(&stage.pixels(under), path)?,
        Format::Svg => {
            let text =
                svg::svg(stage.shapes(), Rect::from_min_size(Default::default(), size), under);
            armor_files::save_atomically(path, text.as_bytes())?;
        }
    }
    Ok(())
}

/// Nothing is joined in a picture.
struct Still;

impl JoinRules for Still {
    fn may_join(&self, _: PortAt, _: PortAt) -> Result<(), String> {
        Err("a picture is not edited".into())
    }
}
