//! The look of both programs with a window, in one place: colours, sizes of text, spacing and corners,
//! for light and dark windows. A shape or a text repeats what a colour means.

use egui::{
    Button, Color32, CornerRadius, FontFamily, FontId, RichText, Stroke, Style, TextStyle, Theme,
    Visuals, style::ScrollStyle, vec2,
};

/// Remarks, and the second lines of a block.
pub const SMALL: f32 = 12.0;
/// The text of panels and fields.
pub const BODY: f32 = 13.0;
/// Headings, the names of blocks, and buttons that are touched.
pub const HEADING: f32 = 16.0;
/// What has to be read from some distance, such as STOPPED.
pub const LARGE: f32 = 26.0;
/// No text is painted smaller than this, however small the drawing is.
pub const LEAST_TEXT: f32 = 11.0;

/// Space between things that belong together.
pub const NEAR: f32 = 4.0;
/// Space between things.
pub const GAP: f32 = 8.0;
/// Space between groups of things.
pub const FAR: f32 = 16.0;

/// Least height and width of what is touched.
pub const TOUCH: f32 = 44.0;

/// Corners of buttons, fields and notices.
pub const CORNER: u8 = 4;
/// Corners of windows, menus and cards.
pub const WINDOW_CORNER: u8 = 8;
/// Width of a scroll bar at which the pointer is.
const SCROLL_BAR: f32 = 8.0;
/// Width of the line around what has the focus.
const FOCUS_WIDTH: f32 = 2.0;

/// Least contrast of text (WCAG 2.2, AA).
pub const TEXT_CONTRAST: f32 = 4.5;
/// Least contrast of the parts of a control that are needed to recognise it.
pub const CONTROL_CONTRAST: f32 = 3.0;

/// Behind STOP.
pub const STOP: Color32 = Color32::from_rgb(205, 20, 24);
/// Behind Release: no red, and no colour of any other button.
pub const RELEASE: Color32 = Color32::from_rgb(0, 94, 184);
/// Text on STOP and Release, and on banners of these colours.
pub const ON_STOP: Color32 = Color32::WHITE;

/// What is drawn on a map, whose free cells are light in both themes.
pub mod map {
    use egui::Color32;

    /// Points of a scan.
    pub const SCAN: Color32 = Color32::from_rgb(232, 40, 40);
    /// The corrected trajectory.
    pub const TRAJECTORY: Color32 = Color32::from_rgb(0, 98, 190);
    /// The trajectory by odometry alone.
    pub const ODOMETRY: Color32 = Color32::from_rgb(196, 104, 0);
    /// The true trajectory of a simulation.
    pub const TRUTH: Color32 = Color32::from_rgb(0, 128, 84);
    /// Hypotheses of mapping.
    pub const PARTICLES: Color32 = Color32::from_rgb(150, 70, 190);
    /// The planned path.
    pub const PATH: Color32 = Color32::from_rgb(40, 160, 40);
    /// The robot.
    pub const ROBOT: Color32 = Color32::from_rgb(0, 92, 200);
    /// The goal.
    pub const GOAL: Color32 = Color32::from_rgb(206, 0, 110);
}

/// How a window is pointed at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pointing {
    /// With a mouse: controls are as small as their texts.
    Mouse,
    /// With a finger, too: what is touched is large.
    Finger,
}

/// The colours of one theme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThemeColours {
    /// Whether the background is dark.
    pub is_dark: bool,
    /// Behind a drawing, and inside of fields.
    pub background: Color32,
    /// Behind panels and notices.
    pub panel: Color32,
    /// Inside of a block, a window, a menu.
    pub block: Color32,
    /// Behind a button.
    pub button: Color32,
    /// Behind the button under the pointer.
    pub hovered: Color32,
    /// The filled part of a bar.
    pub filled: Color32,
    /// Unknown cells of a map.
    pub unknown: Color32,
    /// The points of the grid.
    pub grid: Color32,
    /// Border of a block, a field, a button.
    pub outline: Color32,
    /// Text.
    pub text: Color32,
    /// Text of less weight.
    pub weak: Color32,
    /// A link.
    pub wire: Color32,
    /// What is selected or has the focus; behind the main button.
    pub accent: Color32,
    /// Text on the accent.
    pub on_accent: Color32,
    /// A port that the dragged wire may be connected to, with the wire.
    pub connect: Color32,
    /// Something wrong.
    pub error: Color32,
    /// Something doubtful.
    pub warning: Color32,
    /// Something good: active, proven, fresh.
    pub good: Color32,
    /// A note's paper.
    pub note: Color32,
    /// A group's area.
    pub group: Color32,
}

