//! Driving by keys and stick.

use super::*;

#[test]
fn held_keys_drive_and_a_released_key_sends_zero_once() {
    let mut window = window();
    window.key_down(Key::W);
    window.key_down(Key::ArrowLeft);
    window.run_steps(1);
    let fast = RobotCommand::Velocity { forward_mps: 0.5, turn_radps: 1.0 };
    assert_eq!(take_commands(&mut window).last(), Some(&fast), "both keys together");
    wait(&mut window, 0.06);
    assert_eq!(take_commands(&mut window), [fast], "sent again while they are held");
    window.key_up(Key::ArrowLeft);
    window.run_steps(1);
    assert_eq!(
        take_commands(&mut window),
        [RobotCommand::Velocity { forward_mps: 0.5, turn_radps: 0.0 }]
    );
    window.key_up(Key::W);
    window.run_steps(1);
    assert_eq!(take_commands(&mut window), [ZERO]);
    wait(&mut window, 1.0);
    assert_eq!(take_commands(&mut window), []);
    assert_eq!(events(&mut window), [OperatorEvent::Driving]);
}

#[test]
fn a_window_that_loses_the_focus_stops_driving() {
    let mut window = window();
    window.key_down(Key::S);
    window.run_steps(1);
    assert_eq!(
        take_commands(&mut window),
        [RobotCommand::Velocity { forward_mps: -0.5, turn_radps: 0.0 }]
    );
    window.event(Input::WindowFocused(false));
    window.input_mut().focused = false;
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [ZERO]);
}

#[test]
fn the_stick_drives_while_it_is_held_and_not_during_stop() {
    let mut window = window();
    let pad = window.get_by_label("stick").rect();
    let up = pad.center() - Vec2::new(0.0, 200.0);
    window.hover_at(pad.center());
    window.run_steps(1);
    button(&mut window, pad.center(), PointerButton::Primary, true);
    window.hover_at(up);
    window.run_steps(2);
    let last = take_commands(&mut window).pop();
    assert_eq!(last, Some(RobotCommand::Velocity { forward_mps: 0.5, turn_radps: 0.0 }));
    window.key_press(Key::Space);
    wait(&mut window, 0.1);
    assert_eq!(take_commands(&mut window), [RobotCommand::Stop(true), ZERO]);
    wait(&mut window, 0.1);
    assert_eq!(take_commands(&mut window), [], "the stick is still held, without effect");
    button(&mut window, up, PointerButton::Primary, false);
    assert_eq!(take_commands(&mut window), []);
}
