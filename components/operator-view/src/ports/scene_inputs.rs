//! The inputs of the map area: messages → what the scene takes. Whatever numbers are in a message,
//! the result is a scene or an error, never a panic.

use armor_grid::Pose2;
use armor_sdk::prelude::*;

use super::input::{ConsoleUpdate, ScreenInput, ScreenPort};
use crate::map::{MapChange, MapLayout, MapShapeError};
use crate::photo;
use crate::scene::{LocatedPose, Rays, SceneError};

/// All inputs of the map area.
pub(super) const INPUTS: &[ScreenPort] = &[
    ScreenPort::of::<MapInput>(),
    ScreenPort::of::<MapUpdatesInput>(),
    ScreenPort::of::<PoseInput>(),
    ScreenPort::of::<ScanInput>(),
    ScreenPort::of::<OdometryInput>(),
    ScreenPort::of::<TruthInput>(),
    ScreenPort::of::<TrajectoryInput>(),
    ScreenPort::of::<ParticlesInput>(),
    ScreenPort::of::<PathInput>(),
    ScreenPort::of::<ImageInput>(),
];

struct MapInput;

impl ScreenInput for MapInput {
    const ID: &'static str = "map";
    const DOC: &'static str = "occupancy grid of the world";
    const IS_STEADY: bool = false;
    type Message = OccupancyGrid;

    fn read_message(map: OccupancyGrid) -> Result<ConsoleUpdate, SceneError> {
        let layout = MapLayout {
            corner: to_planar(&map.info.origin),
            resolution_m: f64::from(map.info.resolution),
            width: map.info.width as usize,
            height: map.info.height as usize,
        };
        let cells: Vec<i8> = map.data.into();
        let stamp_s = map.stamp;
        let frame = map.frame;
        Ok(Box::new(move |console| {
            console.frame_seen(&frame);
            Ok(console.scene.map.replace(stamp_s, layout, cells)?)
        }))
    }
}

struct MapUpdatesInput;

impl ScreenInput for MapUpdatesInput {
    const ID: &'static str = "map_updates";
    const DOC: &'static str = "rectangles of the map that changed since it was published";
    const IS_STEADY: bool = false;
    type Message = OccupancyGridUpdate;

    fn read_message(update: OccupancyGridUpdate) -> Result<ConsoleUpdate, SceneError> {
        let (Ok(column), Ok(row)) = (usize::try_from(update.x), usize::try_from(update.y)) else {
            return Err(MapShapeError::Outside.into());
        };
        let size = [update.width as usize, update.height as usize];
        let (corner, cells) = ([column, row], update.data.into());
        let change = MapChange { stamp_s: update.stamp, corner, size, cells };
        let frame = update.frame;
        Ok(Box::new(move |console| {
            console.check_frame(&frame)?;
            Ok(console.scene.map.change(change)?)
        }))
    }
}

struct PoseInput;

impl ScreenInput for PoseInput {
    const ID: &'static str = "pose";
    const DOC: &'static str = "pose of the robot on the map, with its covariance";
    const IS_STEADY: bool = true;
    type Message = PoseWithCovarianceStamped;

    fn read_message(pose: PoseWithCovarianceStamped) -> Result<ConsoleUpdate, SceneError> {
        let covariance = |row: usize, column: usize| pose.pose.covariance[row * 6 + column];
        let covariance_m2 = [covariance(0, 0), covariance(0, 1), covariance(1, 1)];
        let (stamp_s, frame, pose) = (pose.stamp, pose.frame, to_planar(&pose.pose.pose));
        let located = LocatedPose { stamp_s, pose, covariance_m2 };
        Ok(Box::new(move |console| {
            console.frame_seen(&frame);
            console.scene.set_located(located)
        }))
    }
}

struct ScanInput;

impl ScreenInput for ScanInput {
    const ID: &'static str = "scan";
    const DOC: &'static str = "laser scan, drawn at the pose of its time";
    const IS_STEADY: bool = true;
    type Message = LaserScan;

