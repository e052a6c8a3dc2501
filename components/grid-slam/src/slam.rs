//! The whole mapper: the front follows the robot scan by scan, the graph remembers every drawn scan
//! and corrects them all when a loop closes, and the map is drawn anew where they are then.

use crate::closing::{Closing, Keyframe};
use crate::config::Config;
use crate::filter::{Estimate, Filter};
use crate::graph::{Graph, turned};
use crate::particle::Step;
use crate::pose::Pose;
use crate::scan::{Scan, thinned};
use crate::snapshot::Snapshot;
use nalgebra::{Matrix3, Vector3};

/// What no scan match is better than: metres and share of the way, radians.
const CHAIN_FLOOR_M: f64 = 0.01;
const CHAIN_FLOOR_RAD: f64 = 0.002;
/// Loops are looked for this often, metres.
const LOOK_EVERY_M: f64 = 1.0;
/// New closures that disagree with the graph by this many squared sigmas together have it
/// optimised at once.
const DISAGREEMENT: f64 = 15.0;
/// Keyframes that moved by more than this have the map drawn anew, metres …
const REDRAWN_M: f64 = 0.03;
/// … when this share of them is new since it was drawn, so that a scan pays for sixteen at most
/// however many there are …
const REDRAWN_SHARE: usize = 16;
/// … or at once, where the map is too wrong to go on with, metres.
const REDRAWN_AT_ONCE_M: f64 = 0.3;

/// Simultaneous localisation and mapping, one scan at a time.
pub struct Slam {
    front: Filter,
    config: Config,
    keyframes: Vec<Keyframe>,
    graph: Graph,
    closing: Closing,
    /// Every scan: its stamp, the keyframe before it or itself, and where it was seen from there.
    track: Vec<(f64, usize, Pose)>,
    /// Disagreement of the closures since the graph was optimised.
    disagreement: f64,
    /// How far keyframes may have moved since the map was drawn, metres.
    moved_m: f64,
    /// Keyframes at that time.
    redrawn: usize,
}

impl Slam {
    /// Makes a map that begins where the robot stands.
    pub fn new(config: Config) -> Self {
        Self {
            front: Filter::new(config),
            config,
            keyframes: Vec::new(),
            graph: Graph::default(),
            closing: Closing::default(),
            track: Vec::new(),
            disagreement: 0.0,
            moved_m: 0.0,
            redrawn: 0,
        }
    }

    /// Places a scan, taken where the odometry says `odometry`, and draws it if it brings news.
    pub fn add(&mut self, odometry: Pose, scan: &Scan) -> Estimate {
        let beams = scan.beams(&self.config.robot_from_laser, self.config.reach);
        let points = thinned(&beams, 2.0 * self.config.resolution_m);
        let mut estimate = self.front.add(odometry, scan.stamp_s, &beams, &points);
        if estimate.drawn {
            self.remember();
            let travelled_m = self.front.travelled_m();
            if self.config.loop_closing {
                self.keyframes.push(Keyframe { travelled_m, beams, points });
                self.close_loops();
            }
        }
        let keyframe = self.graph.poses().len() - 1;
        // The front's map lags behind the graph by what is too little to draw it anew.
        let seen = self.front.keyframe().inverse() * self.front.robot();
        self.track.push((scan.stamp_s, keyframe, seen));
        estimate.pose = self.front.robot();
        estimate.map_from_odom = estimate.pose * odometry.inverse();
        estimate
    }

    /// Where every scan was taken, as it is known now: stamps in seconds and `map_from_robot`.
    pub fn trajectory(&self) -> impl Iterator<Item = (f64, Pose)> + '_ {
        let pose = |keyframe: usize, seen: Pose| self.graph.poses()[keyframe] * seen;
        self.track.iter().map(move |&(stamp_s, keyframe, seen)| (stamp_s, pose(keyframe, seen)))
    }

    /// Where each particle has the robot now: `map_from_robot`.
    pub fn particles(&self) -> impl Iterator<Item = Pose> + '_ {
        self.front.robots()
    }

    /// Number of scans so far.
    pub fn scans(&self) -> usize {
        self.track.len()
    }

    /// The map as it is now.
    pub fn snapshot(&self) -> Snapshot {
        self.front.snapshot()
    }

    /// Tiles of all particles' maps: in memory, and as many as they would be without sharing.
    pub fn tiles(&self) -> (usize, usize) {
        self.front.tiles()
    }

    /// Number of loops closed so far.
    pub fn closures(&self) -> usize {
        self.graph.closures()
    }

    /// Brings the graph's chain to the best particle's way, which may have become another.
    fn remember(&mut self) {
        let way = self.front.way();
        let first = self.graph.poses().len() + 1 - way.len();
        if first == 0 && self.graph.poses().is_empty() {
            self.graph.extend(way[0].pose, way[0].covariance);
        }
        for (number, pair) in way.windows(2).enumerate() {
            let (motion, covariance) = link(&pair[0], &pair[1]);
            let keyframe = first + number + 1;
            if keyframe < self.graph.poses().len() {
                self.graph.reached(keyframe, motion, covariance);
            } else {
                self.graph.extend(motion, covariance);
            }
        }
    }

    fn close_loops(&mut self) {
        let believed = self.closing.look(&self.graph, &self.keyframes, LOOK_EVERY_M);
        for edge in believed {
            self.disagreement += self.graph.disagreement(&edge).max(f64::MIN_POSITIVE);
            self.graph.connect(edge);
        }
        if self.disagreement > DISAGREEMENT {
            self.optimise();
        }
        let is_due = (self.keyframes.len() - self.redrawn) * REDRAWN_SHARE >= self.keyframes.len();
        if self.moved_m > REDRAWN_AT_ONCE_M || (is_due && self.moved_m > REDRAWN_M) {
            self.redraw();
        }
    }

    fn optimise(&mut self) {
        self.moved_m += self.graph.optimise();
        self.disagreement = 0.0;
    }

    fn redraw(&mut self) {
        let scans = self.graph.poses().iter().zip(&self.keyframes);
        self.front.redraw(scans.map(|(pose, k)| (*pose, k.beams.as_slice())));
        (self.moved_m, self.redrawn) = (0.0, self.keyframes.len());
    }
}

/// The motion from one step to the next, and its covariance in the frame of the second.
fn link(from: &Step, to: &Step) -> (Pose, Matrix3<f64>) {
    let motion = from.pose.inverse() * to.pose;
    let floor_m = CHAIN_FLOOR_M * (1.0 + motion.x_m.hypot(motion.y_m));
    let floor = Vector3::new(floor_m, floor_m, CHAIN_FLOOR_RAD).map(|sigma| sigma * sigma);
    let own = turned(&to.covariance, -to.pose.yaw_rad);
    (motion, own + Matrix3::from_diagonal(&floor))
}