/// For a dark window: indoors and at night.
pub const DARK: ThemeColours = ThemeColours {
    is_dark: true,
    background: Color32::from_rgb(24, 26, 31),
    panel: Color32::from_rgb(32, 35, 42),
    block: Color32::from_rgb(41, 45, 54),
    button: Color32::from_rgb(47, 52, 62),
    hovered: Color32::from_rgb(66, 73, 87),
    filled: Color32::from_rgb(0, 86, 122),
    unknown: Color32::from_rgb(58, 62, 70),
    grid: Color32::from_rgb(50, 55, 66),
    outline: Color32::from_rgb(120, 128, 144),
    text: Color32::from_rgb(226, 230, 237),
    weak: Color32::from_rgb(160, 168, 182),
    wire: Color32::from_rgb(132, 144, 164),
    accent: Color32::from_rgb(86, 168, 255),
    on_accent: Color32::BLACK,
    connect: Color32::from_rgb(84, 200, 150),
    error: Color32::from_rgb(255, 118, 106),
    warning: Color32::from_rgb(240, 178, 62),
    good: Color32::from_rgb(84, 200, 150),
    note: Color32::from_rgb(70, 64, 38),
    group: Color32::from_rgb(33, 38, 49),
};

/// For a light window: by day, and in sunlight.
pub const LIGHT: ThemeColours = ThemeColours {
    is_dark: false,
    background: Color32::from_rgb(246, 247, 249),
    panel: Color32::from_rgb(250, 251, 252),
    block: Color32::WHITE,
    button: Color32::from_rgb(226, 230, 236),
    hovered: Color32::from_rgb(206, 212, 222),
    filled: Color32::from_rgb(150, 205, 235),
    unknown: Color32::from_rgb(192, 198, 206),
    grid: Color32::from_rgb(214, 218, 225),
    outline: Color32::from_rgb(112, 120, 136),
    text: Color32::from_rgb(18, 21, 27),
    weak: Color32::from_rgb(76, 83, 95),
    wire: Color32::from_rgb(100, 112, 132),
    accent: Color32::from_rgb(0, 98, 204),
    on_accent: Color32::WHITE,
    connect: Color32::from_rgb(0, 98, 66),
    error: Color32::from_rgb(176, 20, 18),
    warning: Color32::from_rgb(132, 80, 0),
    good: Color32::from_rgb(0, 98, 66),
    note: Color32::from_rgb(255, 246, 196),
    group: Color32::from_rgb(235, 239, 246),
};

impl ThemeColours {
    /// Returns the colours of a theme.
    pub fn of_theme(is_light: bool) -> &'static Self {
        if is_light { &LIGHT } else { &DARK }
    }

    /// Returns the colours that fit the visuals of a window.
    pub fn of(visuals: &Visuals) -> &'static Self {
        Self::of_theme(!visuals.dark_mode)
    }

    /// Returns the colour of a type of data, by its number among all types. Which type it is, the
    /// text states.
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
        let colours = if self.is_dark { &DARK } else { &LIGHT };
        colours[number % colours.len()]
    }

    /// Returns a colour of the map as it is legible on a panel: nearer to that of text.
    pub fn make_legible(&self, colour: Color32) -> Color32 {
        let steps = (0..=10_u8).map(|step| mix(colour, self.text, f32::from(step) / 10.0));
        let mut steps = steps.filter(|colour| contrast(*colour, self.panel) >= TEXT_CONTRAST);
        steps.next().unwrap_or(self.text)
    }
}

