//! What has been received, when it is written, and whether it is complete. Time is passed
//! in: there is no clock.

use std::path::{Path, PathBuf};

use armor_grid::{Grid, Point2, Pose2};

use crate::files::{WriteError, append_to_file, make_folder, replace_file};
use crate::map_server;
use crate::picture::draw_picture;
use crate::trajectory::{HEADER, WrittenTrajectory};

/// After the last pose, a map that lags behind is waited for this long, in seconds.
const SETTLE_S: f64 = 2.0;
/// Writing may take at most one part in this many of the time.
const SHARE: f64 = 10.0;

/// A map as it was received.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSnapshot {
    /// Up to when it knows the world, in seconds.
    pub stamp_s: f64,
    /// Occupancy in percent; negative where unknown.
    pub percent: Grid<i8>,
}

/// How far a recording has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RecordProgress {
    /// More may come.
    Open,
    /// As many poses as announced, and the map drawn from them, are on the disk.
    Complete,
    /// What was announced has not come, and nothing else does: poses, or the map of the last.
    Missing {
        /// Poses announced.
        announced: u64,
        /// Poses received; where corrections come, in the last of them.
        received: u64,
    },
}

/// Everything that goes into one output folder.
#[derive(Debug)]
pub struct MapRecord {
    folder: PathBuf,
    interval_s: f64,
    patience_s: f64,
    begun: bool,
    /// Whether corrections come, so that the last of them is worth waiting for.
    is_corrected: bool,
    map: Option<MapSnapshot>,
    map_written: bool,
    trajectory: WrittenTrajectory,
    truth: WrittenTrajectory,
    /// Number of poses there will be, once that is known.
    announced: Option<u64>,
    /// When a pose, a map or the announcement came last.
    heard_s: f64,
    due_s: f64,
}

impl MapRecord {
    /// Writes into `folder` every `interval_s`; waits `patience_s` for what was announced.
    pub fn new(folder: PathBuf, interval_s: f64, patience_s: f64) -> Self {
        Self {
            folder,
            interval_s,
            patience_s,
            begun: false,
            is_corrected: false,
            map: None,
            map_written: true,
            trajectory: WrittenTrajectory::default(),
            truth: WrittenTrajectory::default(),
            announced: None,
            heard_s: f64::NEG_INFINITY,
            due_s: f64::NEG_INFINITY,
        }
    }

    /// Makes the folder and starts `trajectory.csv`; a second call continues with the existing
    /// files.
    ///
    /// # Errors
    /// If the folder or the file cannot be written.
    pub fn begin(&mut self, now_s: f64) -> Result<(), WriteError> {
        if !self.begun {
            make_folder(&self.folder)?;
            replace_file(&self.file_path("trajectory.csv"), HEADER.as_bytes())?;
            self.truth.start_over();
            self.begun = true;
            self.due_s = now_s + self.interval_s;
        }
        Ok(())
    }

    /// Sets whether corrections of all poses arrive: the recording is then complete with the last
    /// correction and the map of that time, and not before.
    pub fn expect_corrections(&mut self, come: bool) {
        self.is_corrected = come;
    }

    /// Takes the newest map.
    pub fn map_seen(&mut self, now_s: f64, map: MapSnapshot) {
        self.map = Some(map);
        self.map_written = false;
        self.heard_s = now_s;
    }

    /// Takes one more pose of the trajectory.
    pub fn pose_seen(&mut self, now_s: f64, stamp_s: f64, pose: Pose2) {
        self.trajectory.push(stamp_s, pose);
        self.heard_s = now_s;
    }

    /// Takes the corrected poses up to a stamp: `trajectory.csv` is rewritten.
    pub fn correction_seen(
        &mut self,
        now_s: f64,
        stamp_s: f64,
        poses: impl Iterator<Item = (f64, Pose2)>,
    ) {
        self.trajectory.correct_poses(stamp_s, poses);
        self.heard_s = now_s;
    }

