//! Where a robot is at each time: straight drives at constant speed, and stops.

use armor_geo::{MapPoint, MapSegment};

use crate::timing::course::CourseTrack;

/// A stretch of a robot's motion, on a straight line at constant speed; at a stop both ends are the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionPiece {
    /// When it begins, in seconds from the begin of the mission.
    pub start_s: f64,
    /// When it ends.
    pub end_s: f64,
    /// Where it begins.
    pub from: MapPoint,
    /// Where it ends.
    pub to: MapPoint,
    /// How far along the route it begins, in metres.
    pub from_m: f64,
    /// How far along the route it ends.
    pub to_m: f64,
    /// The number of the step among those of the robot; none before the first and after the last.
    pub step: Option<usize>,
}

impl MotionPiece {
    /// The share of it that has passed at a time, from 0 to 1.
    fn share_at(&self, time_s: f64) -> f64 {
        let length_s = self.end_s - self.start_s;
        if length_s > 0.0 { ((time_s - self.start_s) / length_s).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Where the robot is at a time.
    pub fn position_at(&self, time_s: f64) -> MapPoint {
        MapSegment::new(self.from, self.to).point_at(self.share_at(time_s))
    }

    /// How far along the route the robot is at a time, in metres.
    pub fn distance_at(&self, time_s: f64) -> f64 {
        self.from_m + (self.to_m - self.from_m) * self.share_at(time_s)
    }

    /// Metres per second along the axes.
    pub(super) fn velocity_mps(&self) -> [f64; 2] {
        let length_s = self.end_s - self.start_s;
        if length_s > 0.0 {
            let (from, to) = (self.from, self.to);
            [(to.x_m() - from.x_m()) / length_s, (to.y_m() - from.y_m()) / length_s]
        } else {
            [0.0, 0.0]
        }
    }
}

/// The motion of a robot over the whole mission, as far as its times are known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotMotion {
    /// Its pieces from the begin of the mission, each from the end of the one before it.
    pub pieces: Vec<MotionPiece>,
    /// The number of the first step whose end is not known; none if the whole route is.
    pub open_step: Option<usize>,
}

impl RobotMotion {
    /// Of a route whose moments come at these times; `steps` has the number of the step of each stretch.
    pub(super) fn of_track(track: &CourseTrack, times: &[Option<i128>], steps: &[usize]) -> Self {
        let mut motion = Self::default();
        let begin_s = times[track.begins].map(as_seconds);
        let (Some(begin_s), Some(mut from)) = (begin_s, track.start) else {
            motion.open_step = Some(0);
            return motion;
        };
        // Even without a duration: where the robot is at the begin is known.
        motion.pieces.push(MotionPiece {
            start_s: 0.0,
            end_s: begin_s,
            from,
            to: from,
            from_m: 0.0,
            to_m: 0.0,
            step: None,
        });
        let (mut start_s, mut from_m) = (begin_s, 0.0);
        for (stretch, step) in track.stretches.iter().zip(steps) {
            let end_s = times[stretch.ends].map(as_seconds);
            let (Some(end_s), Some(to)) = (end_s, stretch.to) else {
                motion.open_step = Some(*step);
                return motion;
            };
            let to_m = from_m + from.distance_m(to);
            let step = Some(*step);
            motion.push(MotionPiece { start_s, end_s, from, to, from_m, to_m, step });
            (start_s, from, from_m) = (end_s, to, to_m);
        }
        motion
    }

    /// A piece without duration and length is left out.
    fn push(&mut self, piece: MotionPiece) {
        if piece.end_s > piece.start_s || piece.from != piece.to {
            self.pieces.push(piece);
        }
    }

    /// When its last known step ends; none if not even its first position is known.
    pub fn end_s(&self) -> Option<f64> {
        self.pieces.last().map(|piece| piece.end_s)
    }

    /// A robot whose whole route is known stays at its end until a time.
    pub(super) fn stay_until(&mut self, time_s: f64) {
        if let Some(last) = self.pieces.last().copied()
            && self.open_step.is_none()
            && last.end_s < time_s
        {
            let (start_s, from, from_m) = (last.end_s, last.to, last.to_m);
            let (to, to_m) = (from, from_m);
            let piece = MotionPiece { start_s, end_s: time_s, from, to, from_m, to_m, step: None };
            self.pieces.push(piece);
        }
    }

    /// The piece at a time: at its end rather than at the beginning of the next one.
    pub fn piece_at(&self, time_s: f64) -> Option<&MotionPiece> {
        let number = self.pieces.partition_point(|piece| piece.end_s < time_s);
        let is_before = self.pieces.first().is_some_and(|first| time_s < first.start_s);
        self.pieces.get(number).filter(|_| !is_before)
    }

    /// Where the robot is at a time; none where this is not known.
    pub fn position_at(&self, time_s: f64) -> Option<MapPoint> {
        self.piece_at(time_s).map(|piece| piece.position_at(time_s))
    }

    /// How far along its route the robot is at a time, in metres.
    pub fn distance_at(&self, time_s: f64) -> Option<f64> {
        self.piece_at(time_s).map(|piece| piece.distance_at(time_s))
    }
}

pub(super) fn as_seconds(ns: i128) -> f64 {
    ns as f64 / 1e9
}
