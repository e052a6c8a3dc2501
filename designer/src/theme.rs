//! The look of the window and of the drawings, in one place: colours, sizes of text, spacing and
//! corners, for light and dark windows. A shape or a text repeats what a colour means.

use eframe::egui::{
    self, Color32, CornerRadius, FontFamily, FontId, Stroke, TextStyle, Visuals, vec2,
};

/// The smallest text, in points: remarks, and the second lines of a block.
pub const SMALL: f32 = 12.0;
/// The text of panels and fields.
pub const BODY: f32 = 13.0;
/// Headings, and the names of blocks.
pub const HEADING: f32 = 16.0;
/// No text is painted smaller than this, however small the drawing is.
pub const LEAST_TEXT: f32 = 11.0;

/// Space between things that belong together.
pub const NEAR: f32 = 4.0;
/// Space between things.
pub const GAP: f32 = 8.0;
/// Space between groups of things.
pub const FAR: f32 = 16.0;

/// Corners of buttons and fields.
const CORNER: u8 = 4;
/// Corners of windows and menus.
const WINDOW_CORNER: u8 = 8;
/// Width of the line around what has the focus.
const FOCUS_WIDTH: f32 = 2.0;

/// Makes both themes of a window look like the drawing.
pub fn apply(ctx: &egui::Context) {
    for (theme, colours) in
        [(egui::Theme::Dark, CanvasColours::DARK), (egui::Theme::Light, CanvasColours::LIGHT)]
    {
        ctx.style_mut_of(theme, |style| style_window(style, &colours));
    }
}

fn style_window(style: &mut egui::Style, colours: &CanvasColours) {
    let visuals = &mut style.visuals;
    visuals.panel_fill = colours.panel();
    visuals.window_fill = colours.block;
    visuals.extreme_bg_color = colours.background;
    visuals.weak_text_color = Some(colours.weak);
    visuals.selection.bg_fill = colours.selected.gamma_multiply(0.35);
    visuals.selection.stroke = Stroke::new(FOCUS_WIDTH, colours.selected);
    visuals.hyperlink_color = colours.selected;
    visuals.warn_fg_color = colours.warning;
    visuals.error_fg_color = colours.error;
    visuals.window_corner_radius = CornerRadius::same(WINDOW_CORNER);
    visuals.menu_corner_radius = CornerRadius::same(WINDOW_CORNER);
    let widgets = &mut visuals.widgets;
    for widget in [
        &mut widgets.noninteractive,
        &mut widgets.inactive,
        &mut widgets.hovered,
        &mut widgets.active,
        &mut widgets.open,
    ] {
        widget.corner_radius = CornerRadius::same(CORNER);
        widget.fg_stroke.color = colours.text;
    }
    // The line around a field or a button.
    widgets.inactive.bg_stroke = Stroke::new(1.0, colours.outline);
    widgets.hovered.bg_stroke = Stroke::new(1.0, colours.text);
    // What has the focus looks so, too.
    widgets.active.bg_stroke = Stroke::new(FOCUS_WIDTH, colours.selected);
    style.text_styles = [
        (TextStyle::Small, FontId::new(SMALL, FontFamily::Proportional)),
        (TextStyle::Body, FontId::new(BODY, FontFamily::Proportional)),
        (TextStyle::Button, FontId::new(BODY, FontFamily::Proportional)),
        (TextStyle::Heading, FontId::new(HEADING, FontFamily::Proportional)),
        (TextStyle::Monospace, FontId::new(SMALL, FontFamily::Monospace)),
    ]
    .into();
    style.spacing.item_spacing = vec2(GAP, NEAR);
    style.spacing.button_padding = vec2(GAP, NEAR);
    style.interaction.tooltip_delay = 0.35;
}

/// The colours of one theme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CanvasColours {
    /// Whether the background is dark.
    pub is_dark: bool,
    /// Behind everything.
    pub background: Color32,
    /// The points of the grid.
    pub grid: Color32,
    /// Inside of a block.
    pub block: Color32,
    /// Border of a block.
    pub outline: Color32,
    /// Text.
    pub text: Color32,
    /// Text of less weight.
    pub weak: Color32,
    /// A link.
    pub wire: Color32,
    /// What is selected.
    pub selected: Color32,
    /// A port that the dragged wire may be connected to; ArMoR's red.
    pub connect: Color32,
    /// Something wrong.
    pub error: Color32,
    /// Something doubtful.
    pub warning: Color32,
    /// Something good: active, proven.
    pub good: Color32,
    /// A note's paper.
    pub note: Color32,
    /// A group's area.
    pub group: Color32,
}

impl CanvasColours {
    /// The colours that fit the visuals of the window.
    pub fn of(visuals: &Visuals) -> Self {
        if visuals.dark_mode { Self::DARK } else { Self::LIGHT }
    }

    /// The ground of panels.
    pub fn panel(&self) -> Color32 {
        mix(self.background, self.block, 0.5)
    }

    /// For a dark window.
    pub const DARK: Self = Self {
        is_dark: true,
        background: Color32::from_rgb(24, 26, 31),
        grid: Color32::from_rgb(50, 55, 66),
        block: Color32::from_rgb(41, 45, 54),
        outline: Color32::from_rgb(118, 126, 142),
        text: Color32::from_rgb(226, 230, 237),
        weak: Color32::from_rgb(150, 158, 172),
        wire: Color32::from_rgb(132, 144, 164),
        selected: Color32::from_rgb(86, 168, 255),
        connect: Color32::from_rgb(255, 102, 94),
        error: Color32::from_rgb(255, 106, 92),
        warning: Color32::from_rgb(240, 178, 62),
        good: Color32::from_rgb(72, 190, 160),
        note: Color32::from_rgb(70, 64, 38),
        group: Color32::from_rgb(33, 38, 49),
    };

