//! The pose graph: keyframes, what was measured between them, and the poses that fit all of it
//! best (Gauss-Newton as in Grisetti, Kümmerle, Stachniss and Burgard, *A Tutorial on Graph-Based
//! SLAM*, 2010). Closures that disagree with the rest lose their weight by dynamic covariance
//! scaling (Agarwal et al., ICRA 2013), gradually, so that right ones far off are not lost at the
//! start (graduated non-convexity, Yang et al., RA-L 2020).

use crate::pose::{Pose, wrapped};
use crate::sparse::SparseSystem;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Dynamic covariance scaling's Φ: closures with a larger squared error count less and less.
const DOUBT: f64 = 10.0;
/// The doubt begins where no closure is doubted, and is divided by this at every step.
const DOUBT_STEP: f64 = 4.0;
const MOST_STEPS: usize = 30;
/// Steps smaller than this end it, metres and radians.
const STILL: f64 = 1e-4;
/// What was measured between two keyframes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseEdge {
    /// The keyframe it is measured from.
    pub from: usize,
    /// The keyframe that is seen.
    pub to: usize,
    /// `from_from_to`: the second in the frame of the first.
    pub motion: Pose,
    /// Covariance of x, y (m²) and heading (rad²), in the frame of `to`.
    pub covariance: Matrix3<f64>,
    /// Whether it may be wrong altogether.
    pub is_closure: bool,
}

/// Keyframes and edges.
#[derive(Clone, Debug, Default)]
pub struct PoseGraph {
    poses: Vec<Pose>,
    edges: Vec<PoseEdge>,
    /// Number of the edge that leads to each keyframe from the one before.
    chain: Vec<usize>,
    /// Numbers of the edges at each keyframe.
    at: Vec<Vec<usize>>,
}

impl PoseGraph {
    /// `map_from_keyframe` of all keyframes.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// What was measured between them, in the order in which it was added.
    pub fn edges(&self) -> &[PoseEdge] {
        &self.edges
    }

    /// Makes a graph of keyframes at `poses`; `None` if the edges do not lead from each keyframe to
    /// the next, once, in their order.
    pub fn from_parts(poses: Vec<Pose>, edges: Vec<PoseEdge>) -> Option<Self> {
        let mut graph = Self { at: vec![Vec::new(); poses.len()], poses, ..Self::default() };
        graph.chain.push(0);
        for edge in edges {
            if edge.from.max(edge.to) >= graph.poses.len() {
                return None;
            }
            if !edge.is_closure {
                let is_next = (edge.from + 1, edge.to) == (graph.chain.len(), graph.chain.len());
                is_next.then(|| graph.chain.push(graph.edges.len()))?;
            }
            graph.add_edge(edge);
        }
        (graph.chain.len() == graph.poses.len()).then_some(graph)
    }

    /// Number of closures.
    pub fn closures(&self) -> usize {
        self.edges.len() + 1 - self.poses.len().max(1)
    }

    /// Adds a keyframe: the pose of the first, the motion from the one before of all others, with
    /// its covariance in the new one's frame.
    pub fn add_keyframe(&mut self, motion: Pose, covariance: Matrix3<f64>) {
        let to = self.poses.len();
        self.at.push(Vec::new());
        self.chain.push(self.edges.len());
        match to.checked_sub(1) {
            None => self.poses.push(motion),
            Some(from) => {
                self.poses.push(self.poses[from] * motion);
                self.add_edge(PoseEdge { from, to, motion, covariance, is_closure: false });
            }
        }
    }

    /// Replaces the motion that leads to a keyframe from the one before. The keyframe and all later
    /// ones move along rigidly. The first keyframe has no such motion.
    pub fn replace_motion(&mut self, keyframe: usize, motion: Pose, covariance: Matrix3<f64>) {
        let edge = &mut self.edges[self.chain[keyframe]];
        if edge.motion == motion {
            return;
        }
        (edge.motion, edge.covariance) = (motion, covariance);
        let moved = self.poses[keyframe - 1] * motion * self.poses[keyframe].inverse();
        for pose in &mut self.poses[keyframe..] {
            *pose = moved * *pose;
        }
    }

    /// Adds an edge between two keyframes.
    pub fn add_edge(&mut self, edge: PoseEdge) {
        self.at[edge.from].push(self.edges.len());
        self.at[edge.to].push(self.edges.len());
        self.edges.push(edge);
    }

    /// The pose of a keyframe seen from another, as the graph believes it now.
    pub fn between(&self, from: usize, to: usize) -> Pose {
        self.poses[from].inverse() * self.poses[to]
    }

