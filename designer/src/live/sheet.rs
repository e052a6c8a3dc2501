//! A drawing of the files, with the state of the running system in it.

use eframe::egui;

use crate::canvas::{Canvas, CanvasOutput, Diagram, JoinRules, PortAt};
use crate::item::Item;

/// One drawing, looked at.
pub struct Sheet {
    /// How it is looked at.
    pub canvas: Canvas<Item>,
    /// The drawing of the files alone.
    pub base: Diagram<Item>,
    /// The same with what runs in it.
    pub diagram: Diagram<Item>,
}

/// Nothing is joined while it runs.
struct Fixed;

impl JoinRules for Fixed {
    fn may_join(&self, _: PortAt, _: PortAt) -> Result<(), String> {
        Err("The live view is read-only: edit in the system or mission view".into())
    }
}

impl Sheet {
    /// A drawing that screen readers call `name`.
    pub fn new(name: &'static str) -> Self {
        let mut canvas = Canvas::new(name);
        canvas.is_editable = false;
        Self { canvas, base: Diagram::default(), diagram: Diagram::default() }
    }

    /// Draws other files.
    pub fn set(&mut self, base: Diagram<Item>) {
        self.diagram.clone_from(&base);
        self.base = base;
        self.canvas.drawing_changed(&self.diagram);
    }

    /// Draws the files alone again.
    pub fn clear(&mut self) {
        self.diagram.clone_from(&self.base);
    }

    /// Shows it; whether something was selected in it.
    pub fn show(&mut self, ui: &mut egui::Ui, minimap: bool) -> (CanvasOutput<Item>, bool) {
        self.canvas.minimap = minimap;
        let before = self.canvas.selection.clone();
        let shown = self.canvas.show(ui, &self.diagram, &Fixed);
        let is_new = self.canvas.selection != before && !self.canvas.selection.is_empty();
        (shown, is_new)
    }

    /// Selects nothing.
    pub fn select_none(&mut self) {
        self.canvas.selection.clear();
    }
}
