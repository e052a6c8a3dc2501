use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Vector3};

use super::*;
use crate::history::HISTORY_S;

fn ahead(x_m: f64) -> Isometry3<f64> {
    Isometry3::translation(x_m, 0.0, 0.0)
}

/// map → odom → base_link → laser, and a table that stands in the map.
fn robot() -> FrameTree {
    let mut tree = FrameTree::default();
    let turned = Isometry3::new(Vector3::new(1.0, 2.0, 0.0), Vector3::z() * FRAC_PI_2);
    for stamp_s in [0.0, 4.0] {
        tree.add_sample("map", "odom", stamp_s, turned).expect("a new edge");
    }
    for stamp_s in [1.0, 3.0] {
        tree.add_sample("odom", "base_link", stamp_s, ahead(stamp_s)).expect("a new edge");
    }
    tree.set_fixed("base_link", "laser", ahead(0.5)).expect("a new edge");
    tree.set_fixed("map", "table", ahead(-1.0)).expect("a new edge");
    tree
}

fn refusal(result: Result<Isometry3<f64>, FrameError>) -> String {
    result.expect_err("a refusal").to_string()
}

#[test]
fn a_lookup_composes_the_edges_as_they_were_at_that_moment() {
    let tree = robot();
    // The laser is 2.5 m along odom's x axis, which is map's y axis.
    let beam_end = tree.lookup("map", "laser", 2.0).expect("all is known") * Point3::origin();
    assert!((beam_end - Point3::new(1.0, 4.5, 0.0)).norm() < 1e-12, "{beam_end}");
    let there = tree.lookup("laser", "table", 2.0).expect("all is known");
    let back = tree.lookup("table", "laser", 2.0).expect("all is known");
    assert!(
        (there * back * Point3::new(3.0, 4.0, 5.0) - Point3::new(3.0, 4.0, 5.0)).norm() < 1e-12
    );
    assert_eq!(tree.lookup("laser", "laser", -7.0), Ok(Isometry3::identity()));
}

#[test]
fn a_fixed_transform_is_returned_as_it_was_set() {
    let tree = robot();
    assert_eq!(tree.lookup("base_link", "laser", 1e9), Ok(ahead(0.5)));
    assert_eq!(tree.lookup("base_link", "laser", -1e9), Ok(ahead(0.5)));
}

#[test]
fn what_cannot_be_answered_is_refused_with_its_reason() {
    let mut tree = robot();
    tree.set_fixed("world", "tower", ahead(1.0)).expect("a new edge");
    let check = |target, source, stamp_s, expected| {
        assert_eq!(refusal(tree.lookup(target, source, stamp_s)), expected);
    };
    let unknown = "the frame `camera` is unknown: no transform names it";
    check("map", "camera", 2.0, unknown);
    check("camera", "map", 2.0, unknown);
    let apart = "`laser` and `tower` are not connected: the one is in the tree of `map`, the other in that of `world`";
    check("laser", "tower", 2.0, apart);
    let old = "odom -> base_link at 0.5 s is too old: the edge has 1 s to 3 s";
    check("map", "laser", 0.5, old);
    let new = "odom -> base_link at 3.5 s is too new: the edge has 1 s to 3 s";
    check("laser", "table", 3.5, new);
    check("map", "odom", 4.5, "map -> odom at 4.5 s is too new: the edge has 0 s to 4 s");
    let not_finite = "a number of the transform or its stamp is not finite";
    assert!(refusal(tree.lookup("map", "odom", f64::NAN)).ends_with(not_finite));
}

#[test]
fn edges_above_the_common_parent_do_not_matter() {
    let tree = robot();
    assert!(tree.lookup("odom", "laser", 2.0).is_ok());
    assert_eq!(tree.newest_common_s("map", "laser"), Ok(Some(3.0)));
    assert_eq!(tree.newest_common_s("map", "odom"), Ok(Some(4.0)));
    assert_eq!(tree.newest_common_s("laser", "base_link"), Ok(None));
    assert!(matches!(tree.newest_common_s("map", "moon"), Err(FrameError::Unknown { .. })));
}

