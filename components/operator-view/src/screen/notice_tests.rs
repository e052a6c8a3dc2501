//! What the notices and panels state while a run ends, while orders reach nothing, and after a
//! button of the mission.

use armor_grid::Pose2;
use eframe::egui::Vec2;
use egui_kittest::kittest::Queryable;

use super::tests::{ViewWindow, shows, test_screen, wait, window_of};
use super::*;
use crate::connection::{CUT, RunEnd};
use crate::links::SequenceNumber;
use crate::mission::MissionState;

const SIZE: Vec2 = Vec2::new(1000.0, 700.0);

fn mission(stage: &str, places: &[&str]) -> MissionState {
    MissionState {
        name: "survey".into(),
        stage: stage.into(),
        places: places.iter().map(|place| (*place).to_owned()).collect(),
        ..MissionState::default()
    }
}

fn set_goal(window: &mut ViewWindow) {
    let order = OperatorOrder::Goal { place: Pose2::new(2.0, 1.0, 0.0), has_heading: false };
    window.state_mut().console.orders.handle_order(order, 1.0);
}

/// Data of this number arrive at all inputs.
fn receive_everywhere(window: &mut ViewWindow, sequence: u64) {
    let now = window.state().now;
    let number = SequenceNumber { instance: 1, sequence };
    for input in ["scan", "pose", "image", "map"] {
        window.state_mut().console.record_arrival(input, now, now.system_s, number, Ok(()));
    }
    window.run_steps(2);
}

#[test]
fn the_end_of_a_mission_is_no_alarm() {
    let mut window = window_of(test_screen(), SIZE);
    let now = window.state().now;
    let console = &mut window.state_mut().console;
    console.set_mission(mission("stopping", &["over"]), now);
    assert!(console.mission.as_ref().is_some_and(MissionState::is_over));
    console.await_end("rover", now);
    window.run_steps(2);
    assert!(shows(&window, "rover is ending") && shows(&window, "stopping"));
    assert!(!shows(&window, "may be moving") && !shows(&window, "connection lost"));
    wait(&mut window, 3.0);
    window.state_mut().console.watch_conditions(now);
    assert_eq!(window.state().console.alerts.count_new(), 0);
    // One that does not end is lost, as any other.
    let now = window.state().now;
    window.state_mut().console.cut_connection("rover", "it does not end", now);
    window.run_steps(2);
    assert!(shows(&window, CUT) && shows(&window, "may be moving"));
    let end = RunEnd { why: "it was interrupted".into(), is_normal: true };
    window.state_mut().console.end_system("rover", end, now);
    window.run_steps(2);
    assert!(shows(&window, "rover has ended:") && !shows(&window, "stopping"));
}

#[test]
fn a_mission_that_is_played_is_not_over() {
    assert!(!mission("playing", &[]).is_over() && !mission("paused", &[]).is_over());
}

#[test]
fn a_goal_cannot_be_cancelled_after_the_end() {
    let mut window = window_of(test_screen(), SIZE);
    set_goal(&mut window);
    let now = window.state().now;
    let end = RunEnd { why: "it was interrupted".into(), is_normal: true };
    window.state_mut().console.end_system("rover", end, now);
    window.run_steps(2);
    window.get_by_label("cancel").click();
    window.run_steps(2);
    assert!(window.state().console.orders.goal().is_some(), "it is disabled");
}

#[test]
fn a_goal_that_nothing_receives_is_stated_as_such() {
    let mut window = window_of(test_screen(), SIZE);
    set_goal(&mut window);
    window.state_mut().console.record_delivery("goal", 0);
    window.state_mut().now.host_s = 2.0;
    window.run_steps(2);
    assert!(shows(&window, "no goal here: nothing receives goals"), "at the click");
    assert!(window.state().console.orders.goal().is_none(), "it would be driven to later");
    // One that was received stays while its subscriber is started again.
    set_goal(&mut window);
    window.state_mut().console.record_delivery("goal", 1);
    let repeated = window.state_mut().console.orders.repeat_order(10.0);
    assert!(repeated.is_some());
    window.state_mut().console.record_delivery("goal", 0);
    window.run_steps(2);
    assert!(shows(&window, "nothing receives the goal"));
    window.state_mut().console.record_delivery("goal", 1);
    window.run_steps(2);
    assert!(!shows(&window, "nothing receives the goal"));
}

