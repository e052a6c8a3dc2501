//! Which matches of places are consistent: pairwise loops that close, and the largest set of
//! them by the first eigenvector (Olson, *Recognizing places using spectrally clustered local
//! matches*, Robotics and Autonomous Systems 57, 2009).

use crate::graph::{PoseEdge, PoseGraph, pose_error, turn_covariance};
use crate::pose::Pose;
use nalgebra::{DMatrix, Matrix3};

/// A second story may be at most this much of the first, as eigenvalues.
const RIVAL_STORY: f64 = 0.6;

/// Returns the numbers of the matches that agree with each other, if there is one story only.
/// Two contradict each other when their loop is open by more than `contradiction` squared sigmas.
pub fn select_agreeing(graph: &PoseGraph, matches: &[PoseEdge], contradiction: f64) -> Vec<usize> {
    if matches.is_empty() {
        return Vec::new();
    }
    let doubts: Vec<_> =
        matches.iter().map(|m| (graph.seen_from(m.from), graph.seen_from(m.to))).collect();
    let count = matches.len();
    let consistent = DMatrix::from_fn(count, count, |row, column| {
        let (a, b) = (row.min(column), row.max(column));
        if a == b {
            return 1.0;
        }
        let (from, to) = (&doubts[a].0[matches[b].from], &doubts[a].1[matches[b].to]);
        let open = loop_openness(graph, &matches[a], &matches[b], from, to);
        if open < contradiction { (-open / contradiction).exp() } else { 0.0 }
    });
    let eigen = consistent.symmetric_eigen();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let first = order[0];
    let is_clear = order
        .get(1)
        .is_none_or(|&second| eigen.eigenvalues[second] < RIVAL_STORY * eigen.eigenvalues[first]);
    if !is_clear {
        return Vec::new();
    }
    let weights = eigen.eigenvectors.column(first).abs();
    let most = weights.max();
    (0..count).filter(|&number| weights[number] > 0.5 * most).collect()
}

/// Squared error in sigmas of the loop over two matches and the two paths between them. `from` and
/// `to` are the doubts about the second's keyframes as seen from the first's.
fn loop_openness(
    graph: &PoseGraph,
    a: &PoseEdge,
    b: &PoseEdge,
    from: &Matrix3<f64>,
    to: &Matrix3<f64>,
) -> f64 {
    let over_a = a.motion * graph.between(a.to, b.to);
    let over_b = graph.between(a.from, b.from) * b.motion;
    let open = pose_error(&over_a, &over_b);
    // All in the frame of b's newer keyframe.
    let spread = move_covariance(&a.covariance, &graph.between(a.to, b.to))
        + turn_covariance(to, -graph.between(a.to, b.to).yaw_rad)
        + move_covariance(
            &turn_covariance(from, -graph.between(a.from, b.from).yaw_rad),
            &b.motion,
        )
        + b.covariance;
    spread.cholesky().map_or(f64::INFINITY, |c| c.solve(&open).dot(&open))
}

/// A covariance in a frame as that of a pose fixed to it, in the pose's own frame.
fn move_covariance(covariance: &Matrix3<f64>, pose: &Pose) -> Matrix3<f64> {
    let mut lever = Matrix3::identity();
    lever[(0, 2)] = -pose.y_m;
    lever[(1, 2)] = pose.x_m;
    turn_covariance(&(lever * covariance * lever.transpose()), -pose.yaw_rad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// Out and back along a corridor; keyframe 20 + i is at the place of keyframe 20 - i.
    fn there_and_back() -> PoseGraph {
        let covariance = Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-4, 1e-6));
        let mut graph = PoseGraph::default();
        for step in 0..41 {
            let (x_m, yaw_rad) =
                if step <= 20 { (f64::from(step), 0.0) } else { (f64::from(40 - step), 3.0) };
            let pose = Pose::new(x_m, 0.0, yaw_rad);
            let before = graph.poses().last().copied().unwrap_or_default();
            graph.add_keyframe(before.inverse() * pose, covariance);
        }
        graph
    }

    /// Matches of (old, new, metres by which they are wrong along the corridor).
    fn check(found: &[(usize, usize, f64)], expected: &[usize]) {
        let graph = there_and_back();
        let edge = |&(from, to, wrong_m): &(usize, usize, f64)| {
            let motion = Pose::new(wrong_m, 0.0, 0.0) * graph.between(from, to);
            let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 1e-5));
            PoseEdge { from, to, motion, covariance, is_closure: true }
        };
        let edges: Vec<_> = found.iter().map(edge).collect();
        assert_eq!(select_agreeing(&graph, &edges, 11.3), expected, "{found:?}");
    }

    #[test]
    fn those_that_agree_are_found_among_others() {
        let right = [(10, 30, 2.0), (9, 31, 2.0), (8, 32, 2.02)];
        check(&right, &[0, 1, 2]);
        check(&[right[0], (9, 31, -3.0), right[1], right[2]], &[0, 2, 3]);
    }

    #[test]
    fn two_stories_are_none() {
        let one = [(10, 30, 2.0), (9, 31, 2.0), (8, 32, 2.0)];
        let other = [(10, 30, -1.0), (9, 31, -1.0), (8, 32, -1.0)];
        check(&[one, other].concat(), &[]);
        check(&[], &[]);
    }
}
