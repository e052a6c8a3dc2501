//! The screen as a PNG file, without a window, painted on a thread of its own.

use armor_picture::theme::ThemeColours;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use armor_files::{create_private_folder, replace_private_file};
use armor_picture::{PixelsPngError, Stage};
use eframe::egui::Context;

use crate::console::Console;
use crate::links::ClockTimes;
use crate::screen::{Screen, SidePanel, apply_theme};

/// Frames until sizes that depend on one another have settled.
const FRAMES: usize = 3;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ScreenPictureError {
    /// It cannot be encoded.
    #[error(transparent)]
    Encode(#[from] PixelsPngError),
    /// It cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the file system.
        source: std::io::Error,
    },
}

/// A screen without a window.
struct ScreenPicture {
    stage: Stage,
    screen: Screen,
}

impl ScreenPicture {
    /// A screen of so many pixels, of which `pixels_per_point` make a point.
    fn new(
        [width, height]: [usize; 2],
        pixels_per_point: f32,
        panels: Vec<Box<dyn SidePanel>>,
    ) -> Self {
        let context = Context::default();
        apply_theme(&context);
        let stage = Stage::new(context, width, height, pixels_per_point);
        Self { stage, screen: Screen::new(panels) }
    }

    /// Paints the screen as it looks now. Orders are not possible here.
    fn paint_png(
        &mut self,
        mut console: Console,
        now: ClockTimes,
    ) -> Result<Vec<u8>, PixelsPngError> {
        self.stage.settle(FRAMES, |ui| {
            self.screen.show_frame(ui, &mut console, now);
        });
        self.stage.pixels(ThemeColours::of_theme(console.is_light).unknown).png()
    }
}

/// Paints pictures on a thread, one at a time.
pub(crate) struct Painter {
    path: PathBuf,
    picture: Option<ScreenPicture>,
    painting: Option<JoinHandle<(ScreenPicture, Result<(), ScreenPictureError>)>>,
}

impl Painter {
    /// Will paint pictures of `size` pixels as the file at `path`.
    pub(crate) fn new(
        path: PathBuf,
        size: [usize; 2],
        pixels_per_point: f32,
        panels: Vec<Box<dyn SidePanel>>,
    ) -> Self {
        Self {
            path,
            picture: Some(ScreenPicture::new(size, pixels_per_point, panels)),
            painting: None,
        }
    }

    /// Begins to paint, unless the last picture is still being painted.
    ///
    /// # Errors
    /// If the last picture could not be made, or there can be no thread.
    pub(crate) fn begin_painting(
        &mut self,
        console: Console,
        now: ClockTimes,
    ) -> Result<(), ScreenPictureError> {
        if self.painting.as_ref().is_some_and(|painting| !painting.is_finished()) {
            return Ok(());
        }
        self.wait_for_painting()?;
        let Some(mut picture) = self.picture.take() else { return Ok(()) };
        let path = self.path.clone();
        let paint = move || {
            let outcome = paint_picture(&mut picture, console, now, &path);
            (picture, outcome)
        };
        let thread = std::thread::Builder::new().name("picture".into()).spawn(paint);
        self.painting = Some(
            thread
                .map_err(|source| ScreenPictureError::Write { path: self.path.clone(), source })?,
        );
        Ok(())
    }

    /// Paints the last one, and waits for it.
    ///
    /// # Errors
    /// If it could not be made.
    pub(crate) fn finish_painting(
        &mut self,
        console: Console,
        now: ClockTimes,
    ) -> Result<(), ScreenPictureError> {
        // A failure of the one before does not matter if this one is made.
        let _ = self.wait_for_painting();
        let Some(picture) = &mut self.picture else { return Ok(()) };
        paint_picture(picture, console, now, &self.path)
    }

    fn wait_for_painting(&mut self) -> Result<(), ScreenPictureError> {
        let Some(painting) = self.painting.take() else { return Ok(()) };
        // A panic has been logged, and there are no more pictures.
        let Ok((picture, outcome)) = painting.join() else { return Ok(()) };
        self.picture = Some(picture);
        outcome
    }
}

fn paint_picture(
    picture: &mut ScreenPicture,
    console: Console,
    now: ClockTimes,
    path: &Path,
) -> Result<(), ScreenPictureError> {
    save_file(path, &picture.paint_png(console, now)?)
}

/// Writes a file whole or not at all.
///
/// # Errors
/// If it or its folder cannot be written.
fn save_file(path: &Path, content: &[u8]) -> Result<(), ScreenPictureError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let written = create_private_folder(folder)
        .and_then(|()| replace_private_file(path, content).map_err(|error| error.reason));
    written.map_err(|source| ScreenPictureError::Write { path: path.into(), source })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_picture_is_written_whole_into_folders_that_are_made_for_it() {
        let folder = std::env::temp_dir().join(format!("armor-view-{}", std::process::id()));
        let path = folder.join("deep/view.png");
        let mut painter = Painter::new(path.clone(), [400, 300], 1.0, Vec::new());
        painter.begin_painting(Console::default(), ClockTimes::default()).unwrap();
        painter.begin_painting(Console::default(), ClockTimes::default()).unwrap();
        painter.finish_painting(Console::default(), ClockTimes::default()).unwrap();
        let bytes = fs::read(&path).unwrap();
        let reader = ::png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        assert_eq!((reader.info().width, reader.info().height), (400, 300));
        let others = fs::read_dir(path.parent().unwrap()).unwrap().count();
        assert_eq!(others, 1, "nothing but the picture is left");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_folder_that_cannot_be_is_an_error_that_names_the_file() {
        let mut painter = Painter::new("/proc/no/view.png".into(), [40, 30], 1.0, Vec::new());
        let error = painter
            .finish_painting(Console::default(), ClockTimes::default())
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("cannot write /proc/no/view.png"), "{error}");
    }
}
