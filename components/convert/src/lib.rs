//! Conversions between the standard messages and the geometry of `armor-grid`: `read_…` takes a
//! message, `build_…` makes one. Where sensors are on the robot, moving frames in a tree
//! (`armor-frames`), and zones (`armor-zones`).

mod frame;
mod mount;
mod transforms;
mod zone_text;
mod zones;

use armor_grid::{Geometry, Grid, Occupancy, Point2, Pose2, Thresholds};
use armor_sdk::messages::{
    MapMetaData, OccupancyGrid, Odometry, Path, Pose, Pose2D, PoseStamped,
    PoseWithCovarianceStamped,
};
use thiserror::Error;

pub use frame::{FrameNews, FrameWatch, build_frame, read_epoch};
pub use mount::{MountError, locate_level, locate_on_base};
pub use transforms::{build_transform, take_transforms};
pub use zone_text::{ZoneParsingError, parse_zone_map};
pub use zones::{ZoneWatch, ZonesError, build_zones, read_zones};

/// An occupancy grid whose data do not fill it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the number of the map's cells is not its width times its height, or they have no size")]
pub struct MapSizeError;

/// Returns the projection of a pose onto the plane.
pub fn read_pose(pose: &Pose) -> Pose2 {
    let Pose2D { x, y, theta } = pose.to_planar();
    Pose2::new(x, y, theta)
}

/// Returns the pose of a robot on its map.
pub fn read_robot_pose(pose: &PoseWithCovarianceStamped) -> Pose2 {
    read_pose(&pose.pose.pose)
}

/// Returns the pose of a robot in its odometry's frame.
pub fn read_odometry_pose(odometry: &Odometry) -> Pose2 {
    read_pose(&odometry.pose.pose)
}

/// Returns the poses of a path in their order.
pub fn read_path(path: &Path) -> Vec<Pose2> {
    path.poses.iter().map(|stamped| read_pose(&stamped.pose)).collect()
}

/// Returns the layout of a map. Its cells are parallel to the axes of its frame: a rotation of the
/// origin is ignored.
pub fn read_geometry(info: &MapMetaData) -> Geometry {
    let Pose2D { x, y, .. } = info.origin.to_planar();
    Geometry {
        origin: Point2::new(x, y),
        resolution_m: f64::from(info.resolution),
        width: info.width as usize,
        height: info.height as usize,
    }
}

/// Returns a map as free, occupied and unknown cells.
///
/// # Errors
/// [`MapSizeError`] if the number of cells is another than width times height, or a cell has no
/// size.
pub fn read_occupancy(
    map: &OccupancyGrid,
    thresholds: Thresholds,
) -> Result<Grid<Occupancy>, MapSizeError> {
    Grid::classified_by(thresholds, read_geometry(&map.info), &map.data).ok_or(MapSizeError)
}

/// Returns a map in percent, negative where it is unknown.
///
/// # Errors
/// [`MapSizeError`] if the number of cells is another than width times height.
pub fn read_percent(map: OccupancyGrid) -> Result<Grid<i8>, MapSizeError> {
    Grid::from_values(read_geometry(&map.info), map.data.into()).ok_or(MapSizeError)
}

/// Makes the message of a pose on the ground.
pub fn build_pose(pose: Pose2) -> Pose {
    Pose::planar(Pose2D { x: pose.x_m, y: pose.y_m, theta: pose.yaw_rad })
}

/// Makes the message of a pose in a frame at a time.
pub fn build_stamped_pose(stamp_s: f64, frame: &str, pose: Pose2) -> PoseStamped {
    PoseStamped { stamp: stamp_s, frame: frame.into(), pose: build_pose(pose) }
}

/// Makes the message of a path, all of one time.
pub fn build_path(stamp_s: f64, frame: &str, poses: &[Pose2]) -> Path {
    let poses = poses.iter().map(|pose| build_stamped_pose(stamp_s, frame, *pose)).collect();
    Path { stamp: stamp_s, frame: frame.into(), poses }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: u32, cells: Vec<i8>) -> OccupancyGrid {
        let info = MapMetaData {
            resolution: 0.5,
            width,
            height: 2,
            origin: build_pose(Pose2::new(-1.0, 2.0, 0.0)),
            ..Default::default()
        };
        OccupancyGrid { info, data: cells.into(), ..Default::default() }
    }

    #[test]
    fn a_pose_comes_back_from_its_message() {
        let pose = Pose2::new(1.0, -2.0, 0.7);
        let back = read_pose(&build_pose(pose));
        assert!(
            (back.x_m - 1.0).abs() + (back.y_m + 2.0).abs() + (back.yaw_rad - 0.7).abs() < 1e-9
        );
    }

    #[test]
    fn a_path_keeps_order_stamp_and_frame() {
        let poses = [Pose2::new(1.0, 0.0, 0.0), Pose2::new(2.0, 0.0, 0.0)];
        let path = build_path(5.0, "map", &poses);
        assert_eq!((path.stamp, path.frame.as_str()), (5.0, "map"));
        assert!(path.poses.iter().all(|pose| pose.stamp == 5.0 && pose.frame == "map"));
        assert_eq!(read_path(&path), poses);
    }

    #[test]
    fn a_map_is_read_with_its_place() {
        let grid = read_occupancy(&map(2, vec![0, 100, -1, 0]), Thresholds::SEEN).expect("a map");
        assert_eq!(grid.geometry().origin, Point2::new(-1.0, 2.0));
        assert_eq!(grid.at(Point2::new(-0.2, 2.2)), Some(&Occupancy::Occupied));
        assert_eq!(grid.at(Point2::new(-0.8, 2.7)), Some(&Occupancy::Unknown));
        assert_eq!(read_percent(map(2, vec![0, 100, -1, 0])).expect("a map").values()[1], 100);
    }

    #[test]
    fn a_map_without_all_of_its_cells_is_refused() {
        assert_eq!(read_percent(map(3, vec![0; 4])), Err(MapSizeError));
        assert_eq!(read_occupancy(&map(3, vec![0; 4]), Thresholds::SEEN), Err(MapSizeError));
    }
}
