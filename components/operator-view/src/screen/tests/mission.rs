//! The mission: its buttons, questions and pauses, and the strip.

use super::*;

#[test]
fn a_button_of_the_mission_is_sent_once_and_shown() {
    let mut test_screen = test_screen();
    test_screen.console.buttons = vec!["explore".into(), "home".into()];
    let mut window = window_of(test_screen, SIZE);
    window.get_by_label("home").click();
    window.run_steps(3);
    assert_eq!(events(&mut window), [OperatorEvent::Pressed("home".into())]);
    wait(&mut window, 4.0);
    window.get_by_label("home: sent 4 s ago");
    assert_eq!(take_commands(&mut window), []);
}

#[test]
fn a_new_question_moves_no_button_and_takes_no_click_that_was_begun_before() {
    use crate::mission::{MissionQuestion, MissionState};

    let mut shown = test_screen();
    shown.console.mission = Some(MissionState::default());
    let mut window = window_of(shown, SIZE);
    let places = |window: &ViewWindow| {
        ["light", "alerts", "STOP"].map(|name| window.get_by_label(name).rect())
    };
    let before = places(&window);
    let question = MissionQuestion {
        transition: "turn-back".into(),
        answer_by_at_s: None,
        unanswered: "decline".into(),
    };
    if let Some(mission) = &mut window.state_mut().console.mission {
        mission.questions.push(question);
    }
    window.run_steps(2);
    assert_eq!(places(&window), before);
    window.get_by_label("Confirm").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [], "it was meant for something else");
    wait(&mut window, 0.6);
    window.get_by_label("Confirm").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window).len(), 1);
}

#[test]
fn a_pause_is_shown_with_what_still_moves() {
    use crate::mission::MissionState;

    let mut shown = test_screen();
    shown.console.mission = Some(MissionState {
        paused_by: "ruth".into(),
        frozen: vec!["explorer".into(), "homing".into()],
        ..MissionState::default()
    });
    let mut window = window_of(shown, SIZE);
    assert!(shows(&window, "PAUSED"));
    assert!(shows(&window, "by ruth: the mission waits (explorer, homing stand still)."));
    assert!(shows(&window, "You can still move the robot: set a goal, or drive by hand."));
    window.get_by_label("Resume").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [], "it has only just appeared");
    wait(&mut window, 0.6);
    window.get_by_label("Resume").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [RobotCommand::Resume]);
}

#[test]
fn a_question_lies_over_the_map_and_not_over_the_camera_image() {
    use crate::mission::{MissionQuestion, MissionState};

    let question = MissionQuestion {
        transition: "turn-back".into(),
        answer_by_at_s: None,
        unanswered: "decline".into(),
    };
    let mut shown = test_screen();
    shown.console.mission = Some(MissionState {
        questions: vec![question],
        paused_by: "ruth".into(),
        ..MissionState::default()
    });
    let mut window = window_of(shown, SIZE);
    window.run_steps(2);
    let image = window.get_by_role(Role::Image).rect();
    for label in ["The mission asks:", "turn-back?", "Confirm", "Decline", "Resume", "PAUSED"] {
        let rect = window.get_by_label(label).rect();
        assert!(!rect.intersects(image), "{label} at {rect:?} covers the image at {image:?}");
    }
    let text = window.get_by_label("turn-back?").rect();
    assert!(text.height() > 25.0, "it can be read from some distance: {text:?}");
}

#[test]
fn the_strip_shows_robot_mission_questions_and_battery() {
    use crate::mission::{MissionQuestion, MissionState};
    use crate::readings::BatteryReading;

    let mut test_screen = test_screen();
    let question = MissionQuestion {
        transition: "turn-back".into(),
        answer_by_at_s: Some(80.0),
        unanswered: "decline".into(),
    };
    test_screen.console.robot_name = "rover".into();
    test_screen.console.mission = Some(MissionState {
        name: "survey".into(),
        stage: "playing".into(),
        now_at_s: 61.0,
        is_running: true,
        places: vec!["explore".into(), "watch".into()],
        questions: vec![question],
        received_s: 1.0,
        ..MissionState::default()
    });
    let charge = Some(0.15);
    let battery = BatteryReading { charge, volts: None, is_charging: false };
    test_screen.console.readings.store(battery);
    let mut window = window_of(test_screen, SIZE);
    wait(&mut window, 4.0);
    for text in ["rover", "connected", "explore, watch", "survey 1:05"] {
        window.get_by_label_contains(text);
    }
    window.get_by_label_contains("turn-back? (decline in 15 s)");
    window.get_by_role_and_label(Role::ProgressIndicator, "battery 15 %");
    window.get_by_label("Decline").click();
    window.run_steps(2);
    let transition = "turn-back".to_owned();
    let answer = RobotCommand::Answer { transition, is_confirmed: false };
    assert_eq!(take_commands(&mut window), [answer]);
}