    fn read_message(scan: LaserScan) -> Result<ConsoleUpdate, SceneError> {
        Ok(Box::new(move |console| {
            console.scene.set_scan(&Rays {
                stamp_s: scan.stamp,
                first_rad: f64::from(scan.angle_min),
                step_rad: f64::from(scan.angle_increment),
                range_m: [scan.range_min, scan.range_max],
                ranges_m: &scan.ranges,
            })
        }))
    }
}

struct OdometryInput;

impl ScreenInput for OdometryInput {
    const ID: &'static str = "odometry";
    const DOC: &'static str =
        "odometry: extrapolates the pose; its own trajectory is drawn next to the corrected one";
    const IS_STEADY: bool = true;
    type Message = Odometry;

    fn read_message(odometry: Odometry) -> Result<ConsoleUpdate, SceneError> {
        let twist = odometry.twist.twist;
        let velocity = (twist.linear.x, twist.angular.z);
        let (stamp_s, pose) = (odometry.stamp, to_planar(&odometry.pose.pose));
        Ok(Box::new(move |console| console.scene.add_odometry(stamp_s, pose, velocity)))
    }
}

struct TruthInput;

impl ScreenInput for TruthInput {
    const ID: &'static str = "truth";
    const DOC: &'static str = "true pose of a simulated robot";
    const IS_STEADY: bool = true;
    type Message = Odometry;

    fn read_message(truth: Odometry) -> Result<ConsoleUpdate, SceneError> {
        let (stamp_s, pose) = (truth.stamp, to_planar(&truth.pose.pose));
        Ok(Box::new(move |console| console.scene.add_truth(stamp_s, pose)))
    }
}

struct TrajectoryInput;

impl ScreenInput for TrajectoryInput {
    const ID: &'static str = "trajectory";
    const DOC: &'static str = "trajectory so far, with all corrections";
    const IS_STEADY: bool = false;
    type Message = Path;

    fn read_message(path: Path) -> Result<ConsoleUpdate, SceneError> {
        Ok(Box::new(move |console| {
            console.check_frame(&path.frame)?;
            console.scene.set_trajectory(path.stamp, list_poses(&path));
            Ok(())
        }))
    }
}

struct ParticlesInput;

impl ScreenInput for ParticlesInput {
    const ID: &'static str = "particles";
    const DOC: &'static str = "hypotheses of the robot's pose";
    const IS_STEADY: bool = true;
    type Message = PoseArray;

    fn read_message(array: PoseArray) -> Result<ConsoleUpdate, SceneError> {
        Ok(Box::new(move |console| {
            console.check_frame(&array.frame)?;
            console.scene.set_particles(array.poses.iter().map(to_planar));
            Ok(())
        }))
    }
}

struct PathInput;

impl ScreenInput for PathInput {
    const ID: &'static str = "path";
    const DOC: &'static str = "planned path";
    const IS_STEADY: bool = false;
    type Message = Path;

    fn read_message(path: Path) -> Result<ConsoleUpdate, SceneError> {
        Ok(Box::new(move |console| {
            console.check_frame(&path.frame)?;
            console.scene.set_path(list_poses(&path));
            Ok(())
        }))
    }
}

struct ImageInput;

impl ScreenInput for ImageInput {
    const ID: &'static str = "image";
    const DOC: &'static str = "camera image, jpeg or png";
    const IS_STEADY: bool = true;
    type Message = CompressedImage;

    fn read_message(image: CompressedImage) -> Result<ConsoleUpdate, SceneError> {
        let photo = photo::decode_photo(&image.format, &image.data)?;
        Ok(Box::new(move |console| {
            console.scene.set_photo(photo);
            Ok(())
        }))
    }
}

fn to_planar(pose: &Pose) -> Pose2 {
    let Pose2D { x, y, theta } = pose.to_planar();
    Pose2::new(x, y, theta)
}

fn list_poses(path: &Path) -> impl ExactSizeIterator<Item = Pose2> + '_ {
    path.poses.iter().map(|pose| to_planar(&pose.pose))
}
