//! Finds the pose near a prior at which a scan fits the map best: the correlative search of Olson
//! (ICRA 2009), exhaustive within its window, made fast by upper bounds from coarse to fine.

use crate::field::{FULL, LikelihoodField};
use crate::pose::{Point, Pose};
use crate::prior::Prior;
use crate::tile::floor;

/// The best pose found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanMatch {
    /// Where it is, to a cell and a step of angle.
    pub pose: Pose,
    /// Mean likelihood of the points there, 0..1.
    pub fit: f64,
}

/// What doubt in the odometry costs, in mean likelihood. The odometry's errors have long tails
/// (wheels slip rarely, but then far), so the cost grows with the logarithm.
const PRIOR_WEIGHT: f64 = 0.02;

struct WindowSearch<'a> {
    field: &'a LikelihoodField,
    prior: &'a Prior,
    resolution_m: f64,
    /// The scan's cells at each heading, for the prior's position.
    turned: Vec<(f64, Vec<[i32; 2]>)>,
    reach: i32,
    best: Option<ShiftCandidate>,
    /// Shifts nearer than this to one are not looked at, in cells.
    left_out: Option<([i32; 2], i32)>,
}

#[derive(Clone, Copy)]
struct ShiftCandidate {
    turn: usize,
    shift: [i32; 2],
    fit: f64,
    value: f64,
}

/// Searches the prior's window; `None` when there is nothing to match. With `rival_of` it finds the
/// best pose outside the square around that one, half its side in metres.
pub fn search(
    field: &LikelihoodField,
    points: &[Point],
    prior: &Prior,
    resolution_m: f64,
    rival_of: Option<(&Pose, f64)>,
) -> Option<ScanMatch> {
    if points.is_empty() {
        return None;
    }
    let reach = (prior.window_m / resolution_m).ceil() as i32;
    let turned = turn_all(points, prior, resolution_m);
    let cells = |metres: f64| (metres / resolution_m).round() as i32;
    let left_out = rival_of.map(|(pose, apart_m)| {
        let shift = [cells(pose.x_m - prior.pose.x_m), cells(pose.y_m - prior.pose.y_m)];
        (shift, cells(apart_m))
    });
    let mut search =
        WindowSearch { field, prior, resolution_m, turned, reach, best: None, left_out };
    search.search_window();
    let best = search.best?;
    let along = |cells: i32| f64::from(cells) * resolution_m;
    let pose = Pose::new(
        prior.pose.x_m + along(best.shift[0]),
        prior.pose.y_m + along(best.shift[1]),
        prior.pose.yaw_rad + search.turned[best.turn].0,
    );
    Some(ScanMatch { pose, fit: best.fit })
}

/// One step of angle moves the farther points by about a cell and a half, at most half a degree.
fn turn_all(points: &[Point], prior: &Prior, resolution_m: f64) -> Vec<(f64, Vec<[i32; 2]>)> {
    let mut ranges_m: Vec<f64> = points.iter().map(|p| p.x_m.hypot(p.y_m)).collect();
    ranges_m.sort_by(f64::total_cmp);
    let far_m = ranges_m[ranges_m.len() * 9 / 10].max(1.0);
    let step_rad = (1.5 * resolution_m / far_m).clamp(0.002, 0.01);
    let steps = (prior.window_rad / step_rad).ceil() as i32;
    let cells = |turn_rad: f64| {
        let pose = Pose { yaw_rad: prior.pose.yaw_rad + turn_rad, ..prior.pose };
        let cell = |point: &Point| {
            let world = pose.apply(*point);
            [world.x_m, world.y_m].map(|metres| floor(metres / resolution_m))
        };
        points.iter().map(cell).collect()
    };
    (-steps..=steps).map(|i| f64::from(i) * step_rad).map(|turn| (turn, cells(turn))).collect()
}

impl WindowSearch<'_> {
    fn search_window(&mut self) {
        let top = self.field.top();
        let shifts: Vec<i32> = (-self.reach..=self.reach).step_by(1 << top).collect();
        let mut nodes = Vec::new();
        for turn in 0..self.turned.len() {
            for &x in &shifts {
                nodes.extend(shifts.iter().map(|&y| self.rate_candidate(turn, [x, y], top)));
            }
        }
        self.descend_level(nodes, top);
    }

    fn descend_level(&mut self, mut nodes: Vec<ShiftCandidate>, level: usize) {
        nodes.sort_by(|a, b| b.value.total_cmp(&a.value));
        for node in nodes {
            if self.best.is_some_and(|best| best.value >= node.value) {
                return;
            }
            if self.is_left_out(&node, level) {
                continue;
            }
            if level == 0 {
                self.best = Some(node);
                return;
            }
            let half = 1 << (level - 1);
            let mut below = Vec::with_capacity(4);
            for [x, y] in [[0, 0], [half, 0], [0, half], [half, half]] {
                let shift = [node.shift[0] + x, node.shift[1] + y];
                if shift.iter().all(|&s| s <= self.reach) {
                    below.push(self.rate_candidate(node.turn, shift, level - 1));
                }
            }
            self.descend_level(below, level - 1);
        }
    }

    /// Returns whether all of a node's shifts are too near to the pose a rival is looked for.
    fn is_left_out(&self, node: &ShiftCandidate, level: usize) -> bool {
        let side = (1 << level) - 1;
        self.left_out.is_some_and(|(shift, apart)| {
            let within = |i: usize| {
                node.shift[i] > shift[i] - apart && node.shift[i] + side < shift[i] + apart
            };
            within(0) && within(1)
        })
    }

    /// Value of a square of shifts: exact at level 0, an upper bound above.
    fn rate_candidate(&self, turn: usize, shift: [i32; 2], level: usize) -> ShiftCandidate {
        let (turn_rad, cells) = &self.turned[turn];
        let at = |cell: &[i32; 2]| {
            u32::from(self.field.at(level, [cell[0] + shift[0], cell[1] + shift[1]]))
        };
        let sum: u32 = cells.iter().map(at).sum();
        let fit = f64::from(sum) / (FULL * cells.len() as f64);
        let side = (1 << level) - 1;
        let nearest = |s: i32| f64::from(0.clamp(s, s + side)) * self.resolution_m;
        let squared_m = nearest(shift[0]).powi(2) + nearest(shift[1]).powi(2);
        let unlikely = (1.0 + squared_m / self.prior.sigma_m.powi(2)).ln()
            + (1.0 + (turn_rad / self.prior.sigma_rad).powi(2)).ln();
        ShiftCandidate { turn, shift, fit, value: fit - PRIOR_WEIGHT * unlikely }
    }
}
