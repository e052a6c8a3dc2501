//! Moving frames: the message `FrameTransforms` into and from a tree of frames.

use armor_frames::{
    FrameError, FrameTree, Isometry3, Quaternion as FrameQuaternion, Translation3, UnitQuaternion,
};
use armor_grid::Pose2;
use armor_sdk::messages::{FrameTransform, FrameTransforms, Quaternion, Vector3};

use crate::frame::read_name;

/// Makes the message of one frame that moves in the plane of another.
pub fn build_transform(
    stamp_s: f64,
    parent: &str,
    child: &str,
    parent_from_child: Pose2,
) -> FrameTransforms {
    let transform = FrameTransform {
        parent: parent.into(),
        child: child.into(),
        translation: Vector3 { x: parent_from_child.x_m, y: parent_from_child.y_m, z: 0.0 },
        rotation: Quaternion::from_yaw(parent_from_child.yaw_rad),
    };
    FrameTransforms { stamp: stamp_s, transforms: vec![transform] }
}

/// Adds the transforms of a message to a tree. If a parent has a new epoch, `map#3f2a` after `map`,
/// its origin is another place: the history of the child is dropped. It is dropped, too, where
/// time has begun again, as after a restart of the clock's source: the transforms of one link come in
/// their order.
///
/// # Errors
/// [`FrameError`] about the first transform that the tree does not take; those before it are added.
pub fn take_transforms(tree: &mut FrameTree, message: &FrameTransforms) -> Result<(), FrameError> {
    for FrameTransform { parent, child, translation, rotation } in &message.transforms {
        let is_of_other_epoch =
            |known: &str| known != parent && read_name(known) == read_name(parent);
        if tree.parent(child).is_some_and(is_of_other_epoch) {
            tree.remove(child);
        }
        let Quaternion { x, y, z, w } = *rotation;
        // Numbers that are no rotation become none at all, which the tree refuses.
        let rotation = UnitQuaternion::from_quaternion(FrameQuaternion::new(w, x, y, z));
        let place = Translation3::new(translation.x, translation.y, translation.z);
        let parent_from_child = Isometry3::from_parts(place, rotation);
        let mut add = || tree.add_sample(parent, child, message.stamp, parent_from_child);
        if let Err(refused) = add() {
            if !matches!(refused, FrameError::Outdated { .. }) {
                return Err(refused);
            }
            tree.remove(child);
            tree.add_sample(parent, child, message.stamp, parent_from_child)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn x_m(tree: &FrameTree, target: &str, source: &str, stamp_s: f64) -> Result<f64, FrameError> {
        tree.lookup(target, source, stamp_s).map(|transform| transform.translation.x)
    }

    fn at(x_m: f64) -> Pose2 {
        Pose2::new(x_m, 0.0, 0.0)
    }

    #[test]
    fn transforms_of_several_publishers_form_one_tree() {
        let mut tree = FrameTree::default();
        for stamp_s in [1.0, 2.0] {
            let moved = build_transform(stamp_s, "odom", "base_link", at(stamp_s));
            take_transforms(&mut tree, &moved).expect("a new edge");
            let corrected = build_transform(stamp_s, "map", "odom", at(10.0));
            take_transforms(&mut tree, &corrected).expect("a new edge");
        }
        assert_eq!(x_m(&tree, "map", "base_link", 1.5), Ok(11.5));
    }

    #[test]
    fn a_new_epoch_of_the_map_drops_its_history() {
        let mut tree = FrameTree::default();
        for (stamp_s, map) in [(1.0, "map"), (2.0, "map"), (3.0, "map#3f2a")] {
            let corrected = build_transform(stamp_s, map, "odom", at(stamp_s));
            take_transforms(&mut tree, &corrected).expect("an edge of one epoch");
        }
        assert_eq!(x_m(&tree, "map#3f2a", "odom", 3.0), Ok(3.0));
        assert!(matches!(x_m(&tree, "map#3f2a", "odom", 2.0), Err(FrameError::TooOld { .. })));
        assert!(matches!(x_m(&tree, "map", "odom", 2.0), Err(FrameError::Unknown { .. })));
        let other = build_transform(4.0, "world", "odom", at(0.0));
        let refused = take_transforms(&mut tree, &other).expect_err("another frame is no epoch");
        assert!(matches!(refused, FrameError::SecondParent { .. }), "{refused}");
    }

    #[test]
    fn time_that_begins_again_begins_a_new_history() {
        let mut tree = FrameTree::default();
        for stamp_s in [500.0, 501.0, 0.1, 0.2] {
            let moved = build_transform(stamp_s, "odom", "base_link", at(stamp_s));
            take_transforms(&mut tree, &moved).expect("an edge");
        }
        assert_eq!(x_m(&tree, "odom", "base_link", 0.1), Ok(0.1));
        assert!(matches!(x_m(&tree, "odom", "base_link", 500.0), Err(FrameError::TooNew { .. })));
    }

    #[test]
    fn numbers_that_are_no_transform_are_refused() {
        let mut tree = FrameTree::default();
        let mut moved = build_transform(1.0, "odom", "base_link", at(0.0));
        moved.transforms[0].rotation = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 };
        let refused = take_transforms(&mut tree, &moved).expect_err("no rotation");
        assert!(matches!(refused, FrameError::NotFinite { .. }), "{refused}");
    }
}
