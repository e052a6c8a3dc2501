//! Converts between the messages of the ports and what the algorithm takes and returns.

use armor_sdk::prelude::*;

use crate::filter::ScanEstimate;
use crate::pose::Pose as Pose2;
use crate::scan::MapperScan;
use crate::slam::Slam;
use crate::snapshot::GridSnapshot;

pub(super) fn read_scan(scan: &LaserScan) -> MapperScan {
    MapperScan {
        stamp_s: scan.stamp,
        angle_min_rad: f64::from(scan.angle_min),
        increment_rad: f64::from(scan.angle_increment),
        range_min_m: f64::from(scan.range_min),
        range_max_m: f64::from(scan.range_max),
        ranges_m: scan.ranges.to_vec(),
    }
}

pub(super) fn build_pose(pose: &Pose2) -> Pose {
    Pose::planar(Pose2D { x: pose.x_m, y: pose.y_m, theta: pose.yaw_rad })
}

pub(super) fn build_map(stamp: f64, frame: String, snapshot: &GridSnapshot) -> OccupancyGrid {
    OccupancyGrid {
        stamp,
        frame,
        info: MapMetaData {
            map_load_time: stamp,
            resolution: snapshot.resolution_m as f32,
            width: snapshot.width as u32,
            height: snapshot.height as u32,
            origin: build_pose(&snapshot.origin),
        },
        data: snapshot.cells.clone().into(),
    }
}

/// The part of the map from a corner on, both in cells.
pub(super) fn build_update(
    stamp: f64,
    frame: String,
    snapshot: &GridSnapshot,
    (corner, size): ([usize; 2], [usize; 2]),
) -> OccupancyGridUpdate {
    OccupancyGridUpdate {
        stamp,
        frame,
        x: corner[0] as i32,
        y: corner[1] as i32,
        width: size[0] as u32,
        height: size[1] as u32,
        data: snapshot.rows(corner, size).flatten().copied().collect::<Vec<i8>>().into(),
    }
}

pub(super) fn build_trajectory(stamp: f64, frame: String, slam: &Slam) -> Path {
    let poses = slam.trajectory().map(|(stamp, pose)| PoseStamped {
        stamp,
        frame: frame.clone(),
        pose: build_pose(&pose),
    });
    Path { stamp, poses: poses.collect(), frame }
}

pub(super) fn build_estimate(
    stamp: f64,
    frame: String,
    estimate: &ScanEstimate,
) -> PoseWithCovarianceStamped {
    let mut covariance = [0.0; 36];
    for (row, from) in [0, 1, 5].into_iter().enumerate() {
        for (column, to) in [0, 1, 5].into_iter().enumerate() {
            covariance[from * 6 + to] = estimate.covariance[(row, column)];
        }
    }
    let pose = PoseWithCovariance { pose: build_pose(&estimate.pose), covariance };
    PoseWithCovarianceStamped { stamp, frame, pose }
}