/// Gives both themes of a window their look.
pub fn apply(context: &egui::Context, pointing: Pointing) {
    for (theme, colours) in [(Theme::Dark, &DARK), (Theme::Light, &LIGHT)] {
        context.style_mut_of(theme, |style| style_window(style, colours, pointing));
    }
}

/// Returns the main button of a question or a page, in the accent's colour.
pub fn main_button<'a>(colours: &ThemeColours, text: impl Into<String>) -> Button<'a> {
    let text = RichText::new(text).strong().color(colours.on_accent);
    Button::new(text).fill(colours.accent)
}

fn style_window(style: &mut Style, colours: &ThemeColours, pointing: Pointing) {
    colour_visuals(&mut style.visuals, colours);
    let button = if pointing == Pointing::Finger { HEADING } else { BODY };
    let sizes = [
        (TextStyle::Small, SMALL, FontFamily::Proportional),
        (TextStyle::Body, BODY, FontFamily::Proportional),
        (TextStyle::Button, button, FontFamily::Proportional),
        (TextStyle::Heading, HEADING, FontFamily::Proportional),
        (TextStyle::Monospace, SMALL, FontFamily::Monospace),
    ];
    style.text_styles = sizes.map(|(name, size, family)| (name, FontId::new(size, family))).into();
    style.spacing.item_spacing = vec2(GAP, NEAR);
    style.spacing.button_padding = vec2(GAP, NEAR);
    style.interaction.tooltip_delay = 0.35;
    // A bar has its own room next to what it scrolls, and shows at rest that there is more.
    style.spacing.scroll = ScrollStyle {
        floating_width: SCROLL_BAR / 2.0,
        bar_width: SCROLL_BAR,
        floating_allocated_width: SCROLL_BAR + NEAR,
        dormant_handle_opacity: 0.6,
        ..ScrollStyle::floating()
    };
    if pointing == Pointing::Finger {
        style.spacing.button_padding = vec2(GAP + NEAR, GAP);
        style.spacing.interact_size = vec2(TOUCH, TOUCH);
        style.spacing.icon_width = 20.0;
        // A text that can be selected would take the finger that is meant for what lies under it.
        style.interaction.selectable_labels = false;
    }
}

fn colour_visuals(visuals: &mut Visuals, colours: &ThemeColours) {
    visuals.panel_fill = colours.panel;
    visuals.window_fill = colours.block;
    visuals.extreme_bg_color = colours.background;
    visuals.faint_bg_color = colours.block;
    visuals.weak_text_color = Some(colours.weak);
    visuals.selection.bg_fill = colours.accent.gamma_multiply(0.35);
    // Text on the selected fill: the accent on its own shade has a contrast of 3.
    visuals.selection.stroke = Stroke::new(FOCUS_WIDTH, colours.text);
    visuals.hyperlink_color = colours.accent;
    visuals.warn_fg_color = colours.warning;
    visuals.error_fg_color = colours.error;
    visuals.window_corner_radius = CornerRadius::same(WINDOW_CORNER);
    visuals.menu_corner_radius = CornerRadius::same(WINDOW_CORNER);
    let widgets = &mut visuals.widgets;
    widgets.noninteractive.bg_fill = colours.panel;
    for (widget, fill) in [
        (&mut widgets.noninteractive, colours.panel),
        (&mut widgets.inactive, colours.button),
        (&mut widgets.hovered, colours.hovered),
        (&mut widgets.active, colours.hovered),
        (&mut widgets.open, colours.hovered),
    ] {
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.corner_radius = CornerRadius::same(CORNER);
        widget.fg_stroke.color = colours.text;
    }
    // The line around a field or a button.
    widgets.inactive.bg_stroke = Stroke::new(1.0, colours.outline);
    widgets.hovered.bg_stroke = Stroke::new(1.0, colours.text);
    // What has the focus looks so, too.
    widgets.active.bg_stroke = Stroke::new(FOCUS_WIDTH, colours.accent);
}

