//! The results of an evaluation as charts.

use armor_grid_slam::pose::Pose;
use armor_picture::chart::{
    MEASURED, REFERENCE, SHEET_WIDTH, draw_curve, draw_histogram, draw_trajectories,
};
use armor_picture::plot_sheet::PlotSheet;

use crate::alignment::AlignedPose;
use crate::columns::TitledColumn;
use crate::relations::JudgedRelation;
use crate::trajectory::ScanTrajectory;

/// Draws the trajectory, and the errors along it as curves and histograms. The poses aligned with a
/// reference take the place of the trajectory if there are any.
pub fn draw_evaluation(
    trajectory: &ScanTrajectory,
    aligned: &[AlignedPose],
    judged: &[JudgedRelation],
) -> PlotSheet {
    let mut sheet = PlotSheet::new(SHEET_WIDTH);
    draw_poses(&mut sheet, trajectory, aligned);
    let by_scan = |error: fn(&JudgedRelation) -> f64| -> Vec<(f64, f64)> {
        judged.iter().map(|one| (one.relation.to as f64, error(one))).collect()
    };
    let distances = aligned.iter().map(|pose| (pose.stamp_s, pose.distance_m()));
    for (title, points) in [
        ("error of relations by scan number, metres", by_scan(|one| one.metres)),
        ("error of relations by scan number, degrees", by_scan(|one| one.degrees)),
        ("distance to the reference over time, metres", distances.collect()),
    ] {
        draw_curve(&mut sheet, title, points);
    }
    let metres = judged.iter().map(|one| one.metres);
    draw_histogram(&mut sheet, "number of relations by error, metres", metres);
    let degrees = judged.iter().map(|one| one.degrees);
    draw_histogram(&mut sheet, "number of relations by error, degrees", degrees);
    sheet
}

/// Draws every column over the first one.
pub fn draw_columns(columns: &[TitledColumn]) -> PlotSheet {
    let mut sheet = PlotSheet::new(SHEET_WIDTH);
    let Some((first, others)) = columns.split_first() else { return sheet };
    for column in others {
        let points = first.numbers.iter().copied().zip(column.numbers.iter().copied());
        let title = format!("{} over {}", column.title, first.title);
        draw_curve(&mut sheet, &title, points.collect());
    }
    sheet
}

fn draw_poses(sheet: &mut PlotSheet, trajectory: &ScanTrajectory, aligned: &[AlignedPose]) {
    let at = |pose: &Pose| (pose.x_m, pose.y_m);
    let (measured, reference): (Vec<_>, Vec<_>) = if aligned.is_empty() {
        (trajectory.values().map(|(_, pose)| at(pose)).collect(), Vec::new())
    } else {
        aligned.iter().map(|pair| (at(&pair.pose), at(&pair.reference))).unzip()
    };
    let title = "trajectory: blue as measured, grey the reference";
    draw_trajectories(sheet, title, &[(&reference, REFERENCE), (&measured, MEASURED)]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relations::ScanRelation;

    fn drawn() -> PlotSheet {
        let pair = |i: u32| {
            let x_m = f64::from(i);
            let (pose, reference) = (Pose::new(x_m, 0.0, 0.0), Pose::new(x_m, 0.5, 0.0));
            AlignedPose { stamp_s: x_m, pose, reference }
        };
        let aligned: Vec<_> = (0..20).map(pair).collect();
        let relation =
            |to: usize| ScanRelation { from: 0, to, kind: "next".into(), motion: Pose::default() };
        let judged = |to: usize| JudgedRelation {
            relation: relation(to),
            metres: 0.1 * to as f64,
            degrees: 1.0,
        };
        let judged: Vec<_> = (1..20).map(judged).collect();
        draw_evaluation(&ScanTrajectory::new(), &aligned, &judged)
    }

    #[test]
    fn everything_is_drawn_within_the_picture() {
        let svg = drawn().to_svg();
        // Both trajectories, three curves, five pairs of axes.
        assert_eq!(svg.matches("<polyline").count(), 2 + 3 + 5);
        assert!(svg.contains("distance to the reference over time, metres"));
        let places = svg.split("points=\"").skip(1).flat_map(|part| {
            part.split('"').next().unwrap_or("").split_whitespace().flat_map(|p| p.split(','))
        });
        assert!(places.map(|p| p.parse::<f64>().unwrap()).all(|p| (0.0..=1400.0).contains(&p)));
    }
}
