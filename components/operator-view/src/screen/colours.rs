//! Colours of the screen, dark for use indoors and light for sunlight. No information is in a colour
//! alone: a word or a shape repeats it.

use eframe::egui::style::WidgetVisuals;
use eframe::egui::{
    Color32, Context, CornerRadius, FontFamily, FontId, Stroke, Style, TextStyle, Theme,
    ThemePreference, Ui, Visuals, vec2,
};

use crate::links::Freshness;

pub(crate) const SCAN: Color32 = Color32::from_rgb(232, 40, 40);
pub(crate) const TRAJECTORY: Color32 = Color32::from_rgb(0, 98, 190);
pub(crate) const ODOMETRY: Color32 = Color32::from_rgb(196, 104, 0);
pub(crate) const TRUTH: Color32 = Color32::from_rgb(0, 128, 84);
pub(crate) const PARTICLES: Color32 = Color32::from_rgb(150, 70, 190);
pub(crate) const PATH: Color32 = Color32::from_rgb(40, 160, 40);
pub(crate) const ROBOT: Color32 = Color32::from_rgb(0, 92, 200);
pub(crate) const GOAL: Color32 = Color32::from_rgb(206, 0, 110);
pub(crate) const STOP: Color32 = Color32::from_rgb(205, 20, 24);
/// Behind Release: no red, and no colour of any other button.
pub(crate) const RELEASE: Color32 = Color32::from_rgb(0, 94, 184);
/// Text on STOP and Release, and on banners of these colours.
pub(crate) const ON_STOP: Color32 = Color32::WHITE;

/// Least height and width of what is touched, in points.
pub(crate) const TOUCH: f32 = 44.0;
/// Least contrast of text (WCAG 2.2, AA).
pub(crate) const CONTRAST: f32 = 4.5;

/// The colours of a theme.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Palette {
    /// Unknown cells.
    pub(crate) canvas: Color32,
    /// Behind panels and notices.
    pub(crate) panel: Color32,
    /// Behind buttons.
    pub(crate) button: Color32,
    /// Behind the button under the pointer.
    pub(crate) hovered: Color32,
    /// The filled part of a bar.
    pub(crate) filled: Color32,
    pub(crate) text: Color32,
    pub(crate) weak: Color32,
    pub(crate) late: Color32,
    pub(crate) gone: Color32,
    pub(crate) good: Color32,
}

/// For use indoors and at night.
pub(crate) const DARK: Palette = Palette {
    canvas: Color32::from_rgb(58, 62, 70),
    panel: Color32::from_rgb(29, 31, 36),
    button: Color32::from_rgb(52, 56, 64),
    hovered: Color32::from_rgb(70, 76, 88),
    filled: Color32::from_rgb(0, 86, 122),
    text: Color32::from_rgb(232, 235, 240),
    weak: Color32::from_rgb(170, 176, 188),
    late: Color32::from_rgb(246, 178, 62),
    gone: Color32::from_rgb(255, 128, 116),
    good: Color32::from_rgb(92, 200, 130),
};

/// For sunlight.
pub(crate) const LIGHT: Palette = Palette {
    canvas: Color32::from_rgb(192, 198, 206),
    panel: Color32::from_rgb(248, 249, 250),
    button: Color32::from_rgb(222, 226, 232),
    hovered: Color32::from_rgb(204, 210, 220),
    filled: Color32::from_rgb(150, 205, 235),
    text: Color32::from_rgb(16, 18, 22),
    weak: Color32::from_rgb(66, 72, 82),
    late: Color32::from_rgb(120, 70, 0),
    gone: Color32::from_rgb(170, 14, 12),
    good: Color32::from_rgb(0, 94, 50),
};

impl Palette {
    /// Returns the palette of a theme.
    pub(crate) fn of_theme(is_light: bool) -> &'static Self {
        if is_light { &LIGHT } else { &DARK }
    }

    /// Returns the palette of the theme in which `ui` is shown.
    pub(crate) fn of(ui: &Ui) -> &'static Self {
        Self::of_theme(!ui.visuals().dark_mode)
    }

    /// Returns the colour of a freshness.
    pub(crate) fn of_freshness(&self, freshness: Freshness) -> Color32 {
        match freshness {
            Freshness::Nothing => self.weak,
            Freshness::Fresh => self.good,
            Freshness::Late => self.late,
            Freshness::Gone => self.gone,
        }
    }

    /// Returns a colour of the map as it is legible on a panel: nearer to that of text.
    pub(crate) fn make_legible(&self, colour: Color32) -> Color32 {
        let steps = (0..=10_u8).map(|step| colour.lerp_to_gamma(self.text, f32::from(step) / 10.0));
        let mut steps = steps.filter(|colour| contrast(*colour, self.panel) >= CONTRAST);
        steps.next().unwrap_or(self.text)
    }
}