    /// For a light window.
    pub const LIGHT: Self = Self {
        is_dark: false,
        background: Color32::from_rgb(246, 247, 249),
        grid: Color32::from_rgb(214, 218, 225),
        block: Color32::WHITE,
        outline: Color32::from_rgb(118, 126, 142),
        text: Color32::from_rgb(28, 32, 40),
        weak: Color32::from_rgb(96, 104, 118),
        wire: Color32::from_rgb(100, 112, 132),
        selected: Color32::from_rgb(0, 98, 204),
        connect: Color32::from_rgb(200, 24, 24),
        error: Color32::from_rgb(196, 32, 28),
        warning: Color32::from_rgb(145, 90, 0),
        good: Color32::from_rgb(0, 112, 90),
        note: Color32::from_rgb(255, 246, 196),
        group: Color32::from_rgb(235, 239, 246),
    };

    /// The colour of a type of data, by its number among all types. Which type it is, the text
    /// states.
    pub fn of_type(&self, number: usize) -> Color32 {
        // Distinguishable with the common colour deficiencies (after Okabe and Ito).
        const DARK: [Color32; 8] = [
            Color32::from_rgb(86, 180, 233),
            Color32::from_rgb(230, 159, 0),
            Color32::from_rgb(0, 190, 140),
            Color32::from_rgb(240, 228, 66),
            Color32::from_rgb(120, 150, 255),
            Color32::from_rgb(230, 130, 70),
            Color32::from_rgb(220, 140, 190),
            Color32::from_rgb(190, 200, 210),
        ];
        const LIGHT: [Color32; 8] = [
            Color32::from_rgb(0, 108, 170),
            Color32::from_rgb(145, 90, 0),
            Color32::from_rgb(0, 112, 82),
            Color32::from_rgb(112, 100, 0),
            Color32::from_rgb(70, 80, 200),
            Color32::from_rgb(165, 70, 0),
            Color32::from_rgb(170, 70, 130),
            Color32::from_rgb(90, 96, 106),
        ];
        let palette = if self.is_dark { &DARK } else { &LIGHT };
        palette[number % palette.len()]
    }
}

/// Mixes two colours; `share` is the part of the second.
pub fn mix(first: Color32, second: Color32, share: f32) -> Color32 {
    first.lerp_to_gamma(second, share)
}

/// The contrast of two opaque colours, from 1 to 21, as WCAG 2.2 defines it.
pub fn contrast(one: Color32, other: Color32) -> f32 {
    let luminance = |colour: Color32| {
        let linear = egui::Rgba::from(colour);
        0.2126 * linear.r() + 0.7152 * linear.g() + 0.0722 * linear.b()
    };
    let (one, other) = (luminance(one), luminance(other));
    (one.max(other) + 0.05) / (one.min(other) + 0.05)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// WCAG 2.2: text, and the parts of a control that are needed to recognise it.
    const TEXT: f32 = 4.5;
    const CONTROL: f32 = 3.0;

    const THEMES: [CanvasColours; 2] = [CanvasColours::DARK, CanvasColours::LIGHT];

    fn grounds(colours: &CanvasColours) -> [Color32; 4] {
        [colours.background, colours.block, colours.panel(), colours.group]
    }

    fn check(what: &str, ink: Color32, ground: Color32, least: f32) {
        let contrast = contrast(ink, ground);
        assert!(contrast >= least, "{what} {ink:?} on {ground:?}: {contrast:.2}");
    }

    #[test]
    fn contrast_is_that_of_the_standard() {
        for (grey, expected) in [(0, 21.0), (119, 4.48), (255, 1.0)] {
            let contrast = contrast(Color32::from_gray(grey), Color32::WHITE);
            assert!((contrast - expected).abs() < 0.01, "{grey}: {contrast}");
        }
    }

    #[test]
    fn text_can_be_read_on_every_ground_of_both_themes() {
        for colours in THEMES {
            for ground in grounds(&colours) {
                let inks = [
                    ("text", colours.text),
                    ("weak", colours.weak),
                    ("selected", colours.selected),
                    ("connect", colours.connect),
                    ("error", colours.error),
                    ("warning", colours.warning),
                    ("good", colours.good),
                ];
                inks.into_iter().for_each(|(what, ink)| check(what, ink, ground, TEXT));
                // The log writes names of components in them.
                (0..8).for_each(|n| check("type", colours.of_type(n), ground, TEXT));
            }
            check("note", colours.text, colours.note, TEXT);
            let badge = if colours.is_dark { Color32::BLACK } else { Color32::WHITE };
            for tint in [colours.error, colours.warning, colours.good, colours.weak] {
                check("badge", badge, tint, TEXT);
            }
        }
    }

    #[test]
    fn fields_ports_blocks_and_the_focus_are_seen_in_both_themes() {
        for colours in THEMES {
            let mut style = egui::Style::default();
            style_window(&mut style, &colours);
            let widgets = &style.visuals.widgets;
            for ground in grounds(&colours) {
                check("outline", colours.outline, ground, CONTROL);
                check("wire", colours.wire, ground, CONTROL);
                (0..8).for_each(|n| check("port", colours.of_type(n), ground, CONTROL));
                check("field", widgets.inactive.bg_stroke.color, ground, CONTROL);
                check("focus", widgets.active.bg_stroke.color, ground, CONTROL);
            }
            assert!(widgets.active.bg_stroke.width >= 2.0);
        }
    }

    #[test]
    fn no_style_is_below_the_least_size() {
        let mut style = egui::Style::default();
        style_window(&mut style, &CanvasColours::LIGHT);
        assert!(style.text_styles.values().all(|font| font.size >= LEAST_TEXT));
    }
}
