//! Colours of a drawing, for light and dark windows. A shape or a text repeats what a colour
//! means.

use eframe::egui::{Color32, Visuals};

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

    /// For a dark window.
    pub const DARK: Self = Self {
        is_dark: true,
        background: Color32::from_rgb(24, 26, 31),
        grid: Color32::from_rgb(50, 55, 66),
        block: Color32::from_rgb(41, 45, 54),
        outline: Color32::from_rgb(84, 92, 108),
        text: Color32::from_rgb(226, 230, 237),
        weak: Color32::from_rgb(150, 158, 172),
        wire: Color32::from_rgb(132, 144, 164),
        selected: Color32::from_rgb(86, 168, 255),
        connect: Color32::from_rgb(255, 82, 76),
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
        outline: Color32::from_rgb(148, 156, 170),
        text: Color32::from_rgb(28, 32, 40),
        weak: Color32::from_rgb(96, 104, 118),
        wire: Color32::from_rgb(100, 112, 132),
        selected: Color32::from_rgb(0, 104, 214),
        connect: Color32::from_rgb(214, 30, 30),
        error: Color32::from_rgb(196, 32, 28),
        warning: Color32::from_rgb(176, 112, 0),
        good: Color32::from_rgb(0, 128, 104),
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
            Color32::from_rgb(0, 114, 178),
            Color32::from_rgb(190, 120, 0),
            Color32::from_rgb(0, 130, 94),
            Color32::from_rgb(140, 126, 0),
            Color32::from_rgb(70, 80, 200),
            Color32::from_rgb(190, 80, 0),
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
