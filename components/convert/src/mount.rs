//! Where a sensor is on the robot, from the `<frame>`s of the file.

use armor_frames::{FrameError, FrameTree, Isometry3, Translation3, UnitQuaternion, Vector3};
use armor_grid::Pose2;
use armor_sdk::FixedFrame;
use thiserror::Error;

/// The frame of the robot's base (REP-105), on which sensors are mounted.
const BASE: &str = "base_link";
/// Farthest from level that a sensor may be for a component that works in the plane, in radians: 2°,
/// with which 10 m are short by 6 mm.
const MAX_TILT_RAD: f64 = 0.035;

/// Why the place of a sensor on the robot is not known.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MountError {
    /// The frames of the file do not lead from it to the base.
    #[error(
        "where the frame `{frame}` is on the robot is not known: {cause}; add <frame \
         name=\"{frame}\" in=\"{BASE}\" x=\"…\"/> to the system"
    )]
    NotPlaced {
        /// The sensor's frame.
        frame: String,
        /// Why not.
        cause: FrameError,
    },
    /// It is not level.
    #[error(
        "the frame `{frame}` is tilted by {tilt_deg:.1} deg, and this component takes only what is \
         level within 2 deg; correct its roll and pitch in the file"
    )]
    Tilted {
        /// The sensor's frame.
        frame: String,
        /// How far, in degrees.
        tilt_deg: f64,
    },
}

/// Returns where a frame of the file is on the robot's base, `base_from_frame`.
///
/// # Errors
/// [`MountError::NotPlaced`] if the frames do not lead from it to the base.
pub fn locate_on_base(frames: &[FixedFrame], frame: &str) -> Result<Isometry3<f64>, MountError> {
    let locate = || {
        let mut tree = FrameTree::default();
        for FixedFrame { name, parent, translation_m: [x, y, z], rotation_rad } in frames {
            let [roll, pitch, yaw] = *rotation_rad;
            let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let placed = Isometry3::from_parts(Translation3::new(*x, *y, *z), rotation);
            tree.set_fixed(parent, name, placed)?;
        }
        // Fixed frames are the same at every moment.
        if frame == BASE { Ok(Isometry3::identity()) } else { tree.lookup(BASE, frame, 0.0) }
    };
    locate().map_err(|cause| MountError::NotPlaced { frame: frame.to_owned(), cause })
}

/// Returns where a level frame of the file is on the robot's base, in the plane.
///
/// # Errors
/// [`MountError`].
pub fn locate_level(frames: &[FixedFrame], frame: &str) -> Result<Pose2, MountError> {
    let base_from_frame = locate_on_base(frames, frame)?;
    let ahead = base_from_frame.rotation * Vector3::x();
    let up = base_from_frame.rotation * Vector3::z();
    let tilt_rad = up.angle(&Vector3::z());
    if tilt_rad > MAX_TILT_RAD {
        let (frame, tilt_deg) = (frame.to_owned(), tilt_rad.to_degrees());
        return Err(MountError::Tilted { frame, tilt_deg });
    }
    let place = base_from_frame.translation;
    Ok(Pose2::new(place.x, place.y, ahead.y.atan2(ahead.x)))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use armor_sdk::wire::text_format::parse_frames;

    use super::*;

    fn level(frames: &str, frame: &str) -> Result<Pose2, String> {
        let frames = parse_frames(frames).expect("frames");
        locate_level(&frames, frame).map_err(|why| why.to_string())
    }

    #[test]
    fn a_sensor_is_where_the_file_places_it_to_the_bit() {
        let placed = level("laser,base_link,0.08,-0.03,0.3,0,0,0", "laser");
        assert_eq!(placed, Ok(Pose2::new(0.08, -0.03, 0.0)));
        assert_eq!(level("laser,base_link,1,0,0,0,0,0", "base_link"), Ok(Pose2::IDENTITY));
    }

    #[test]
    fn a_sensor_on_another_part_is_where_the_parts_bring_it() {
        let frames = format!("laser,mast,0.1,0,0.2,0,0,0 mast,base_link,1,2,0.5,0,0,{FRAC_PI_2}");
        let Pose2 { x_m, y_m, yaw_rad } = level(&frames, "laser").expect("it is placed");
        let error = (x_m - 1.0).abs() + (y_m - 2.1).abs() + (yaw_rad - FRAC_PI_2).abs();
        assert!(error < 1e-12, "{x_m} {y_m} {yaw_rad}");
        let tilted = parse_frames("camera,base_link,0.1,0,0.4,0,0.5,0").expect("frames");
        let camera = locate_on_base(&tilted, "camera").expect("it is placed");
        assert!((camera.rotation.euler_angles().1 - 0.5).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_known_is_refused_with_its_reason() {
        let unknown = level("laser,base_link,0,0,0,0,0,0", "lidar").expect_err("no such frame");
        assert_eq!(
            unknown,
            "where the frame `lidar` is on the robot is not known: the frame `lidar` is unknown: no \
             transform names it; add <frame name=\"lidar\" in=\"base_link\" x=\"…\"/> to the system"
        );
        let apart = "laser,gripper,0,0,0,0,0,0 camera,base_link,0,0,0,0,0,0";
        let apart = level(apart, "laser").expect_err("the gripper is not on the base");
        assert!(apart.contains("`base_link` and `laser` are not connected"), "{apart}");
    }

    #[test]
    fn a_sensor_that_is_not_level_is_not_taken_for_one_that_is() {
        let upside_down = level(&format!("laser,base_link,0,0,0.3,{PI},0,0"), "laser");
        let why = upside_down.expect_err("it is upside down");
        assert!(why.starts_with("the frame `laser` is tilted by 180.0 deg"), "{why}");
        assert!(level("laser,base_link,0,0,0.3,0.01,-0.01,1", "laser").is_ok());
    }
}
