//! The whole mapper: the front follows the robot scan by scan, the graph remembers every drawn scan
//! and corrects them all when a loop closes, and the map is redrawn at the corrected poses.

use crate::closing::{Closing, Keyframe};
use crate::config::Config;
use crate::filter::{ParticleFilter, ScanEstimate};
use crate::graph::{PoseGraph, turn_covariance};
use crate::particle::ScanStep;
use crate::pose::Pose;
use crate::recognition::{PlaceSearch, SeenScan};
use crate::scan::{Beam, MapperScan, ScanPoint, thinned};
use crate::snapshot::GridSnapshot;
use crate::state::{SavedKeyframe, SavedState};
use nalgebra::{Matrix3, Vector3};

/// The accuracy that no scan match exceeds: metres and share of the distance, radians.
const CHAIN_FLOOR_M: f64 = 0.01;
const CHAIN_FLOOR_RAD: f64 = 0.002;
/// Loops are looked for this often, metres.
const LOOK_EVERY_M: f64 = 1.0;
/// New closures that disagree with the graph by this many squared sigmas together have it
/// optimised immediately.
const DISAGREEMENT: f64 = 15.0;
/// Keyframes that moved by more than this have the map redrawn, metres …
const REDRAWN_M: f64 = 0.03;
/// … when this share of them is new since it was drawn, so that a scan pays for sixteen at most
/// however many there are …
const REDRAWN_SHARE: usize = 16;
/// … or immediately, where the map is too wrong to continue with, metres.
const REDRAWN_AT_ONCE_M: f64 = 0.3;

