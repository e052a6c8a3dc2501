//! Which records of the state are new since it was written last. Pure.

use crate::graph::PoseEdge;
use crate::pose::Pose;
use crate::scan::MapperScan;
use crate::slam::Slam;
use crate::state::{SavedPlace, SavedState, StateRecord, encode_record};

/// What has been written of the state.
#[derive(Debug, Default)]
pub struct StateRecorder {
    /// Drawn scans that are still to be written, each with the distance driven up to it.
    drawn: Vec<(f64, MapperScan)>,
    edges: Vec<PoseEdge>,
    poses: Vec<Pose>,
    track: usize,
}

impl StateRecorder {
    /// Makes a recorder that continues a state.
    pub fn continue_state(state: &SavedState) -> Self {
        let (edges, poses) = (state.edges.clone(), state.poses.clone());
        Self { drawn: Vec::new(), edges, poses, track: state.track.len() }
    }

    /// Takes a scan that was drawn into the map.
    pub fn scan_drawn(&mut self, travelled_m: f64, scan: MapperScan) {
        self.drawn.push((travelled_m, scan));
    }

    /// Returns the batch that brings what was written to the state now; empty if nothing is new.
    /// `odometry` is that of the last scan.
    pub fn take_batch(&mut self, slam: &Slam, odometry: Pose) -> Vec<u8> {
        let mut batch = Vec::new();
        for (stamp_s, keyframe, seen) in &slam.track()[self.track..] {
            encode_record(&mut batch, &StateRecord::Track(*stamp_s, *keyframe, *seen));
        }
        let Some((stamp_s, ..)) = slam.track().last().filter(|_| !batch.is_empty()) else {
            return batch;
        };
        self.track = slam.track().len();
        for (travelled_m, scan) in self.drawn.drain(..) {
            encode_record(&mut batch, &StateRecord::Keyframe(travelled_m, &scan));
        }
        for (number, edge) in slam.graph().edges().iter().enumerate() {
            match self.edges.get_mut(number) {
                Some(written) if written.motion == edge.motion => continue,
                Some(written) => *written = *edge,
                None => self.edges.push(*edge),
            }
            encode_record(&mut batch, &StateRecord::Edge(number, edge));
        }
        let poses = slam.graph().poses();
        let same = self.poses.iter().zip(poses).take_while(|(old, new)| old == new).count();
        if same < poses.len() {
            self.poses.truncate(same);
            self.poses.extend_from_slice(&poses[same..]);
            // A record has a limit: more poses than that are several records.
            for (number, some) in poses[same..].chunks(POSES_PER_RECORD).enumerate() {
                let first = same + number * POSES_PER_RECORD;
                encode_record(&mut batch, &StateRecord::Poses(first, some));
            }
        }
        let (robot, travelled_m) = (slam.robot(), slam.travelled_m());
        let here = SavedPlace { stamp_s: *stamp_s, odometry, robot, travelled_m };
        encode_record(&mut batch, &StateRecord::Here(here));
        batch
    }
}

/// Poses in one record.
const POSES_PER_RECORD: usize = 10_000;
