//! The map writer as a component: maps and poses in, files out.

use std::path::PathBuf;

use armor_convert::{read_odometry_pose, read_percent, read_pose, read_robot_pose};
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
    fn record(&self) -> MapRecord {
        MapRecord::new(self.directory.clone(), self.interval_s, self.patience_s)
    }
}

/// Writes what the robot has mapped: a picture, a map for `map_server`, the trajectory.
pub struct MapWriter {
    armor: Armor,
    parameters: MapWriterParameters,
    record: MapRecord,
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

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<OccupancyGrid>("map")?;
        armor.subscribe::<Optional<PoseWithCovarianceStamped>>("pose")?;
        armor.subscribe::<Optional<Path>>("trajectory")?;
        armor.subscribe::<Optional<Count>>("end")?;
        armor.subscribe::<Optional<Odometry>>("truth")?;
        let parameters = MapWriterParameters::request(&armor)?;
        let record = parameters.record();
        Ok(Self { armor, parameters, record })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        // All of them arrive before any data.
        self.record = self.parameters.record();
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let now_s = self.armor.timestamp();
        match header.id() {
            "map" => self.record.map_seen(now_s, read_snapshot(data.decode()?)?),
            "pose" => {
                let pose: PoseWithCovarianceStamped = data.decode()?;
                self.record.pose_seen(now_s, pose.stamp, read_robot_pose(&pose));
            }
            "trajectory" => {
                let path: Path = data.decode()?;
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

fn read_snapshot(map: OccupancyGrid) -> Result<MapSnapshot, Fault> {
    Ok(MapSnapshot { stamp_s: map.stamp, percent: read_percent(map)? })
}
