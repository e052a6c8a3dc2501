//! The command line.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use lexopt::{Arg, Parser, ValueExt};

use crate::view::View;

/// What `--help` prints.
pub const HELP: &str = "\
Draws a robot as blocks and its mission as a net, and watches both run.

Usage: armor-designer [OPTIONS] [FILE]
       armor-designer [OPTIONS] RECORDING.mcap
       armor-designer --check FILE...
       armor-designer --screenshot OUT.png [--view VIEW] [--size WxH] [--theme THEME] FILE
       armor-designer --export OUT.svg [--view VIEW] FILE

  --attach [REGISTRY]    watches a running system without affecting it; without REGISTRY,
                         that of ARMOR_REGISTRY, or the only one of yours on this host
  --components DIR       looks for components there too; may be given again
  --check                prints what is wrong with the files, as `armor check` does, and ends
  --screenshot OUT.png   saves a picture of the whole window without opening one, and ends
  --export OUT           saves the drawing alone, as .svg or .png, and ends
  --view VIEW            system, mission, map or live: what is shown (system; live with --attach)
  --size WxH             points of the window in a screenshot (1280x800)
  --scale N              pixels of a point in a picture (1)
  --theme THEME          light or dark
  --help, --version

Exit codes: 0 fine, 1 the check or the picture failed, 2 a mistake in the command line.";

/// What is to be done.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// A window is opened.
    Window,
    /// The files are checked, nothing is shown.
    Check,
    /// A picture is taken, without a window.
    Picture(Picture),
    /// `--help`.
    Help,
    /// `--version`.
    Version,
}

/// What a picture is of, and the file that it becomes.
#[derive(Clone, Debug, PartialEq)]
pub enum Picture {
    /// The whole window.
    Window(PathBuf),
    /// The drawing alone.
    Drawing(PathBuf),
}

/// The command line as it was given.
#[derive(Clone, Debug, PartialEq)]
pub struct Arguments {
    /// What is to be done.
    pub task: Task,
    /// The files given.
    pub files: Vec<PathBuf>,
    /// The registry of a running system that is to be watched; inside none, the only one.
    pub attach: Option<Option<String>>,
    /// Component directories.
    pub components: Vec<PathBuf>,
    /// What is shown.
    pub view: View,
    /// Width and height in points.
    pub size: (u16, u16),
    /// Pixels of a point.
    pub scale: f32,
    /// Whether the theme is dark, if specified.
    pub is_dark: Option<bool>,
}

/// Why a command line is refused.
#[derive(Debug, thiserror::Error)]
pub enum UsageError {
    /// Not an option, or without its value.
    #[error(transparent)]
    Syntax(#[from] lexopt::Error),
    /// A value that cannot be.
    #[error("--{option} {value}: {expected}")]
    Value {
        /// The option, without dashes.
        option: &'static str,
        /// What was given.
        value: String,
        /// What may be.
        expected: &'static str,
    },
    /// No file, or too many.
    #[error("{0}")]
    Files(&'static str),
}

/// Largest picture in points: what the painter can hold.
const MAX_SIZE: u16 = 8192;
/// What is painted without a GPU needs some hundred bytes for a pixel.
const MAX_PIXELS: f64 = 64e6;

impl Arguments {
    /// Reads the arguments behind the program's name.
    ///
    /// # Errors
    /// If they make no sense.
    pub fn parse(given: impl IntoIterator<Item = OsString>) -> Result<Self, UsageError> {
        let mut arguments = Self {
            task: Task::Window,
            files: Vec::new(),
            attach: None,
            components: Vec::new(),
            view: View::System,
            size: (1280, 800),
            scale: 1.0,
            is_dark: None,
        };
        let mut shown = None;
        let mut parser = Parser::from_args(given);
        while let Some(argument) = parser.next()? {
            match argument {
                Arg::Long("check") => arguments.task = Task::Check,
                Arg::Long("screenshot") => {
                    arguments.task = Task::Picture(Picture::Window(parser.value()?.into()));
                }
                Arg::Long("export") => {
                    arguments.task = Task::Picture(Picture::Drawing(parser.value()?.into()));
                }
                Arg::Long("attach") => arguments.attach = Some(parse_registry(&mut parser)?),
                Arg::Long("components") => arguments.components.push(parser.value()?.into()),
                Arg::Long("view") => shown = Some(parse_view(&parser.value()?.string()?)?),
                Arg::Long("size") => arguments.size = parse_size(&parser.value()?.string()?)?,
                Arg::Long("scale") => arguments.scale = parse_scale(&parser.value()?.string()?)?,
                Arg::Long("theme") => {
                    arguments.is_dark = Some(parse_theme(&parser.value()?.string()?)?);
                }
                Arg::Long("help") | Arg::Short('h') => arguments.task = Task::Help,
                Arg::Long("version") | Arg::Short('V') => arguments.task = Task::Version,
                Arg::Value(file) => arguments.files.push(file.into()),
                other => return Err(other.unexpected().into()),
            }
        }
        // Who attaches wants to see what runs.
        let first = if arguments.attach.is_some() { View::Live } else { View::System };
        arguments.view = shown.unwrap_or(first);
        arguments.complete()
    }

    /// Of a picture of the window.
    fn pixels(&self) -> f64 {
        let scale = f64::from(self.scale);
        f64::from(self.size.0) * scale * f64::from(self.size.1) * scale
    }

    fn complete(self) -> Result<Self, UsageError> {
        match (&self.task, self.files.len()) {
            (Task::Check, 0) => Err(UsageError::Files("--check needs a file")),
            (Task::Picture(Picture::Window(_)), _) if self.pixels() > MAX_PIXELS => {
                let size = format!("{}x{}", self.size.0, self.size.1);
                Err(refused("size", &size, "with --scale it makes more than 64 million pixels"))
            }
            (Task::Picture(Picture::Window(path)), _) if !is_png(path) => {
                Err(refused("screenshot", &path.to_string_lossy(), "its name ends in .png"))
            }
            (Task::Window | Task::Picture(_), 2..) => Err(UsageError::Files(
                "one file at a time: its mission or system is opened with it",
            )),
            (Task::Picture(Picture::Drawing(_)), 0) => {
                Err(UsageError::Files("--export needs a file"))
            }
            _ => Ok(self),
        }
    }
}

fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
}

/// The value of `--attach`, which may be missing; a file is none.
fn parse_registry(parser: &mut Parser) -> Result<Option<String>, UsageError> {
    let Some(mut rest) = parser.try_raw_args() else {
        // As --attach=ADDRESS.
        return Ok(Some(parser.value()?.string()?));
    };
    let is_address = |value: &OsStr| {
        value
            .to_str()
            .and_then(|text| text.rsplit_once(':'))
            .is_some_and(|(_, port)| port.parse::<u16>().is_ok())
    };
    Ok(rest.next_if(is_address).map(|value| value.string()).transpose()?)
}

fn parse_view(value: &str) -> Result<View, UsageError> {
    match value {
        "system" => Ok(View::System),
        "mission" => Ok(View::Mission),
        "map" => Ok(View::Map),
        "live" => Ok(View::Live),
        _ => Err(refused("view", value, "it is system, mission, map or live")),
    }
}

fn parse_size(value: &str) -> Result<(u16, u16), UsageError> {
    let number = |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIZE).contains(side));
    value
        .split_once(['x', 'X', '×'])
        .and_then(|(width, height)| Some((number(width)?, number(height)?)))
        .ok_or_else(|| refused("size", value, "write it as 1280x800, each from 1 to 8192"))
}

