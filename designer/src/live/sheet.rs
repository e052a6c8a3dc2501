//! A drawing of the files, with the state of the running system in it.

use eframe::egui::{self, Vec2};

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
    /// Its width and height; zero if there is nothing in it.
    pub size: Vec2,
}

/// Nothing is joined while it runs.
struct Fixed;

impl JoinRules for Fixed {
    fn may_join(&self, _: PortAt, _: PortAt) -> Result<(), String> {
        Err("The live view is read-only: edit in the system or mission view".into())
    }
}

/// Moves the ports of nodes to their edges: the handles from which arcs are drawn stand off from the
/// bars, and are not shown here, so that arcs would end in the void.
fn put_ports_at_edges(diagram: &mut Diagram<Item>) {
    for node in &mut diagram.nodes {
        let size = node.rect.size();
        for port in &mut node.ports {
            port.at = port.at.clamp(Vec2::ZERO, size);
        }
    }
}

impl Sheet {
    /// A drawing that screen readers call `name`.
    pub fn new(name: &'static str) -> Self {
        let mut canvas = Canvas::new(name);
        canvas.is_editable = false;
        let (base, diagram) = (Diagram::default(), Diagram::default());
        Self { canvas, base, diagram, size: Vec2::ZERO }
    }

    /// Draws other files.
    pub fn set(&mut self, mut base: Diagram<Item>) {
        put_ports_at_edges(&mut base);
        self.diagram.clone_from(&base);
        self.size = base.extent().map_or(Vec2::ZERO, |extent| extent.size());
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mission::net;
    use crate::project::Project;
    use armor_picture::theme::ThemeColours;

    #[test]
    fn arcs_touch_their_bars() {
        let text = r#"<armor version="1"><system name="s"/>
          <mission name="m" goal="over"><place name="look" initial="true"/><place name="over"/>
          <transition name="seen" from="look" to="over" timeout="1s"/></mission></armor>"#;
        let project = Project::still(&[("a.xml".into(), text.into())], Arc::default());
        let base = net(&project, ThemeColours::of_theme(true));
        let ends_outside = |diagram: &Diagram<Item>| {
            let nodes = diagram.nodes.iter();
            let outside = |node: &crate::canvas::DiagramNode<Item>| {
                let size = node.rect.size();
                node.ports.iter().any(|port| port.at != port.at.clamp(Vec2::ZERO, size))
            };
            nodes.filter(|node| outside(node)).count()
        };
        assert!(ends_outside(&base) > 0, "where they are drawn, a bar has handles next to it");
        let mut sheet = Sheet::new("net");
        sheet.set(base);
        assert_eq!(ends_outside(&sheet.diagram), 0);
    }
}
