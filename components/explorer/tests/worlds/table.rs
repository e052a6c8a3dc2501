//! The figures of runs: a line for each, and one row for all seeds of a world.

use crate::trial::Report;

/// The head of the table that [`row`] makes rows of, as Markdown.
pub const HEAD: &str = "\
| world | runs | explored after, s | home after, s | distance driven, m | seen, minimum, % | walls right, % | nearest to a wall, m | collisions | final pose error, maximum, m |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |";

/// One run.
pub fn line(report: &Report) -> String {
    let time = |time_s: Option<f64>| time_s.map_or("never".into(), |s| format!("{s:.1} s"));
    format!(
        "done {}, home {}, {:.1} m, {:.0} rad, slow {:.0} s, {} goals, {:.2} % seen, walls {:.3}, \
         nearest {:.3} m, {} collisions, off {:.3} m",
        time(report.explored_s),
        time(report.home_s),
        report.way_m,
        report.turned_rad,
        report.slow_s,
        report.goals,
        100.0 * report.explored,
        report.wall_precision,
        report.nearest_m,
        report.collisions,
        report.pose_error_m,
    )
}

/// All runs in a world: means with the least and the most, or the worst.
pub fn row(world: &str, reports: &[(u64, Report)]) -> String {
    let all =
        |of: fn(&Report) -> f64| -> Vec<f64> { reports.iter().map(|run| of(&run.1)).collect() };
    let [explored_s, home_s] = [
        all(|run| run.explored_s.unwrap_or(f64::INFINITY)),
        all(|run| run.home_s.unwrap_or(f64::INFINITY)),
    ]
    .map(|times_s| spread(&times_s));
    format!(
        "| {world} | {} | {explored_s} | {home_s} | {} | {:.1} | {:.1} | {:.3} | {} | {:.3} |",
        reports.len(),
        spread(&all(|run| run.way_m)),
        100.0 * least(&all(|run| run.explored)),
        100.0 * least(&all(|run| run.wall_precision)),
        least(&all(|run| run.nearest_m)),
        reports.iter().map(|run| run.1.collisions).sum::<u64>(),
        most(&all(|run| run.pose_error_m)),
    )
}

fn spread(values: &[f64]) -> String {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    format!("{mean:.0} ({:.0}–{:.0})", least(values), most(values))
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}
