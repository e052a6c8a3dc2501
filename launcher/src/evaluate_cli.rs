//! `armor eval`: prints how far a trajectory is from known relations and a reference, and how well
//! a map agrees with another one.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use armor_evaluation::alignment::{
    AbsoluteErrors, AlignedPose, align_to_reference, measure_absolute_errors,
};
use armor_evaluation::columns::read_columns;
use armor_evaluation::map_agreement::{MapAgreement, MapAlignment, PlacedMap, compare_maps};
use armor_evaluation::plots::{draw_columns, draw_evaluation};
use armor_evaluation::relations::{
    JudgedRelation, RelationErrors, judge_relations, read_relations, select_worst,
    summarize_by_kind,
};
use armor_evaluation::statistics::Spread;
use armor_evaluation::trajectory::{ScanTrajectory, read_trajectory};
use armor_grid_slam::pose::Pose;
use armor_map_file::read_map_cells;
use armor_picture::plot_sheet::PictureFormat;
use armor_simulator::world::World;
use clap::Args;
use serde_json::{Map, Value, json};

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::print_line;
use crate::verb::Verb;

/// Measure a trajectory by relations between scans or a reference, and a map by another map.
#[derive(Args, Debug)]
pub struct EvalArguments {
    /// The trajectory: scan,timestamp_s,x_m,y_m,theta_rad, as map-writer writes it.
    #[arg(required_unless_present_any = ["map", "curve"])]
    trajectory: Option<PathBuf>,
    /// Known relations between scans: i,j,kind,dx_m,dy_m,dtheta_rad.
    #[arg(long, value_name = "FILE", requires = "trajectory")]
    relations: Option<PathBuf>,
    /// A trajectory to compare with, after aligning one with the other. Poses are matched by scan
    /// number, or by time where the stamps differ, as in the truth.csv of a simulated run.
    #[arg(long, value_name = "FILE", requires = "trajectory")]
    reference: Option<PathBuf>,
    /// A map to compare with --reference-map.
    #[arg(long, value_name = "MAP.yaml", requires = "reference_map")]
    map: Option<PathBuf>,
    /// What the map should look like: another map, or the drawing of a world.
    #[arg(long, value_name = "MAP.yaml|WORLD.svg", requires = "map")]
    reference_map: Option<PathBuf>,
    /// Align the map with the reference map first, by up to 3 m and 11 degrees.
    #[arg(long, requires = "map")]
    align: bool,
    /// How far off a wall may be and count as found, in metres.
    #[arg(long, default_value_t = 0.1, value_name = "METRES")]
    tolerance: f64,
    /// Draw every column of a CSV file over its first one instead, such as time and memory by scan.
    #[arg(long, value_name = "FILE.csv", requires = "plot", conflicts_with_all = ["trajectory", "map"])]
    curve: Option<PathBuf>,
    /// Draw trajectories and errors, or the curves, as SVG or PNG.
    #[arg(long, value_name = "FILE.svg|FILE.png")]
    plot: Option<PathBuf>,
}

impl Verb for EvalArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(evaluate(&self, format)?.into())
    }
}

/// The results of the comparisons that the arguments ask for.
#[derive(Default)]
struct Evaluation {
    trajectory: ScanTrajectory,
    judged: Vec<JudgedRelation>,
    aligned: Vec<AlignedPose>,
    map: Option<MapAgreement>,
}

/// Prints the errors, and draws them if `--plot` is given.
///
/// # Errors
/// If a file cannot be read, parsed or written.
fn evaluate(arguments: &EvalArguments, format: OutputFormat) -> Result<CommandEnding> {
    if let Some(path) = &arguments.plot {
        PictureFormat::from_path(path)?;
    }
    if let (Some(curve), Some(path)) = (&arguments.curve, &arguments.plot) {
        draw_columns(&read_file(curve, read_columns)?).write_file(path)?;
        return Ok(CommandEnding::Fine);
    }
    if arguments.relations.is_none() && arguments.reference.is_none() && arguments.map.is_none() {
        bail!(
            "nothing to compare with; give --relations, --reference, or --map and --reference-map"
        );
    }
    let evaluation = Evaluation::measure(arguments)?;
    let is_json = format == OutputFormat::Json;
    print_line(if is_json { evaluation.to_json().to_string() } else { evaluation.to_text() })?;
    if let Some(path) = &arguments.plot {
        let Evaluation { trajectory, aligned, judged, .. } = &evaluation;
        draw_evaluation(trajectory, aligned, judged).write_file(path)?;
    }
    Ok(CommandEnding::Fine)
}

impl Evaluation {
    fn measure(arguments: &EvalArguments) -> Result<Self> {
        let mut evaluation = Self::default();
        if let Some(path) = &arguments.trajectory {
            evaluation.trajectory = read_file(path, read_trajectory)?;
            let own = &evaluation.trajectory;
            if let Some(path) = &arguments.relations {
                evaluation.judged = judge_relations(own, &read_file(path, read_relations)?)
                    .with_context(|| format!("cannot compare with {}", path.display()))?;
            }
            if let Some(path) = &arguments.reference {
                evaluation.aligned = align_to_reference(own, &read_file(path, read_trajectory)?)
                    .with_context(|| format!("cannot compare with {}", path.display()))?;
            }
        }
        if let (Some(map), Some(reference)) = (&arguments.map, &arguments.reference_map) {
            let map = read_map(map)?;
            let is_world = reference.extension().is_some_and(|ending| ending == "svg");
            let reference = if is_world {
                read_world(reference, map.cells.geometry().resolution_m)?
            } else {
                read_map(reference)?
            };
            let alignment =
                if arguments.align { MapAlignment::Search } else { MapAlignment::SameFrame };
            evaluation.map = Some(compare_maps(&map, &reference, alignment, arguments.tolerance));
        }
        Ok(evaluation)
    }

