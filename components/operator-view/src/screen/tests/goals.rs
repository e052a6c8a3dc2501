//! Goals by the pointer: given, with a heading, refused, reached.

use super::*;

#[test]
fn a_click_on_the_map_is_a_goal_and_a_right_click_deletes_it() {
    let mut window = window();
    stroke(&mut window, PointerButton::Primary, MIDDLE, MIDDLE);
    let commands = take_commands(&mut window);
    let [RobotCommand::Goal { place, .. }] = commands[..] else { panic!("{commands:?}") };
    assert!(place.point().distance_m(Default::default()) < 0.3, "{place:?}");
    let back = place.yaw_rad.abs() - std::f64::consts::PI;
    assert!(back.abs() < 0.5, "it comes from the right: {place:?}");
    window.get_by_label_contains("m away");
    stroke(&mut window, PointerButton::Secondary, MIDDLE, MIDDLE);
    assert_eq!(window.state().console.orders.goal(), None);
    assert_eq!(events(&mut window), [OperatorEvent::Goal]);
}

#[test]
fn a_stroke_is_a_goal_with_a_heading_unless_esc_cancels_it() {
    let mut window = window();
    stroke(&mut window, PointerButton::Primary, MIDDLE, MIDDLE - Vec2::new(0.0, 80.0));
    let commands = take_commands(&mut window);
    let [RobotCommand::Goal { place, .. }] = commands[..] else { panic!("{commands:?}") };
    assert!((place.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 0.01, "upwards: {place:?}");
    window.key_press(Key::Escape);
    window.run_steps(1);
    assert_eq!(window.state().console.orders.goal(), None);
    window.hover_at(MIDDLE);
    button(&mut window, MIDDLE, PointerButton::Primary, true);
    window.hover_at(MIDDLE + Vec2::new(60.0, 0.0));
    window.run_steps(2);
    window.key_press(Key::Escape);
    window.run_steps(1);
    button(&mut window, MIDDLE + Vec2::new(60.0, 0.0), PointerButton::Primary, false);
    assert_eq!(take_commands(&mut window), [], "it was cancelled while it was drawn");
}

#[test]
fn a_click_at_the_cameras_image_sends_the_robot_nowhere() {
    let mut window = window();
    let at = window.get_by_label("no image yet").rect().center();
    stroke(&mut window, PointerButton::Primary, at, at);
    assert_eq!(take_commands(&mut window), []);
}

#[test]
fn the_right_button_moves_the_map_and_sends_the_robot_nowhere() {
    let mut window = window();
    let before = window.state().screen.area.centre();
    stroke(&mut window, PointerButton::Secondary, MIDDLE, MIDDLE + Vec2::new(100.0, 0.0));
    let after = window.state().screen.area.centre();
    assert!(after.x_m < before.x_m - 0.5, "{before:?} {after:?}");
    assert_eq!(take_commands(&mut window), []);
}

#[test]
fn a_goal_that_cannot_be_reached_is_refused_at_the_click_with_its_reason() {
    let mut window = window();
    set_cells(&mut window, |x_m, y_m| match () {
        () if x_m < -3.0 => -1,
        // A closed room around (3, -3).
        () if (x_m - 2.0).abs() < 0.1 || (x_m > 2.0 && (y_m + 2.0).abs() < 0.1) => 100,
        () => 0,
    });
    for (x_m, y_m, why) in [
        (-4.0, 0.0, "this place is unknown"),
        (2.0, 0.0, "there is an obstacle"),
        (3.0, -3.0, "obstacles enclose it"),
        (-6.0, 0.0, "off the map"),
    ] {
        assert_eq!(click_at(&mut window, x_m, y_m), [], "{why}");
        assert!(refusal(&window).contains(why), "{}", refusal(&window));
        let at = window.state().screen.area.on_screen(armor_grid::Point2::new(x_m, y_m));
        assert!(
            painted_texts(&window)
                .iter()
                .any(|(text, place)| { text.contains(why) && place.distance(at) < 400.0 }),
            "{why}: at the place of the click"
        );
    }
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    assert!(window.query_by_label_contains("refused: ").is_none(), "it was accepted");
    assert_eq!(events(&mut window), [OperatorEvent::Goal]);
}

#[test]
fn during_stop_and_before_a_map_a_goal_is_refused_with_the_reason() {
    let mut window = window();
    window.key_press(Key::Space);
    window.run_steps(2);
    take_commands(&mut window);
    assert_eq!(click_at(&mut window, 0.0, -2.0), []);
    assert!(refusal(&window).contains("STOP is active"));
    window.get_by_label("Release").click();
    window.run_steps(2);
    take_commands(&mut window);
    wait(&mut window, 7.0);
    assert!(!shows(&window, "STOP is active"), "it is shown for a while");
    let map = std::mem::take(&mut window.state_mut().console.scene.map);
    window.state_mut().console.scene.map = map.emptied();
    window.run_steps(1);
    assert!(shows(&window, "no map yet: waiting for robot.map"));
    // Screen readers read what is over the map, too.
    window.get_by_label("no map yet: waiting for robot.map");
    assert_eq!(click_at(&mut window, 0.0, -2.0), []);
    assert!(refusal(&window).contains("there is no map yet"));
}

#[test]
fn a_goal_without_a_path_for_a_second_is_reported_at_the_goal_and_in_the_panel() {
    let mut test_screen = test_screen();
    test_screen.console.links.push(InputLink::new("path", "planner.path".into(), false));
    let mut window = window_of(test_screen, SIZE);
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    wait(&mut window, 0.5);
    assert!(!shows(&window, "no path to the goal"));
    wait(&mut window, 1.0);
    window.get_by_label_contains("no path to the goal");
    let count =
        painted_texts(&window).iter().filter(|(text, _)| text.contains("no path to")).count();
    assert_eq!(count, 2, "at the goal and in the panel");
    let state = window.state_mut();
    let goal = Pose2::new(0.0, -2.0, 0.0);
    state.console.scene.set_path([Pose2::IDENTITY, goal].into_iter());
    state.console.record_arrival("path", state.now, 1.0, FIRST, Ok(()));
    window.run_steps(1);
    assert!(!shows(&window, "no path to the goal"));
    window.get_by_label_contains("1 alert");
}

#[test]
fn a_press_and_a_release_within_a_frame_are_a_click() {
    let mut window = window();
    window.hover_at(MIDDLE);
    window.run_steps(1);
    for pressed in [true, false] {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        window.event(Input::PointerButton { pos: MIDDLE, button, pressed, modifiers });
    }
    window.run_steps(2);
    assert_eq!(take_commands(&mut window).len(), 1);
}

#[test]
fn a_reached_goal_is_shown_and_a_cancelled_one_is_not() {
    let mut window = window();
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(!shows(&window, "goal reached"));
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    let alerts = window.state().console.alerts.count_new();
    let state = window.state_mut();
    let pose = Pose2::new(0.0, -2.0, 0.0);
    let located = LocatedPose { stamp_s: 2.0, pose, covariance_m2: [0.0; 3] };
    state.console.scene.set_located(located).unwrap();
    state.console.record_arrival("pose", state.now, 2.0, FIRST, Ok(()));
    window.run_steps(2);
    assert!(shows(&window, "goal reached"));
    assert_eq!(window.state().console.alerts.count_new(), alerts);
    wait(&mut window, 7.0);
    assert!(!shows(&window, "goal reached"));
}

#[test]
fn the_heading_is_shown_while_it_is_drawn() {
    let mut window = window();
    window.hover_at(MIDDLE);
    button(&mut window, MIDDLE, PointerButton::Primary, true);
    window.hover_at(MIDDLE - Vec2::new(0.0, 60.0));
    window.run_steps(2);
    assert!(shows(&window, "heading 90°"));
    button(&mut window, MIDDLE - Vec2::new(0.0, 60.0), PointerButton::Primary, false);
    window.run_steps(1);
    assert!(!shows(&window, "heading"));
}