#[test]
fn a_pause_does_not_contradict_stop() {
    let mut shown = test_screen();
    shown.console.mission =
        Some(MissionState { paused_by: "ruth".into(), ..mission("paused", &[]) });
    shown.console.orders.handle_order(OperatorOrder::Stop, 1.0);
    let window = window_of(shown, SIZE);
    assert!(shows(&window, "PAUSED") && shows(&window, "by ruth: the mission waits."));
    assert!(!shows(&window, "still move"));
}

#[test]
fn losses_are_in_the_line_of_all_links_for_some_seconds() {
    let mut window = window_of(test_screen(), SIZE);
    assert!(shows(&window, "4 links, no data yet: image"));
    receive_everywhere(&mut window, 4);
    assert!(shows(&window, "! data are lost: "));
    window.state_mut().now.host_s += 10.5;
    receive_everywhere(&mut window, 5);
    assert!(shows(&window, "links: all 4 fine"));
}

#[test]
fn what_followed_a_button_is_shown() {
    let mut shown = test_screen();
    shown.console.buttons = vec!["home".into()];
    let now = shown.now;
    shown.console.set_mission(mission("playing", &["by-hand"]), now);
    shown.console.orders.handle_order(OperatorOrder::Press("home".into()), now.host_s);
    shown.console.set_mission(mission("playing", &["return"]), now);
    shown.console.set_mission(mission("playing", &["by-hand"]), now);
    shown.console.set_mission(mission("playing", &["by-hand"]), now);
    let window = window_of(shown, SIZE);
    assert!(shows(&window, "the mission went to return, then by-hand"));
}

#[test]
fn a_button_that_has_no_effect_is_an_alert_with_the_reason() {
    for (cause, reason) in [
        ("homing.frame_changed", Some("homing knows no place on a map with a new origin")),
        ("homing.failed", Some("homing reports failed")),
        ("lost", Some("lost has fired")),
        ("view.driving", None),
    ] {
        let mut shown = test_screen();
        shown.console.buttons = vec!["home".into()];
        let now = shown.now;
        let console = &mut shown.console;
        console.set_mission(mission("playing", &["by-hand"]), now);
        console.handle_order(OperatorOrder::Press("home".into()), now);
        console.set_mission(mission("playing", &["return"]), now);
        assert_eq!(console.alerts.count_new(), 0, "{cause}: it may arrive");
        let back = MissionState { last_cause: cause.into(), ..mission("playing", &["by-hand"]) };
        console.set_mission(back.clone(), now);
        console.set_mission(back, now);
        let texts: Vec<_> = console.alerts.newest_first().map(|it| it.text.clone()).collect();
        let expected = reason
            .map(|reason| format!("home was refused: {reason}; the mission is in by-hand again"));
        assert_eq!(texts, expected.into_iter().collect::<Vec<_>>(), "{cause}");
    }
}

#[test]
fn a_new_origin_cannot_be_acknowledged_after_the_end() {
    let mut window = window_of(test_screen(), SIZE);
    let now = window.state().now;
    let console = &mut window.state_mut().console;
    console.frame_seen("map");
    console.frame_seen("map#1");
    window.run_steps(2);
    assert!(shows(&window, "Acknowledge"));
    let end = RunEnd { why: "it was interrupted".into(), is_normal: true };
    let console = &mut window.state_mut().console;
    console.end_system("rover", end, now);
    console.handle_order(OperatorOrder::Acknowledge, now);
    assert!(console.orders.is_frame_new(), "a run that has ended takes no orders");
    window.run_steps(2);
    assert!(!shows(&window, "Acknowledge") && !shows(&window, "new origin"));
}

#[test]
fn changes_long_after_a_button_are_not_its_own() {
    let mut shown = test_screen();
    shown.console.orders.handle_order(OperatorOrder::Press("home".into()), 1.0);
    shown.console.orders.follow_button(&["return".into()], 12.0);
    assert!(shown.console.orders.followed_button().is_empty());
}