    /// Takes a pose where the robot really was, for comparison: a line of `truth.csv`.
    pub fn truth_seen(&mut self, stamp_s: f64, pose: Pose2) {
        self.truth.push(stamp_s, pose);
    }

    /// Takes the number of poses that there will be in all.
    pub fn end_seen(&mut self, now_s: f64, count: u64) {
        self.announced = Some(count);
        self.heard_s = now_s;
    }

    /// Writes if it is due, and returns how far the recording has come.
    ///
    /// # Errors
    /// If a file cannot be written; what is in memory is kept for the next time.
    pub fn step(&mut self, now_s: f64) -> Result<RecordProgress, WriteError> {
        let progress = self.progress(now_s);
        if progress != RecordProgress::Open || now_s >= self.due_s {
            self.write()?;
            self.due_s = now_s + self.interval_s;
        }
        Ok(progress)
    }

    /// Postpones the next write after one that took `duration_s`, so that writing takes a bounded
    /// share of the time on slow disks and with large maps.
    pub fn step_took(&mut self, duration_s: f64) {
        self.due_s += (duration_s * SHARE - self.interval_s).max(0.0);
    }

    /// Writes all that is new.
    ///
    /// # Errors
    /// If a file cannot be written; what is in memory is kept for the next time.
    pub fn write(&mut self) -> Result<(), WriteError> {
        let new_poses = !self.trajectory.unwritten_lines().is_empty();
        write_lines(&self.folder.join("trajectory.csv"), &mut self.trajectory)?;
        write_lines(&self.folder.join("truth.csv"), &mut self.truth)?;
        let Some(map) = &self.map else { return Ok(()) };
        if !self.map_written {
            replace_file(&self.file_path("map.pgm"), &map_server::encode_pgm(&map.percent))?;
            replace_file(
                &self.file_path("map.yaml"),
                map_server::write_yaml(&map.percent).as_bytes(),
            )?;
        }
        if new_poses || !self.map_written {
            self.write_picture(&self.file_path("map.png"), &map.percent)?;
        }
        self.map_written = true;
        Ok(())
    }

    fn write_picture(&self, path: &Path, map: &Grid<i8>) -> Result<(), WriteError> {
        let finite = |point: &Point2| point.x_m.is_finite() && point.y_m.is_finite();
        let trajectory = self.trajectory.line().filter(finite);
        let truth = self.truth.line().filter(finite);
        let png = draw_picture(map, trajectory, truth).encode_png().map_err(|error| {
            WriteError { path: path.to_owned(), source: std::io::Error::other(error) }
        })?;
        replace_file(path, &png)
    }

    fn progress(&self, now_s: f64) -> RecordProgress {
        let Some(announced) = self.announced else { return RecordProgress::Open };
        let quiet_s = now_s - self.heard_s;
        let mapped_s = self.map.as_ref().map(|map| map.stamp_s);
        let (received, is_complete) = if self.is_corrected {
            let corrected_s = self.trajectory.corrected_s();
            let is_current = mapped_s.is_some() && mapped_s == corrected_s;
            (self.trajectory.count_corrected(), is_current)
        } else {
            let is_current = mapped_s >= self.trajectory.newest_s();
            let is_settled = mapped_s.is_some() && quiet_s >= SETTLE_S;
            (self.trajectory.count(), is_current || is_settled)
        };
        if received >= announced && is_complete {
            RecordProgress::Complete
        } else if quiet_s >= self.patience_s {
            RecordProgress::Missing { announced, received }
        } else {
            RecordProgress::Open
        }
    }

    fn file_path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}