fn parse_scale(value: &str) -> Result<f32, UsageError> {
    let number = value.parse().ok().filter(|scale| (0.25..=4.0).contains(scale));
    number.ok_or_else(|| refused("scale", value, "it is a number from 0.25 to 4"))
}

fn parse_theme(value: &str) -> Result<bool, UsageError> {
    match value {
        "dark" => Ok(true),
        "light" => Ok(false),
        _ => Err(refused("theme", value, "it is light or dark")),
    }
}

fn refused(option: &'static str, value: &str, expected: &'static str) -> UsageError {
    UsageError::Value { option, value: value.to_owned(), expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<Arguments, String> {
        Arguments::parse(line.split_whitespace().map(OsString::from)).map_err(|e| e.to_string())
    }

    #[test]
    fn a_screenshot_says_what_and_how_large() {
        let line = "--screenshot a.png --view mission --size 640x480 --theme dark a.xml";
        let arguments = parsed(line).expect("fine");
        assert_eq!(arguments.task, Task::Picture(Picture::Window("a.png".into())));
        assert_eq!((arguments.view, arguments.size), (View::Mission, (640, 480)));
        assert_eq!(arguments.is_dark, Some(true));
        assert_eq!(arguments.files, [PathBuf::from("a.xml")]);
    }

    #[track_caller]
    fn attaches(line: &str, registry: Option<&str>, files: usize) {
        let arguments = parsed(line).expect("fine");
        let expected = (Some(registry.map(ToOwned::to_owned)), files);
        assert_eq!((arguments.attach, arguments.files.len()), expected);
    }

    #[test]
    fn the_registry_may_be_left_out() {
        attaches("--attach", None, 0);
        attaches("--attach a.xml", None, 1);
        attaches("--attach 10.0.0.1:9 a.xml", Some("10.0.0.1:9"), 1);
        attaches("--attach=10.0.0.1:9", Some("10.0.0.1:9"), 0);
    }

    #[test]
    fn who_attaches_sees_what_runs_or_the_view_that_is_named() {
        let view = |line: &str| parsed(line).expect("fine").view;
        assert_eq!(view("--attach 10.0.0.1:9 a.xml"), View::Live);
        assert_eq!(view("--view map --attach 10.0.0.1:9 a.xml"), View::Map);
        assert_eq!(view("--attach --view map"), View::Map);
    }

    #[track_caller]
    fn refuses(line: &str, part: &str) {
        let error = parsed(line).expect_err("it makes no sense");
        assert!(error.contains(part), "{error}");
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_what_would() {
        refuses("--size 3 a.xml", "1280x800");
        refuses("--size 0x9 a.xml", "1280x800");
        refuses("--view all a.xml", "mission");
        refuses("--check", "needs a file");
        refuses("a.xml b.xml", "one file at a time");
        refuses("--unknown", "--unknown");
        refuses("--scale 99 a.xml", "0.25");
        refuses("--screenshot a.png --size 8192x8192 --scale 4 a.xml", "64 million");
        refuses("--screenshot a.txt a.xml", ".png");
    }
}
