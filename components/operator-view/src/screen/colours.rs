//! Colours of the screen. No information is in a colour alone: a word or a shape repeats it.

use eframe::egui::{Color32, Context, CornerRadius, Theme, ThemePreference, vec2};

use crate::links::Freshness;

/// Unknown cells.
pub(crate) const CANVAS: Color32 = Color32::from_rgb(58, 62, 70);
/// Behind panels.
const PANEL: Color32 = Color32::from_rgb(29, 31, 36);
pub(crate) const TEXT: Color32 = Color32::from_rgb(228, 231, 236);
pub(crate) const SCAN: Color32 = Color32::from_rgb(232, 40, 40);
pub(crate) const TRAJECTORY: Color32 = Color32::from_rgb(0, 98, 190);
pub(crate) const ODOMETRY: Color32 = Color32::from_rgb(196, 104, 0);
pub(crate) const TRUTH: Color32 = Color32::from_rgb(0, 128, 84);
pub(crate) const PARTICLES: Color32 = Color32::from_rgb(150, 70, 190);
pub(crate) const PATH: Color32 = Color32::from_rgb(40, 160, 40);
pub(crate) const ROBOT: Color32 = Color32::from_rgb(0, 92, 200);
pub(crate) const GOAL: Color32 = Color32::from_rgb(206, 0, 110);
pub(crate) const STOP: Color32 = Color32::from_rgb(205, 20, 24);
pub(crate) const LATE: Color32 = Color32::from_rgb(246, 178, 62);
pub(crate) const GONE: Color32 = Color32::from_rgb(255, 104, 92);
pub(crate) const GOOD: Color32 = Color32::from_rgb(92, 200, 130);
pub(crate) const WEAK: Color32 = Color32::from_rgb(150, 156, 168);

/// Returns the colour of a freshness.
pub(crate) fn of(freshness: Freshness) -> Color32 {
    match freshness {
        Freshness::Nothing => WEAK,
        Freshness::Fresh => GOOD,
        Freshness::Late => LATE,
        Freshness::Gone => GONE,
    }
}

/// Makes a window look like this: dark, for use next to a robot.
pub(crate) fn apply(context: &Context) {
    context.set_theme(ThemePreference::Dark);
    context.style_mut_of(Theme::Dark, |style| {
        style.visuals.panel_fill = PANEL;
        style.visuals.widgets.noninteractive.fg_stroke.color = TEXT;
        style.visuals.widgets.inactive.fg_stroke.color = TEXT;
        style.visuals.widgets.inactive.corner_radius = CornerRadius::same(4);
        style.spacing.item_spacing = vec2(8.0, 4.0);
        // A picture shows one moment: no animations.
        style.animation_time = 0.0;
    });
}
