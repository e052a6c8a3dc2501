//! `armor eval`: how far a trajectory is from what is known about it, and a map from another.

mod drawing;
mod maps;
mod plot;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use armor_grid_slam::evaluation::{
    Errors, Judged, Spread, by_kind, columns, judge, relations, spread, trajectory, worst,
};
use armor_grid_slam::laid::laid_over;
use armor_grid_slam::pose::Pose;
use clap::Args;
use serde_json::{Map, Value, json};

use crate::arguments::Format;
use crate::eval::drawing::Form;
use crate::eval::maps::{Agreement, compared};
use crate::exit::Ending;
use crate::inspect_cli::say;

#[derive(Args, Debug)]
pub struct Eval {
    /// The trajectory: scan,timestamp_s,x_m,y_m,theta_rad, as map-writer writes it.
    #[arg(required_unless_present_any = ["map", "curve"])]
    pub trajectory: Option<PathBuf>,
    /// Known relations between scans: i,j,kind,dx_m,dy_m,dtheta_rad.
    #[arg(long, value_name = "FILE", requires = "trajectory")]
    pub relations: Option<PathBuf>,
    /// A trajectory to compare with, after laying one over the other: scan by scan, or by time
    /// where the stamps are others, as in the truth.csv of a simulated run.
    #[arg(long, value_name = "FILE", requires = "trajectory")]
    pub reference: Option<PathBuf>,
    /// A map to compare with --reference-map.
    #[arg(long, value_name = "MAP.yaml", requires = "reference_map")]
    pub map: Option<PathBuf>,
    /// What the map should look like: another map, or the drawing of a world.
    #[arg(long, value_name = "MAP.yaml|WORLD.svg", requires = "map")]
    pub reference_map: Option<PathBuf>,
    /// Lay the map over the other first: moved by up to 3 m and turned by up to 11 degrees.
    #[arg(long, requires = "map")]
    pub align: bool,
    /// How far off a wall may be and count as found, in metres.
    #[arg(long, default_value_t = 0.1, value_name = "METRES")]
    pub tolerance: f64,
    /// Draw every column of a CSV over its first one instead, such as time and memory by scan.
    #[arg(long, value_name = "FILE.csv", requires = "plot", conflicts_with_all = ["trajectory", "map"])]
    pub curve: Option<PathBuf>,
    /// Draw trajectories and errors, or the curves, as SVG or PNG.
    #[arg(long, value_name = "FILE.svg|FILE.png")]
    pub plot: Option<PathBuf>,
}

/// Distances to the reference, in metres: root of the mean square, mean, largest.
struct Absolute {
    root_m: f64,
    mean: Spread,
    most_m: f64,
}

/// What was asked for, as far as it was.
#[derive(Default)]
struct Found {
    way: Vec<(f64, Pose)>,
    judged: Vec<Judged>,
    laid: Vec<(f64, Pose, Pose)>,
    map: Option<Agreement>,
}

/// Prints the errors, and draws them if asked to.
///
/// # Errors
/// If a file cannot be read, written or understood.
pub fn run(eval: &Eval, format: Format) -> Result<Ending> {
    if let Some(path) = &eval.plot {
        Form::of(path)?;
    }
    if let (Some(curve), Some(path)) = (&eval.curve, &eval.plot) {
        plot::curves(&read(curve, columns)?).write(path)?;
        return Ok(Ending::Fine);
    }
    if eval.relations.is_none() && eval.reference.is_none() && eval.map.is_none() {
        bail!(
            "nothing to compare with; give --relations, --reference, or --map and --reference-map"
        );
    }
    let found = Found::look(eval)?;
    let told = if format == Format::Json { found.as_json().to_string() } else { found.in_words() };
    say(told)?;
    if let Some(path) = &eval.plot {
        plot::plot(&found.way, &found.laid, &found.judged).write(path)?;
    }
    Ok(Ending::Fine)
}

impl Found {
    fn look(eval: &Eval) -> Result<Self> {
        let mut found = Self::default();
        if let Some(path) = &eval.trajectory {
            let own = read(path, trajectory)?;
            if let Some(path) = &eval.relations {
                found.judged = judge(&own, &read(path, relations)?)
                    .with_context(|| format!("cannot compare with {}", path.display()))?;
            }
            if let Some(path) = &eval.reference {
                found.laid = laid_over(&own, &read(path, trajectory)?)
                    .with_context(|| format!("cannot compare with {}", path.display()))?;
            }
            found.way = own.into_values().collect();
        }
        if let (Some(map), Some(reference)) = (&eval.map, &eval.reference_map) {
            found.map = Some(compared(map, reference, eval.align, eval.tolerance)?);
        }
        Ok(found)
    }
}

