//! Turns a log into what is due now: scans of one laser, each with its odometry at the same stamp,
//! in the log's own timing, times a factor, or as fast as they are taken. No clock, no sockets.

use crate::log::{CarmenLog, LogError, Tally};
use crate::record::{LogRecord, Mount, RecordedOdometry, RecordedPose, RecordedScan};
use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::io::BufRead;

/// Most scans that wait for the odometry after them; at 50 Hz that is a minute without odometry.
pub const MAX_WAITING_SCANS: usize = 3_000;

/// Where the odometry of a scan is taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OdometrySource {
    /// From the scan's own line.
    Scan,
    /// From the ODOM lines around it, interpolated at the scan's stamp.
    Apart,
}

/// Plays the scans of one laser out of a log.
pub struct Playback<R> {
    log: CarmenLog<R>,
    mount: Mount,
    source: OdometrySource,
    pace: PlaybackPace,
    earlier: Option<RecordedOdometry>,
    waiting: VecDeque<RecordedScan>,
    ready: VecDeque<RecordedScan>,
    played: u64,
    last_fault: Option<LogError>,
    damage: Option<LogError>,
}

impl<R: BufRead> Playback<R> {
    /// Plays `log` at `speed` times its own timing; 0 plays as fast as the scans are taken.
    pub fn new(log: CarmenLog<R>, mount: Mount, source: OdometrySource, speed: f64) -> Self {
        Self {
            log,
            mount,
            source,
            pace: PlaybackPace { speed, origin: None },
            earlier: None,
            waiting: VecDeque::new(),
            ready: VecDeque::new(),
            played: 0,
            last_fault: None,
            damage: None,
        }
    }

    /// Takes the next scan if it is due at `now_s` (any steady clock, seconds).
    ///
    /// `Ok(None)`: nothing is due yet, or the log [has ended](Self::has_ended).
    ///
    /// # Errors
    /// [`LogError::Io`] when the log cannot be read before its first scan; malformed lines are
    /// counted instead, and a log that breaks off ends there.
    pub fn next_due(&mut self, now_s: f64) -> Result<Option<RecordedScan>, LogError> {
        self.read_ahead()?;
        let due = self.ready.front().is_some_and(|scan| self.pace.is_due(scan.stamp_s, now_s));
        let scan = if due { self.ready.pop_front() } else { None };
        self.played += u64::from(scan.is_some());
        Ok(scan)
    }

    /// What time it is in the log, if it has its own timing and has begun: at least that of the
    /// scan taken last.
    pub fn time_s(&self, now_s: f64) -> Option<f64> {
        self.pace.time_s(now_s)
    }

    /// Returns whether every scan has been played; true only after [`Self::next_due`] found the
    /// end.
    pub fn has_ended(&self) -> bool {
        self.log.has_ended() && self.ready.is_empty() && self.waiting.is_empty()
    }

    /// Continues the log from here after a pause, instead of catching up with the time lost.
    pub fn resume(&mut self) {
        self.pace.origin = None;
    }

    /// Number of scans taken so far.
    pub fn played(&self) -> u64 {
        self.played
    }

    /// Counts of the lines read so far.
    pub fn tally(&self) -> Tally {
        self.log.tally()
    }

    /// Takes the newest malformed line met since the last call.
    pub fn take_fault(&mut self) -> Option<LogError> {
        self.last_fault.take()
    }

    /// Why the log broke off before its end, if it did.
    pub fn damage(&self) -> Option<&LogError> {
        self.damage.as_ref()
    }

    /// Reads until a scan is ready or the log is at its end.
    fn read_ahead(&mut self) -> Result<(), LogError> {
        while self.ready.is_empty() {
            match self.log.next() {
                None => return self.end_of_log(),
                Some(Ok(LogRecord::Scan(scan))) if scan.mount == self.mount => self.take_scan(scan),
                Some(Ok(LogRecord::Odometry(odometry))) => self.take_odometry(odometry),
                Some(Ok(_)) => {}
                Some(Err(error @ LogError::Io { .. })) if self.log.tally().scans == 0 => {
                    return Err(error);
                }
                Some(Err(error @ LogError::Io { .. })) => {
                    self.damage = Some(error);
                    return self.end_of_log();
                }
                Some(Err(malformed)) => self.last_fault = Some(malformed),
            }
        }
        Ok(())
    }

