//! Drawn maps and what shall be decided on them.

use super::*;
use crate::drawing::MapDrawing;

const SETTINGS: ExplorerSettings = ExplorerSettings {
    clearance_m: 0.15,
    min_frontier_m: 0.3,
    underfoot_m: 0.0,
    setback_m: 0.1,
    worth_m_per_m2: 1.0,
    least_yield_m2_per_m: 0.0,
    turn_m_per_rad: 0.0,
    switch_gain_m: 1.5,
    patience_s: 8.0,
    look_s: 2.0,
    confirm_s: 2.0,
};

fn begin(rows: &[&str]) -> (Exploration, MapDrawing) {
    let drawing = MapDrawing::read(0.1, rows);
    let mut exploration = Exploration::new(SETTINGS);
    let robot = drawing.robot.expect("the drawing has a robot");
    exploration.map_seen(drawing.map.clone());
    exploration.pose_seen(Pose2::new(robot.x_m, robot.y_m, 0.0));
    (exploration, drawing)
}

/// Runs until the confirmation time is over; a drawn `G` is where the goal must be (0.25 m).
fn check(rows: &[&str]) {
    let (mut exploration, drawing) = begin(rows);
    let first = exploration.step(0.0);
    match (first, drawing.goal) {
        (ExplorerDecision::Goto(goal), Some(expected)) => {
            let off_m = goal.point().distance_m(expected);
            assert!(off_m <= 0.25, "{off_m:.2} m off: {goal:?}\n{rows:#?}");
        }
        (ExplorerDecision::Wait, None) => {
            assert_eq!(exploration.step(2.1), ExplorerDecision::Done, "{rows:#?}");
        }
        _ => panic!("{first:?} for {rows:#?}"),
    }
}

#[test]
fn it_goes_to_the_open_side_and_stays_inside() {
    check(&[
        "##################",
        "#..............???",
        "#..............???",
        "#...R........G.???",
        "#..............???",
        "#..............???",
        "##################",
    ]);
}

#[test]
fn the_explored_share_compares_the_seen_with_what_the_frontiers_promise() {
    let open = [
        "##################",
        "#..............???",
        "#..............???",
        "#...R..........???",
        "#..............???",
        "#..............???",
        "##################",
    ];
    let (mut exploration, drawing) = begin(&open);
    assert_eq!((exploration.explored_share(), exploration.goal_distance_m()), (None, None));
    let ExplorerDecision::Goto(goal) = exploration.step(0.0) else { panic!("it is open") };
    let share = exploration.explored_share().expect("there is a map");
    assert!((0.02..0.9).contains(&share), "{share}");
    let off_m = goal.point().distance_m(drawing.robot.expect("the drawing has a robot"));
    assert_eq!(exploration.goal_distance_m(), Some(off_m));

    let closed = ["########", "#......#", "#......#", "#..R...#", "#......#", "########"];
    let (mut exploration, _) = begin(&closed);
    exploration.step(0.0);
    assert_eq!((exploration.explored_share(), exploration.goal_distance_m()), (Some(1.0), None));
}

#[test]
fn a_closed_room_is_done() {
    check(&["########", "#......#", "#......#", "#..R...#", "#......#", "########"]);
}

#[test]
fn a_gap_that_the_map_has_closed_behind_the_robot_is_passed() {
    let rows = [
        "####################",
        "#........#.......???",
        "#........#.......???",
        "#........#.......???",
        "#................???",
        "#...R............???",
        "#................???",
        "#........#.......???",
        "#........#.......???",
        "#........#.......???",
        "####################",
    ];
    let drawing = MapDrawing::read(0.1, &rows);
    let robot = drawing.robot.expect("the drawing has a robot");
    let there = Pose2::new(robot.x_m, robot.y_m, 0.0);
    let beyond = Pose2::new(robot.x_m + 0.9, robot.y_m, 0.0);
    for (start, is_passed) in [(there, false), (beyond, true)] {
        let mut exploration = Exploration::new(ExplorerSettings { clearance_m: 0.25, ..SETTINGS });
        exploration.map_seen(drawing.map.clone());
        exploration.pose_seen(start);
        exploration.pose_seen(there);
        let decision = exploration.step(0.0);
        assert_eq!(
            matches!(decision, ExplorerDecision::Goto(_)),
            is_passed,
            "{decision:?} from {start:?}"
        );
    }
}