    /// Squared error of an edge in sigmas, as the graph stands.
    pub fn disagreement(&self, edge: &PoseEdge) -> f64 {
        let error = pose_error(&edge.motion, &self.between(edge.from, edge.to));
        edge.covariance.cholesky().map_or(f64::INFINITY, |c| c.solve(&error).dot(&error))
    }

    /// The edges at a keyframe.
    pub(crate) fn edges_at(&self, keyframe: usize) -> impl Iterator<Item = &PoseEdge> {
        self.at[keyframe].iter().map(|&number| &self.edges[number])
    }

    /// Moves the keyframes to where all edges fit best; the first one stays. Returns the longest
    /// distance that one was moved, metres.
    pub fn optimise_poses(&mut self) -> f64 {
        let before = self.poses.clone();
        let closures = self.edges.iter().filter(|edge| edge.is_closure);
        let mut doubt = closures.map(|edge| self.disagreement(edge)).fold(DOUBT, f64::max);
        for _ in 0..MOST_STEPS {
            let Some(steps) = self.build_system(doubt).solve() else { break };
            let mut largest: f64 = 0.0;
            for (pose, step) in self.poses.iter_mut().zip(&steps) {
                let yaw_rad = wrapped(pose.yaw_rad + step.z);
                *pose = Pose::new(pose.x_m + step.x, pose.y_m + step.y, yaw_rad);
                largest = largest.max(step.amax());
            }
            // Small steps at a larger doubt do not count: wrong closures still have too much
            // weight.
            if largest < STILL && doubt <= DOUBT {
                break;
            }
            doubt = (doubt / DOUBT_STEP).max(DOUBT);
        }
        self.poses.iter().zip(&before).map(|(new, old)| new.distance_m(old)).fold(0.0, f64::max)
    }

    fn build_system(&self, doubt: f64) -> SparseSystem {
        let mut system = SparseSystem::new(self.poses.len());
        for edge in &self.edges {
            let Some(information) = edge.covariance.try_inverse() else { continue };
            let (from, to) = (&self.poses[edge.from], &self.poses[edge.to]);
            let error = pose_error(&edge.motion, &(from.inverse() * *to));
            let squared = (information * error).dot(&error);
            // Dynamic covariance scaling: s = min(1, 2Φ / (Φ + χ²)) scales the error, so the
            // information is scaled by s².
            let trust = (2.0 * doubt / (doubt + squared)).min(1.0);
            let scale = if edge.is_closure { trust } else { 1.0 };
            let information = information * (scale * scale);
            let (a, b) = error_jacobians(from, to, &edge.motion);
            let (left, right) = (a.transpose() * information, b.transpose() * information);
            system.add_block(edge.from, &(left * a), &(-left * error));
            system.add_block(edge.to, &(right * b), &(-right * error));
            system.couple_blocks(edge.from, edge.to, &(left * b));
        }
        // Fixes the first keyframe: edges are relative, so without this the system is singular.
        system.add_block(0, &(Matrix3::identity() * 1e12), &Vector3::zeros());
        system
    }
}

/// Error of a pose in the frame of what was measured: x, y, heading.
pub fn pose_error(measured: &Pose, believed: &Pose) -> Vector3<f64> {
    let error = measured.inverse() * *believed;
    Vector3::new(error.x_m, error.y_m, error.yaw_rad)
}

/// Brings a covariance from a frame into the one it is turned in by an angle.
pub fn turn_covariance(covariance: &Matrix3<f64>, yaw_rad: f64) -> Matrix3<f64> {
    let turning = turn_matrix(yaw_rad);
    turning * covariance * turning.transpose()
}

pub(crate) fn turn_matrix(yaw_rad: f64) -> Matrix3<f64> {
    let (sin, cos) = yaw_rad.sin_cos();
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}

