//! The window at each scale that a system sets.

use super::*;

/// The window of a small laptop at each scale that a system sets: as many points, and more pixels.
#[test]
fn the_map_and_the_main_buttons_have_their_place_at_each_scale_of_the_system() {
    for scale in [1.0, 1.5, 2.0, 3.0] {
        let mut test_screen = test_screen();
        test_screen.console.buttons = vec!["explore".into(), "home".into()];
        let mut window = window_of(test_screen, Vec2::new(1280.0, 800.0));
        let viewport =
            window.input_mut().viewports.entry(eframe::egui::ViewportId::ROOT).or_default();
        viewport.native_pixels_per_point = Some(scale);
        window.run_steps(3);
        assert_eq!(window.ctx.pixels_per_point(), scale);
        let whole = window.ctx.content_rect();
        let share = window.state().screen.area.place().intersect(whole).area() / whole.area();
        assert!(share >= 0.5, "the map at {scale}: {share}");
        for name in ["STOP", "explore", "home"] {
            let rect = window.get_by_label(name).rect();
            assert!(whole.contains_rect(rect), "{name} at {scale}: {rect:?}");
        }
    }
}
