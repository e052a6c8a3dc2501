//! Messages → what the scene takes. Whatever the numbers in them are, nothing here fails but bytes
//! that are no message.

use armor_grid::Pose2;
use armor_sdk::prelude::*;

use crate::map::{Change, Layout};
use crate::photo::{self, Photo};
use crate::scene::{Battery, Located, Mapping, Rays, Scene, SceneError};

/// A message in the scene's words.
pub(super) enum Seen {
    Map(f64, Layout, Vec<i8>),
    Change(Change),
    Located(Located),
    Scan(LaserScan),
    Moved(f64, Pose2, (f64, f64)),
    Truth(f64, Pose2),
    Trajectory(Path),
    Particles(PoseArray),
    Path(Path),
    Photo(Photo),
    Battery(Battery),
    Mapping(Mapping),
    Other,
}

/// Reads the data of an input. The outer error is for bytes that are no message, the inner one for
/// messages that cannot be shown.
pub(super) fn read(input: &str, data: &Data<'_>) -> Result<Result<Seen, SceneError>, Fault> {
    Ok(Ok(match input {
        "map" => map(data.decode()?),
        "map_updates" => {
            let Some(change) = change(data.decode()?) else {
                return Ok(Err(crate::map::MapError::Outside.into()));
            };
            Seen::Change(change)
        }
        "pose" => located(&data.decode()?),
        "scan" => Seen::Scan(data.decode()?),
        "odometry" => {
            let odometry: Odometry = data.decode()?;
            let twist = odometry.twist.twist;
            let velocity = (twist.linear.x, twist.angular.z);
            Seen::Moved(odometry.stamp, planar(&odometry.pose.pose), velocity)
        }
        "truth" => {
            let truth: Odometry = data.decode()?;
            Seen::Truth(truth.stamp, planar(&truth.pose.pose))
        }
        "trajectory" => Seen::Trajectory(data.decode()?),
        "particles" => Seen::Particles(data.decode()?),
        "path" => Seen::Path(data.decode()?),
        "image" => {
            let image: CompressedImage = data.decode()?;
            match photo::decode(&image.format, &image.data) {
                Ok(photo) => Seen::Photo(photo),
                Err(error) => return Ok(Err(error.into())),
            }
        }
        "battery" => Seen::Battery(battery(&data.decode()?)),
        "diagnostics" => Seen::Mapping(mapping(&data.decode()?)),
        _ => Seen::Other,
    }))
}

impl Seen {
    /// Puts it into the scene.
    pub(super) fn show(self, scene: &mut Scene) -> Result<(), SceneError> {
        match self {
            Self::Map(stamp_s, layout, cells) => scene.map.replace(stamp_s, layout, cells)?,
            Self::Change(change) => scene.map.change(change)?,
            Self::Located(located) => scene.located(located)?,
            Self::Scan(scan) => scene.scanned(&Rays {
                stamp_s: scan.stamp,
                first_rad: f64::from(scan.angle_min),
                step_rad: f64::from(scan.angle_increment),
                range_m: [scan.range_min, scan.range_max],
                ranges_m: &scan.ranges,
            })?,
            Self::Moved(stamp_s, pose, velocity) => scene.moved(stamp_s, pose, velocity)?,
            Self::Truth(stamp_s, pose) => scene.truly_at(stamp_s, pose)?,
            Self::Trajectory(path) => scene.corrected(path.stamp, poses(&path)),
            Self::Particles(array) => scene.supposed(array.poses.iter().map(planar)),
            Self::Path(path) => scene.planned(poses(&path)),
            Self::Photo(photo) => scene.photographed(photo),
            Self::Battery(battery) => scene.battery = Some(battery),
            Self::Mapping(mapping) => scene.mapping = Some(mapping),
            Self::Other => {}
        }
        Ok(())
    }
}

fn planar(pose: &Pose) -> Pose2 {
    let Pose2D { x, y, theta } = pose.to_planar();
    Pose2::new(x, y, theta)
}

fn poses(path: &Path) -> impl ExactSizeIterator<Item = Pose2> + '_ {
    path.poses.iter().map(|pose| planar(&pose.pose))
}

fn map(map: OccupancyGrid) -> Seen {
    let layout = Layout {
        corner: planar(&map.info.origin),
        resolution_m: f64::from(map.info.resolution),
        width: map.info.width as usize,
        height: map.info.height as usize,
    };
    Seen::Map(map.stamp, layout, map.data.into())
}

/// Nothing if it begins before the map does.
fn change(update: OccupancyGridUpdate) -> Option<Change> {
    let corner = [usize::try_from(update.x).ok()?, usize::try_from(update.y).ok()?];
    let size = [update.width as usize, update.height as usize];
    Some(Change { stamp_s: update.stamp, corner, size, cells: update.data.into() })
}

fn located(pose: &PoseWithCovarianceStamped) -> Seen {
    let of = |row: usize, column: usize| pose.pose.covariance[row * 6 + column];
    let covariance_m2 = [of(0, 0), of(0, 1), of(1, 1)];
    let stamp_s = pose.stamp;
    Seen::Located(Located { stamp_s, pose: planar(&pose.pose.pose), covariance_m2 })
}

fn battery(battery: &BatteryState) -> Battery {
    let known = |value: f32| value.is_finite().then(|| f64::from(value));
    Battery {
        charge: known(battery.percentage),
        volts: known(battery.voltage),
        is_charging: battery.power_supply_status == PowerSupplyStatus::Charging,
    }
}

fn mapping(diagnostics: &SlamDiagnostics) -> Mapping {
    Mapping {
        particles: diagnostics.particles,
        effective: diagnostics.effective_particles,
        score: diagnostics.match_score,
        closures: diagnostics.closures,
        update_s: diagnostics.update_time,
        dropped: diagnostics.dropped,
    }
}
