//! Paths over a room of 4 x 3 m at 5 cm, its walls where `room` puts them.

use std::f64::consts::FRAC_PI_2;

use armor_grid::{Geometry, Point2};

use super::*;

const NEAR: Pose2 = Pose2::new(0.5, 0.5, 0.0);
const FAR: Pose2 = Pose2::new(3.5, 0.5, FRAC_PI_2);
const ASIDE: Pose2 = Pose2::new(0.5, 2.5, 0.0);
const THERE: Pose2 = Pose2::new(3.5, 2.5, 0.0);

/// The room, drawn by what is at each place.
fn drawn(what: impl Fn(Point2) -> Occupancy) -> Grid<Occupancy> {
    let geometry =
        Geometry { origin: Point2::new(0.0, 0.0), resolution_m: 0.05, width: 80, height: 60 };
    let mut map = Grid::filled(geometry, Occupancy::Free);
    for cell in geometry.cells() {
        map[cell] = what(geometry.centre(cell));
    }
    map
}

/// A free room but for a block from corner to corner, in metres.
fn room(from: (f64, f64), to: (f64, f64)) -> Grid<Occupancy> {
    drawn(|Point2 { x_m, y_m }| {
        let is_in = (from.0..to.0).contains(&x_m) && (from.1..to.1).contains(&y_m);
        if is_in { Occupancy::Occupied } else { Occupancy::Free }
    })
}

/// A wall across the room, with a gap in its middle.
fn with_gap(gap_m: f64) -> Grid<Occupancy> {
    drawn(|Point2 { x_m, y_m }| {
        let is_wall = (1.9..2.1).contains(&x_m) && (y_m - 1.5).abs() > gap_m / 2.0;
        if is_wall { Occupancy::Occupied } else { Occupancy::Free }
    })
}

fn planning(map: Grid<Occupancy>) -> Planning {
    let mut planning = Planning::new(PlannerSettings::default());
    planning.map_seen(map);
    planning.pose_seen(NEAR);
    planning
}

/// Plans from `NEAR`; returns the path.
fn path(map: Grid<Occupancy>, goal: Pose2) -> Vec<Pose2> {
    let mut planning = planning(map);
    planning.goal_seen(1.0, Rank::Task, goal);
    planning.step(1.0).expect("a path is published").to_vec()
}

fn end(path: Option<&[Pose2]>) -> Option<Pose2> {
    path.expect("a path is published").last().copied()
}

fn length_m(path: &[Pose2]) -> f64 {
    path.windows(2).map(|pair| pair[0].point().distance_m(pair[1].point())).sum()
}

#[test]
fn it_leads_through_the_gap_and_ends_as_the_goal() {
    let path = path(with_gap(0.8), FAR);
    assert!(path[0].point().distance_m(NEAR.point()) < 0.05, "{:?}", path[0]);
    assert_eq!(path.last(), Some(&FAR));
    assert!(path.iter().any(|pose| (pose.x_m - 2.0).abs() < 0.05 && (pose.y_m - 1.5).abs() < 0.1));
    for pair in path.windows(2) {
        let bearing_rad = pair[0].point().bearing_rad(pair[1].point());
        assert!((pair[0].yaw_rad - bearing_rad).abs() < 1e-9, "{pair:?}");
    }
}

#[test]
fn a_gap_that_the_robot_does_not_fit_through_is_no_way() {
    assert!(!path(with_gap(0.55), FAR).is_empty());
    assert_eq!(path(with_gap(0.3), FAR), []);
}

#[test]
fn a_gap_without_a_margin_is_a_way_if_there_is_no_other() {
    // 0.23 m to either side would be free with the margin.
    assert_eq!(path(with_gap(0.4), FAR).last(), Some(&FAR));
    let two_gaps = drawn(|Point2 { x_m, y_m }| {
        let is_gap = (y_m - 0.5).abs() < 0.2 || (y_m - 2.5).abs() < 0.3;
        let is_wall = (1.9..2.1).contains(&x_m) && !is_gap;
        if is_wall { Occupancy::Occupied } else { Occupancy::Free }
    });
    let around = path(two_gaps, FAR);
    assert!(around.iter().any(|pose| (pose.x_m - 2.0).abs() < 0.05 && pose.y_m > 2.0));
}

#[test]
fn it_keeps_off_the_walls_where_there_is_room() {
    let nearest_m = path(room((1.0, 0.0), (3.0, 1.0)), FAR)
        .iter()
        .filter(|pose| (1.2..2.8).contains(&pose.x_m))
        .map(|pose| pose.y_m - 1.0)
        .fold(f64::INFINITY, f64::min);
    assert!(nearest_m > 0.35, "{nearest_m} m from the wall");
}

