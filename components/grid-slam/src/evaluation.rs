//! How good a trajectory is: errors over relations between poses (Kümmerle et al., *On Measuring the
//! Accuracy of SLAM Algorithms*, Autonomous Robots 27, 2009). Pure: text in, numbers out.

use crate::pose::{Pose, wrapped};
use std::collections::BTreeMap;

/// Most of the worst relations that are named.
pub const WORST: usize = 5;

/// A file that cannot be used.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum EvaluationError {
    /// A line has too few fields, or one that is no number.
    #[error("line {line}: {expected} expected, found `{text}`")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What should stand there.
        expected: &'static str,
        /// What does.
        text: String,
    },
    /// Nothing in one file is of a scan that the other has too.
    #[error(
        "no scan of the trajectory is in the other file, neither by its number nor by its time; \
         are they of one run?"
    )]
    Nothing,
}

/// Poses by scan: the stamp in seconds and `world_from_robot`.
pub type Trajectory = BTreeMap<usize, (f64, Pose)>;

/// A relation that is known: the pose of scan `to` as seen from scan `from`.
#[derive(Clone, Debug, PartialEq)]
pub struct Relation {
    /// The scan it is seen from.
    pub from: usize,
    /// The scan that is seen.
    pub to: usize,
    /// What kind of relation: `next`, `revisit`, …
    pub kind: String,
    /// `from_from_to`.
    pub motion: Pose,
}

/// Mean and standard deviation of absolute errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub deviation: f64,
}

/// Errors over the relations of one kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors {
    /// Number of relations.
    pub count: usize,
    /// Of the position, metres.
    pub metres: Spread,
    /// Of the heading, degrees.
    pub degrees: Spread,
}

/// One relation and how wrong the trajectory has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// The relation.
    pub relation: Relation,
    /// Error of the position, metres.
    pub metres: f64,
    /// Error of the heading, degrees.
    pub degrees: f64,
}

/// Reads `scan,timestamp_s,x_m,y_m,theta_rad`, with a line of titles.
///
/// # Errors
/// If a line is something else.
pub fn trajectory(text: &str) -> Result<Trajectory, EvaluationError> {
    let expected = "scan,timestamp_s,x_m,y_m,theta_rad";
    let line = |(line, text): (usize, &str)| {
        let numbers: Option<Vec<f64>> = text.split(',').map(|f| f.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[scan, stamp_s, x_m, y_m, yaw_rad]) if scan >= 0.0 => {
                Ok((scan as usize, (stamp_s, Pose::new(x_m, y_m, yaw_rad))))
            }
            _ => Err(EvaluationError::Line { line, expected, text: text.into() }),
        }
    };
    lines(text).map(line).collect()
}

/// Reads `i,j,kind,dx_m,dy_m,dtheta_rad`, with a line of titles.
///
/// # Errors
/// If a line is something else.
pub fn relations(text: &str) -> Result<Vec<Relation>, EvaluationError> {
    let expected = "i,j,kind,dx_m,dy_m,dtheta_rad";
    let relation = |text: &str| {
        let fields: Vec<_> = text.split(',').map(str::trim).collect();
        let [from, to, kind, x, y, yaw] = fields.as_slice() else { return None };
        let motion = Pose::new(x.parse().ok()?, y.parse().ok()?, yaw.parse().ok()?);
        let (from, to) = (from.parse().ok()?, to.parse().ok()?);
        Some(Relation { from, to, kind: (*kind).into(), motion })
    };
    let line = |(line, text): (usize, &str)| {
        relation(text).ok_or_else(|| EvaluationError::Line { line, expected, text: text.into() })
    };
    lines(text).map(line).collect()
}

/// Numbers under a title.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// What stands above them.
    pub title: String,
    /// The numbers.
    pub numbers: Vec<f64>,
}

/// Reads columns of numbers under a line of titles.
///
/// # Errors
/// If a line has another number of fields than the titles, or one that is no number.
pub fn columns(text: &str) -> Result<Vec<Column>, EvaluationError> {
    let titles = text.lines().next().unwrap_or_default().split(',');
    let column = |title: &str| Column { title: title.trim().into(), numbers: Vec::new() };
    let mut columns: Vec<_> = titles.map(column).collect();
    for (line, text) in lines(text) {
        let numbers: Option<Vec<f64>> = text.split(',').map(|f| f.trim().parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == columns.len());
        let expected = "a number for each title";
        let bad = || EvaluationError::Line { line, expected, text: text.into() };
        for (column, number) in columns.iter_mut().zip(numbers.ok_or_else(bad)?) {
            column.numbers.push(number);
        }
    }
    Ok(columns)
}

fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..).zip(text.lines()).skip(1).filter(|(_, line)| !line.trim().is_empty())
}

