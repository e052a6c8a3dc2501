//! `armor map import`: a plan of another planner as a map and a route of a mission file.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use armor_robotfile::{Configuration, Document, read_bytes};
use armor_wire::name::{is_name, split_data};
use clap::Args;
use serde_json::json;

use super::drawing::{ComponentPort, Drawing, DrawingOptions, ExistingDrawing, PositionForm};
use super::drawn_plan::draw_plan;
use super::insertion::{GOAL, find_existing, insert_drawing, make_file};
use super::plan_file::{load_plan, notes_to_json, print_notes};
use super::text_difference::unified_difference;
use crate::arguments::{KindFolders, OutputFormat};
use crate::check::{CheckedFile, check_reading};
use crate::exit::CommandEnding;
use crate::findings_error::refuse_file;
use crate::print::{end_printing, print_line, print_notice, print_text, print_wrapped};

/// The kind whose parameter `route` takes the point of a leg.
const MOVER_KIND: &str = "patrol";
const MOVER_PARAMETER: &str = "route";
/// The mover of a file that has no system.
const NEW_MOVER: &str = "way";
/// How findings name a file that is printed.
const NEW_FILE: &str = "<the new mission>";

/// Draw a plan of another planner into a mission file: its waypoints as points and legs, fences as
/// zones, rally points as such. Prints what would change; what has no counterpart is named on
/// stderr and kept as a comment.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor map import field.plan --into robot.xml            print what would change
  armor map import field.plan --into robot.xml --write    change the file
  armor map import field.plan --system robot.xml > mission.xml    a mission of its own")]
pub struct ImportArguments {
    /// The plan: .plan, .waypoints, .gpx, .geojson or .kml.
    pub plan: PathBuf,
    /// The file that it is drawn into.
    #[arg(long, value_name = "FILE.xml")]
    pub into: Option<PathBuf>,
    /// Change the file, unless it has errors then.
    #[arg(long, requires = "into")]
    pub write: bool,
    /// The file with the system of a new mission. Default: print the map and the route alone.
    #[arg(long, value_name = "FILE.xml", conflicts_with = "into")]
    pub system: Option<PathBuf>,
    /// The name of the new route. Default: the plan's, or route.
    #[arg(long, value_name = "NAME", value_parser = parse_name)]
    pub route: Option<String>,
    /// The route of the plan, by its name or number, if it has several.
    #[arg(long, value_name = "ROUTE")]
    pub only: Option<String>,
    /// The parameter that takes the point of a leg. Default: that of the only component of the kind
    /// patrol; without a system, way.route.
    #[arg(long, value_name = "COMPONENT.PARAMETER", value_parser = parse_port)]
    pub mover: Option<ComponentPort>,
    /// The parameter for the speeds of the plan.
    #[arg(long, value_name = "COMPONENT.PARAMETER", value_parser = parse_port)]
    pub pace: Option<ComponentPort>,
    /// The output with the robot's pose.
    #[arg(long, value_name = "COMPONENT.OUTPUT", value_parser = parse_port)]
    pub pose: Option<ComponentPort>,
    /// A component that is active on every leg; may be given several times.
    #[arg(long, value_name = "COMPONENT", value_parser = parse_name)]
    pub active: Vec<String>,
    /// The component for pictures, and its report that it has taken one.
    #[arg(long, value_name = "COMPONENT.REPORT", value_parser = parse_port)]
    pub camera: Option<ComponentPort>,
    /// The place whose token begins the route. Default: it begins with the mission.
    #[arg(long = "in", value_name = "PLACE", value_parser = parse_name)]
    pub enter: Option<String>,
    /// The place after the last step. Default: the goal, if nothing else leads there.
    #[arg(long = "out", value_name = "PLACE", value_parser = parse_name)]
    pub leave: Option<String>,
    /// How positions are written.
    #[arg(long, value_enum, default_value = "metres")]
    pub positions: PositionForm,
    #[command(flatten)]
    pub kinds: KindFolders,
}

pub(super) fn parse_port(text: &str) -> Result<ComponentPort, String> {
    let (component, port) =
        split_data(text).ok_or("two names joined by a dot are expected, such as driver.speed")?;
    Ok(ComponentPort { component: component.to_owned(), port: port.to_owned() })
}

