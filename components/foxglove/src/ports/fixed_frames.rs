//! The fixed frames of the file as transforms: viewers know only those that are published, and place
//! scans and images with them.

use armor_sdk::FixedFrame;
use armor_sdk::messages::{FrameTransform, FrameTransforms, Quaternion, Vector3};

/// Returns the transforms of fixed frames.
pub(super) fn make_transforms(frames: &[FixedFrame], stamp: f64) -> FrameTransforms {
    let transform = |frame: &FixedFrame| {
        let [x, y, z] = frame.translation_m;
        FrameTransform {
            parent: frame.parent.clone(),
            child: frame.name.clone(),
            translation: Vector3 { x, y, z },
            rotation: make_quaternion(frame.rotation_rad),
        }
    };
    FrameTransforms { stamp, transforms: frames.iter().map(transform).collect() }
}

/// Turns about the fixed axes x, then y, then z (REP-103).
fn make_quaternion([roll, pitch, yaw]: [f64; 3]) -> Quaternion {
    let [(sr, cr), (sp, cp), (sy, cy)] = [roll, pitch, yaw].map(|angle| (angle / 2.0).sin_cos());
    Quaternion {
        x: sr * cp * cy - cr * sp * sy,
        y: cr * sp * cy + sr * cp * sy,
        z: cr * cp * sy - sr * sp * cy,
        w: cr * cp * cy + sr * sp * sy,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// Turns a vector by a quaternion.
    fn turn(by: Quaternion, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let Quaternion { x: a, y: b, z: c, w } = by;
        let cross = |[px, py, pz]: [f64; 3]| [b * pz - c * py, c * px - a * pz, a * py - b * px];
        let [tx, ty, tz] = cross([x, y, z]).map(|it| 2.0 * it);
        let [ux, uy, uz] = cross([tx, ty, tz]);
        [x + w * tx + ux, y + w * ty + uy, z + w * tz + uz]
    }

    #[test]
    fn a_frame_turns_about_x_then_y_then_z() {
        let check = |rotation_rad, expected: [f64; 3]| {
            let turned = turn(make_quaternion(rotation_rad), [0.0, 1.0, 0.0]);
            let is_near = turned.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(is_near, "{rotation_rad:?}: {turned:?}, not {expected:?}");
        };
        check([0.0; 3], [0.0, 1.0, 0.0]);
        check([FRAC_PI_2, 0.0, 0.0], [0.0, 0.0, 1.0]);
        check([0.0, 0.0, FRAC_PI_2], [-1.0, 0.0, 0.0]);
        check([FRAC_PI_2, FRAC_PI_2, 0.0], [1.0, 0.0, 0.0]);
        check([FRAC_PI_2, FRAC_PI_2, FRAC_PI_2], [0.0, 1.0, 0.0]);
    }

    #[test]
    fn every_frame_of_the_file_is_a_transform() {
        let laser = FixedFrame {
            name: "laser".into(),
            parent: "base_link".into(),
            translation_m: [0.1, 0.0, 0.2],
            rotation_rad: [0.0; 3],
        };
        let made = make_transforms(&[laser], 2.5);
        let [transform] = &made.transforms[..] else { panic!("{made:?}") };
        assert_eq!((transform.parent.as_str(), transform.child.as_str()), ("base_link", "laser"));
        assert_eq!((made.stamp, transform.translation.z, transform.rotation.w), (2.5, 0.2, 1.0));
    }
}