/// Derivatives of an edge's error by both poses.
fn error_jacobians(from: &Pose, to: &Pose, motion: &Pose) -> (Matrix3<f64>, Matrix3<f64>) {
    let back = |yaw_rad: f64| turn_matrix(yaw_rad).fixed_view::<2, 2>(0, 0).transpose();
    let (sin, cos) = from.yaw_rad.sin_cos();
    let offset = Vector2::new(to.x_m - from.x_m, to.y_m - from.y_m);
    let turn = back(motion.yaw_rad) * Matrix2::new(-sin, cos, -cos, -sin) * offset;
    let rotation = back(motion.yaw_rad) * back(from.yaw_rad);
    let (mut a, mut b) = (-Matrix3::identity(), Matrix3::identity());
    a.fixed_view_mut::<2, 2>(0, 0).copy_from(&-rotation);
    a.fixed_view_mut::<2, 1>(0, 2).copy_from(&turn);
    b.fixed_view_mut::<2, 2>(0, 0).copy_from(&rotation);
    (a, b)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn covariance(sigma_m: f64, sigma_rad: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(sigma_m, sigma_m, sigma_rad).map(|s| s * s))
    }

    /// A square of 4 × `side` keyframes driven with a bend that the truth does not have.
    pub(crate) fn bent_square(side: usize) -> (Vec<Pose>, PoseGraph) {
        let (mut truth, mut graph) = (vec![Pose::default()], PoseGraph::default());
        graph.add_keyframe(Pose::default(), Matrix3::identity());
        for step in 1..=4 * side {
            let turn = if step % side == 0 { std::f64::consts::FRAC_PI_2 } else { 0.0 };
            truth.push(truth[step - 1] * Pose::new(1.0, 0.0, turn));
            graph.add_keyframe(Pose::new(1.01, 0.0, turn + 0.01), covariance(0.02, 0.01));
        }
        (truth, graph)
    }

    #[test]
    fn a_closure_straightens_what_was_bent() {
        let (truth, mut graph) = bent_square(10);
        let worst = |graph: &PoseGraph| {
            let pairs = truth.iter().zip(graph.poses());
            pairs.map(|(true_pose, pose)| true_pose.distance_m(pose)).fold(0.0, f64::max)
        };
        let bent = worst(&graph);
        for (from, to) in [(0, 40), (1, 39), (0, 39)] {
            let motion = truth[from].inverse() * truth[to];
            let covariance = covariance(0.01, 0.003);
            graph.add_edge(PoseEdge { from, to, motion, covariance, is_closure: true });
        }
        graph.optimise_poses();
        assert!(bent > 2.0 && worst(&graph) < 0.6, "{bent} became {}", worst(&graph));
        assert!(
            graph.between(0, 40).distance_m(&Pose::default()) < 0.02,
            "{:?}",
            graph.poses()[40]
        );
    }

    #[test]
    fn a_wrong_closure_among_right_ones_has_no_say() {
        let (truth, mut graph) = bent_square(10);
        let mut close = |from: usize, to: usize, motion: Pose| {
            let covariance = covariance(0.01, 0.003);
            graph.add_edge(PoseEdge { from, to, motion, covariance, is_closure: true });
        };
        for (from, to) in [(0, 40), (1, 40), (0, 39), (1, 39), (2, 38)] {
            close(from, to, truth[from].inverse() * truth[to]);
        }
        close(2, 40, Pose::new(3.0, 3.0, 1.0));
        graph.optimise_poses();
        assert!(
            graph.between(0, 40).distance_m(&Pose::default()) < 0.05,
            "{:?}",
            graph.poses()[40]
        );
    }

    #[test]
    fn another_motion_to_a_keyframe_moves_all_after_it() {
        let (_, mut graph) = bent_square(3);
        let (before, after) = (graph.between(0, 4), graph.between(5, 12));
        let motion = Pose::new(0.5, 0.2, -0.3);
        graph.replace_motion(5, motion, covariance(0.02, 0.01));
        for (found, expected) in [
            (graph.between(0, 4), before),
            (graph.between(4, 5), motion),
            (graph.between(5, 12), after),
        ] {
            assert!(pose_error(&found, &expected).norm() < 1e-12, "{found:?}, not {expected:?}");
        }
    }

    /// Derivatives by hand agree with differences.
    #[test]
    fn jacobians_are_the_errors_derivatives() {
        let (from, to) = (Pose::new(1.0, 2.0, 0.7), Pose::new(2.5, 1.0, -0.4));
        let motion = Pose::new(1.0, -1.5, -0.9);
        let at = |from: Pose, to: Pose| pose_error(&motion, &(from.inverse() * to));
        let (a, b) = error_jacobians(&from, &to, &motion);
        let moved = |pose: Pose, axis: usize| {
            let mut shift = [0.0; 3];
            shift[axis] = 1e-6;
            Pose::new(pose.x_m + shift[0], pose.y_m + shift[1], pose.yaw_rad + shift[2])
        };
        for axis in 0..3 {
            let by_from = (at(moved(from, axis), to) - at(from, to)) / 1e-6;
            let by_to = (at(from, moved(to, axis)) - at(from, to)) / 1e-6;
            assert!((by_from - a.column(axis)).norm() < 1e-5, "from, axis {axis}");
            assert!((by_to - b.column(axis)).norm() < 1e-5, "to, axis {axis}");
        }
    }
}
