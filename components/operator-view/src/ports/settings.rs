//! The parameters of the component and its console.

use std::path::PathBuf;

use armor_convert::locate_level;
use armor_sdk::prelude::*;
use armor_sdk::wire::text_format::TextFormat;
use armor_sdk::{FromValue, ValueError};

use crate::console::Console;
use crate::scene::LaserPlace;

/// The parameters of the operator's screen.
pub(super) const PARAMETERS: &[Parameter] = &[
    Parameter::flag("window")
        .default("true")
        .doc("opens a window; without it only the picture is made"),
    Parameter::path("picture")
        .default("")
        .written()
        .doc("a PNG of the screen, made every picture_period and at the end, in the run's folder"),
    Parameter::number("picture_period", "s")
        .default("2s")
        .range(0.1, 3600.0)
        .doc("the picture is made this often"),
    Parameter::integer("width")
        .default("1280")
        .range(320.0, 8192.0)
        .doc("of the window in points, of the picture in pixels"),
    Parameter::integer("height")
        .default("800")
        .range(240.0, 8192.0)
        .doc("of the window in points, of the picture in pixels"),
    Parameter::number("scale", "")
        .default("1")
        .range(0.5, 4.0)
        .doc("pixels of the picture for each point"),
    Parameter::flag("light")
        .default("false")
        .doc("begins with the light theme, for sunlight; the screen has a button for it, too"),
    Parameter::text("buttons").default("").format(TextFormat::Names).doc(
        "words, such as `explore home`: a button each, which sends an event of that name to the \
         mission",
    ),
    Parameter::number("speed", "m/s")
        .default("0.5m/s")
        .range(0.01, 5.0)
        .doc("fastest speed by hand"),
    Parameter::number("turn", "rad/s")
        .default("1rad/s")
        .range(0.01, 10.0)
        .doc("fastest turn by hand"),
    Parameter::number("tolerance", "m")
        .default("0.3m")
        .range(0.02, 10.0)
        .doc("a goal is reached within this"),
    Parameter::number("robot_radius", "m")
        .default("0.18m")
        .range(0.02, 5.0)
        .doc("circle that is drawn for the robot"),
    Parameter::text("frames")
        .default("")
        .format(TextFormat::Frames)
        .live()
        .doc("the frames of the file: where the laser is on the robot"),
    Parameter::text("laser_frame")
        .default("laser")
        .format(TextFormat::Frame)
        .live()
        .doc("the laser's frame"),
];

/// What concerns the component itself.
pub(super) struct ViewSettings {
    pub(super) window: bool,
    pub(super) picture: Option<PathBuf>,
    pub(super) picture_period_s: f64,
    pub(super) size: [usize; 2],
    pub(super) scale: f64,
    /// The frames of the file.
    frames: Vec<FixedFrame>,
    /// The laser's.
    laser_frame: String,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            window: true,
            picture: None,
            picture_period_s: 2.0,
            size: [1280, 800],
            scale: 1.0,
            frames: Vec::new(),
            laser_frame: "laser".into(),
        }
    }
}

impl ViewSettings {
    /// Takes a parameter, for the component or its console.
    pub(super) fn take_parameter(
        &mut self,
        console: &mut Console,
        name: &str,
        value: &Value,
    ) -> Result<(), Fault> {
        let limits = &mut console.orders.limits;
        match name {
            "window" => self.window = value.flag()?,
            "picture" => self.picture = picture_path(value)?,
            "picture_period" => self.picture_period_s = value.number()?,
            "width" => self.size[0] = value.integer()?.unsigned_abs() as usize,
            "height" => self.size[1] = value.integer()?.unsigned_abs() as usize,
            "buttons" => console.buttons = parse_buttons(value.text()?)?,
            "light" => console.is_light = value.flag()?,
            "scale" => self.scale = value.number()?,
            "speed" => limits.speed_mps = value.number()?,
            "turn" => limits.turn_radps = value.number()?,
            "tolerance" => limits.tolerance_m = value.number()?,
            "robot_radius" => console.robot_radius_m = value.number()?,
            "frames" => self.frames = Vec::from_value(value)?,
            "laser_frame" => self.laser_frame = String::from_value(value)?,
            _ => {}
        }
        console.scene.robot_from_laser = match locate_level(&self.frames, &self.laser_frame) {
            Ok(pose) => LaserPlace::Known(pose),
            Err(why) => LaserPlace::Unknown(why.to_string()),
        };
        Ok(())
    }
}

/// Most buttons that fit on a screen.
const MAX_BUTTONS: usize = 32;

/// The words of a text, each a name that a mission can wait for.
fn parse_buttons(text: &str) -> Result<Vec<String>, Fault> {
    let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
    let of_ours = ["stopped", "released", "goal", "arrived", "driving", "done", "failed"];
    let is_wrong =
        |word: &&String| !armor_sdk::wire::name::is_name(word) || of_ours.contains(&word.as_str());
    match words.iter().find(is_wrong) {
        Some(word) => Err(format!(
            "`{word}` cannot be a button: use letters, digits, _ and -, and none of {}",
            of_ours.join(", ")
        )
        .into()),
        None if words.len() > MAX_BUTTONS => Err(format!("more than {MAX_BUTTONS} buttons").into()),
        None => Ok(words),
    }
}

/// The file of the picture, if there is to be one.
fn picture_path(value: &Value) -> Result<Option<PathBuf>, ValueError> {
    if value.text()?.is_empty() { Ok(None) } else { value.path().map(Some) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buttons_are_names_of_events() {
        assert_eq!(parse_buttons(" explore  go-home\n").unwrap(), ["explore", "go-home"]);
        for (text, wrong) in [("home done", "done"), ("a/b", "a/b"), ("home stopped", "stopped")] {
            let error = parse_buttons(text).unwrap_err().to_string();
            assert!(error.starts_with(&format!("`{wrong}` cannot")), "{error}");
        }
    }
}
