//! STOP and its release.

use super::*;

#[test]
fn stop_is_sent_immediately_and_stays_until_release_is_clicked() {
    let mut window = window();
    assert!(window.query_by_label("Release").is_none(), "there is nothing to release");
    window.get_by_label("STOP").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [RobotCommand::Stop(true)]);
    window.get_by_label("STOP sent");
    window.get_by_label("STOP").click();
    window.run_steps(2);
    assert_eq!(
        take_commands(&mut window),
        [RobotCommand::Stop(true)],
        "a second click does not release"
    );
    window.get_by_label("Release").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [RobotCommand::Stop(false)]);
    assert_eq!(events(&mut window), [OperatorEvent::Stopped, OperatorEvent::Released]);
}

#[test]
fn space_stops_whatever_has_the_focus_and_never_releases() {
    let mut window = window();
    window.key_press(Key::Space);
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [RobotCommand::Stop(true)]);
    window.get_by_label("Release").focus();
    window.run_steps(1);
    window.key_press(Key::Space);
    window.key_press_modifiers(Modifiers::SHIFT, Key::Space);
    window.run_steps(2);
    assert!(window.state().console.orders.is_stopped());
    assert!(!take_commands(&mut window).contains(&RobotCommand::Stop(false)));
}

#[test]
fn on_a_small_screen_stop_and_release_are_visible() {
    let mut window = window_of(test_screen(), Vec2::new(560.0, 360.0));
    window.key_press(Key::Space);
    window.run_steps(2);
    for name in ["STOP", "Release"] {
        let rect = window.get_by_label(name).rect();
        assert!(rect.min.y > 0.0 && rect.max.y < 300.0 && rect.max.x <= 560.0, "{name}: {rect:?}");
    }
}

#[test]
fn stopped_is_a_banner_over_the_map_and_release_is_far_from_stop() {
    let mut window = window();
    window.key_press(Key::Space);
    window.run_steps(2);
    let banner = window.get_by_label("STOP sent").rect();
    let map = window.state().screen.area.place();
    assert!(map.contains_rect(banner), "{banner:?}");
    let (stop, release) =
        (window.get_by_label("STOP").rect(), window.get_by_label("Release").rect());
    assert!(map.contains_rect(release) && !map.intersects(stop));
    assert!(release.distance_to_pos(stop.center()) > 150.0, "{stop:?} {release:?}");
    assert!(theme::contrast(theme::STOP, theme::RELEASE) > 1.0 && theme::STOP != theme::RELEASE);
}

#[test]
fn without_a_connection_stop_is_kept_and_the_screen_shows_that_the_robot_may_move() {
    let mut window = window();
    let now = window.state().now;
    let hint = "view is given up; `armor restart view` starts it again";
    window.state_mut().console.cut_connection("rover", hint, now);
    window.run_steps(2);
    let lost = "the connection to the robot's screen component is lost; the robot may be moving";
    for text in [lost, hint, "OLD"] {
        assert!(shows(&window, text), "{text}");
    }
    assert!(!shows(&window, "ended"), "that is not known");
    window.key_press(Key::Space);
    window.run_steps(1);
    // Nothing confirms it.
    window.state_mut().console.stop.begin_again(2.0);
    window.run_steps(1);
    assert!(shows(&window, "STOP not delivered: the robot may be moving"));
    assert!(window.query_by_label("Release").is_none());
    let state = window.state_mut();
    state.console.connection = SystemConnection::Live { system: "rover".into() };
    state.console.record_stop(true, 1, state.now);
    window.run_steps(2);
    assert!(shows(&window, "STOP sent") && !shows(&window, "STOP not delivered"));
    window.get_by_label("Release");
}

#[test]
fn the_robot_stands_only_when_its_data_show_it() {
    let mut shown = test_screen();
    shown.console.links.push(InputLink::new("odometry", "base.odometry".into(), true));
    let mut window = window_of(shown, SIZE);
    window.key_press(Key::Space);
    window.run_steps(2);
    assert!(!shows(&window, "STOPPED"));
    let mut sequence = 0;
    let mut measure = |window: &mut ViewWindow, mps: f64| {
        sequence += 1;
        let state = window.state_mut();
        state.console.scene.velocity = Some((mps, 0.0));
        let number = SequenceNumber { instance: 1, sequence };
        state.console.record_arrival("odometry", state.now, 1.0, number, Ok(()));
        window.run_steps(2);
    };
    measure(&mut window, 0.25);
    assert!(shows(&window, "STOP sent") && shows(&window, "the robot still moves: 0.25 m/s"));
    measure(&mut window, 0.0);
    assert!(shows(&window, "STOPPED") && shows(&window, "the robot stands"));
    wait(&mut window, 9.0);
    assert!(shows(&window, "STOP sent") && shows(&window, "the data are old"));
}

#[test]
fn the_banner_of_stop_shows_with_what_release_continues() {
    let mut shown = test_screen();
    shown.console.buttons = vec!["explore".into()];
    let mut window = window_of(shown, SIZE);
    window.key_press(Key::Space);
    window.run_steps(2);
    assert!(!shows(&window, "the robot continues"));
    window.get_by_label("explore").click();
    window.run_steps(2);
    assert!(shows(&window, "Release: the robot continues with explore"));
    window.get_by_label("Release").click();
    window.run_steps(2);
    window.key_press(Key::Space);
    window.run_steps(2);
    assert!(!shows(&window, "the robot continues"), "that was the STOP before");
}
