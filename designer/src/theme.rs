//! The look of the window: egui's widgets in the colours of the drawing.

use eframe::egui::{self, CornerRadius, Stroke};

use crate::canvas::{CanvasColours, mix};

/// Makes both themes of a window look like the drawing.
pub fn apply(ctx: &egui::Context) {
    for (theme, colours) in
        [(egui::Theme::Dark, CanvasColours::DARK), (egui::Theme::Light, CanvasColours::LIGHT)]
    {
        ctx.style_mut_of(theme, |style| {
            let visuals = &mut style.visuals;
            visuals.panel_fill = mix(colours.background, colours.block, 0.5);
            visuals.window_fill = colours.block;
            visuals.extreme_bg_color = colours.background;
            visuals.selection.bg_fill = colours.selected.gamma_multiply(0.35);
            visuals.selection.stroke = Stroke::new(1.0, colours.text);
            visuals.hyperlink_color = colours.selected;
            visuals.warn_fg_color = colours.warning;
            visuals.error_fg_color = colours.error;
            visuals.window_corner_radius = CornerRadius::same(8);
            visuals.widgets.noninteractive.fg_stroke.color = colours.text;
            visuals.widgets.inactive.fg_stroke.color = colours.text;
            style.spacing.item_spacing = egui::vec2(8.0, 5.0);
            style.spacing.button_padding = egui::vec2(7.0, 3.0);
            style.interaction.tooltip_delay = 0.35;
        });
    }
}