/// Returns the contrast of two opaque colours by WCAG 2.2: 1 … 21.
pub(crate) fn contrast(a: Color32, b: Color32) -> f32 {
    let luminance = |colour: Color32| {
        let part = |sample: u8| {
            let sample = f32::from(sample) / 255.0;
            if sample <= 0.040_45 { sample / 12.92 } else { ((sample + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * part(colour.r()) + 0.7152 * part(colour.g()) + 0.0722 * part(colour.b())
    };
    let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
    a.max(b) / a.min(b)
}

/// Makes a window look like this, in both themes.
pub(crate) fn apply(context: &Context) {
    context.set_theme(ThemePreference::Dark);
    for (theme, palette) in [(Theme::Dark, &DARK), (Theme::Light, &LIGHT)] {
        context.style_mut_of(theme, |style| style_of(style, palette));
    }
}

/// Changes to a theme.
pub(super) fn choose_theme(context: &Context, is_light: bool) {
    let wanted = if is_light { ThemePreference::Light } else { ThemePreference::Dark };
    if context.options(|options| options.theme_preference) != wanted {
        context.set_theme(wanted);
    }
}

fn style_of(style: &mut Style, palette: &Palette) {
    let visuals = &mut style.visuals;
    colour_visuals(visuals, palette);
    style.spacing.item_spacing = vec2(8.0, 4.0);
    style.spacing.button_padding = vec2(12.0, 6.0);
    style.spacing.interact_size = vec2(TOUCH, TOUCH);
    style.spacing.icon_width = 20.0;
    style.text_styles = [
        (TextStyle::Small, 12.0),
        (TextStyle::Body, 14.0),
        (TextStyle::Monospace, 13.0),
        (TextStyle::Button, 15.0),
        (TextStyle::Heading, 18.0),
    ]
    .map(|(name, size)| (name, FontId::new(size, FontFamily::Proportional)))
    .into();
    // A picture shows one moment: no animations.
    style.animation_time = 0.0;
}

fn colour_visuals(visuals: &mut Visuals, palette: &Palette) {
    visuals.panel_fill = palette.panel;
    visuals.window_fill = palette.panel;
    visuals.extreme_bg_color = palette.button;
    visuals.faint_bg_color = palette.panel;
    visuals.weak_text_color = Some(palette.weak);
    visuals.selection.bg_fill = palette.filled;
    visuals.selection.stroke = Stroke::new(1.0, palette.text);
    let colour = |widget: &mut WidgetVisuals, fill: Color32| {
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.fg_stroke.color = palette.text;
        widget.corner_radius = CornerRadius::same(4);
    };
    colour(&mut visuals.widgets.noninteractive, palette.panel);
    colour(&mut visuals.widgets.inactive, palette.button);
    for widget in
        [&mut visuals.widgets.hovered, &mut visuals.widgets.active, &mut visuals.widgets.open]
    {
        colour(widget, palette.hovered);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_has_enough_contrast_in_both_themes() {
        for (name, palette) in [("dark", DARK), ("light", LIGHT)] {
            let inks = [palette.text, palette.weak, palette.late, palette.gone, palette.good];
            let on_panel = inks.map(|ink| (ink, palette.panel));
            let others = [palette.button, palette.hovered, palette.filled, palette.canvas]
                .map(|ground| (palette.text, ground));
            let layers = [SCAN, TRAJECTORY, ODOMETRY, TRUTH, PARTICLES, PATH, ROBOT, GOAL]
                .map(|colour| (palette.make_legible(colour), palette.panel));
            let pairs = on_panel.into_iter().chain(others).chain(layers);
            for (ink, ground) in pairs.chain([(ON_STOP, STOP), (ON_STOP, RELEASE)]) {
                let ratio = contrast(ink, ground);
                assert!(ratio >= CONTRAST, "{name}: {ink:?} on {ground:?}: {ratio:.2}");
            }
        }
    }

    #[test]
    fn contrast_is_that_of_the_standard() {
        assert!((contrast(Color32::BLACK, Color32::WHITE) - 21.0).abs() < 0.01);
        let grey = contrast(Color32::from_rgb(119, 119, 119), Color32::WHITE);
        assert!((grey - 4.48).abs() < 0.01, "{grey}");
    }
}