#[test]
fn a_gap_too_narrow_is_not_reachable() {
    check(&[
        "#################",
        "#.......#........",
        "#.......#.....???",
        "#.......#.....???",
        "#..R..........???",
        "#.......#.....???",
        "#.......#.....???",
        "#################",
    ]);
}

#[test]
fn a_door_is_passed() {
    check(&[
        "#################",
        "#.......#.....???",
        "#.............???",
        "#...........G.???",
        "#..R..........???",
        "#.............???",
        "#.......#.....???",
        "#################",
    ]);
}

#[test]
fn the_near_one_comes_first_if_sizes_are_alike() {
    check(&[
        "##########################",
        "??.....................???",
        "??.....................???",
        "??.G....R..............???",
        "??.....................???",
        "??.....................???",
        "##########################",
    ]);
}

#[test]
fn the_larger_unseen_space_is_worth_a_detour() {
    check(&[
        "??###################",
        "??..................#",
        "??..................#",
        "??................###",
        "??................?##",
        "??.G.......R......?##",
        "??................?##",
        "??................?##",
        "??................###",
        "??..................#",
        "??###################",
    ]);
}

#[test]
fn a_shadow_is_worth_no_long_way_but_an_open_end_is_worth_any() {
    let far = ".".repeat(70);
    for (end, is_worth_it) in [(["??", "??", "??", "??"], true), (["##", "##", "?#", "##"], false)]
    {
        let wall = "#".repeat(75);
        let row = |first: &str, end: &str| format!("#{first}{far}.{end}");
        let middle = [row(".", end[0]), row("R", end[1]), row(".", end[2]), row(".", end[3])];
        let mut rows = vec![wall.as_str()];
        rows.extend(middle.iter().map(String::as_str));
        rows.push(&wall);
        // 35 m of corridor.
        let drawing = MapDrawing::read(0.5, &rows);
        let mut exploration = Exploration::new(ExplorerSettings {
            least_yield_m2_per_m: 0.2,
            min_frontier_m: 0.5,
            ..SETTINGS
        });
        let robot = drawing.robot.expect("the drawing has a robot");
        exploration.map_seen(drawing.map);
        exploration.pose_seen(Pose2::new(robot.x_m, robot.y_m, 0.0));
        let goes = matches!(exploration.step(0.0), ExplorerDecision::Goto(_));
        assert_eq!(goes, is_worth_it, "{rows:#?}");
    }
}

#[test]
fn what_lies_ahead_comes_before_what_lies_behind() {
    let (mut exploration, drawing) = begin(&TWO_WAYS);
    exploration.settings.turn_m_per_rad = 0.5;
    let robot = drawing.robot.expect("drawn");
    for (yaw_rad, is_left) in [(0.0, false), (3.0, true)] {
        exploration.pursuit = None;
        exploration.pose_seen(Pose2::new(robot.x_m, robot.y_m, yaw_rad));
        let chosen = goal(&mut exploration, 10.0 * (1.0 + yaw_rad));
        assert_eq!(chosen.x_m < robot.x_m, is_left, "{chosen:?}");
    }
}

#[test]
fn what_is_seen_by_the_first_step_is_no_goal() {
    let rows = ["########", "#......#", "#......#", "#..?R..#", "#..?...#", "#......#", "########"];
    let (mut exploration, _) = begin(&rows);
    assert!(matches!(exploration.step(0.0), ExplorerDecision::Goto(_)));
    let (mut exploration, _) = begin(&rows);
    exploration.settings.underfoot_m = 0.6;
    assert_eq!(exploration.step(0.0), ExplorerDecision::Wait);
}

#[test]
fn a_frontier_behind_a_thin_wall_is_not_mistaken_for_near() {
    check(&[
        "###########",
        "#.......#.?",
        "#.......#.?",
        "#....R..#.?",
        "#.......#.?",
        "#.......#.?",
        "###########",
    ]);
}

