//! The drawing for screen readers and tests: every node and port that is shown has a name.

use eframe::egui::accesskit::{Action, Rect as Bounds, Role};
use eframe::egui::{self, Pos2, Rect, Vec2};

use crate::canvas::curve::point_at;
use crate::canvas::diagram::Diagram;
use crate::canvas::diagram::DiagramId;
use crate::canvas::edges::path;
use crate::canvas::state::Canvas;

/// Side of the square around the middle of a port.
const PORT_SIZE: f32 = 14.0;

impl<Id: DiagramId> Canvas<Id> {
    /// Publishes the names of what is shown. It costs nothing without a screen reader.
    pub(super) fn describe_drawing(
        &self,
        ui: &egui::Ui,
        response: &egui::Response,
        diagram: &Diagram<Id>,
    ) {
        let ctx = ui.ctx();
        let listens = ctx.accesskit_node_builder(response.id, |node| {
            node.set_role(Role::Canvas);
            node.set_label(self.name);
            node.add_action(Action::Focus);
        });
        if listens.is_none() {
            return;
        }
        let shown = self.viewport.shown(self.rect);
        for n in self.grid.nodes_in(shown, diagram.nodes.len()) {
            let node = &diagram.nodes[n];
            if !shown.intersects(node.rect) {
                continue;
            }
            let area = self.viewport.area_to_window(self.rect, node.rect);
            let is_selected = self.selection.contains(node.item);
            describe(ctx, response.id.with(("node", n)), &node.label, &node.doc, area, |entry| {
                entry.set_role(Role::ListItem);
                entry.set_selected(is_selected);
            });
            for (p, port) in node.ports.iter().enumerate() {
                let at = self.to_window(node.rect.min + port.at);
                let area = Rect::from_center_size(at, Vec2::splat(PORT_SIZE));
                describe(
                    ctx,
                    response.id.with(("port", n, p)),
                    &port.label,
                    &port.doc,
                    area,
                    |entry| {
                        entry.set_role(Role::Button);
                    },
                );
            }
        }
        for (n, wire) in diagram.wires.iter().enumerate() {
            let ends = [wire.from, wire.to].map(|port| diagram.port_position(port));
            if let [Some(from), Some(to)] = ends
                && shown.intersects(Rect::from_two_pos(from, to).expand(1.0))
            {
                let middle: Pos2 = self.to_window(self.name_point(diagram, n));
                let area = Rect::from_center_size(middle, Vec2::splat(8.0));
                describe(
                    ctx,
                    response.id.with(("wire", n)),
                    &wire.label,
                    &wire.doc,
                    area,
                    |entry| {
                        entry.set_role(Role::ListItem);
                    },
                );
            }
        }
        let ends = ["start", "end"].into_iter().zip(self.grips(diagram));
        for (word, (n, _, at)) in ends {
            let area = Rect::from_center_size(self.to_window(at), Vec2::splat(PORT_SIZE));
            let label = format!("{word} of {}", diagram.wires[n].label);
            describe(ctx, response.id.with(("grip", n, word)), &label, "", area, |entry| {
                entry.set_role(Role::Button);
            });
        }
        for (n, decoration) in diagram.decorations.iter().enumerate() {
            let area = self.viewport.area_to_window(self.rect, decoration.rect);
            let sort = if decoration.is_note { "note" } else { "group" };
            let label = format!("{sort} {}", decoration.text);
            describe(ctx, response.id.with(("decoration", n)), &label, "", area, |entry| {
                entry.set_role(Role::Note);
            });
        }
    }
}

impl<Id: DiagramId> Canvas<Id> {
    /// The point of a wire that is its alone: its middle, or in a bundle that of its first piece.
    fn name_point(&self, diagram: &Diagram<Id>, wire: usize) -> Pos2 {
        let still = |_| Vec2::ZERO;
        let points = match self.closed_bundle(diagram, wire) {
            Some(bundle) => diagram.bundled_path(bundle, wire, still, 24).map(|[out, ..]| out),
            None => path(diagram, wire, still, 24),
        };
        point_at(&points.unwrap_or_default(), 0.5)
    }
}

fn describe(
    ctx: &egui::Context,
    id: egui::Id,
    label: &str,
    doc: &str,
    area: Rect,
    more: impl FnOnce(&mut egui::accesskit::Node),
) {
    // Without a name there is nothing to announce; the list of problems reports its absence.
    if label.trim().is_empty() {
        return;
    }
    ctx.accesskit_node_builder(id, |node| {
        node.set_label(label);
        if !doc.is_empty() {
            node.set_description(doc);
        }
        node.set_bounds(Bounds {
            x0: area.min.x.into(),
            y0: area.min.y.into(),
            x1: area.max.x.into(),
            y1: area.max.y.into(),
        });
        more(node);
    });
}