/// Judges every relation whose scans the trajectory has.
///
/// # Errors
/// If it has none of them.
pub fn judge(
    trajectory: &Trajectory,
    relations: &[Relation],
) -> Result<Vec<Judged>, EvaluationError> {
    let judged = relations.iter().filter_map(|relation| {
        let ((_, from), (_, to)) = (trajectory.get(&relation.from)?, trajectory.get(&relation.to)?);
        let error = relation.motion.inverse() * (from.inverse() * *to);
        let metres = error.x_m.hypot(error.y_m);
        let degrees = wrapped(error.yaw_rad).abs().to_degrees();
        Some(Judged { relation: relation.clone(), metres, degrees })
    });
    let judged: Vec<_> = judged.collect();
    if judged.is_empty() { Err(EvaluationError::Nothing) } else { Ok(judged) }
}

/// Errors over all relations, and over those of each kind, by name.
pub fn by_kind(judged: &[Judged]) -> BTreeMap<String, Errors> {
    let mut kinds: BTreeMap<String, Vec<&Judged>> = BTreeMap::new();
    for one in judged {
        kinds.entry(one.relation.kind.clone()).or_default().push(one);
        kinds.entry("all".into()).or_default().push(one);
    }
    let errors = |of: Vec<&Judged>| Errors {
        count: of.len(),
        metres: spread(of.iter().map(|one| one.metres)),
        degrees: spread(of.iter().map(|one| one.degrees)),
    };
    kinds.into_iter().map(|(kind, of)| (kind, errors(of))).collect()
}

/// The relations with the largest errors of position, worst first.
pub fn worst(judged: &[Judged]) -> Vec<&Judged> {
    let mut sorted: Vec<_> = judged.iter().collect();
    sorted.sort_by(|a, b| b.metres.total_cmp(&a.metres));
    sorted.truncate(WORST);
    sorted
}

/// Mean and standard deviation.
pub fn spread(values: impl Iterator<Item = f64> + Clone) -> Spread {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    let variance = values.map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    Spread { mean, deviation: variance.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(count: usize) -> Trajectory {
        let pose = |i: usize| {
            let angle = i as f64 * 0.1;
            (i as f64, Pose::new(5.0 * angle.cos(), 5.0 * angle.sin(), wrapped(angle)))
        };
        (0..count).map(|i| (i, pose(i))).collect()
    }

    fn relation(trajectory: &Trajectory, from: usize, to: usize, kind: &str) -> Relation {
        let motion = trajectory[&from].1.inverse() * trajectory[&to].1;
        Relation { from, to, kind: kind.into(), motion }
    }

    #[test]
    fn a_moved_and_turned_trajectory_has_no_error() {
        let truth = circle(40);
        let turned =
            |(i, (s, pose)): (&usize, &(f64, Pose))| (*i, (*s, Pose::new(3.0, -7.0, 2.1) * *pose));
        let moved: Trajectory = truth.iter().map(turned).collect();
        let relations: Vec<_> = (1..40).map(|i| relation(&truth, i - 1, i, "next")).collect();
        let errors = &by_kind(&judge(&moved, &relations).unwrap())["next"];
        assert!(errors.metres.mean < 1e-9 && errors.degrees.mean < 1e-9, "{errors:?}");
    }

    #[test]
    fn errors_are_counted_by_kind_and_the_worst_is_named() {
        let truth = circle(4);
        let mut relations = vec![relation(&truth, 0, 1, "next"), relation(&truth, 0, 2, "revisit")];
        relations.push(relation(&truth, 2, 3, "next"));
        relations.push(Relation { to: 99, ..relations[0].clone() });
        relations[1].motion = relations[1].motion * Pose::new(0.3, 0.4, 0.1);
        let judged = judge(&truth, &relations).unwrap();
        let kinds = by_kind(&judged);
        assert_eq!((kinds["next"].count, kinds["revisit"].count, kinds["all"].count), (2, 1, 3));
        assert!((kinds["revisit"].metres.mean - 0.5).abs() < 1e-9);
        assert!((kinds["revisit"].degrees.mean - 0.1_f64.to_degrees()).abs() < 1e-9);
        assert!((kinds["all"].metres.mean - 0.5 / 3.0).abs() < 1e-9);
        assert_eq!(worst(&judged)[0].relation.to, 2);
    }

    #[test]
    fn what_is_not_understood_is_named() {
        let titles = "scan,timestamp_s,x_m,y_m,theta_rad\n";
        let read = trajectory(&format!("{titles}0,1.5,1,2,0.5\n\n7,2,1,2,3\n")).unwrap();
        assert_eq!(read[&7], (2.0, Pose::new(1.0, 2.0, 3.0)));
        let error = trajectory(&format!("{titles}0,1.5,1\n")).unwrap_err().to_string();
        assert!(error.contains("line 2") && error.contains("0,1.5,1"), "{error}");
        let error = relations("i,j\n0,1,next,a,0,0\n").unwrap_err().to_string();
        assert!(error.contains("dtheta_rad"), "{error}");
        assert_eq!(judge(&circle(2), &[]), Err(EvaluationError::Nothing));
    }
}
