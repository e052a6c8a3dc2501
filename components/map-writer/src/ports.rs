//! The map writer as a component: maps and poses in, files out.

use std::path::PathBuf;

use armor_grid::{Geometry, Grid, Point2, Pose2};
use armor_sdk::prelude::*;

use crate::record::{MapSnapshot, Progress, Record};

/// Where files go unless told otherwise: the run's own folder.
const OUT_VARIABLE: &str = "ARMOR_OUT";

/// Writes what the robot has mapped: a picture, a map for `map_server`, the trajectory.
pub struct MapWriter {
    armor: Armor,
    directory: PathBuf,
    interval_s: f64,
    patience_s: f64,
    record: Record,
}

impl Component for MapWriter {
    const KIND: &'static str = "map-writer";
    const SUMMARY: &'static str =
        "Writes the map as a picture and for map_server, and the trajectory as CSV.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::path("directory")
            .default("")
            .doc("where the files go; without it into the run's own folder (ARMOR_OUT)"),
        Parameter::number("interval", "s")
            .default("3s")
            .range(0.1, 3600.0)
            .doc("files are written this often"),
        Parameter::number("patience", "s")
            .default("60s")
            .range(1.0, 1e6)
            .doc("after the end, what has not come within this is given up"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("map", "the map, drawn and saved"),
        ("pose", "poses of the trajectory; one line of trajectory.csv each"),
        ("trajectory", "all poses as corrected by now; takes the place of those in trajectory.csv"),
        ("end", "how many poses there will be; done when they are all written"),
        ("truth", "where the robot really was: drawn for comparison, and in truth.csv"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<OccupancyGrid>("map")?;
        armor.subscribe::<Optional<PoseWithCovarianceStamped>>("pose")?;
        armor.subscribe::<Optional<Path>>("trajectory")?;
        armor.subscribe::<Optional<Count>>("end")?;
        armor.subscribe::<Optional<Odometry>>("truth")?;
        for name in ["directory", "interval", "patience"] {
            armor.get_parameter(name)?;
        }
        armor.synchronize()?;
        let directory = std::env::var_os(OUT_VARIABLE).map_or_else(|| "out".into(), PathBuf::from);
        let record = Record::new(directory.clone(), 3.0, 60.0);
        Ok(Self { armor, directory, interval_s: 3.0, patience_s: 60.0, record })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "directory" if !value.text()?.is_empty() => self.directory = value.path()?,
            "interval" => self.interval_s = value.number()?,
            "patience" => self.patience_s = value.number()?,
            _ => {}
        }
        // All of them arrive before any data.
        self.record = Record::new(self.directory.clone(), self.interval_s, self.patience_s);
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let now_s = self.armor.timestamp();
        match header.id() {
            "map" => self.record.map_seen(now_s, snapshot(data.decode()?)?),
            "pose" => {
                let pose: PoseWithCovarianceStamped = data.decode()?;
                self.record.pose_seen(now_s, pose.stamp, planar(&pose.pose.pose));
            }
            "trajectory" => {
                let path: Path = data.decode()?;
                let poses = path.poses.iter().map(|pose| (pose.stamp, planar(&pose.pose)));
                self.record.correction_seen(now_s, path.stamp, poses);
            }
            "end" => self.record.end_seen(now_s, data.decode::<Count>()?.count),
            "truth" => {
                let truth: Odometry = data.decode()?;
                self.record.truth_seen(truth.stamp, planar(&truth.pose.pose));
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
            Progress::Open => Outcome::CarryOn,
            Progress::Complete => Outcome::Done,
            Progress::Missing { announced, received } if received >= announced => {
                Outcome::Failed("the map of the last pose has not come".into())
            }
            Progress::Missing { announced, received } => {
                Outcome::Failed(format!("{received} of {announced} poses have come, and no more"))
            }
        })
    }
}

fn planar(pose: &Pose) -> Pose2 {
    let Pose2D { x, y, theta } = pose.to_planar();
    Pose2::new(x, y, theta)
}

fn snapshot(map: OccupancyGrid) -> Result<MapSnapshot, Fault> {
    let corner = map.info.origin.to_planar();
    let geometry = Geometry {
        origin: Point2::new(corner.x, corner.y),
        resolution_m: f64::from(map.info.resolution),
        width: map.info.width as usize,
        height: map.info.height as usize,
    };
    let percent = Grid::from_values(geometry, map.data.into())
        .ok_or("the map has not as many cells as its width and height say, or they have no size")?;
    Ok(MapSnapshot { stamp_s: map.stamp, percent })
}
