//! What the mapper writes down, so that it can continue after its own death: a header, and batches
//! of records that are only added to the end. Pure: bytes in, bytes out.
//!
//! A batch ends with a record of the kind `Here`; what follows the last one was being written when
//! the mapper died, and does not count. The bytes of a record: `record_bytes.rs`.

use crate::config::Config;
use crate::graph::PoseEdge;
use crate::pose::Pose;
use crate::record_bytes::{Payload, PayloadReader, RawRecord, append_record, is_torn, take_record};
use crate::scan::MapperScan;
use nalgebra::Matrix3;
use thiserror::Error;

const MAGIC: &[u8; 8] = b"armslam1";

/// Why a file is no state that can be continued from.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StateError {
    /// It does not begin as a state of this version.
    #[error("it is no state of this version of the mapper")]
    Unknown,
    /// A record is damaged.
    #[error("it is damaged at byte {at}")]
    Damaged {
        /// Where the record begins.
        at: usize,
    },
    /// The records contradict each other.
    #[error("its records contradict each other at byte {at}")]
    Contradiction {
        /// Where the record begins.
        at: usize,
    },
}

/// The parameters that a state and its mapper must have in common: with others, the stored scans cannot
/// be drawn and continued.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateFit {
    resolution_m: f64,
    robot_from_laser: Pose,
    reach_m: [f64; 2],
    loop_closing: bool,
}

impl StateFit {
    /// Those of a configuration.
    pub fn of(config: &Config) -> Self {
        let reach_m = [config.reach.hit_m, config.reach.clear_m];
        let Config { resolution_m, robot_from_laser, loop_closing, .. } = *config;
        Self { resolution_m, robot_from_laser, reach_m, loop_closing }
    }
}

/// How the scans of a laser look; another laser has another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanShape {
    angle_min_rad: f64,
    increment_rad: f64,
    range_min_m: f64,
    range_max_m: f64,
    beams: usize,
}

impl ScanShape {
    /// That of a scan.
    pub fn of(scan: &MapperScan) -> Self {
        let MapperScan { angle_min_rad, increment_rad, range_min_m, range_max_m, .. } = *scan;
        let beams = scan.ranges_m.len();
        Self { angle_min_rad, increment_rad, range_min_m, range_max_m, beams }
    }
}

/// What a state belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct StateHeader {
    /// Number of the run.
    pub run: String,
    /// Epoch of the map frame.
    pub epoch: String,
    /// The parameters.
    pub fit: StateFit,
}

/// A drawn scan.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedKeyframe {
    /// Distance driven up to it, metres.
    pub travelled_m: f64,
    /// The scan.
    pub scan: MapperScan,
}

/// Where the robot was when the state was written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SavedPlace {
    /// Stamp of the last scan, seconds.
    pub stamp_s: f64,
    /// The odometry of that moment.
    pub odometry: Pose,
    /// `map_from_robot`.
    pub robot: Pose,
    /// Distance driven, metres.
    pub travelled_m: f64,
}

/// A state as it was written last.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedState {
    /// What it belongs to.
    pub header: StateHeader,
    /// The drawn scans.
    pub keyframes: Vec<SavedKeyframe>,
    /// `map_from_keyframe` of each.
    pub poses: Vec<Pose>,
    /// What was measured between them.
    pub edges: Vec<PoseEdge>,
    /// Every scan: its stamp, its keyframe, and where it was seen from there.
    pub track: Vec<(f64, usize, Pose)>,
    /// Where the robot was; `None` if nothing was mapped.
    pub here: Option<SavedPlace>,
    /// Bytes up to the end of the last whole batch.
    pub len: usize,
}

