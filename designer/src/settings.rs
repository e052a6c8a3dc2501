//! What is remembered from one start to the next: how the window looks.

use eframe::egui;
use serde::{Deserialize, Serialize};

/// Which panels are open, and how the drawing looks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Whether the panel with what can be added is open; until the user has decided, it is open for
    /// a robot with nothing in it, and folded when there is a drawing that needs the space.
    pub palette: Option<bool>,
    /// The panel with what is selected.
    pub properties: bool,
    /// The panel with what is wrong.
    pub problems: bool,
    /// The small map of the drawing.
    pub minimap: bool,
    /// Whether moved nodes are aligned with the grid.
    pub snap: bool,
    /// Light or dark.
    pub theme: egui::ThemePreference,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            palette: None,
            properties: true,
            problems: true,
            minimap: true,
            snap: true,
            theme: egui::ThemePreference::System,
        }
    }
}

impl Settings {
    /// Dark or light, whatever the system states.
    pub fn set_dark(&mut self, is_dark: bool) {
        self.theme =
            if is_dark { egui::ThemePreference::Dark } else { egui::ThemePreference::Light };
    }
}
