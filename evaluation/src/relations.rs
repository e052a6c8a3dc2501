//! Errors of a trajectory over known relations between its poses (Kümmerle et al., *On Measuring
//! the Accuracy of SLAM Algorithms*, Autonomous Robots 27, 2009).

use std::collections::BTreeMap;

use armor_grid_slam::pose::{Pose, wrapped};

use crate::columns::number_lines;
use crate::error::EvaluationError;
use crate::statistics::{Spread, measure_spread};
use crate::trajectory::ScanTrajectory;

/// How many relations [`select_worst`] returns at most.
pub const WORST_COUNT: usize = 5;

/// A known relation: the pose of scan `to` as seen from scan `from`.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanRelation {
    /// The scan it is seen from.
    pub from: usize,
    /// The scan that is seen.
    pub to: usize,
    /// The kind of relation: `next`, `revisit`, …
    pub kind: String,
    /// `from_from_to`.
    pub motion: Pose,
}

/// A relation and the trajectory's error in it.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedRelation {
    /// The relation.
    pub relation: ScanRelation,
    /// Error of the position, metres.
    pub metres: f64,
    /// Error of the heading, degrees.
    pub degrees: f64,
}

/// Errors over the relations of one kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RelationErrors {
    /// Number of relations.
    pub count: usize,
    /// Of the position, metres.
    pub metres: Spread,
    /// Of the heading, degrees.
    pub degrees: Spread,
}

/// Reads `i,j,kind,dx_m,dy_m,dtheta_rad`, with a line of titles.
///
/// # Errors
/// If a line has other fields.
pub fn read_relations(text: &str) -> Result<Vec<ScanRelation>, EvaluationError> {
    let expected = "i,j,kind,dx_m,dy_m,dtheta_rad";
    let read_relation = |text: &str| {
        let fields: Vec<_> = text.split(',').map(str::trim).collect();
        let [from, to, kind, x, y, yaw] = fields.as_slice() else { return None };
        let motion = Pose::new(x.parse().ok()?, y.parse().ok()?, yaw.parse().ok()?);
        let (from, to) = (from.parse().ok()?, to.parse().ok()?);
        Some(ScanRelation { from, to, kind: (*kind).into(), motion })
    };
    let read_line = |(line, text): (usize, &str)| {
        let bad = || EvaluationError::BadLine { line, expected, text: text.into() };
        read_relation(text).ok_or_else(bad)
    };
    number_lines(text).map(read_line).collect()
}

/// Judges every relation whose scans are both in the trajectory.
///
/// # Errors
/// If there is no such relation.
pub fn judge_relations(
    trajectory: &ScanTrajectory,
    relations: &[ScanRelation],
) -> Result<Vec<JudgedRelation>, EvaluationError> {
    let judged = relations.iter().filter_map(|relation| {
        let ((_, from), (_, to)) = (trajectory.get(&relation.from)?, trajectory.get(&relation.to)?);
        let error = relation.motion.inverse() * (from.inverse() * *to);
        let metres = error.x_m.hypot(error.y_m);
        let degrees = wrapped(error.yaw_rad).abs().to_degrees();
        Some(JudgedRelation { relation: relation.clone(), metres, degrees })
    });
    let judged: Vec<_> = judged.collect();
    if judged.is_empty() { Err(EvaluationError::NothingInCommon) } else { Ok(judged) }
}

/// Returns the errors over all relations under `all`, and over those of each kind under its name.
pub fn summarize_by_kind(judged: &[JudgedRelation]) -> BTreeMap<String, RelationErrors> {
    let mut kinds: BTreeMap<String, Vec<&JudgedRelation>> = BTreeMap::new();
    for one in judged {
        kinds.entry(one.relation.kind.clone()).or_default().push(one);
        kinds.entry("all".into()).or_default().push(one);
    }
    let errors = |of: Vec<&JudgedRelation>| RelationErrors {
        count: of.len(),
        metres: measure_spread(of.iter().map(|one| one.metres)),
        degrees: measure_spread(of.iter().map(|one| one.degrees)),
    };
    kinds.into_iter().map(|(kind, of)| (kind, errors(of))).collect()
}

/// Returns the relations with the largest errors of position, the worst first.
pub fn select_worst(judged: &[JudgedRelation]) -> Vec<&JudgedRelation> {
    let mut sorted: Vec<_> = judged.iter().collect();
    sorted.sort_by(|a, b| b.metres.total_cmp(&a.metres));
    sorted.truncate(WORST_COUNT);
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(count: usize) -> ScanTrajectory {
        let pose = |i: usize| {
            let angle = i as f64 * 0.1;
            (i as f64, Pose::new(5.0 * angle.cos(), 5.0 * angle.sin(), wrapped(angle)))
        };
        (0..count).map(|i| (i, pose(i))).collect()
    }

    fn relation(trajectory: &ScanTrajectory, from: usize, to: usize, kind: &str) -> ScanRelation {
        let motion = trajectory[&from].1.inverse() * trajectory[&to].1;
        ScanRelation { from, to, kind: kind.into(), motion }
    }

    #[test]
    fn a_moved_and_turned_trajectory_has_no_error() {
        let truth = circle(40);
        let turned =
            |(i, (s, pose)): (&usize, &(f64, Pose))| (*i, (*s, Pose::new(3.0, -7.0, 2.1) * *pose));
        let moved: ScanTrajectory = truth.iter().map(turned).collect();
        let relations: Vec<_> = (1..40).map(|i| relation(&truth, i - 1, i, "next")).collect();
        let errors = &summarize_by_kind(&judge_relations(&moved, &relations).unwrap())["next"];
        assert!(errors.metres.mean < 1e-9 && errors.degrees.mean < 1e-9, "{errors:?}");
    }

    #[test]
    fn errors_are_counted_by_kind_and_the_worst_is_named() {
        let truth = circle(4);
        let mut relations = vec![relation(&truth, 0, 1, "next"), relation(&truth, 0, 2, "revisit")];
        relations.push(relation(&truth, 2, 3, "next"));
        relations.push(ScanRelation { to: 99, ..relations[0].clone() });
        relations[1].motion = relations[1].motion * Pose::new(0.3, 0.4, 0.1);
        let judged = judge_relations(&truth, &relations).unwrap();
        let kinds = summarize_by_kind(&judged);
        assert_eq!((kinds["next"].count, kinds["revisit"].count, kinds["all"].count), (2, 1, 3));
        assert!((kinds["revisit"].metres.mean - 0.5).abs() < 1e-9);
        assert!((kinds["revisit"].degrees.mean - 0.1_f64.to_degrees()).abs() < 1e-9);
        assert!((kinds["all"].metres.mean - 0.5 / 3.0).abs() < 1e-9);
        assert_eq!(select_worst(&judged)[0].relation.to, 2);
    }

    #[test]
    fn bad_lines_and_relations_of_another_run_are_refused() {
        let error = read_relations("i,j\n0,1,next,a,0,0\n").unwrap_err().to_string();
        assert!(error.contains("dtheta_rad"), "{error}");
        assert_eq!(judge_relations(&circle(2), &[]), Err(EvaluationError::NothingInCommon));
    }
}