/// A part of a state, as it is written.
#[derive(Clone, Debug)]
pub enum StateRecord<'a> {
    /// The next keyframe.
    Keyframe(f64, &'a MapperScan),
    /// An edge, new or changed.
    Edge(usize, &'a PoseEdge),
    /// The poses of the keyframes from this one on.
    Poses(usize, &'a [Pose]),
    /// The next scan of the trajectory.
    Track(f64, usize, Pose),
    /// The end of a batch.
    Here(SavedPlace),
}

/// Returns the begin of a file.
pub fn encode_header(header: &StateHeader) -> Vec<u8> {
    let mut payload = Payload::default();
    payload.text(&header.run);
    payload.text(&header.epoch);
    let StateFit { resolution_m, robot_from_laser, reach_m, loop_closing } = header.fit;
    payload.number(resolution_m);
    payload.pose(&robot_from_laser);
    reach_m.iter().for_each(|metres| payload.number(*metres));
    payload.byte(u8::from(loop_closing));
    let mut bytes = MAGIC.to_vec();
    append_record(&mut bytes, 0, &payload);
    bytes
}

/// Adds a record to the end.
pub fn encode_record(bytes: &mut Vec<u8>, record: &StateRecord<'_>) {
    let mut payload = Payload::default();
    let kind = match *record {
        StateRecord::Keyframe(travelled_m, scan) => {
            let ScanShape { angle_min_rad, increment_rad, range_min_m, range_max_m, .. } =
                ScanShape::of(scan);
            for number in
                [travelled_m, scan.stamp_s, angle_min_rad, increment_rad, range_min_m, range_max_m]
            {
                payload.number(number);
            }
            for range_m in &scan.ranges_m {
                payload.range(*range_m);
            }
            1
        }
        StateRecord::Edge(number, edge) => {
            payload.index(number);
            payload.index(edge.from);
            payload.index(edge.to);
            payload.byte(u8::from(edge.is_closure));
            payload.pose(&edge.motion);
            edge.covariance.iter().for_each(|number| payload.number(*number));
            2
        }
        StateRecord::Poses(first, poses) => {
            payload.index(first);
            poses.iter().for_each(|pose| payload.pose(pose));
            3
        }
        StateRecord::Track(stamp_s, keyframe, seen) => {
            payload.number(stamp_s);
            payload.index(keyframe);
            payload.pose(&seen);
            4
        }
        StateRecord::Here(SavedPlace { stamp_s, odometry, robot, travelled_m }) => {
            payload.number(stamp_s);
            payload.pose(&odometry);
            payload.pose(&robot);
            payload.number(travelled_m);
            5
        }
    };
    append_record(bytes, kind, &payload);
}

/// Reads what a state belongs to.
///
/// # Errors
/// If the bytes do not begin as a state.
pub fn decode_header(bytes: &[u8]) -> Result<StateHeader, StateError> {
    let rest = bytes.strip_prefix(MAGIC).ok_or(StateError::Unknown)?;
    let RawRecord { kind: 0, payload, .. } =
        take_record(rest).ok_or(StateError::Damaged { at: MAGIC.len() })?
    else {
        return Err(StateError::Unknown);
    };
    let mut reader = PayloadReader::new(payload);
    let mut read = || {
        let (run, epoch) = (reader.text()?, reader.text()?);
        let (resolution_m, robot_from_laser) = (reader.number()?, reader.pose()?);
        let reach_m = [reader.number()?, reader.number()?];
        let loop_closing = reader.byte()? != 0;
        let fit = StateFit { resolution_m, robot_from_laser, reach_m, loop_closing };
        reader.is_empty().then_some(StateHeader { run, epoch, fit })
    };
    read().ok_or(StateError::Contradiction { at: MAGIC.len() })
}

/// Reads a state. What was being written when the mapper died is left out.
///
/// # Errors
/// If a record is damaged or contradicts the others. Whatever the bytes are, it does not panic.
pub fn decode_state(bytes: &[u8]) -> Result<SavedState, StateError> {
    let header = decode_header(bytes)?;
    let mut at = MAGIC.len() + take_record(&bytes[MAGIC.len()..]).map_or(0, |it| it.len);
    let mut state = SavedState {
        header,
        keyframes: Vec::new(),
        poses: Vec::new(),
        edges: Vec::new(),
        track: Vec::new(),
        here: None,
        len: at,
    };
    let mut batch = Vec::new();
    while let Some(record) = take_record(&bytes[at..]) {
        batch.push((at, record.kind, record.payload));
        at += record.len;
        if record.kind == 5 {
            for (at, kind, payload) in batch.drain(..) {
                let known = state.apply_record(kind, PayloadReader::new(payload));
                known.ok_or(StateError::Contradiction { at })?;
            }
            state.is_whole().then_some(()).ok_or(StateError::Contradiction { at })?;
            state.len = at;
        }
    }
    if is_torn(&bytes[at..]) { Ok(state) } else { Err(StateError::Damaged { at }) }
}

impl SavedState {
    fn apply_record(&mut self, kind: u8, mut payload: PayloadReader<'_>) -> Option<()> {
        match kind {
            1 => {
                let travelled_m = payload.number()?;
                let scan = MapperScan {
                    stamp_s: payload.number()?,
                    angle_min_rad: payload.number()?,
                    increment_rad: payload.number()?,
                    range_min_m: payload.number()?,
                    range_max_m: payload.number_or_infinite()?,
                    ranges_m: payload.ranges()?,
                };
                self.keyframes.push(SavedKeyframe { travelled_m, scan });
            }
            2 => {
                let [number, from, to] = [payload.index()?, payload.index()?, payload.index()?];
                let is_closure = payload.byte()? != 0;
                let motion = payload.pose()?;
                let mut covariance = Matrix3::zeros();
                for entry in covariance.iter_mut() {
                    *entry = payload.number()?;
                }
                let edge = PoseEdge { from, to, motion, covariance, is_closure };
                if number == self.edges.len() {
                    self.edges.push(edge);
                } else {
                    *self.edges.get_mut(number)? = edge;
                }
            }
            3 => {
                let first = payload.index()?;
                (first <= self.poses.len()).then_some(())?;
                self.poses.truncate(first);
                while !payload.is_empty() {
                    self.poses.push(payload.pose()?);
                }
            }
            4 => {
                let (stamp_s, keyframe) = (payload.number()?, payload.index()?);
                self.track.push((stamp_s, keyframe, payload.pose()?));
            }
            5 => {
                let stamp_s = payload.number()?;
                let (odometry, robot) = (payload.far_pose()?, payload.pose()?);
                let travelled_m = payload.number()?;
                self.here = Some(SavedPlace { stamp_s, odometry, robot, travelled_m });
            }
            _ => return None,
        }
        payload.is_empty().then_some(())
    }

    /// Returns whether every index leads somewhere.
    fn is_whole(&self) -> bool {
        let count = self.poses.len();
        let is_edge = |edge: &PoseEdge| edge.from < edge.to && edge.to < count;
        count == self.keyframes.len()
            && self.edges.iter().all(is_edge)
            && self.track.iter().all(|(_, keyframe, _)| *keyframe < count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(range_m: f32) -> MapperScan {
        let (angle_min_rad, increment_rad, range_max_m) = (-1.0, 0.1, 20.0);
        let ranges_m = vec![range_m; 21];
        MapperScan { angle_min_rad, increment_rad, range_max_m, ranges_m, ..MapperScan::default() }
    }

    fn header() -> StateHeader {
        let fit = StateFit::of(&Config::default());
        StateHeader { run: "00000000000000a1".into(), epoch: "3f2a".into(), fit }
    }

    /// A header and three batches; where each of them ends.
    fn written() -> (Vec<u8>, Vec<usize>) {
        let mut bytes = encode_header(&header());
        let mut ends = vec![bytes.len()];
        for number in 0..3usize {
            let along = |number: usize| Pose::new(number as f64, 0.5, 0.1);
            encode_record(
                &mut bytes,
                &StateRecord::Keyframe(number as f64, &scan(number as f32 + 1.0)),
            );
            if let Some(from) = number.checked_sub(1) {
                let (motion, covariance) = (along(1), Matrix3::identity());
                let edge = PoseEdge { from, to: number, motion, covariance, is_closure: false };
                encode_record(&mut bytes, &StateRecord::Edge(from, &edge));
            }
            encode_record(&mut bytes, &StateRecord::Poses(number, &[along(number)]));
            encode_record(&mut bytes, &StateRecord::Track(number as f64, number, Pose::default()));
            let (stamp_s, travelled_m) = (number as f64, number as f64);
            let (odometry, robot) = (along(7), along(number));
            encode_record(
                &mut bytes,
                &StateRecord::Here(SavedPlace { stamp_s, odometry, robot, travelled_m }),
            );
            ends.push(bytes.len());
        }
        (bytes, ends)
    }

    #[test]
    fn what_was_written_is_read() {
        let (bytes, _) = written();
        let state = decode_state(&bytes).expect("a state");
        assert_eq!((&state.header, state.len), (&header(), bytes.len()));
        let counts = [state.keyframes.len(), state.poses.len(), state.edges.len() + 1];
        assert_eq!((counts, state.track.len()), ([3; 3], 3));
        assert_eq!(state.poses[2], Pose::new(2.0, 0.5, 0.1));
        assert_eq!(state.here.map(|here| here.stamp_s), Some(2.0));
    }

    #[test]
    fn a_file_that_ends_anywhere_is_the_state_of_its_last_whole_batch() {
        let (bytes, ends) = written();
        for len in ends[0]..bytes.len() {
            let whole = ends.iter().filter(|end| **end <= len).count() - 1;
            let state = decode_state(&bytes[..len]).expect("a state");
            assert_eq!((state.keyframes.len(), state.len), (whole, ends[whole]), "{len} bytes");
            // A file system may have made room for what the disk never got.
            let mut longer = bytes[..len].to_vec();
            longer.resize(bytes.len(), 0);
            if let Ok(state) = decode_state(&longer) {
                assert_eq!(state.len, ends[whole], "{len} bytes, then zeros");
            }
        }
        for len in 0..ends[0] {
            assert!(decode_state(&bytes[..len]).is_err(), "{len} bytes are no header");
        }
    }

    #[test]
    fn no_damage_of_a_byte_is_taken_for_another_map() {
        let (bytes, ends) = written();
        let whole = decode_state(&bytes).expect("a state");
        for at in 0..bytes.len() {
            for flipped in [1, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[at] ^= flipped;
                // A length that leads beyond the end of the file looks like a batch that was
                // being written: the state is the one before it.
                if let Ok(state) = decode_state(&damaged) {
                    let before = ends.iter().rposition(|end| *end <= at).expect("a batch");
                    assert_eq!(state.len, ends[before], "byte {at}");
                    assert_eq!(state.keyframes[..], whole.keyframes[..before], "byte {at}");
                }
            }
        }
    }

    #[test]
    fn records_that_contradict_each_other_are_refused() {
        let place = SavedPlace {
            stamp_s: 0.0,
            odometry: Pose::default(),
            robot: Pose::default(),
            travelled_m: 0.0,
        };
        let far = Pose::new(1e9, 0.0, 0.0);
        let (motion, covariance) = (Pose::default(), Matrix3::identity());
        let edge = PoseEdge { from: 3, to: 4, motion, covariance, is_closure: false };
        for record in [
            StateRecord::Track(0.0, 0, Pose::default()),
            StateRecord::Poses(1, &[]),
            StateRecord::Poses(0, &[far]),
            StateRecord::Poses(0, &[Pose::default()]),
            StateRecord::Edge(0, &edge),
            StateRecord::Edge(7, &edge),
            StateRecord::Keyframe(f64::NAN, &scan(1.0)),
        ] {
            let mut bytes = encode_header(&header());
            encode_record(&mut bytes, &record);
            encode_record(&mut bytes, &StateRecord::Here(place));
            let refused = decode_state(&bytes);
            assert!(matches!(refused, Err(StateError::Contradiction { .. })), "{record:?}");
        }
    }
}
