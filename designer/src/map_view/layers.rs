//! What of the map is shown, and how strongly.

use eframe::egui;

use crate::map_view::scene::SceneShape;

/// A part of the map that can be hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The picture under the drawing.
    Picture,
    /// The grid of what is free and occupied.
    Grid,
    /// Areas with a meaning.
    Zones,
    /// Lines with a meaning.
    Lines,
    /// Legs, stays and meetings.
    Routes,
    /// The ways to rally points.
    Exits,
    /// Points and rally points.
    Points,
    /// Military symbols.
    Symbols,
}

impl Layer {
    /// All of them, from back to front.
    pub const ALL: [Self; 8] = [
        Self::Picture,
        Self::Grid,
        Self::Zones,
        Self::Lines,
        Self::Exits,
        Self::Routes,
        Self::Symbols,
        Self::Points,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Picture => "Picture",
            Self::Grid => "Grid",
            Self::Zones => "Zones",
            Self::Lines => "Lines",
            Self::Routes => "Routes",
            Self::Exits => "Exits",
            Self::Points => "Points",
            Self::Symbols => "Symbols",
        }
    }

    fn doc(self) -> &'static str {
        match self {
            Self::Picture => "The picture of the map: picture=\"…\"",
            Self::Grid => "What is free and occupied: grid=\"…\"",
            Self::Zones => "Areas with a meaning, such as those that no robot enters",
            Self::Lines => "Phase lines, boundaries and limits of advance",
            Self::Routes => "Legs, stays and meetings",
            Self::Exits => "Where the robot goes from each step when it ends early",
            Self::Points => "Points and rally points",
            Self::Symbols => "Military symbols",
        }
    }
}

/// Which layers are shown.
#[derive(Clone, Debug)]
pub struct Layers {
    shown: [bool; Layer::ALL.len()],
    /// Of the picture and of the grid, from 0 to 1.
    opacity: [f32; 2],
}

impl Default for Layers {
    fn default() -> Self {
        Self { shown: [true; Layer::ALL.len()], opacity: [1.0, 0.6] }
    }
}

impl Layers {
    /// Whether a layer is shown.
    pub fn is_shown(&self, layer: Layer) -> bool {
        self.shown[layer as usize]
    }

    /// How strongly the picture or the grid is shown.
    pub fn opacity(&self, layer: Layer) -> f32 {
        let opacity = self.opacity.get(layer as usize).copied().unwrap_or(1.0);
        if self.is_shown(layer) { opacity } else { 0.0 }
    }

    /// Whether the layer of a shape is shown.
    pub fn shows(&self, shape: &SceneShape) -> bool {
        self.is_shown(match shape {
            SceneShape::Zone { .. } => Layer::Zones,
            SceneShape::Line { .. } => Layer::Lines,
            SceneShape::Leg { .. } | SceneShape::Stop { .. } => Layer::Routes,
            SceneShape::Point(_) | SceneShape::Rally(_) => Layer::Points,
            SceneShape::Symbol { .. } => Layer::Symbols,
        })
    }

    /// Shows them as a list; those without a source are grey.
    pub fn show(&mut self, ui: &mut egui::Ui, has_source: impl Fn(Layer) -> bool) {
        for layer in Layer::ALL {
            let name = layer.name();
            ui.horizontal(|ui| {
                let is_there = has_source(layer);
                let shown = &mut self.shown[layer as usize];
                let shown_box = ui.add_enabled(is_there, egui::Checkbox::new(shown, name));
                shown_box.on_hover_text(layer.doc()).accessible_name(format!("layer: {name}"));
                if let Some(opacity) = self.opacity.get_mut(layer as usize) {
                    ui.spacing_mut().slider_width = 70.0;
                    let slider = egui::Slider::new(opacity, 0.0..=1.0).show_value(false);
                    let slider = ui.add_enabled(is_there && *shown, slider);
                    slider
                        .on_hover_text("How strongly it is shown")
                        .accessible_name(format!("opacity of {name}"));
                }
            });
        }
    }
}
