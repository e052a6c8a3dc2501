//! The public logs, as they were recorded.

use armor_carmen_player::log::CarmenLog;
use armor_carmen_player::record::{self, LogRecord};
use armor_evaluation::relations::{ScanRelation, read_relations};
use armor_evaluation::trajectory::ScanTrajectory;
use armor_grid_slam::pose::Pose;
use armor_grid_slam::scan::MapperScan;
use armor_grid_slam::slam::Slam;
use std::path::PathBuf;

/// A scan and the odometry of its moment.
#[derive(Clone)]
pub struct Recorded {
    /// Its number in the log, from 0.
    pub number: usize,
    pub odometry: Pose,
    pub scan: MapperScan,
}

/// A log's scans, and the known poses at which they were taken. Without `ARMOR_DATA` the tests are
/// skipped, except under CI.
pub fn recorded(name: &str) -> Option<(Vec<Recorded>, Vec<ScanRelation>)> {
    let data = std::env::var_os("ARMOR_DATA");
    assert!(data.is_some() || std::env::var_os("CI").is_none(), "ARMOR_DATA is not set");
    let Some(data) = data else {
        println!("skipped: ARMOR_DATA is not set");
        return None;
    };
    let folder = PathBuf::from(data).join("laser");
    let records =
        CarmenLog::open(&folder.join(format!("{name}.log.gz"))).unwrap().map(Result::unwrap);
    let scans =
        records.filter_map(|r| if let LogRecord::Scan(scan) = r { Some(scan) } else { None });
    let scans = scans.enumerate().map(|(number, scan)| understood(number, &scan)).collect();
    let text = std::fs::read_to_string(folder.join(format!("{name}.relations.csv"))).unwrap();
    Some((scans, read_relations(&text).unwrap()))
}

fn understood(number: usize, scan: &record::RecordedScan) -> Recorded {
    let odometry = Pose::new(scan.odometry.x_m, scan.odometry.y_m, scan.odometry.yaw_rad);
    let sweep = MapperScan {
        stamp_s: scan.stamp_s,
        angle_min_rad: scan.beams.angle_min_rad,
        increment_rad: scan.beams.increment_rad,
        range_min_m: 0.02,
        range_max_m: 50.0,
        ranges_m: scan.ranges_within(50.0),
    };
    Recorded { number, odometry, scan: sweep }
}

/// The poses found, by the numbers of their scans in the log.
pub fn numbered(scans: &[Recorded], slam: &Slam) -> ScanTrajectory {
    scans.iter().map(|scan| scan.number).zip(slam.trajectory()).collect()
}