#[test]
fn a_frame_has_one_parent_and_is_in_no_circle() {
    let mut tree = robot();
    let second = tree.add_sample("map", "base_link", 1.0, ahead(0.0)).expect_err("a second parent");
    assert_eq!(second.to_string(), "`base_link` is in `odom` already: it cannot be in `map`, too");
    let circle = tree.set_fixed("laser", "map", ahead(0.0)).expect_err("a circle");
    assert_eq!(circle.to_string(), "`map` cannot be in `laser`, which is in `map` itself");
    let own = tree.set_fixed("arm", "arm", ahead(0.0)).expect_err("a circle");
    assert!(matches!(own, FrameError::Circle { .. }), "{own}");
    let fixed = tree.add_sample("base_link", "laser", 1.0, ahead(0.0)).expect_err("it is fixed");
    assert_eq!(fixed.to_string(), "base_link -> laser is fixed: it takes no samples");
    let moving = tree.set_fixed("odom", "base_link", ahead(0.0)).expect_err("it moves");
    assert_eq!(moving.to_string(), "odom -> base_link is moving: it cannot become fixed");
    tree.set_fixed("base_link", "laser", ahead(0.7)).expect("the file has another value");
    assert_eq!(tree.lookup("base_link", "laser", 0.0), Ok(ahead(0.7)));
}

#[test]
fn malformed_transforms_and_names_are_refused() {
    let mut tree = FrameTree::default();
    let not_finite = tree.add_sample("a", "b", f64::INFINITY, ahead(0.0));
    assert!(matches!(not_finite, Err(FrameError::NotFinite { .. })));
    assert!(matches!(tree.set_fixed("a", "b", ahead(f64::NAN)), Err(FrameError::NotFinite { .. })));
    assert_eq!(tree.set_fixed("", "b", ahead(0.0)), Err(FrameError::BadName { len: 0 }));
    let long = "n".repeat(MAX_FRAME_NAME_LEN + 1);
    let len = long.len();
    assert_eq!(tree.add_sample("a", &long, 0.0, ahead(0.0)), Err(FrameError::BadName { len }));
    assert!(
        matches!(tree.lookup("a", "a", 0.0), Err(FrameError::Unknown { .. })),
        "nothing was added"
    );
}

#[test]
fn a_removed_edge_takes_its_history_with_it() {
    let mut tree = robot();
    assert_eq!(tree.remove("odom").as_deref(), Some("map"));
    assert_eq!(tree.remove("odom"), None);
    assert!(matches!(tree.lookup("map", "laser", 2.0), Err(FrameError::NotConnected { .. })));
    assert!(tree.lookup("odom", "laser", 2.0).is_ok(), "what is below it stays");
    tree.add_sample("map#3f2a", "odom", 3.0, ahead(9.0)).expect("it has no parent");
    assert!(matches!(tree.lookup("map#3f2a", "odom", 2.0), Err(FrameError::TooOld { .. })));
    assert_eq!(tree.parent("odom"), Some("map#3f2a"));
}

#[test]
fn stamps_that_begin_again_need_a_new_edge() {
    let mut tree = robot();
    tree.add_sample("odom", "base_link", 100.0, ahead(0.0)).expect("it is newer");
    let old = tree.add_sample("odom", "base_link", 100.0 - HISTORY_S - 1.0, ahead(0.0));
    let old = old.expect_err("older than what is kept").to_string();
    assert!(old.contains("at 89 s is more than 10 s older than the newest, 100 s"), "{old}");
    tree.remove("base_link");
    tree.add_sample("odom", "base_link", 1.0, ahead(1.0)).expect("the edge is new");
    assert_eq!(tree.lookup("odom", "base_link", 1.0), Ok(ahead(1.0)));
}

#[test]
fn the_number_of_edges_is_limited() {
    let mut tree = FrameTree::default();
    for index in 0..MAX_FRAMES {
        tree.set_fixed("root", &format!("leaf{index}"), ahead(0.0)).expect("it has room");
    }
    let full = tree.set_fixed("root", "one-more", ahead(0.0));
    assert_eq!(full, Err(FrameError::Full { child: "one-more".into() }));
    tree.set_fixed("root", "leaf0", ahead(2.0)).expect("it is not new");
    tree.remove("leaf1");
    tree.set_fixed("root", "one-more", ahead(0.0)).expect("it has room again");
}
