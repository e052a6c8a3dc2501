//! The map writer as a component: maps and poses in, files out.

use std::path::PathBuf;

use armor_convert::{
    FrameNews, FrameWatch, read_epoch, read_odometry_pose, read_percent, read_pose, read_robot_pose,
};
use armor_sdk::prelude::*;

use crate::record::{MapRecord, MapSnapshot, RecordProgress};

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct MapWriterParameters {
    /// folder of the files, within the run's folder; empty: that folder itself
    #[parameter(default = "", written)]
    directory: PathBuf,
    /// period at which files are written
    #[parameter(unit = "s", default = "3s", range = 0.1..=3600.0)]
    interval_s: f64,
    /// after the end, what has not come within this is given up
    #[parameter(unit = "s", default = "60s", range = 1.0..=1e6)]
    patience_s: f64,
}

impl MapWriterParameters {
    /// What is recorded in a frame: a later epoch has a folder of its own.
    fn record(&self, frame: &str) -> MapRecord {
        let folder = match read_epoch(frame) {
            "" => self.directory.clone(),
            epoch => self.directory.join(format!("frame-{epoch}")),
        };
        MapRecord::new(folder, self.interval_s, self.patience_s)
    }
}

/// Writes what the robot has mapped: a picture, a map for `map_server`, the trajectory.
pub struct MapWriter {
    armor: Armor,
    parameters: MapWriterParameters,
    record: MapRecord,
    frames: FrameWatch,
}

/// What it reports to the mission.
#[derive(Debug, Events)]
enum MapWriterEvent {
    /// the map frame has another origin: what follows is written to a folder of its own
    FrameChanged,
}

impl Component for MapWriter {
    const KIND: &'static str = "map-writer";
    const SUMMARY: &'static str =
        "Writes the map as a picture and for map_server, and the trajectory as CSV.";
    const PARAMETERS: &'static [Parameter] = MapWriterParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("map", "the map, drawn and saved"),
        ("pose", "poses of the trajectory; one line of trajectory.csv each"),
        ("trajectory", "all poses as corrected so far; replaces those in trajectory.csv"),
        ("end", "number of poses to come; done when they are all written"),
        ("truth", "where the robot really was: drawn for comparison, and in truth.csv"),
    ];

    const EVENTS: &'static [DeclaredEvent] = MapWriterEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<OccupancyGrid>("map")?;
        armor.subscribe::<Optional<PoseWithCovarianceStamped>>("pose")?;
        armor.subscribe::<Optional<Path>>("trajectory")?;
        armor.subscribe::<Optional<Count>>("end")?;
        armor.subscribe::<Optional<Odometry>>("truth")?;
        let parameters = MapWriterParameters::request(&armor)?;
        let (record, frames) = (parameters.record(""), FrameWatch::default());
        Ok(Self { armor, parameters, record, frames })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        // All of them arrive before any data.
        self.record = self.parameters.record(self.frames.frame().unwrap_or_default());
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let now_s = self.armor.timestamp();
        match header.id() {
            "map" => {
                let map: OccupancyGrid = data.decode()?;
                self.frame_seen(now_s, &map.frame)?;
                self.record.map_seen(now_s, read_snapshot(map)?);
            }
            "pose" => {
                let pose: PoseWithCovarianceStamped = data.decode()?;
                self.frame_seen(now_s, &pose.frame)?;
                self.record.pose_seen(now_s, pose.stamp, read_robot_pose(&pose));
            }
            "trajectory" => {
                let path: Path = data.decode()?;
                if !self.frames.is_usable(&path.frame) {
                    return Ok(());
                }
                let poses = path.poses.iter().map(|pose| (pose.stamp, read_pose(&pose.pose)));
                self.record.correction_seen(now_s, path.stamp, poses);
            }
            "end" => self.record.end_seen(now_s, data.decode::<Count>()?.count),
            "truth" => {
                let truth: Odometry = data.decode()?;
                self.record.truth_seen(truth.stamp, read_odometry_pose(&truth));
            }
            _ => {}
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let start_s = self.armor.timestamp();
        self.record.begin(start_s)?;
        if call == Call::Stopping {
            self.record.write()?;
            return Ok(Outcome::CarryOn);
        }
        self.record.expect_corrections(self.armor.subscribed_data("trajectory").is_some());
        if self.frames.take_change() {
            return Ok(MapWriterEvent::FrameChanged.into());
        }
        let progress = self.record.step(start_s)?;
        self.record.step_took(self.armor.timestamp() - start_s);
        Ok(match progress {
            RecordProgress::Open => Outcome::CarryOn,
            RecordProgress::Complete => Outcome::Done,
            RecordProgress::Missing { announced, received } if received >= announced => {
                Outcome::Failed("the map of the last pose has not come".into())
            }
            RecordProgress::Missing { announced, received } => {
                Outcome::Failed(format!("{received} of {announced} poses have come, and no more"))
            }
        })
    }
}

impl MapWriter {
    /// Takes the frame of a pose or a map: what is of another epoch than before gets a folder of its
    /// own, and what was recorded before stays.
    fn frame_seen(&mut self, now_s: f64, frame: &str) -> Result<(), Fault> {
        let news = self.frames.frame_seen(frame);
        if news == FrameNews::Changed {
            self.record.write()?;
        }
        if news == FrameNews::Changed || (news == FrameNews::First && !read_epoch(frame).is_empty())
        {
            self.record = self.parameters.record(frame);
            self.record.begin(now_s)?;
        }
        Ok(())
    }
}

fn read_snapshot(map: OccupancyGrid) -> Result<MapSnapshot, Fault> {
    Ok(MapSnapshot { stamp_s: map.stamp, percent: read_percent(map)? })
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::time::Duration;

    use armor_sdk::testing::{ReportKind, TestError, TestedComponent};

    use super::*;
    use crate::files::tests::Scratch;

    #[test]
    fn each_epoch_has_a_folder_of_its_own() -> Result<(), TestError> {
        let scratch = Scratch::new("epochs");
        let folder = scratch.0.display().to_string();
        let parameters = [("directory", folder.as_str()), ("interval", "0.1s")];
        let mut writer = TestedComponent::build::<MapWriter>(&parameters)?;
        writer.start()?;
        let mut stamp = 0.0;
        for frame in ["map", "map", "map#3f2a"] {
            stamp += 1.0;
            let frame = frame.into();
            writer
                .send("pose", &PoseWithCovarianceStamped { stamp, frame, ..Default::default() })?;
            writer.tick_after(Duration::from_secs(1))?;
        }
        writer.stop()?;
        let changed = ReportKind::Event { name: "frame_changed".into(), value: 1.0 };
        assert_eq!(writer.reports(), [changed]);
        let count_lines = |path: &str| {
            fs::read_to_string(scratch.0.join(path)).map_or(0, |text| text.lines().count() - 1)
        };
        assert_eq!(count_lines("trajectory.csv"), 2);
        assert_eq!(count_lines("frame-3f2a/trajectory.csv"), 1);
        Ok(())
    }
}