/// Mixes two colours; `share` is the part of the second.
pub fn mix(first: Color32, second: Color32, share: f32) -> Color32 {
    first.lerp_to_gamma(second, share)
}

/// Returns the contrast of two opaque colours, from 1 to 21, as WCAG 2.2 defines it.
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

    fn grounds(colours: &ThemeColours) -> [Color32; 4] {
        [colours.background, colours.block, colours.panel, colours.group]
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
        for colours in [DARK, LIGHT] {
            for ground in grounds(&colours) {
                let inks = [
                    ("text", colours.text),
                    ("weak", colours.weak),
                    ("accent", colours.accent),
                    ("connect", colours.connect),
                    ("error", colours.error),
                    ("warning", colours.warning),
                    ("good", colours.good),
                ];
                inks.into_iter().for_each(|(what, ink)| check(what, ink, ground, TEXT_CONTRAST));
                // The log writes names of components in them.
                (0..8).for_each(|n| check("type", colours.of_type(n), ground, TEXT_CONTRAST));
            }
            let on_buttons = [colours.text, colours.error, colours.warning, colours.good];
            for ink in on_buttons {
                check("button", ink, colours.button, TEXT_CONTRAST);
            }
            for ground in [colours.hovered, colours.filled, colours.note, colours.unknown] {
                check("text", colours.text, ground, TEXT_CONTRAST);
            }
            check("main button", colours.on_accent, colours.accent, TEXT_CONTRAST);
            let badge = if colours.is_dark { Color32::BLACK } else { Color32::WHITE };
            for tint in [colours.error, colours.warning, colours.good, colours.weak] {
                check("badge", badge, tint, TEXT_CONTRAST);
            }
        }
        check("STOP", ON_STOP, STOP, TEXT_CONTRAST);
        check("Release", ON_STOP, RELEASE, TEXT_CONTRAST);
    }

    #[test]
    fn layers_of_the_map_are_legible_on_panels_and_seen_on_free_cells() {
        let layers = [
            map::SCAN,
            map::TRAJECTORY,
            map::ODOMETRY,
            map::TRUTH,
            map::PARTICLES,
            map::PATH,
            map::ROBOT,
            map::GOAL,
        ];
        for layer in layers {
            for colours in [DARK, LIGHT] {
                check("layer", colours.make_legible(layer), colours.panel, TEXT_CONTRAST);
            }
            check("layer", layer, Color32::WHITE, CONTROL_CONTRAST);
        }
    }

    #[test]
    fn fields_ports_blocks_and_the_focus_are_seen_in_both_themes() {
        for colours in [DARK, LIGHT] {
            for pointing in [Pointing::Mouse, Pointing::Finger] {
                let mut style = Style::default();
                style_window(&mut style, &colours, pointing);
                let widgets = &style.visuals.widgets;
                for ground in grounds(&colours) {
                    check("outline", colours.outline, ground, CONTROL_CONTRAST);
                    check("wire", colours.wire, ground, CONTROL_CONTRAST);
                    (0..8)
                        .for_each(|n| check("port", colours.of_type(n), ground, CONTROL_CONTRAST));
                    for widget in [widgets.inactive, widgets.hovered, widgets.active] {
                        check("border", widget.bg_stroke.color, ground, CONTROL_CONTRAST);
                    }
                }
                assert!(widgets.active.bg_stroke.width >= 2.0);
            }
        }
    }

    #[test]
    fn no_style_is_below_the_least_size_and_a_finger_has_room() {
        for pointing in [Pointing::Mouse, Pointing::Finger] {
            let mut style = Style::default();
            style_window(&mut style, &LIGHT, pointing);
            let scale = [SMALL, BODY, HEADING];
            assert!(style.text_styles.values().all(|font| scale.contains(&font.size)));
            assert!(scale.iter().all(|size| *size >= LEAST_TEXT));
            let is_large = style.spacing.interact_size.min_elem() >= TOUCH;
            assert_eq!(is_large, pointing == Pointing::Finger);
        }
    }
}
