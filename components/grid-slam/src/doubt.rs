//! How well each keyframe of the graph is known as seen from another: covariances along the best
//! path of edges.

use crate::graph::{PoseEdge, PoseGraph, turn_covariance, turn_matrix};
use crate::pose::Pose;
use nalgebra::Matrix3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// How far ahead a heading error is felt when paths are compared, metres.
const LEVER_M: f64 = 10.0;

impl PoseGraph {
    /// How well the pose of each keyframe is known as seen from one of them: covariances along the
    /// best path of edges (Bosse et al.'s Dijkstra projection, IJRR 2004; never too small), each in
    /// the frame of `root`.
    pub fn seen_from(&self, root: usize) -> Vec<Matrix3<f64>> {
        let mut known: Vec<Option<Matrix3<f64>>> = vec![None; self.poses().len()];
        let mut waiting =
            BinaryHeap::from([(Reverse(Length(0.0)), root, Matrix3::zeros())].map(ByLength));
        while let Some(ByLength((Reverse(Length(length)), keyframe, covariance))) = waiting.pop() {
            if known[keyframe].is_some() {
                continue;
            }
            known[keyframe] = Some(covariance);
            let here = self.between(root, keyframe);
            for edge in self.edges_at(keyframe) {
                let next = if edge.from == keyframe { edge.to } else { edge.from };
                if known[next].is_none() {
                    let there = self.between(root, next);
                    let step =
                        if edge.to == next { edge.covariance } else { edge.reverse_covariance() };
                    let grown = carry_covariance(&covariance, &here, &there)
                        + turn_covariance(&step, there.yaw_rad);
                    let added = step.m11 + step.m22 + LEVER_M * LEVER_M * step.m33;
                    waiting.push(ByLength((Reverse(Length(length + added)), next, grown)));
                }
            }
        }
        let unknown = Matrix3::identity() * 1e6;
        known.into_iter().map(|covariance| covariance.unwrap_or(unknown)).collect()
    }
}

impl PoseEdge {
    /// Covariance of the reverse motion, in the frame of `from`.
    fn reverse_covariance(&self) -> Matrix3<f64> {
        let mut jacobian = turn_matrix(self.motion.yaw_rad);
        jacobian[(0, 2)] = self.motion.y_m;
        jacobian[(1, 2)] = -self.motion.x_m;
        jacobian * self.covariance * jacobian.transpose()
    }
}

/// What doubt about `here` makes of a pose `there` that is fixed to it.
fn carry_covariance(covariance: &Matrix3<f64>, here: &Pose, there: &Pose) -> Matrix3<f64> {
    let mut jacobian = Matrix3::identity();
    jacobian[(0, 2)] = here.y_m - there.y_m;
    jacobian[(1, 2)] = there.x_m - here.x_m;
    jacobian * covariance * jacobian.transpose()
}

/// A length that can be compared.
#[derive(Clone, Copy, PartialEq)]
struct Length(f64);

impl Eq for Length {}

impl PartialOrd for Length {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Length {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// A keyframe that waits with its covariance, ordered by the length of the path, then its number.
struct ByLength((Reverse<Length>, usize, Matrix3<f64>));

impl PartialEq for ByLength {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for ByLength {}

impl PartialOrd for ByLength {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for ByLength {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.0.0, self.0.1).cmp(&(other.0.0, other.0.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::tests::{bent_square, covariance};

    #[test]
    fn doubt_grows_along_the_chain_and_shrinks_by_a_closure() {
        let (truth, mut graph) = bent_square(10);
        let spread = |graph: &PoseGraph, i: usize| graph.seen_from(40)[i].m11.sqrt();
        let (near, far) = (spread(&graph, 35), spread(&graph, 5));
        assert!(near < 0.5 * far && spread(&graph, 40) == 0.0, "{near} {far}");
        let motion = truth[0].inverse() * truth[40];
        let covariance = covariance(0.01, 0.003);
        graph.add_edge(PoseEdge { from: 0, to: 40, motion, covariance, is_closure: true });
        graph.optimise_poses();
        assert!(spread(&graph, 5) < 0.5 * far, "{}", spread(&graph, 5));
    }
}