fn read<T, E>(path: &Path, parse: impl Fn(&str) -> Result<T, E>) -> Result<T>
where
    E: std::error::Error + Send + Sync + 'static,
{
    let text = std::fs::read_to_string(path);
    let text = text.with_context(|| format!("cannot read {}", path.display()))?;
    parse(&text).with_context(|| format!("cannot read {}", path.display()))
}

fn absolute(laid: &[(f64, Pose, Pose)]) -> Option<Absolute> {
    let distances = laid.iter().map(|(_, pose, reference)| pose.distance_m(reference));
    let mean = spread(distances.clone());
    let root_m = mean.mean.hypot(mean.deviation);
    (!laid.is_empty()).then(|| Absolute { root_m, mean, most_m: distances.fold(0.0, f64::max) })
}

impl Found {
    fn in_words(&self) -> String {
        let mut lines = Vec::new();
        if !self.judged.is_empty() {
            lines.push(format!(
                "{:<10} {:>6}  {:>17}  {:>15}",
                "relations", "", "metres", "degrees"
            ));
        }
        lines.extend(by_kind(&self.judged).into_iter().map(
            |(kind, Errors { count, metres, degrees })| {
                format!(
                    "{kind:<10} {count:>6}  {:>8.4} ± {:<6.4}  {:>7.3} ± {:<5.3}",
                    metres.mean, metres.deviation, degrees.mean, degrees.deviation
                )
            },
        ));
        lines.extend(absolute(&self.laid).map(|Absolute { root_m, mean, most_m }| {
            format!(
                "absolute, laid over the reference: rms {root_m:.4} m, mean {:.4} ± {:.4} m, most {most_m:.4} m",
                mean.mean, mean.deviation
            )
        }));
        lines.extend(self.map.as_ref().map(map_in_words));
        if !self.judged.is_empty() {
            lines.push("worst:".into());
        }
        lines.extend(worst(&self.judged).into_iter().map(
            |Judged { relation, metres, degrees }| {
                let (from, to, kind) = (relation.from, relation.to, &relation.kind);
                format!("  {kind} {from} to {to}: {metres:.4} m, {degrees:.3} deg")
            },
        ));
        lines.join("\n")
    }

    fn as_json(&self) -> Value {
        let of = |Spread { mean, deviation }: Spread| json!({"mean": mean, "deviation": deviation});
        let kinds: Map<String, Value> = by_kind(&self.judged)
            .into_iter()
            .map(|(kind, errors)| {
                let (metres, degrees) = (of(errors.metres), of(errors.degrees));
                (kind, json!({"count": errors.count, "metres": metres, "degrees": degrees}))
            })
            .collect();
        let absolute = absolute(&self.laid).map(|Absolute { root_m, mean, most_m }| {
            json!({"rms_m": root_m, "mean_m": mean.mean, "deviation_m": mean.deviation, "most_m": most_m})
        });
        let worst: Vec<Value> = worst(&self.judged)
            .into_iter()
            .map(|Judged { relation, metres, degrees }| {
                let (from, to, kind) = (relation.from, relation.to, &relation.kind);
                json!({"kind": kind, "i": from, "j": to, "metres": metres, "degrees": degrees})
            })
            .collect();
        let map = self.map.as_ref().map(|Agreement { score, moved }| {
            json!({
                "walls": {"found": score.wall_recall, "right": score.wall_precision},
                "free": {"found": score.free_recall, "right": score.free_precision},
                "moved": {"x_m": moved.x_m, "y_m": moved.y_m, "theta_rad": moved.yaw_rad},
            })
        });
        json!({"relations": kinds, "absolute": absolute, "worst": worst, "map": map})
    }
}

fn map_in_words(Agreement { score, moved }: &Agreement) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let line = |what: &str, found: f64, right: f64| {
        format!("{what:<10} {:>7} found  {:>7} right", percent(found), percent(right))
    };
    let mut lines = vec![
        line("walls", score.wall_recall, score.wall_precision),
        line("free space", score.free_recall, score.free_precision),
    ];
    if *moved != Pose::default() {
        let Pose { x_m, y_m, yaw_rad } = moved;
        let degrees = yaw_rad.to_degrees();
        lines.push(format!(
            "the map was moved by {x_m:.3} m, {y_m:.3} m and turned by {degrees:.2} deg"
        ));
    }
    lines.join("\n")
}