    fn to_text(&self) -> String {
        let mut lines = Vec::new();
        if !self.judged.is_empty() {
            lines.push(format!(
                "{:<10} {:>6}  {:>17}  {:>15}",
                "relations", "", "metres", "degrees"
            ));
        }
        lines.extend(summarize_by_kind(&self.judged).into_iter().map(
            |(kind, RelationErrors { count, metres, degrees })| {
                format!(
                    "{kind:<10} {count:>6}  {:>8.4} ± {:<6.4}  {:>7.3} ± {:<5.3}",
                    metres.mean, metres.deviation, degrees.mean, degrees.deviation
                )
            },
        ));
        lines.extend(measure_absolute_errors(&self.aligned).map(
            |AbsoluteErrors { rms_m, spread, max_m }| {
                format!(
                    "distance to the reference after alignment: rms {rms_m:.4} m, mean {:.4} ± {:.4} m, \
                     max {max_m:.4} m",
                    spread.mean, spread.deviation
                )
            },
        ));
        lines.extend(self.map.as_ref().map(format_agreement));
        if !self.judged.is_empty() {
            lines.push("worst:".into());
        }
        lines.extend(select_worst(&self.judged).into_iter().map(
            |JudgedRelation { relation, metres, degrees }| {
                let (from, to, kind) = (relation.from, relation.to, &relation.kind);
                format!("  {kind} {from} to {to}: {metres:.4} m, {degrees:.3} deg")
            },
        ));
        lines.join("\n")
    }

    fn to_json(&self) -> Value {
        let of = |Spread { mean, deviation }: Spread| json!({"mean": mean, "deviation": deviation});
        let kinds: Map<String, Value> = summarize_by_kind(&self.judged)
            .into_iter()
            .map(|(kind, errors)| {
                let (metres, degrees) = (of(errors.metres), of(errors.degrees));
                (kind, json!({"count": errors.count, "metres": metres, "degrees": degrees}))
            })
            .collect();
        let absolute = measure_absolute_errors(&self.aligned).map(|errors| {
            json!({
                "rms_m": errors.rms_m,
                "mean_m": errors.spread.mean,
                "deviation_m": errors.spread.deviation,
                "most_m": errors.max_m,
            })
        });
        let worst: Vec<Value> = select_worst(&self.judged)
            .into_iter()
            .map(|JudgedRelation { relation, metres, degrees }| {
                let (from, to, kind) = (relation.from, relation.to, &relation.kind);
                json!({"kind": kind, "i": from, "j": to, "metres": metres, "degrees": degrees})
            })
            .collect();
        let map = self.map.as_ref().map(|MapAgreement { score, motion }| {
            json!({
                "walls": {"found": score.wall_recall, "right": score.wall_precision},
                "free": {"found": score.free_recall, "right": score.free_precision},
                "moved": {"x_m": motion.x_m, "y_m": motion.y_m, "theta_rad": motion.yaw_rad},
            })
        });
        json!({"relations": kinds, "absolute": absolute, "worst": worst, "map": map})
    }
}

fn read_file<T, E>(path: &Path, parse: impl Fn(&str) -> Result<T, E>) -> Result<T>
where
    E: std::error::Error + Send + Sync + 'static,
{
    let text = std::fs::read_to_string(path);
    let text = text.with_context(|| format!("cannot read {}", path.display()))?;
    parse(&text).with_context(|| format!("cannot read {}", path.display()))
}

fn read_map(path: &Path) -> Result<PlacedMap> {
    let (cells, origin) = read_map_cells(path).context("cannot compare maps")?;
    let map_from_cells = Pose::new(origin.x_m, origin.y_m, origin.yaw_rad);
    Ok(PlacedMap { cells, map_from_cells })
}

/// Reads the world of a drawing as the map that a robot would draw: in the frame of its start.
fn read_world(path: &Path, resolution_m: f64) -> Result<PlacedMap> {
    let world = World::read(path).context("cannot compare maps")?;
    let cells = world.free_space(resolution_m)?;
    Ok(PlacedMap { cells, map_from_cells: Pose::default() })
}

fn format_agreement(MapAgreement { score, motion }: &MapAgreement) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let line = |what: &str, found: f64, right: f64| {
        format!("{what:<10} {:>7} found  {:>7} right", percent(found), percent(right))
    };
    let mut lines = vec![
        line("walls", score.wall_recall, score.wall_precision),
        line("free space", score.free_recall, score.free_precision),
    ];
    if *motion != Pose::default() {
        let Pose { x_m, y_m, yaw_rad } = motion;
        let degrees = yaw_rad.to_degrees();
        lines.push(format!(
            "the map was moved by {x_m:.3} m, {y_m:.3} m and turned by {degrees:.2} deg"
        ));
    }
    lines.join("\n")
}
