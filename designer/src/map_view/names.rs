//! The map for screen readers and tests: every item and handle that is shown has a name.

use eframe::egui::accesskit::{Action, Node, Rect as Bounds, Role};
use eframe::egui::{self, Rect, Vec2};

use crate::map_view::hit::{MapHit, SYMBOL_HEIGHT};
use crate::map_view::scene::SceneShape;
use crate::map_view::state::MapView;

/// What the drawing of the map is called.
pub const NAME: &str = "drawing of the map";
/// Side of the square around what is a point.
const POINT_SIZE: f32 = 18.0;

impl MapView {
    /// Publishes the names of what is shown. It costs nothing without a screen reader.
    pub(super) fn describe(&self, ui: &egui::Ui, response: &egui::Response) {
        let ctx = ui.ctx();
        let listens = ctx.accesskit_node_builder(response.id, |node| {
            node.set_role(Role::Canvas);
            node.set_label(NAME);
            node.add_action(Action::Focus);
        });
        if listens.is_none() {
            return;
        }
        let sight = self.sight();
        for entry in sight.items() {
            let at = sight.anchor(&entry.shape);
            let size = match &entry.shape {
                SceneShape::Symbol { .. } => Vec2::splat(SYMBOL_HEIGHT),
                _ => Vec2::splat(POINT_SIZE),
            };
            let area = Rect::from_center_size(at, size);
            if !self.window.intersects(area) {
                continue;
            }
            let is_selected = self.selection.contains(&entry.item);
            publish(ctx, response.id.with(entry.item), &entry.label, area, |node| {
                node.set_role(Role::ListItem);
                node.set_selected(is_selected);
                if !entry.doc.is_empty() {
                    node.set_description(entry.doc.as_str());
                }
            });
        }
        let label_of = |item| self.scene.find(item).map_or("", |entry| entry.label.as_str());
        for handle in sight.handles(self.only()) {
            let label = match handle.hit {
                MapHit::Corner(corner) => {
                    format!("corner {} of {}", corner.number + 1, label_of(corner.item))
                }
                MapHit::NewCorner(corner) => {
                    format!("new corner {} of {}", corner.number + 1, label_of(corner.item))
                }
                MapHit::NewLeg(item) => format!("middle of {}", label_of(item)),
                MapHit::Item(item) => label_of(item).to_owned(),
            };
            let area = Rect::from_center_size(handle.at, Vec2::splat(POINT_SIZE));
            publish(ctx, response.id.with(("handle", label.as_str())), &label, area, |node| {
                node.set_role(Role::Button);
            });
        }
        self.describe_others(ctx, response);
        self.describe_times(ctx, response);
        self.describe_rehearsal(ctx, response);
        self.describe_live(ctx, response);
    }
}

/// Publishes the name of what is in an area.
pub fn publish(
    ctx: &egui::Context,
    id: egui::Id,
    label: &str,
    area: Rect,
    more: impl FnOnce(&mut Node),
) {
    ctx.accesskit_node_builder(id, |node| {
        node.set_label(label);
        node.set_bounds(Bounds {
            x0: area.min.x.into(),
            y0: area.min.y.into(),
            x1: area.max.x.into(),
            y1: area.max.y.into(),
        });
        more(node);
    });
}