/// Simultaneous localisation and mapping, one scan at a time.
pub struct Slam {
    front: ParticleFilter,
    config: Config,
    keyframes: Vec<Keyframe>,
    graph: PoseGraph,
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
            front: ParticleFilter::new(config),
            config,
            keyframes: Vec::new(),
            graph: PoseGraph::default(),
            closing: Closing::default(),
            track: Vec::new(),
            disagreement: 0.0,
            moved_m: 0.0,
            redrawn: 0,
        }
    }

    /// Makes a mapper that knows a stored map, and not yet where the robot is on it: no scan may be
    /// added before [`place_robot`](Self::place_robot). `None` if the state is not one of a map.
    pub fn restore(config: Config, state: SavedState) -> Option<Self> {
        let graph = PoseGraph::from_parts(state.poses, state.edges)?;
        let read = |saved: &SavedKeyframe| {
            let (beams, points) = read_scan(&config, &saved.scan);
            Keyframe::new(saved.travelled_m, beams, &points)
        };
        let mut keyframes: Vec<Keyframe> = state.keyframes.iter().map(read).collect();
        let travelled_m = state.here?.travelled_m;
        let scans = graph.poses().iter().zip(&keyframes);
        let scans = scans.map(|(pose, keyframe)| (*pose, keyframe.beams.as_slice()));
        let front = ParticleFilter::restore(config, scans, travelled_m);
        let redrawn = keyframes.len();
        let looked_m = keyframes.last()?.travelled_m;
        if !config.loop_closing {
            keyframes.clear();
        }
        Some(Self {
            front,
            keyframes,
            graph,
            closing: Closing::after(looked_m),
            track: state.track,
            redrawn,
            ..Self::new(config)
        })
    }

    /// Sets where the robot is on a restored map, and the odometry of that moment.
    pub fn place_robot(&mut self, robot: Pose, odometry: Pose, stamp_s: f64) {
        self.front.set_robot(robot, odometry, stamp_s);
    }

    /// Looks where the robot is on a restored map; `None` as long as that is not certain.
    pub fn find_place(
        &self,
        search: &mut PlaceSearch,
        odometry: Pose,
        scan: &MapperScan,
    ) -> Option<Pose> {
        let (_, points) = read_scan(&self.config, scan);
        let seen = SeenScan { stamp_s: scan.stamp_s, odometry, points: &points };
        search.find_place(&self.config, self.front.grid(), &seen)
    }

    /// Places a scan, taken at the odometry pose `odometry`, and draws it if it brings news.
    pub fn add(&mut self, odometry: Pose, scan: &MapperScan) -> ScanEstimate {
        let (beams, points) = read_scan(&self.config, scan);
        let mut estimate = self.front.add(odometry, scan.stamp_s, &beams, &points);
        if estimate.drawn {
            self.remember_keyframe();
            let travelled_m = self.front.travelled_m();
            if self.config.loop_closing {
                self.keyframes.push(Keyframe::new(travelled_m, beams, &points));
                self.close_loops();
            }
        }
        let keyframe = self.graph.poses().len() - 1;
        // The front's map lags behind the graph by corrections too small to redraw it.
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

    /// Every scan: its stamp, the keyframe before it or itself, and where it was seen from there.
    pub(crate) fn track(&self) -> &[(f64, usize, Pose)] {
        &self.track
    }

    pub(crate) fn graph(&self) -> &PoseGraph {
        &self.graph
    }

    /// Where the robot was at the last scan: `map_from_robot`.
    pub fn robot(&self) -> Pose {
        self.front.robot()
    }

    /// Distance driven according to the odometry, metres.
    pub fn travelled_m(&self) -> f64 {
        self.front.travelled_m()
    }

    /// Number of scans so far.
    pub fn scans(&self) -> usize {
        self.track.len()
    }

    /// The map as it is now.
    pub fn snapshot(&self) -> GridSnapshot {
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

    /// Brings the graph's chain to the trajectory of the best particle, which may have changed.
    fn remember_keyframe(&mut self) {
        let steps = self.front.steps();
        let first = self.graph.poses().len() + 1 - steps.len();
        if first == 0 && self.graph.poses().is_empty() {
            self.graph.add_keyframe(steps[0].pose, steps[0].covariance);
        }
        for (number, pair) in steps.windows(2).enumerate() {
            let (motion, covariance) = relate_steps(&pair[0], &pair[1]);
            let keyframe = first + number + 1;
            if keyframe < self.graph.poses().len() {
                self.graph.replace_motion(keyframe, motion, covariance);
            } else {
                self.graph.add_keyframe(motion, covariance);
            }
        }
    }

    fn close_loops(&mut self) {
        let believed = self.closing.look_for_closures(&self.graph, &self.keyframes, LOOK_EVERY_M);
        for edge in believed {
            self.disagreement += self.graph.disagreement(&edge).max(f64::MIN_POSITIVE);
            self.graph.add_edge(edge);
        }
        if self.disagreement > DISAGREEMENT {
            self.optimise_graph();
        }
        let is_due = (self.keyframes.len() - self.redrawn) * REDRAWN_SHARE >= self.keyframes.len();
        if self.moved_m > REDRAWN_AT_ONCE_M || (is_due && self.moved_m > REDRAWN_M) {
            self.redraw_map();
        }
    }

    fn optimise_graph(&mut self) {
        self.moved_m += self.graph.optimise_poses();
        self.disagreement = 0.0;
    }

    fn redraw_map(&mut self) {
        let scans = self.graph.poses().iter().zip(&self.keyframes);
        self.front.redraw_map(scans.map(|(pose, k)| (*pose, k.beams.as_slice())));
        (self.moved_m, self.redrawn) = (0.0, self.keyframes.len());
    }
}

/// What a scan saw, in the robot's frame: its beams, and thinned points on surfaces.
fn read_scan(config: &Config, scan: &MapperScan) -> (Vec<Beam>, Vec<ScanPoint>) {
    let beams = scan.beams(&config.robot_from_laser, config.reach);
    let points = thinned(&beams, 2.0 * config.resolution_m);
    (beams, points)
}

/// The motion from one step to the next, and its covariance in the frame of the second.
fn relate_steps(from: &ScanStep, to: &ScanStep) -> (Pose, Matrix3<f64>) {
    let motion = from.pose.inverse() * to.pose;
    let floor_m = CHAIN_FLOOR_M * (1.0 + motion.x_m.hypot(motion.y_m));
    let floor = Vector3::new(floor_m, floor_m, CHAIN_FLOOR_RAD).map(|sigma| sigma * sigma);
    let own = turn_covariance(&to.covariance, -to.pose.yaw_rad);
    (motion, own + Matrix3::from_diagonal(&floor))
}