    fn take_scan(&mut self, scan: RecordedScan) {
        if self.source == OdometrySource::Scan {
            self.ready.push_back(scan);
            return;
        }
        self.waiting.push_back(scan);
        if self.waiting.len() > MAX_WAITING_SCANS {
            self.ready.extend(self.waiting.pop_front());
        }
    }

    fn take_odometry(&mut self, later: RecordedOdometry) {
        let earlier = self.earlier.replace(later).unwrap_or(later);
        while self.waiting.front().is_some_and(|scan| scan.stamp_s <= later.stamp_s) {
            let scan = self.waiting.pop_front();
            self.ready.extend(scan.map(|scan| RecordedScan {
                odometry: interpolate_pose(&earlier, &later, scan.stamp_s),
                ..scan
            }));
        }
    }

    /// The scans after the last odometry get that one; none at all leaves them their own.
    fn end_of_log(&mut self) -> Result<(), LogError> {
        let last = self.earlier.map(|odometry| odometry.pose);
        let rest = self.waiting.drain(..);
        self.ready.extend(
            rest.map(|scan| RecordedScan { odometry: last.unwrap_or(scan.odometry), ..scan }),
        );
        Ok(())
    }
}

/// Pose at `stamp_s` between two readings, turning by the smaller angle; constant beyond them.
pub fn interpolate_pose(
    earlier: &RecordedOdometry,
    later: &RecordedOdometry,
    stamp_s: f64,
) -> RecordedPose {
    let span_s = later.stamp_s - earlier.stamp_s;
    let part = if span_s > 0.0 { (stamp_s - earlier.stamp_s) / span_s } else { 1.0 };
    let part = part.clamp(0.0, 1.0);
    let (from, to) = (earlier.pose, later.pose);
    let turn_rad = (to.yaw_rad - from.yaw_rad + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
    RecordedPose {
        x_m: from.x_m + part * (to.x_m - from.x_m),
        y_m: from.y_m + part * (to.y_m - from.y_m),
        yaw_rad: from.yaw_rad + part * turn_rad,
    }
}

/// Relates log time to a steady clock.
struct PlaybackPace {
    speed: f64,
    /// Time of the log and clock time of the moment playing began.
    origin: Option<(f64, f64)>,
}

impl PlaybackPace {
    fn time_s(&self, now_s: f64) -> Option<f64> {
        let (log_s, clock_s) = self.origin?;
        (self.speed > 0.0).then_some(log_s + (now_s - clock_s) * self.speed)
    }

    fn is_due(&mut self, stamp_s: f64, now_s: f64) -> bool {
        if self.speed <= 0.0 {
            return true;
        }
        let (log_s, clock_s) = *self.origin.get_or_insert((stamp_s, now_s));
        (stamp_s - log_s) <= (now_s - clock_s) * self.speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(stamps: &[f64]) -> String {
        let line =
            |s: &f64| format!("FLASER 1 1 0 0 0 {s} 0 0 {s} h 0\nRLASER 1 1 0 0 0 0 0 0 0 h 0\n");
        stamps.iter().map(line).collect()
    }

    fn play(text: &str, source: OdometrySource, speed: f64) -> Playback<&[u8]> {
        Playback::new(CarmenLog::new(text.as_bytes()), Mount::Front, source, speed)
    }

    fn due(playback: &mut Playback<&[u8]>, now_s: f64) -> Vec<f64> {
        std::iter::from_fn(|| playback.next_due(now_s).unwrap().map(|s| s.stamp_s)).collect()
    }

    #[test]
    fn scans_come_in_the_logs_timing_times_the_speed() {
        let text = text(&[10.0, 11.0, 13.0]);
        let mut playback = play(&text, OdometrySource::Scan, 2.0);
        assert_eq!(due(&mut playback, 100.0), [10.0]);
        assert_eq!(due(&mut playback, 100.4), [] as [f64; 0]);
        assert_eq!(due(&mut playback, 100.5), [11.0]);
        assert_eq!(playback.time_s(101.0), Some(12.0), "between two scans too");
        playback.resume();
        assert_eq!(playback.time_s(400.0), None);
        assert_eq!(due(&mut playback, 500.0), [13.0]);
        assert!(playback.has_ended());
        assert_eq!((playback.played(), playback.tally().scans), (3, 6));
    }

    #[test]
    fn speed_zero_gives_everything_immediately() {
        let text = text(&[10.0, 9.0, 1e6]);
        assert_eq!(due(&mut play(&text, OdometrySource::Scan, 0.0), 0.0), [10.0, 9.0, 1e6]);
    }

    #[test]
    fn odometry_apart_is_interpolated_at_the_scan() {
        let text = "ODOM 0 0 3 0 0 0 10 h 0\nFLASER 1 1 9 9 9 9 9 9 11 h 0\nODOM 4 8 -3 0 0 0 12 h 0\n\
                    FLASER 1 1 9 9 9 9 9 9 13 h 0\n";
        let mut playback = play(text, OdometrySource::Apart, 0.0);
        let first = playback.next_due(0.0).unwrap().unwrap().odometry;
        assert_eq!((first.x_m, first.y_m), (2.0, 4.0));
        assert!((first.yaw_rad - TAU / 2.0).abs() < 1e-12, "the smaller angle: {first:?}");
        let held = playback.next_due(0.0).unwrap().unwrap().odometry;
        assert_eq!((held.x_m, held.yaw_rad), (4.0, -3.0));
        assert_eq!(playback.next_due(0.0).unwrap(), None);
        assert!(playback.has_ended());
    }

    #[test]
    fn a_log_that_breaks_off_is_played_up_to_there() {
        use flate2::{Compression, read::GzDecoder, write::GzEncoder};
        use std::io::{BufReader, Write};
        let stamps: Vec<f64> = (0..5000).map(f64::from).collect();
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(text(&stamps).as_bytes()).unwrap();
        let packed = encoder.finish().unwrap();
        let play = |bytes: &[u8]| {
            let log = CarmenLog::new(BufReader::new(GzDecoder::new(std::io::Cursor::new(
                bytes.to_vec(),
            ))));
            Playback::new(log, Mount::Front, OdometrySource::Scan, 0.0)
        };
        let mut playback = play(&packed[..packed.len() / 2]);
        let played = std::iter::from_fn(|| playback.next_due(0.0).unwrap()).count();
        assert!((1000..5000).contains(&played) && playback.has_ended(), "{played}");
        let damage = playback.damage().unwrap().to_string();
        assert!(damage.starts_with("line "), "{damage}");
        assert!(play(&packed[..12]).next_due(0.0).is_err(), "nothing of it can be played");
    }

    #[test]
    fn windows_line_ends_and_other_messages_change_nothing() {
        let unix = format!("PARAM a b\nODOM 0 0 0 0 0 0 1 h 1\nSYNC x\n{}", text(&[1.0, 2.0]));
        let windows = unix.replace('\n', "\r\n");
        for text in [unix, windows] {
            let mut playback = play(&text, OdometrySource::Scan, 0.0);
            assert_eq!(due(&mut playback, 0.0), [1.0, 2.0]);
            assert_eq!((playback.tally().malformed, playback.tally().unknown), (0, 1));
        }
    }

    #[test]
    fn a_malformed_line_is_remembered_and_costs_only_itself() {
        let text = "FLASER 1 1 0 0 0 0 0 0 1 h 0\nFLASER x\nFLASER 1 1 0 0 0 0 0 0 2 h 0\n";
        let mut playback = play(text, OdometrySource::Scan, 0.0);
        assert_eq!(due(&mut playback, 0.0), [1.0, 2.0]);
        assert_eq!(playback.tally().malformed, 1);
        assert_eq!(playback.take_fault().unwrap().to_string().split(':').next(), Some("line 2"));
    }
}
