//! `armor eval`: how far a trajectory is from what is known about it.

mod plot;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use armor_grid_slam::evaluation::{
    Errors, Judged, Spread, by_kind, judge, relations, spread, trajectory, worst,
};
use armor_grid_slam::laid::laid_over;
use armor_grid_slam::pose::Pose;
use clap::Args;
use serde_json::{Map, Value, json};

use crate::arguments::Format;
use crate::exit::Ending;
use crate::look::say;

#[derive(Args, Debug)]
pub struct Eval {
    /// The trajectory: scan,timestamp_s,x_m,y_m,theta_rad, as map-writer writes it.
    pub trajectory: PathBuf,
    /// Known relations between scans: i,j,kind,dx_m,dy_m,dtheta_rad.
    #[arg(long, value_name = "FILE")]
    pub relations: PathBuf,
    /// A trajectory to compare with, after laying one over the other.
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// Draw trajectories and errors as SVG.
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
}

/// Distances to the reference, in metres: root of the mean square, mean, largest.
struct Absolute {
    root_m: f64,
    mean: Spread,
    most_m: f64,
}

/// Prints the errors, and draws them if asked to.
///
/// # Errors
/// If a file cannot be read, written or understood.
pub fn run(eval: &Eval, format: Format) -> Result<Ending> {
    let found = read(&eval.trajectory, trajectory)?;
    let known = read(&eval.relations, relations)?;
    let judged = judge(&found, &known)
        .with_context(|| format!("cannot compare with {}", eval.relations.display()))?;
    let laid = match &eval.reference {
        Some(path) => laid_over(&found, &read(path, trajectory)?)
            .with_context(|| format!("cannot compare with {}", path.display()))?,
        None => Vec::new(),
    };
    let absolute = absolute(&laid);
    if format == Format::Json {
        say(as_json(&judged, absolute.as_ref()))?;
    } else {
        say(in_words(&judged, absolute.as_ref()))?;
    }
    if let Some(path) = &eval.plot {
        let way: Vec<(f64, Pose)> = found.values().copied().collect();
        std::fs::write(path, plot::svg(&way, &laid, &judged))
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(Ending::Fine)
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

fn in_words(judged: &[Judged], absolute: Option<&Absolute>) -> String {
    let mut lines =
        vec![format!("{:<10} {:>6}  {:>17}  {:>15}", "relations", "", "metres", "degrees")];
    lines.extend(by_kind(judged).into_iter().map(|(kind, Errors { count, metres, degrees })| {
        format!(
            "{kind:<10} {count:>6}  {:>8.4} ± {:<6.4}  {:>7.3} ± {:<5.3}",
            metres.mean, metres.deviation, degrees.mean, degrees.deviation
        )
    }));
    lines.extend(absolute.map(|Absolute { root_m, mean, most_m }| {
        format!(
            "absolute, laid over the reference: rms {root_m:.4} m, mean {:.4} ± {:.4} m, most {most_m:.4} m",
            mean.mean, mean.deviation
        )
    }));
    lines.push("worst:".into());
    lines.extend(worst(judged).into_iter().map(|Judged { relation, metres, degrees }| {
        let (from, to, kind) = (relation.from, relation.to, &relation.kind);
        format!("  {kind} {from} to {to}: {metres:.4} m, {degrees:.3} deg")
    }));
    lines.join("\n")
}

fn as_json(judged: &[Judged], absolute: Option<&Absolute>) -> Value {
    let of = |Spread { mean, deviation }: Spread| json!({"mean": mean, "deviation": deviation});
    let kinds: Map<String, Value> = by_kind(judged)
        .into_iter()
        .map(|(kind, errors)| {
            let (metres, degrees) = (of(errors.metres), of(errors.degrees));
            (kind, json!({"count": errors.count, "metres": metres, "degrees": degrees}))
        })
        .collect();
    let absolute = absolute.map(|Absolute { root_m, mean, most_m }| {
        json!({"rms_m": root_m, "mean_m": mean.mean, "deviation_m": mean.deviation, "most_m": most_m})
    });
    let worst: Vec<Value> = worst(judged)
        .into_iter()
        .map(|Judged { relation, metres, degrees }| {
            let (from, to, kind) = (relation.from, relation.to, &relation.kind);
            json!({"kind": kind, "i": from, "j": to, "metres": metres, "degrees": degrees})
        })
        .collect();
    json!({"relations": kinds, "absolute": absolute, "worst": worst})
}
