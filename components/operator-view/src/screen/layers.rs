//! The layers of the map: each linked one can be switched off.

use super::colours::colours_of;
use armor_picture::theme;
use eframe::egui::{Color32, RichText, Ui};

use crate::console::Console;

/// The layers, in the order in which they are painted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layer {
    Map,
    Truth,
    Odometry,
    Trajectory,
    Particles,
    Path,
    Scan,
    Camera,
}

/// Each with its name, its colour and the inputs that it comes from.
const LAYERS: [(Layer, &str, Color32, &[&str]); 8] = [
    (Layer::Map, "map", Color32::GRAY, &["map", "map_updates"]),
    (Layer::Scan, "scan", theme::map::SCAN, &["scan"]),
    (Layer::Trajectory, "trajectory", theme::map::TRAJECTORY, &["trajectory", "pose"]),
    (Layer::Odometry, "odometry", theme::map::ODOMETRY, &["odometry"]),
    (Layer::Truth, "truth", theme::map::TRUTH, &["truth"]),
    (Layer::Particles, "particles", theme::map::PARTICLES, &["particles"]),
    (Layer::Path, "path", theme::map::PATH, &["path"]),
    (Layer::Camera, "camera", Color32::GRAY, &["image"]),
];

/// What is switched off.
#[derive(Default)]
pub(super) struct Layers {
    hidden: Vec<Layer>,
}

impl Layers {
    /// Returns whether a layer is shown.
    pub(super) fn is_shown(&self, layer: Layer) -> bool {
        !self.hidden.contains(&layer)
    }

    /// Shows a switch for each layer with a linked input.
    pub(super) fn show_switches(&mut self, ui: &mut Ui, console: &Console) -> bool {
        let mut is_any = false;
        for (layer, name, colour, inputs) in LAYERS {
            if !inputs.iter().any(|input| console.is_linked(input)) {
                continue;
            }
            is_any = true;
            let mut is_shown = self.is_shown(layer);
            let text = RichText::new(name).color(colours_of(ui).make_legible(colour));
            if ui.checkbox(&mut is_shown, text).changed() {
                self.hidden.retain(|hidden| *hidden != layer);
                if !is_shown {
                    self.hidden.push(layer);
                }
            }
        }
        is_any
    }
}
