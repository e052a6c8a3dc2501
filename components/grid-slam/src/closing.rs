//! Loop closing: finds where the robot has been before, asks whether the match could be another,
//! and believes it when it changes nothing that is known well or when several matches agree.
//!
//! Correlative matching after Olson (ICRA 2009); agreement of pairs after Olson, *Recognizing
//! places using spectrally clustered local matches*, Robotics and Autonomous Systems 57, 2009.

use crate::agreement::select_agreeing;
use crate::field::{CellWindow, LikelihoodField};
use crate::graph::{PoseEdge, PoseGraph, pose_error, turn_covariance};
use crate::grid::SurfaceGrid;
use crate::pose::{Point, Pose};
use crate::prior::Prior;
use crate::refine::{Expected, refine};
use crate::scan::{Beam, ScanPoint, thin};
use crate::search::search;
use nalgebra::{Matrix3, Vector3};

/// Keyframes are compared after this much travel, metres: nearer ones are the chain's business.
const FRESH_M: f64 = 12.0;
/// What was seen over this much travel is matched together: one scan alone looks like many others.
const NEW_M: f64 = 4.0;
/// … to what was seen this far along the old trajectory, metres.
const OLD_M: f64 = 8.0;
/// Places this far apart still see the same, metres.
const OVERLAP_M: f64 = 3.0;
/// The search looks this many sigmas around …
const SIGMAS: f64 = 3.0;
/// … but not less than this far, so that a match that could be another is seen to be one, metres …
const LEAST_WINDOW_M: f64 = 0.6;
/// … and not farther, metres.
const MOST_WINDOW_M: f64 = 8.0;
const LEAST_WINDOW_RAD: f64 = 0.15;
const MOST_WINDOW_RAD: f64 = 0.6;
/// Old places tried at a time.
const MOST_PLACES: usize = 2;
/// Side of the squares points are thinned to, and of the cells of the search, metres.
const COARSE_M: f64 = 0.1;
const BLUR_M: f64 = 0.12;
/// Mean likelihood that a match needs.
const FIT: f64 = 0.55;
/// Share of the points on old surfaces that a match needs.
const SUPPORT: f64 = 0.6;
/// A match is ambiguous if one that is `APART_M` away fits this well in comparison.
const RIVAL: f64 = 0.92;
const APART_M: f64 = 0.5;
/// What no match is better than, metres and radians.
const FLOOR_M: f64 = 0.02;
const FLOOR_RAD: f64 = 0.004;
/// Places known this well need no witnesses, metres.
const FAMILIAR_M: f64 = 0.25;
/// Squared error in sigmas at which matches contradict each other: 99% for three dimensions.
const CONTRADICTION: f64 = 11.3;
/// So many matches must agree …
const WITNESSES: usize = 3;
/// … within this much travel, metres.
const MEMORY_M: f64 = 20.0;

/// A scan that has been drawn.
#[derive(Clone, Debug)]
pub struct Keyframe {
    /// Distance driven up to it, metres.
    pub travelled_m: f64,
    /// What was seen, in the robot's frame.
    pub beams: Vec<Beam>,
    /// Points on surfaces, thinned, in the robot's frame.
    pub points: Vec<Point>,
}

impl Keyframe {
    pub(crate) fn new(travelled_m: f64, beams: Vec<Beam>, points: &[ScanPoint]) -> Self {
        Self { travelled_m, beams, points: points.iter().map(|point| point.place).collect() }
    }
}

/// Looks for closures and remembers matches that wait for witnesses.
#[derive(Debug, Default)]
pub struct Closing {
    waiting: Vec<PoseEdge>,
    looked_m: f64,
}

impl Closing {
    /// Begins after this much travel, metres.
    pub(crate) fn after(travelled_m: f64) -> Self {
        Self { waiting: Vec::new(), looked_m: travelled_m }
    }

    /// Looks where the newest keyframe has been before; gives the closures that are believed now.
    pub fn look_for_closures(
        &mut self,
        graph: &PoseGraph,
        keyframes: &[Keyframe],
        every_m: f64,
    ) -> Vec<PoseEdge> {
        let newest = keyframes.len() - 1;
        let travelled_m = keyframes[newest].travelled_m;
        if travelled_m - self.looked_m < every_m {
            return Vec::new();
        }
        self.looked_m = travelled_m;
        self.waiting.retain(|edge| travelled_m - keyframes[edge.to].travelled_m < MEMORY_M);
        let doubts = graph.seen_from(newest);
        let mut believed = Vec::new();
        for old in choose_places(graph, keyframes, &doubts) {
            let Some(edge) = match_place(graph, keyframes, old, &doubts[old]) else { continue };
            let is_familiar = sigma_m(&doubts[old]) < FAMILIAR_M;
            if is_familiar && agrees_with_graph(graph, &edge, &doubts[old]) {
                believed.push(edge);
            } else {
                self.waiting.push(edge);
                believed.extend(self.take_witnessed(graph));
            }
        }
        believed
    }