#[test]
fn without_map_or_pose_it_waits() {
    let mut exploration = Exploration::new(SETTINGS);
    assert_eq!(exploration.step(0.0), ExplorerDecision::Wait);
    exploration.pose_seen(Pose2::IDENTITY);
    assert_eq!(exploration.step(100.0), ExplorerDecision::Wait);
    exploration.map_seen(MapDrawing::read(0.1, &["???", "???"]).map);
    assert_eq!(exploration.step(200.0), ExplorerDecision::Wait);
    assert_eq!(exploration.step(300.0), ExplorerDecision::Wait);
}

const TWO_WAYS: [&str; 7] = [
    "##########################",
    "??.....................???",
    "??.....................???",
    "??.........R...........???",
    "??.....................???",
    "??.....................???",
    "##########################",
];

fn goal(exploration: &mut Exploration, now_s: f64) -> Pose2 {
    match exploration.step(now_s) {
        ExplorerDecision::Goto(goal) => goal,
        other => panic!("no goal but {other:?} at {now_s} s"),
    }
}

#[test]
fn it_does_not_flip_between_two_goals_that_are_alike() {
    let (mut exploration, drawing) = begin(&TWO_WAYS);
    let robot = drawing.robot.expect("drawn");
    let first = goal(&mut exploration, 0.0);
    for second in 1..6 {
        // Drifts away from the goal, to where the other one is a little nearer.
        let aside_m = 0.08 * f64::from(second);
        exploration.pose_seen(Pose2::new(robot.x_m + aside_m, robot.y_m, 0.0));
        exploration.map_seen(drawing.map.clone());
        let kept = goal(&mut exploration, f64::from(second));
        assert!(kept.point().distance_m(first.point()) < 0.3, "flipped to {kept:?}");
    }
}

#[test]
fn a_goal_that_comes_underfoot_stays_until_it_is_seen() {
    let (mut exploration, drawing) = begin(&TWO_WAYS);
    exploration.settings.underfoot_m = 0.6;
    let first = goal(&mut exploration, 0.0);
    // Close by, the frontier is still unseen: the robot has its back to it.
    exploration.pose_seen(Pose2::new(first.x_m + 0.3, first.y_m, 0.0));
    exploration.map_seen(drawing.map);
    let kept = goal(&mut exploration, 1.0);
    assert!(kept.point().distance_m(first.point()) < 0.3, "left for {kept:?}");
}

#[test]
fn a_goal_without_progress_is_given_up_for_another() {
    let (mut exploration, drawing) = begin(&TWO_WAYS);
    let first = goal(&mut exploration, 0.0);
    for now_s in [2.0, 4.0, 6.0, 7.9] {
        assert_eq!(goal(&mut exploration, now_s), first);
    }
    let second = goal(&mut exploration, 8.1);
    assert!(second.point().distance_m(first.point()) > 1.0, "still {second:?}");
    let mut now_s = 8.1;
    while exploration.step(now_s) != ExplorerDecision::Done {
        now_s += 0.5;
        exploration.map_seen(drawing.map.clone());
        assert!(now_s < 60.0, "never done");
    }
}

#[test]
fn a_frontier_that_stays_though_looked_at_is_given_up_soon() {
    let (mut exploration, _) = begin(&TWO_WAYS);
    let first = goal(&mut exploration, 0.0);
    exploration.pose_seen(first);
    assert_eq!(goal(&mut exploration, 1.0), first);
    assert_eq!(goal(&mut exploration, 2.5), first);
    let second = goal(&mut exploration, 3.1);
    assert!(second.point().distance_m(first.point()) > 1.0, "still {second:?}");
}

#[test]
fn a_frontier_that_comes_back_ends_the_confirmation() {
    let (mut exploration, _) = begin(&["######", "#....#", "#..R.#", "#....#", "######"]);
    assert_eq!(exploration.step(0.0), ExplorerDecision::Wait);
    let opened = ["######", "#....?", "#..R.?", "#....?", "######"];
    exploration.map_seen(MapDrawing::read(0.1, &opened).map);
    assert!(matches!(exploration.step(1.5), ExplorerDecision::Goto(_)));
    assert!(matches!(exploration.step(2.5), ExplorerDecision::Goto(_)));
}