/// Writes the lines that are new: after those in the file, or in their place.
fn write_lines(file: &Path, trajectory: &mut WrittenTrajectory) -> Result<(), WriteError> {
    let lines = trajectory.unwritten_lines();
    if lines.is_empty() {
        return Ok(());
    }
    if trajectory.starts_over() {
        replace_file(file, [HEADER, lines].concat().as_bytes())?;
    } else {
        append_to_file(file, lines.as_bytes())?;
    }
    trajectory.mark_written();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::tests::Scratch;
    use armor_grid::Geometry;
    use std::fs;

    fn map(stamp_s: f64) -> MapSnapshot {
        let geometry =
            Geometry { origin: Point2::default(), resolution_m: 0.1, width: 30, height: 20 };
        MapSnapshot { stamp_s, percent: Grid::filled(geometry, 0) }
    }

    fn begin(name: &str) -> (Scratch, MapRecord) {
        let scratch = Scratch::new(name);
        let mut record = MapRecord::new(scratch.0.join("deep").join("out"), 3.0, 60.0);
        record.begin(0.0).unwrap();
        (scratch, record)
    }

    fn names(record: &MapRecord) -> Vec<String> {
        let entries = fs::read_dir(&record.folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn lines(record: &MapRecord) -> usize {
        fs::read_to_string(record.file_path("trajectory.csv")).unwrap().lines().count()
    }

    #[test]
    fn files_appear_every_few_seconds() {
        let (_scratch, mut record) = begin("interval");
        record.pose_seen(0.5, 0.5, Pose2::IDENTITY);
        record.map_seen(0.6, map(0.5));
        record.step(1.0).unwrap();
        assert_eq!(names(&record), ["trajectory.csv"]);
        record.step(3.0).unwrap();
        assert_eq!(names(&record), ["map.pgm", "map.png", "map.yaml", "trajectory.csv"]);
        assert_eq!(lines(&record), 2);
    }

    #[test]
    fn poses_are_appended_in_order_and_once() {
        let (_scratch, mut record) = begin("append");
        for scan in 0..100_u32 {
            record.pose_seen(f64::from(scan), f64::from(scan), Pose2::IDENTITY);
            record.step(f64::from(scan)).unwrap();
        }
        record.write().unwrap();
        let text = fs::read_to_string(record.file_path("trajectory.csv")).unwrap();
        let scans: Vec<_> =
            text.lines().skip(1).map(|line| line.split(',').next().unwrap()).collect();
        let expected: Vec<_> = (0..100).map(|scan| scan.to_string()).collect();
        assert_eq!(scans, expected);
    }

    #[test]
    fn a_second_start_continues_the_same_files() {
        let (_scratch, mut record) = begin("again");
        record.pose_seen(1.0, 1.0, Pose2::IDENTITY);
        record.write().unwrap();
        record.begin(5.0).unwrap();
        record.pose_seen(6.0, 6.0, Pose2::IDENTITY);
        record.write().unwrap();
        assert_eq!(lines(&record), 3);
    }

    /// After the end, at `now_s`, with a map of a stamp and some of two announced poses.
    fn check(poses: u32, map_stamp_s: Option<f64>, now_s: f64, expected: RecordProgress) {
        let (_scratch, mut record) = begin(&format!("end-{poses}-{map_stamp_s:?}-{now_s}"));
        for scan in 0..poses {
            record.pose_seen(10.0, f64::from(scan), Pose2::IDENTITY);
        }
        if let Some(stamp_s) = map_stamp_s {
            record.map_seen(10.0, map(stamp_s));
        }
        assert_eq!(record.step(10.0).unwrap(), RecordProgress::Open);
        record.end_seen(10.0, 2);
        assert_eq!(record.step(now_s).unwrap(), expected);
        if expected == RecordProgress::Complete {
            assert_eq!(lines(&record), 3);
            assert_eq!(names(&record).len(), 4);
        }
    }

    #[test]
    fn it_is_complete_with_all_poses_and_the_map_of_the_last() {
        check(2, Some(1.0), 10.1, RecordProgress::Complete);
        check(2, Some(0.0), 11.9, RecordProgress::Open);
        check(2, Some(0.0), 12.1, RecordProgress::Complete);
        check(1, Some(1.0), 12.1, RecordProgress::Open);
        check(2, None, 12.1, RecordProgress::Open);
    }

    #[test]
    fn what_never_comes_is_named() {
        check(1, Some(1.0), 70.1, RecordProgress::Missing { announced: 2, received: 1 });
        check(2, None, 70.1, RecordProgress::Missing { announced: 2, received: 2 });
    }

    #[test]
    fn the_true_way_has_a_file_of_its_own() {
        let (_scratch, mut record) = begin("truth");
        record.pose_seen(1.0, 1.0, Pose2::IDENTITY);
        record.write().unwrap();
        assert_eq!(names(&record), ["trajectory.csv"], "none without a true pose");
        for stamp_s in [1.0, 2.0] {
            record.truth_seen(stamp_s, Pose2::new(3.0, 0.0, 0.0));
            record.write().unwrap();
        }
        let text = fs::read_to_string(record.file_path("truth.csv")).unwrap();
        let line = |i: u32| format!("{i},{}.000000,3.000000,0.000000,0.000000\n", i + 1);
        assert_eq!(text, [HEADER, &line(0), &line(1)].concat());
    }

    #[test]
    fn slow_writing_is_done_less_often() {
        let (_scratch, mut record) = begin("slow");
        record.step(3.0).unwrap();
        record.step_took(1.0);
        record.pose_seen(4.0, 4.0, Pose2::IDENTITY);
        record.step(12.0).unwrap();
        assert_eq!(lines(&record), 1);
        record.step(13.1).unwrap();
        assert_eq!(lines(&record), 2);
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_named() {
        let scratch = Scratch::new("blocked");
        let blocked = scratch.0.join("file");
        fs::write(&blocked, "not a folder").unwrap();
        let mut record = MapRecord::new(blocked.join("out"), 3.0, 60.0);
        let error = record.begin(0.0).unwrap_err().to_string();
        assert!(error.contains("file/out"), "{error}");
    }

    #[test]
    fn the_last_correction_and_its_map_are_waited_for() {
        let (_scratch, mut record) = begin("correction");
        record.expect_corrections(true);
        record.pose_seen(1.0, 1.0, Pose2::IDENTITY);
        record.write().unwrap();
        record.correction_seen(1.5, 1.0, [(1.0, Pose2::new(7.0, 0.0, 0.0))].into_iter());
        record.pose_seen(2.0, 2.0, Pose2::IDENTITY);
        record.map_seen(2.0, map(2.0));
        record.end_seen(2.0, 2);
        assert_eq!(
            record.step(30.0).unwrap(),
            RecordProgress::Open,
            "the last pose is not corrected"
        );
        let both = [(1.0, Pose2::new(7.5, 0.0, 0.0)), (2.0, Pose2::IDENTITY)];
        record.map_seen(30.1, map(1.0));
        record.correction_seen(30.2, 2.0, both.into_iter());
        assert_eq!(record.step(60.0).unwrap(), RecordProgress::Open, "the map is older");
        record.map_seen(61.0, map(2.0));
        assert_eq!(record.step(61.1).unwrap(), RecordProgress::Complete);
        let text = fs::read_to_string(record.file_path("trajectory.csv")).unwrap();
        assert!(lines(&record) == 3 && text.contains(",7.5"), "{text}");
    }

    #[test]
    fn without_any_correction_nothing_is_complete_where_they_come() {
        let (_scratch, mut record) = begin("uncorrected");
        record.expect_corrections(true);
        record.pose_seen(1.0, 1.0, Pose2::IDENTITY);
        record.map_seen(1.0, map(1.0));
        record.end_seen(1.0, 1);
        assert_eq!(record.step(50.0).unwrap(), RecordProgress::Open);
        assert_eq!(
            record.step(61.1).unwrap(),
            RecordProgress::Missing { announced: 1, received: 0 }
        );
    }
}
