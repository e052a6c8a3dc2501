//! What is painted, and its names and sizes.

use super::*;

#[test]
fn only_linked_inputs_appear_and_missing_data_are_marked() {
    let mut window = window();
    window.get_by_role_and_label(Role::CheckBox, "scan");
    assert!(window.query_by_label("particles").is_none());
    window.get_by_label_contains("no data yet: image").click();
    window.run_steps(2);
    window.get_by_label("none yet");
    window.get_by_label("no image yet");
    wait(&mut window, 7.0);
    assert!(window.query_all_by_label("7.0 s").count() >= 2, "scan and pose");
}

#[test]
fn an_image_error_is_shown_in_its_place() {
    let mut window = window();
    let broken = crate::photo::decode_photo("jpeg", b"no").expect_err("no image");
    let now = window.state().now;
    window.state_mut().console.record_arrival(
        "image",
        now,
        1.0,
        FIRST,
        Err(SceneError::Photo(broken)),
    );
    window.run_steps(1);
    window.get_by_label_contains("the image is no JPEG");
}

#[test]
fn a_layer_that_is_switched_off_is_not_painted() {
    let is_scan = |shape: &&ClippedShape| matches!(&shape.shape, Shape::Mesh(mesh) if mesh.vertices.len() == 4 * 30);
    let painted = |window: &ViewWindow| window.output().shapes.iter().filter(is_scan).count();
    let mut window = window();
    let points = vec![armor_grid::Point2::new(1.0, 1.0); 30];
    window.state_mut().console.scene.scan.points = points;
    window.run_steps(1);
    assert_eq!(painted(&window), 1);
    window.get_by_role_and_label(Role::CheckBox, "scan").click();
    window.run_steps(2);
    assert_eq!(painted(&window), 0);
}

#[test]
fn nothing_is_repainted_without_a_change() {
    let mut test_screen = test_screen();
    test_screen.console.links.retain(|link| !link.is_steady);
    let mut window = window_of(test_screen, SIZE);
    window.run_steps(2);
    let delay = window.output().viewport_output.values().map(|out| out.repaint_delay).min();
    assert_eq!(delay, Some(std::time::Duration::MAX));
}

#[test]
fn alerts_are_listed_with_their_time_until_they_are_acknowledged_and_escape_closes_the_list() {
    let mut window = window();
    wait(&mut window, 10.0);
    let place = window.get_by_label("STOP").rect();
    window.get_by_label_contains("2 alerts").click();
    window.run_steps(2);
    assert_eq!(window.get_by_label("STOP").rect(), place, "it has one place");
    wait(&mut window, 5.0);
    assert!(shows(&window, "no data at scan") && shows(&window, "0:05 ago"));
    window.get_by_label("Acknowledge all").click();
    window.run_steps(2);
    assert_eq!(window.state().console.alerts.count_new(), 0);
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(!shows(&window, "no data at scan"), "closed");
    assert!(window.state().console.orders.goal().is_some(), "it was meant for the list");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(window.state().console.orders.goal().is_none());
}

#[test]
fn the_image_is_moved_by_dragging_and_large_after_a_click() {
    let mut window = window();
    let before = window.get_by_label("no image yet").rect();
    let by = Vec2::new(-150.0, 120.0);
    stroke(&mut window, PointerButton::Primary, before.center(), before.center() + by);
    let moved = window.get_by_label("no image yet").rect();
    assert!(moved.center().distance(before.center() + by) < 20.0, "{before:?} {moved:?}");
    stroke(&mut window, PointerButton::Primary, moved.center(), moved.center());
    window.run_steps(2);
    let large = window.get_by_label("no image yet").rect();
    assert!(large.width() > 1.8 * moved.width(), "{moved:?} {large:?}");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert_eq!(window.get_by_label("no image yet").rect(), moved);
    assert_eq!(take_commands(&mut window), []);
}

#[test]
fn the_theme_changes_by_a_button() {
    let mut window = window();
    window.get_by_label("light").click();
    window.run_steps(3);
    assert!(!window.ctx.global_style().visuals.dark_mode);
    window.get_by_label("dark").click();
    window.run_steps(3);
    assert!(window.ctx.global_style().visuals.dark_mode);
}

#[test]
fn what_can_be_operated_has_a_name_for_screen_readers() {
    let mut test_screen = test_screen();
    test_screen.console.buttons = vec!["explore".into()];
    let mut window = window_of(test_screen, Vec2::new(1000.0, 1400.0));
    window.get_by_label("area of the map");
    window.get_by_label("keys and pointer").click();
    window.run_steps(2);
    window.get_by_label_contains("Space: STOP");
    for role in [Role::Button, Role::CheckBox] {
        for node in window.query_all_by_role(role) {
            let name = node.accesskit_node().label().unwrap_or_default();
            assert!(name.chars().any(char::is_alphabetic), "`{name}` at {:?}", node.rect());
        }
    }
}

#[test]
fn what_is_touched_is_large_enough_and_no_text_is_small() {
    let mut test_screen = test_screen();
    test_screen.console.buttons = vec!["explore".into(), "home".into()];
    test_screen.console.frame_seen("map");
    let mut window = window_of(test_screen, Vec2::new(1000.0, 1400.0));
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    window.key_press(Key::Space);
    window.get_by_label("alerts").click();
    window.run_steps(3);
    for role in [Role::Button, Role::CheckBox] {
        for node in window.query_all_by_role(role) {
            let (rect, name) = (node.rect(), node.accesskit_node().label().unwrap_or_default());
            let least = theme::TOUCH - 0.01;
            assert!(rect.height() >= least && rect.width() >= least, "{name}: {rect:?}");
        }
    }
    fn check(shape: &Shape) {
        match shape {
            Shape::Text(text) => {
                for section in &text.galley.job.sections {
                    let size = section.format.font_id.size;
                    assert!(size >= 11.0, "{size}: {}", text.galley.text());
                }
            }
            Shape::Vec(shapes) => shapes.iter().for_each(check),
            _ => {}
        }
    }
    window.output().shapes.iter().for_each(|shape| check(&shape.shape));
}
