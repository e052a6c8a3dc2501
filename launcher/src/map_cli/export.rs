//! `armor map export`: the map and routes of a mission file as a plan for other planners.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use armor_exchange::{PlanFormat, write_plan};
use armor_robotfile::drawn_route::DrawnRoute;
use armor_robotfile::{Mission, advise_similar};
use clap::{Args, ValueEnum};
use serde_json::json;

use super::drawing::ComponentPort;
use super::import::parse_port;
use super::plan_file::{format_of, notes_to_json, print_notes};
use super::planning::plan_drawing;
use crate::arguments::OutputFormat;
use crate::check::STDIN;
use crate::exit::CommandEnding;
use crate::findings_error::refuse_file;
use crate::print::{end_printing, print_line, print_text};

/// A format, as it is named on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PlanFormatName {
    /// QGroundControl's .plan.
    Plan,
    /// QGC WPL 110.
    Wpl,
    /// GPX 1.1.
    Gpx,
    /// GeoJSON.
    Geojson,
    /// KML.
    Kml,
}

impl From<PlanFormatName> for PlanFormat {
    fn from(name: PlanFormatName) -> Self {
        match name {
            PlanFormatName::Plan => Self::GroundControl,
            PlanFormatName::Wpl => Self::WaypointList,
            PlanFormatName::Gpx => Self::Gpx,
            PlanFormatName::Geojson => Self::GeoJson,
            PlanFormatName::Kml => Self::Kml,
        }
    }
}

/// Write the map and routes of a mission file as a plan for other planners. What has no counterpart
/// is named on stderr.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor map export mission.xml mission.plan
  armor map export mission.xml --route red --as gpx -    to stdout")]
pub struct ExportArguments {
    /// The mission file.
    pub file: PathBuf,
    /// The plan that is written; - is stdout.
    pub out: PathBuf,
    /// The route; may be given several times. Default: all.
    #[arg(long, value_name = "NAME")]
    pub route: Vec<String>,
    /// The format. Default: that of the name of OUT.
    #[arg(long = "as", value_enum, value_name = "FORMAT")]
    pub plan_format: Option<PlanFormatName>,
    /// The component whose legs and stays are commands to take pictures, and its report.
    #[arg(long, value_name = "COMPONENT.REPORT", value_parser = parse_port)]
    pub camera: Option<ComponentPort>,
}

/// Writes the plan.
///
/// # Errors
/// If the file has errors, no map with an origin, or no such route, or the format has no place for
/// its routes.
pub fn export_plan(arguments: &ExportArguments, format: OutputFormat) -> Result<CommandEnding> {
    let ExportArguments { file, out, .. } = arguments;
    let is_stdout = out.as_os_str() == STDIN;
    let target = match arguments.plan_format {
        Some(name) => name.into(),
        None if is_stdout => bail!("write --as with the format: stdout has no name"),
        None => format_of(out)?,
    };
    let reading = armor_robotfile::check(armor_robotfile::load(file), &[], None);
    let Some(configuration) = reading.configuration.as_ref().filter(|_| reading.is_valid()) else {
        return Err(refuse_file(file, &reading.findings));
    };
    let mission = configuration.mission.as_ref();
    let (mission, map) = mission
        .and_then(|mission| Some((mission, mission.map.as_ref()?)))
        .with_context(|| format!("{} has no <map>", file.display()))?;
    let routes = choose_routes(mission, &arguments.route, file)?;
    let plan = plan_drawing(map, &routes, arguments.camera.as_ref())
        .with_context(|| file.display().to_string())?;
    let (text, lost) = write_plan(&plan, target).with_context(|| match routes.len() {
        0 | 1 => out.display().to_string(),
        _ => format!("{}: choose a route with --route", out.display()),
    })?;
    if !is_stdout {
        std::fs::write(out, &text).with_context(|| format!("cannot write {}", out.display()))?;
    }
    let notes: Vec<_> = plan.notes.iter().chain(&lost).cloned().collect();
    end_printing(match format {
        OutputFormat::Json => {
            let text = is_stdout.then_some(text);
            print_line(json!({ "text": text, "notes": notes_to_json(&notes) }))
        }
        _ if is_stdout => print_text(text),
        _ => Ok(()),
    })?;
    if format != OutputFormat::Json {
        print_notes(file, &notes);
    }
    Ok(CommandEnding::Fine)
}

/// The routes with these names; all without names.
fn choose_routes<'a>(
    mission: &'a Mission,
    names: &[String],
    file: &Path,
) -> Result<Vec<&'a DrawnRoute>> {
    if names.is_empty() {
        return Ok(mission.routes.iter().collect());
    }
    let known = || mission.routes.iter().map(|route| route.name.value.as_str());
    let find = |name: &String| {
        let route = mission.routes.iter().find(|route| route.name.value == *name);
        route.with_context(|| {
            let advice = advise_similar(name, known());
            let all = known().collect::<Vec<_>>().join(", ");
            format!("{} has no route {name}{advice} (it has: {all})", file.display())
        })
    };
    names.iter().map(find).collect()
}
