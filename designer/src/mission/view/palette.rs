//! The palette of the mission: its elements, dragged into the drawing or added by a click.

use armor_robotfile::mission::ArcKind;
use eframe::egui::{self, Label, RichText, ScrollArea, Sense, UiBuilder};

use super::gestures::NODE_SPACE;
use super::part::DraggedPart;
use super::state::{MissionView, mission_of};
use crate::commands::Command;
use crate::diagram_pane::show_dragged;
use crate::item::Item;
use crate::mission::changes::Change;
use crate::panels::fields::anything;
use crate::workspace::Workspace;

/// What arcs from a place to a transition can do.
const KINDS: [(ArcKind, &str, &str); 4] = [
    (ArcKind::Take, "take", "The transition takes a token from the place."),
    (ArcKind::Read, "read", "It needs a token there and leaves it."),
    (ArcKind::Inhibitor, "inhibit", "It waits while the place has a token."),
    (ArcKind::Reset, "reset", "It takes all tokens."),
];

impl MissionView {
    pub(super) fn show_palette(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        ui.add_space(armor_picture::theme::NEAR);
        ui.strong("Mission");
        let mut wanted = None;
        let parts = [
            (DraggedPart::Place, "Place", "A state of the mission; components are active in it."),
            (DraggedPart::Transition, "Transition", "A change of state, with its conditions."),
        ];
        for (dragged, name, about) in parts {
            if entry(ui, &dragged, name, about, about) {
                wanted = Some(dragged);
            }
        }
        ui.add_space(armor_picture::theme::NEAR);
        ui.weak("Arcs from a place to a transition");
        ui.horizontal_wrapped(|ui| {
            for (kind, name, doc) in KINDS {
                ui.selectable_value(&mut self.kind, kind, name)
                    .on_hover_text(doc)
                    .accessible_name(format!("arcs {name}"));
            }
        });
        let name = if self.simulator.is_some() { "End the simulation" } else { "Simulate" };
        let may = mission_of(workspace).is_some();
        ui.add_space(armor_picture::theme::NEAR);
        if ui.add_enabled(may, egui::Button::new(name)).clicked() {
            workspace.order_command(Command::Simulate);
        }
        ui.add_space(armor_picture::theme::GAP);
        ui.strong("Places that activate");
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let system =
                workspace.project.configuration().map(|configuration| &configuration.system);
            for component in system.iter().flat_map(|system| &system.components) {
                let name = &component.name.value;
                let uses = mission_of(workspace).map_or(0, |mission| {
                    mission.places.iter().filter(|place| place.activates(name)).count()
                });
                let why = workspace.project.kinds().explain_uncontrolled(component);
                let may = why.is_none();
                let about = match (may, uses) {
                    (false, _) => "always active: no mission controls it".to_owned(),
                    (true, 0) => "in no place: always active".to_owned(),
                    (true, 1) => "in one place".to_owned(),
                    (true, uses) => format!("in {uses} places"),
                };
                let doc = why.unwrap_or_else(|| format!("kind {}", component.kind.value));
                let dragged = DraggedPart::Active(name.clone());
                ui.add_enabled_ui(may, |ui| {
                    if entry(ui, &dragged, name, &about, &doc) {
                        wanted = Some(dragged.clone());
                    }
                });
            }
        });
        if let Some(dragged) = wanted {
            let at = self.diagram.free_spot(self.pane.canvas.centre(), NODE_SPACE);
            self.add_part(&dragged, at, workspace);
        }
    }

    /// A group or note that is selected; returns whether one is.
    pub(super) fn decoration_panel(&mut self, ui: &mut egui::Ui, selected: &[Item]) -> bool {
        let [item @ Item::Decoration { number, .. }] = selected else { return false };
        let decorations = &self.diagram.decorations;
        let Some(decoration) = decorations.iter().find(|d| d.item == *item) else { return false };
        ui.heading(if decoration.is_note { "Note" } else { "Group" });
        let change = |text: &str| Some(Change::Decoration(*number, text.to_owned()));
        let text = decoration.text.clone();
        self.form.of(item).line(ui, "text", &text, &anything, change);
        true
    }
}

/// One line of the palette; returns whether it is to be added.
fn entry(ui: &mut egui::Ui, dragged: &DraggedPart, name: &str, about: &str, doc: &str) -> bool {
    let id = ui.scope_id().with(("part", name));
    let inner = UiBuilder::new().id_salt(id).sense(Sense::click_and_drag());
    let response = ui
        .scope_builder(inner, |ui| {
            let response = ui.response();
            let visuals = ui.style().interact(&response);
            let is_lit = response.hovered() || response.has_focus();
            let fill = if is_lit { visuals.weak_bg_fill } else { egui::Color32::TRANSPARENT };
            let frame = egui::Frame::new().inner_margin(5.0).corner_radius(5.0).fill(fill);
            frame.show(ui, |ui| {
                ui.set_width(ui.available_width());
                ui.spacing_mut().item_spacing.y = 1.0;
                ui.add(Label::new(RichText::new(name).strong()).selectable(false).truncate());
                let about = RichText::new(about).weak().small();
                ui.add(Label::new(about).selectable(false).wrap());
            });
        })
        .response;
    let label = match dragged {
        DraggedPart::Active(_) => format!("place with {name}"),
        _ => format!("new {}", name.to_lowercase()),
    };
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &label));
    response.dnd_set_drag_payload(dragged.clone());
    if response.dragged() {
        show_dragged(ui, name);
    }
    let enter = response.has_focus()
        && ui.input_mut(|i| i.consume_key(egui::Modifiers::NONE, egui::Key::Enter));
    let twice = response.double_clicked();
    response.on_hover_text(doc).on_disabled_hover_text(doc);
    twice || enter
}