fn parse_name(text: &str) -> Result<String, String> {
    let expected = "a name is a letter, then letters, digits, _ and -; at most 64";
    is_name(text).then(|| text.to_owned()).ok_or_else(|| expected.to_owned())
}

/// A file before and after, and what was drawn.
pub(super) struct ChangedText {
    pub(super) before: String,
    pub(super) after: String,
    pub(super) drawing: Drawing,
}

/// Prints the file with the plan, or what changes in it; with `--write` changes it.
///
/// # Errors
/// If a file cannot be read or written, or the plan cannot be drawn.
pub fn import_plan(arguments: &ImportArguments, format: OutputFormat) -> Result<CommandEnding> {
    let path = arguments.into.as_deref().unwrap_or(Path::new(NEW_FILE));
    let changed = match &arguments.into {
        Some(file) => change_file(arguments, file)?,
        None => make_mission(arguments)?,
    };
    let ChangedText { before, after, drawing } = changed;
    let is_alone = arguments.into.is_none() && arguments.system.is_none();
    let checked = match is_alone {
        true => None,
        false => Some(check_text(path, after.as_bytes(), &arguments.kinds)?),
    };
    let is_accepted = checked.as_ref().is_none_or(|checked| checked.accepted().is_some());
    let is_written = arguments.write && is_accepted;
    if is_written {
        armor_files::save_atomically(path, after.as_bytes())?;
    }
    let is_new = arguments.into.is_none();
    let name = path.to_string_lossy();
    end_printing(match format {
        OutputFormat::Json => {
            let (key, text) = match is_new {
                true => ("text", after),
                false => ("difference", unified_difference(&name, &before, &after)),
            };
            let notes = notes_to_json(&drawing.notes);
            print_line(json!({ key: text, "written": is_written, "notes": notes }))
        }
        _ if is_new => print_text(&after),
        _ if is_written => print_wrapped(format_args!("{name} is written")),
        _ => print_text(unified_difference(&name, &before, &after)),
    })?;
    if format != OutputFormat::Json {
        print_notes(&arguments.plan, &drawing.notes);
    }
    if let Some(checked) = &checked {
        checked.print_problems(format);
    }
    if is_accepted {
        return Ok(CommandEnding::Fine);
    }
    if arguments.write {
        let text = format!("error: {name} has errors with the plan, and was not changed");
        print_notice(text);
    }
    Ok(CommandEnding::Failed)
}

/// The file with the plan in it.
fn change_file(arguments: &ImportArguments, file: &Path) -> Result<ChangedText> {
    let bytes = read_bytes(file).with_context(|| format!("cannot read {}", file.display()))?;
    let reading = armor_robotfile::load(file);
    let configuration = reading.configuration.as_ref();
    let mover = match &arguments.mover {
        Some(mover) => mover.clone(),
        None => find_mover(configuration, file)?,
    };
    let leave = arguments.leave.clone().or_else(|| find_goal(configuration));
    let options = make_options(arguments, mover, leave);
    draw_into(file, &bytes, configuration, |existing| {
        draw_plan(&load_plan(&arguments.plan)?, &options, existing)
            .with_context(|| arguments.plan.display().to_string())
    })
}

/// Puts a drawing into the bytes of a file, of which `configuration` was read.
pub(super) fn draw_into(
    file: &Path,
    bytes: &[u8],
    configuration: Option<&Configuration>,
    draw: impl FnOnce(&ExistingDrawing) -> Result<Drawing>,
) -> Result<ChangedText> {
    let mut document =
        Document::open(file, bytes).map_err(|findings| refuse_file(file, &findings))?;
    let existing =
        find_existing(&document, configuration).with_context(|| file.display().to_string())?;
    let drawing = draw(&existing)?;
    insert_drawing(&mut document, &drawing, None)?;
    let before = String::from_utf8_lossy(bytes).into_owned();
    let is_formatted = armor_robotfile::format(file, bytes).is_ok_and(|same| same == bytes);
    let after = lay_out(file, document.bytes(), is_formatted)?;
    Ok(ChangedText { before, after, drawing })
}