#[test]
fn the_unseen_is_crossed_only_where_there_is_no_seen_way() {
    let middle = |above: Occupancy| {
        drawn(|Point2 { x_m, y_m }| match (1.5..2.5).contains(&x_m) {
            true if y_m < 1.0 => Occupancy::Unknown,
            true => above,
            false => Occupancy::Free,
        })
    };
    let highest_m = |path: &[Pose2]| path.iter().map(|pose| pose.y_m).fold(0.0, f64::max);
    assert!(highest_m(&path(middle(Occupancy::Free), FAR)) > 1.0);
    let through = path(middle(Occupancy::Occupied), FAR);
    assert_eq!(through.last(), Some(&FAR));
    assert!(highest_m(&through) < 1.0);
}

#[test]
fn a_goal_in_a_wall_is_approached() {
    let in_wall = Pose2::new(2.0, 0.5, 1.0);
    let last = *path(room((1.8, 0.0), (2.2, 3.0)), in_wall).last().expect("a path");
    assert!((1.4..1.6).contains(&last.x_m), "{last:?}");
    assert!((last.yaw_rad - 1.0).abs() < 1e-12);
    // Deep in it, there is nothing to approach.
    assert_eq!(path(room((1.8, 0.0), (3.8, 3.0)), Pose2::new(3.0, 1.5, 0.0)), []);
}

#[test]
fn without_a_map_or_a_pose_the_path_is_empty() {
    let mut planning = Planning::new(PlannerSettings::default());
    planning.goal_seen(1.0, Rank::Task, FAR);
    assert_eq!(planning.step(1.0), Some(&[][..]));
    planning.pose_seen(NEAR);
    assert_eq!(planning.step(1.1), Some(&[][..]));
    planning.map_seen(with_gap(0.8));
    planning.goal_seen(1.7, Rank::Task, FAR);
    assert_eq!(end(planning.step(1.7)), Some(FAR));
}

#[test]
fn the_end_of_a_goal_is_published_once() {
    let mut planning = planning(with_gap(0.8));
    assert_eq!(planning.step(0.9), None);
    planning.goal_seen(1.0, Rank::Task, FAR);
    assert_eq!(end(planning.step(1.0)), Some(FAR));
    assert_eq!(end(planning.step(1.5)), Some(FAR), "fresh for half a second");
    assert_eq!(planning.step(1.6), Some(&[][..]));
    assert_eq!(planning.step(1.7), None);
    planning.goal_seen(1.8, Rank::Operator, FAR);
    assert_eq!(end(planning.step(1.8)), Some(FAR));
    planning.forget_goals();
    assert_eq!(planning.step(1.9), Some(&[][..]));
    assert_eq!(planning.step(2.0), None);
}

#[test]
fn the_highest_rank_holds_while_it_is_fresh() {
    let mut planning = planning(with_gap(0.8));
    planning.goal_seen(1.0, Rank::Operator, ASIDE);
    planning.goal_seen(1.2, Rank::Override, THERE);
    planning.goal_seen(1.4, Rank::Task, FAR);
    for (now_s, expected) in [(1.45, ASIDE), (1.55, THERE), (1.75, FAR)] {
        assert_eq!(end(planning.step(now_s)), Some(expected), "at {now_s}");
    }
}

#[test]
fn a_goal_that_is_no_place_is_none() {
    let mut planning = planning(with_gap(0.8));
    planning.goal_seen(1.0, Rank::Task, FAR);
    planning.goal_seen(1.0, Rank::Operator, Pose2 { x_m: f64::NAN, ..THERE });
    assert_eq!(end(planning.step(1.0)), Some(FAR));
}

#[test]
fn a_goal_that_moves_is_followed_immediately_and_one_that_turns_too() {
    let mut planning = planning(with_gap(0.8));
    planning.goal_seen(1.0, Rank::Task, FAR);
    planning.step(1.0);
    planning.goal_seen(1.1, Rank::Task, THERE);
    assert_eq!(end(planning.step(1.1)), Some(THERE));
    let turned = Pose2 { yaw_rad: 2.0, ..THERE };
    planning.goal_seen(1.2, Rank::Task, turned);
    assert_eq!(end(planning.step(1.2)), Some(turned));
}

#[test]
fn a_changed_map_changes_the_way_half_a_second_later_and_a_robot_that_moves_after_one() {
    let mut planning = planning(with_gap(0.8));
    let published = |planning: &mut Planning, now_s: f64| {
        planning.goal_seen(now_s, Rank::Task, FAR);
        planning.step(now_s).expect("a path is published").to_vec()
    };
    let detour = published(&mut planning, 1.0);
    planning.map_seen(drawn(|_| Occupancy::Free));
    assert_eq!(published(&mut planning, 1.4), detour);
    let straight = published(&mut planning, 1.5);
    assert!(length_m(&straight) < length_m(&detour) - 0.5, "{} m", length_m(&straight));
    planning.pose_seen(ASIDE);
    assert_eq!(published(&mut planning, 2.4), straight);
    assert!(published(&mut planning, 2.5)[0].point().distance_m(ASIDE.point()) < 0.05);
}
