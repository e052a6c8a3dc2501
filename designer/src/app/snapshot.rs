//! `--screenshot` and `--export`: a picture of the window or the drawing, without a window.

use std::path::Path;
use std::sync::Arc;

use eframe::egui::Context;

use crate::app::{Designer, Start};
use crate::arguments::{Arguments, Picture, Task};
use crate::export::{ExportError, PngError, Stage, save_png};
use crate::kinds::{Kinds, KindsError, find_armor};
use crate::project::{OpenError, Project};
use crate::settings::Settings;
use armor_picture::theme::ThemeColours;

/// Frames until the layout of the window is stable.
const FRAMES: usize = 12;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The kinds are unknown, so the blocks would have no ports.
    #[error(transparent)]
    Kinds(#[from] KindsError),
    /// The drawing cannot be saved.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// The picture cannot be saved.
    #[error(transparent)]
    Png(#[from] PngError),
}

/// Takes the picture that the command line asks for, if it asks for one. Nothing of the user's is
/// read or written but the file and the picture, so that the same file gives the same picture.
///
/// # Errors
/// If the file cannot be opened, no kinds are known, or the picture cannot be saved.
pub fn take_picture(arguments: &Arguments) -> Result<(), PictureError> {
    let Task::Picture(picture) = &arguments.task else { return Ok(()) };
    let armor = find_armor().ok_or(KindsError::NoArmor)?;
    let file = arguments.files.first();
    let folder = match file {
        // Opened here too, so that a file that cannot be opened is an error.
        Some(file) => Project::open(file, Arc::default())?.folder(),
        None => Default::default(),
    };
    let kinds = Kinds::ask(&armor, &folder, &arguments.components)?;
    let context = Context::default();
    let is_dark = arguments.is_dark.unwrap_or(false);
    let mut settings = Settings::default();
    settings.set_dark(is_dark);
    let start = Start {
        file: file.cloned(),
        view: arguments.view,
        kinds: Some(kinds),
        first_page: file.is_none(),
        ..Start::default()
    };
    let mut designer = Designer::new(&context, start, settings);
    designer.workspace().project.settle();
    match picture {
        Picture::Drawing(to) => {
            let (pane, workspace) = designer.pane();
            Ok(pane.export(workspace, to, is_dark, arguments.scale)?)
        }
        Picture::Window(to) => screenshot(&mut designer, &context, arguments, to),
    }
}

fn screenshot(
    designer: &mut Designer,
    context: &Context,
    arguments: &Arguments,
    to: &Path,
) -> Result<(), PictureError> {
    let scale = arguments.scale;
    let side = |points: u16| (f32::from(points) * scale).round() as usize;
    let (width, height) = (side(arguments.size.0), side(arguments.size.1));
    let mut stage = Stage::new(context.clone(), width, height, scale);
    stage.settle(FRAMES, |ui| designer.show(ui));
    let (pane, workspace) = designer.pane();
    pane.finish_loading(context, workspace);
    stage.settle(FRAMES, |ui| designer.show(ui));
    let is_dark = context.theme() == eframe::egui::Theme::Dark;
    let under = ThemeColours::of_theme(!is_dark).background;
    Ok(save_png(&stage.pixels(under), to)?)
}