/// A mission of its own, or without a file for its system a map and a route alone.
fn make_mission(arguments: &ImportArguments) -> Result<ChangedText> {
    let path = Path::new(NEW_FILE);
    let system = arguments.system.as_deref();
    let mover = match (&arguments.mover, system) {
        (Some(mover), _) => mover.clone(),
        (None, None) => ComponentPort { component: NEW_MOVER.into(), port: MOVER_PARAMETER.into() },
        (None, Some(file)) => find_mover(armor_robotfile::load(file).configuration.as_ref(), file)?,
    };
    let leave = arguments.leave.clone().or_else(|| system.map(|_| GOAL.to_owned()));
    let options = make_options(arguments, mover, leave);
    let mut document = make_file(path).map_err(|findings| refuse_file(path, &findings))?;
    let existing = find_existing(&document, None)?;
    let drawing = draw_plan(&load_plan(&arguments.plan)?, &options, &existing)
        .with_context(|| arguments.plan.display().to_string())?;
    let system = system.map(|file| file.to_string_lossy());
    insert_drawing(&mut document, &drawing, system.as_deref())?;
    let mut after = lay_out(path, document.bytes(), true)?;
    if system.is_none() {
        after = take_drawing(&after);
    }
    Ok(ChangedText { before: String::new(), after, drawing })
}

/// The lines of the map and the route of a new mission.
fn take_drawing(text: &str) -> String {
    let is_before = |line: &&str| !line.trim_start().starts_with("<map");
    let is_within = |line: &&str| !line.trim_start().starts_with("<place");
    let lines = text.lines().skip_while(is_before).take_while(is_within);
    lines.map(|line| format!("{line}\n")).collect()
}

/// The text as `armor fmt` lays it out, if the file was laid out so before: then only the lines of
/// the drawing change.
fn lay_out(path: &Path, bytes: &[u8], is_formatted: bool) -> Result<String> {
    let bytes = match is_formatted {
        true => {
            armor_robotfile::format(path, bytes).map_err(|findings| refuse_file(path, &findings))?
        }
        false => bytes.to_vec(),
    };
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn make_options(
    arguments: &ImportArguments,
    mover: ComponentPort,
    leave: Option<String>,
) -> DrawingOptions {
    DrawingOptions {
        route: arguments.route.clone(),
        only: arguments.only.clone(),
        mover,
        pace: arguments.pace.clone(),
        pose: arguments.pose.clone(),
        active: arguments.active.clone(),
        camera: arguments.camera.clone(),
        enter: arguments.enter.clone(),
        leave,
        positions: arguments.positions,
    }
}

/// The only component of the kind that drives to points.
fn find_mover(configuration: Option<&Configuration>, file: &Path) -> Result<ComponentPort> {
    let components =
        configuration.map_or(&[][..], |configuration| configuration.system.components.as_slice());
    let movers = components.iter().filter(|component| component.kind.value == MOVER_KIND);
    let names: Vec<_> = movers.map(|component| component.name.value.as_str()).collect();
    match names.as_slice() {
        [only] => {
            Ok(ComponentPort { component: (*only).to_owned(), port: MOVER_PARAMETER.to_owned() })
        }
        [] => bail!(
            "{} has no component of the kind {MOVER_KIND}: write --mover COMPONENT.PARAMETER, the parameter that takes the point of a leg",
            file.display()
        ),
        several => bail!(
            "{} has several components of the kind {MOVER_KIND}: write --mover {}.{MOVER_PARAMETER}, or another of {}",
            file.display(),
            several[0],
            several.join(", ")
        ),
    }
}

/// The goal of the mission, if nothing leads there yet, or of the one that is drawn with the plan.
fn find_goal(configuration: Option<&Configuration>) -> Option<String> {
    let Some(mission) = configuration.and_then(|it| it.mission.as_ref()) else {
        return Some(GOAL.to_owned());
    };
    let is_empty = mission.routes.is_empty()
        && mission.transitions.is_empty()
        && mission.submissions.is_empty();
    mission.goal.as_ref().filter(|_| is_empty).map(|goal| goal.value.clone())
}

/// Checks a file as if it had this text.
pub(super) fn check_text(path: &Path, bytes: &[u8], kinds: &KindFolders) -> Result<CheckedFile> {
    let mut load =
        |asked: &Path| if asked == path { Ok(bytes.to_vec()) } else { read_bytes(asked) };
    check_reading(armor_robotfile::read(path, &mut load), &[], kinds)
}
