//! The keyboard on the drawing: from block to block with the arrow keys, moving them with shift.

use eframe::egui::{self, Event as Input, EventFilter, Key, Modifiers, Pos2, Vec2};

use crate::canvas::diagram::Diagram;
use crate::canvas::diagram::DiagramId;
use crate::canvas::event::CanvasEvent;
use crate::canvas::snap::GRID;
use crate::canvas::state::Canvas;

/// The arrow keys, and the direction of each on the screen.
pub const ARROWS: [(Key, Vec2); 4] = [
    (Key::ArrowLeft, Vec2::new(-1.0, 0.0)),
    (Key::ArrowRight, Vec2::new(1.0, 0.0)),
    (Key::ArrowUp, Vec2::new(0.0, -1.0)),
    (Key::ArrowDown, Vec2::new(0.0, 1.0)),
];

/// Gives the arrow keys to a drawing that has the focus; otherwise they would move the focus.
pub fn keep_arrow_keys(ui: &egui::Ui, drawing: &egui::Response) {
    let filter =
        EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(drawing.id, filter));
}

impl<Id: DiagramId> Canvas<Id> {
    pub(super) fn handle_keys(
        &mut self,
        ui: &egui::Ui,
        response: &egui::Response,
        diagram: &Diagram<Id>,
        events: &mut Vec<CanvasEvent<Id>>,
    ) {
        keep_arrow_keys(ui, response);
        for (key, direction) in ARROWS {
            let pressed = |modifiers: Modifiers| {
                ui.input(|i| {
                    let is_it = |event: &&Input| {
                        matches!(event, Input::Key { key: k, pressed: true, modifiers: m, .. }
                            if *k == key && m.matches_exact(modifiers))
                    };
                    i.events.iter().filter(is_it).count()
                })
            };
            if pressed(Modifiers::NONE) > 0 {
                self.select_neighbour(diagram, direction);
            }
            let nudges = pressed(Modifiers::SHIFT);
            if nudges > 0 && self.is_editable && !self.selection.is_empty() {
                events.push(CanvasEvent::Moved(direction * GRID * nudges as f32));
            }
        }
        if ui.input(|i| i.key_pressed(Key::Home) && i.modifiers.is_none()) {
            self.fit_everything();
        }
    }

    /// Selects the nearest node in a direction, and brings it into view.
    fn select_neighbour(&mut self, diagram: &Diagram<Id>, direction: Vec2) {
        let from = self.selection.iter().find_map(|item| diagram.rect(item));
        let Some(from) = from.map(|rect| rect.center()) else {
            let first = diagram.nodes.first().map(|node| node.item);
            return first.into_iter().for_each(|item| self.go_to(diagram, item));
        };
        let cost = |at: Pos2| {
            let apart = at - from;
            let along = apart.dot(direction);
            // Distance across the direction counts more than distance along it.
            (along > 1.0).then(|| along + 2.5 * (apart - direction * along).length())
        };
        let others =
            diagram.nodes.iter().filter_map(|node| Some((cost(node.rect.center())?, node.item)));
        if let Some((_, item)) = others.min_by(|a, b| a.0.total_cmp(&b.0)) {
            self.go_to(diagram, item);
        }
    }

    /// Selects one item and brings it into view.
    pub fn go_to(&mut self, diagram: &Diagram<Id>, item: Id) {
        if let Some(rect) = diagram.rect(item) {
            self.bring_into_view(rect);
        }
        self.selection = [item].into();
    }

    fn bring_into_view(&mut self, rect: egui::Rect) {
        if self.rect.width() < 10.0 {
            return self.fit_area(rect.expand(200.0));
        }
        // Text too small to be read counts as not shown.
        self.viewport.zoom = self.viewport.zoom.max(0.5);
        let shown = self.viewport.shown(self.rect).shrink(30.0 / self.viewport.zoom);
        if !shown.contains_rect(rect) {
            self.viewport.centre = rect.center();
        }
    }
}