    /// Takes the newest of the waiting matches, and those that agree with it, if they are enough.
    fn take_witnessed(&mut self, graph: &PoseGraph) -> Vec<PoseEdge> {
        let together = select_agreeing(graph, &self.waiting, CONTRADICTION);
        if together.len() < WITNESSES {
            return Vec::new();
        }
        let taken = together.iter().map(|&number| self.waiting[number]).collect();
        let mut number = 0;
        self.waiting.retain(|_| {
            number += 1;
            !together.contains(&(number - 1))
        });
        taken
    }
}

/// Old keyframes to compare the newest with: of each stretch of trajectory that may overlap, the
/// nearest.
fn choose_places(graph: &PoseGraph, keyframes: &[Keyframe], doubts: &[Matrix3<f64>]) -> Vec<usize> {
    let newest = keyframes.len() - 1;
    let here = &graph.poses()[newest];
    let mut stretches: Vec<(f64, usize)> = Vec::new();
    let mut last = None;
    for (old, keyframe) in keyframes.iter().enumerate() {
        if keyframes[newest].travelled_m - keyframe.travelled_m < FRESH_M {
            break;
        }
        let distance_m = here.distance_m(&graph.poses()[old]);
        let doubt_m = sigma_m(&doubts[old]);
        if distance_m > OVERLAP_M + (SIGMAS * doubt_m).min(MOST_WINDOW_M) {
            continue;
        }
        let cost = distance_m + doubt_m;
        let continues = last.is_some_and(|l: f64| keyframe.travelled_m - l < OVERLAP_M);
        last = Some(keyframe.travelled_m);
        match stretches.last_mut() {
            Some(best) if continues => {
                if cost < best.0 {
                    *best = (cost, old);
                }
            }
            _ => stretches.push((cost, old)),
        }
    }
    stretches.sort_by(|a, b| a.0.total_cmp(&b.0));
    stretches.into_iter().take(MOST_PLACES).map(|(_, old)| old).collect()
}

/// Where the newest keyframe is as seen from an old one, if their surroundings fit in one position
/// only.
fn match_place(
    graph: &PoseGraph,
    keyframes: &[Keyframe],
    old: usize,
    doubt: &Matrix3<f64>,
) -> Option<PoseEdge> {
    let newest = keyframes.len() - 1;
    let prior = build_prior(graph.between(old, newest), doubt);
    let now_m = keyframes[newest].travelled_m;
    let new_side = draw_surroundings(graph, keyframes, newest, |k| now_m - k.travelled_m < NEW_M);
    let then_m = keyframes[old].travelled_m;
    let old_side = draw_surroundings(graph, keyframes, old, |k| {
        (k.travelled_m - then_m).abs() < OLD_M + prior.window_m && now_m - k.travelled_m > FRESH_M
    });
    let points = thin(new_side.iter().flatten().copied(), COARSE_M);
    let [coarse, fine] = [COARSE_M, COARSE_M / 2.0].map(|side_m| {
        let mut grid = SurfaceGrid::new(side_m);
        old_side.iter().for_each(|points| grid.mark(points));
        grid
    });
    let levels = ((prior.window_m / COARSE_M).log2() as usize).clamp(2, 5);
    let field = LikelihoodField::draw(
        &coarse,
        CellWindow::around(&points, &prior, COARSE_M, 3.0 * BLUR_M),
        BLUR_M,
        levels,
    );
    let found = search(&field, &points, &prior, COARSE_M, None)?;
    if found.fit < FIT {
        return None;
    }
    let rival = search(&field, &points, &prior, COARSE_M, Some((&found.pose, APART_M)));
    if rival.is_some_and(|rival| rival.fit > RIVAL * found.fit) {
        return None;
    }
    let free = Expected::new(found.pose, Matrix3::identity());
    let points: Vec<_> = points.into_iter().map(ScanPoint::from).collect();
    let refined = refine(&fine, &points, found.pose, &free);
    if refined.support < SUPPORT {
        return None;
    }
    let known = (refined.information + Matrix3::identity()).try_inverse()?;
    let floor = Vector3::new(FLOOR_M, FLOOR_M, FLOOR_RAD).map(|sigma| sigma * sigma);
    let covariance =
        turn_covariance(&known, -refined.pose.yaw_rad) + Matrix3::from_diagonal(&floor);
    Some(PoseEdge { from: old, to: newest, motion: refined.pose, covariance, is_closure: true })
}

/// Points seen from the chosen keyframes, by keyframe, in the frame of one of them.
fn draw_surroundings(
    graph: &PoseGraph,
    keyframes: &[Keyframe],
    anchor: usize,
    is_chosen: impl Fn(&Keyframe) -> bool,
) -> Vec<Vec<Point>> {
    let chosen = keyframes.iter().enumerate().filter(|(_, keyframe)| is_chosen(keyframe));
    chosen
        .map(|(number, keyframe)| {
            let pose = graph.between(anchor, number);
            keyframe.points.iter().map(|point| pose.apply(*point)).collect()
        })
        .collect()
}

fn build_prior(pose: Pose, doubt: &Matrix3<f64>) -> Prior {
    let (sigma_m, sigma_rad) = (sigma_m(doubt).max(0.05), doubt.m33.sqrt().max(0.02));
    let window_m = (SIGMAS * sigma_m).clamp(LEAST_WINDOW_M, MOST_WINDOW_M);
    let window_rad = (SIGMAS * sigma_rad).clamp(LEAST_WINDOW_RAD, MOST_WINDOW_RAD);
    Prior { pose, sigma_m, sigma_rad, window_m, window_rad }
}

/// Largest standard deviation of the position, metres.
fn sigma_m(covariance: &Matrix3<f64>) -> f64 {
    let (half, product) = (
        (covariance.m11 + covariance.m22) / 2.0,
        covariance.m11 * covariance.m22 - covariance.m12 * covariance.m21,
    );
    (half + (half * half - product).max(0.0).sqrt()).sqrt()
}

/// Returns whether a match lies where the graph expects it.
fn agrees_with_graph(graph: &PoseGraph, edge: &PoseEdge, doubt: &Matrix3<f64>) -> bool {
    let error = pose_error(&edge.motion, &graph.between(edge.from, edge.to));
    let spread = sigma_m(doubt).powi(2);
    let expected = Matrix3::from_diagonal(&Vector3::new(spread, spread, doubt.m33));
    let both = edge.covariance + expected;
    both.cholesky().is_some_and(|c| c.solve(&error).dot(&error) < CONTRADICTION)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of `count` keyframes a metre apart, believed to spiral outwards by `drift_m` a round,
    /// twice around; each sees the points of the world within 6 m.
    fn twice_around(world: &[Point], count: usize, drift_m: f64) -> (PoseGraph, Vec<Keyframe>) {
        let radius_m = count as f64 / std::f64::consts::TAU;
        let (mut graph, mut keyframes) = (PoseGraph::default(), Vec::new());
        let chain = Matrix3::from_diagonal(&Vector3::new(2e-3, 2e-3, 1e-5));
        for step in 0..count + 12 {
            let angle = step as f64 / radius_m;
            let at = |r: f64| Pose::new(r * angle.cos(), r * angle.sin(), angle);
            let (truth, part) = (at(radius_m), step as f64 / count as f64);
            let before = graph.poses().last().copied().unwrap_or_default();
            graph.add_keyframe(before.inverse() * at(radius_m + drift_m * part), chain);
            let seen = world.iter().map(|point| truth.inverse().apply(*point));
            let points = seen.filter(|point| point.x_m.hypot(point.y_m) < 6.0).collect();
            keyframes.push(Keyframe { travelled_m: step as f64, beams: Vec::new(), points });
        }
        (graph, keyframes)
    }

    /// All closures that are believed while the ring is driven.
    fn closures(graph: &PoseGraph, keyframes: &[Keyframe]) -> Vec<PoseEdge> {
        let (mut closing, mut driven) = (Closing::default(), PoseGraph::default());
        let mut found = Vec::new();
        for number in 1..=keyframes.len() {
            let chain = Matrix3::from_diagonal(&Vector3::new(2e-3, 2e-3, 1e-5));
            let before = driven.poses().last().copied().unwrap_or_default();
            driven.add_keyframe(before.inverse() * graph.poses()[number - 1], chain);
            found.extend(closing.look_for_closures(&driven, &keyframes[..number], 1.0));
        }
        found
    }

    #[test]
    fn the_way_around_closes_where_it_was_open() {
        let scattered = |i: u32| {
            let (a, b) = ((f64::from(i) * 0.754_877).fract(), (f64::from(i) * 0.569_84).fract());
            Point { x_m: 30.0 * a - 15.0, y_m: 30.0 * b - 15.0 }
        };
        let world: Vec<_> = (0..900).map(scattered).collect();
        let (graph, keyframes) = twice_around(&world, 50, 0.4);
        let found = closures(&graph, &keyframes);
        assert!(found.len() >= WITNESSES, "{found:?}");
        for edge in found {
            // By construction a round is 50 keyframes.
            let back = if edge.to >= 50 { edge.to - 50 } else { edge.to };
            let radius_m = 50.0 / std::f64::consts::TAU;
            let angle = |step: usize| step as f64 / radius_m;
            let at = |a: f64| Pose::new(radius_m * a.cos(), radius_m * a.sin(), a);
            let true_motion = at(angle(edge.from)).inverse() * at(angle(back));
            assert!(edge.motion.distance_m(&true_motion) < 0.15, "{edge:?}, not {true_motion:?}");
        }
    }

    #[test]
    fn a_place_that_repeats_itself_closes_nothing() {
        let pillar = |i: i32| Point { x_m: f64::from(i % 31 - 15), y_m: f64::from(i / 31 - 15) };
        let world: Vec<_> = (0..961).map(pillar).collect();
        let (graph, keyframes) = twice_around(&world, 50, 0.6);
        assert!(closures(&graph, &keyframes).is_empty());
    }
}
