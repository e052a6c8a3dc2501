//! The panel at the left: the tools, the route that legs are added to, and the layers.

use eframe::egui::{self, ComboBox, RichText, ScrollArea};

use crate::commands::{Command, about};
use crate::map_view::layers::Layer;
use crate::map_view::model::mission_of;
use crate::map_view::state::MapView;
use crate::map_view::tools::Tool;
use crate::name::ItemName;
use crate::workspace::Workspace;

impl MapView {
    pub(super) fn show_palette(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.add_space(armor_picture::theme::NEAR);
            ui.strong("Tools");
            for tool in Tool::ALL {
                let name = tool.name();
                let button =
                    ui.selectable_label(self.tool == tool, &name).on_hover_text(tool.doc());
                if button.accessible_name(format!("map tool: {name}")).clicked() {
                    self.cancel();
                    self.tool = tool;
                }
            }
            self.show_tool_hint(ui, workspace);
            ui.add_space(armor_picture::theme::GAP);
            ui.strong("Layers");
            let map = mission_of(workspace).and_then(|mission| mission.map.as_ref());
            let has_picture = map.is_some_and(|map| map.picture.is_some());
            let has_grid = map.is_some_and(|map| map.grid.is_some());
            self.layers.show(ui, |layer| match layer {
                Layer::Picture => has_picture,
                Layer::Grid => has_grid,
                _ => true,
            });
            self.pictures.show_status(ui);
            ui.add_space(armor_picture::theme::GAP);
            let times = ui.selectable_label(self.times.is_open, "Times (T)");
            let times = times.on_hover_text(about(Command::ToggleTimes).doc);
            if times.accessible_name("times of the routes").clicked() {
                self.times.toggle();
            }
            let live = ui.selectable_label(self.live.is_open, "Live (P)");
            let live = live.on_hover_text(about(Command::ToggleProgress).doc);
            if live.accessible_name("the mission while it runs").clicked() {
                self.live.toggle();
            }
            ui.add_space(armor_picture::theme::GAP);
            self.show_others(ui, workspace);
        });
    }

    /// What the tool waits for, and of legs the route.
    fn show_tool_hint(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        if self.tool == Tool::Select {
            return;
        }
        ui.add_space(armor_picture::theme::NEAR);
        if matches!(self.tool, Tool::Leg | Tool::Stay) {
            self.show_route_choice(ui, workspace);
        }
        let is_begun = self.new_start.is_some();
        let text = match (self.tool, self.leg_route(workspace)) {
            (Tool::Leg, Some(route)) => format!("Click adds a leg to route {route}."),
            (Tool::Leg, None) if is_begun => "Click where the first leg leads to.".to_owned(),
            (Tool::Leg, None) => "Click where the robot is at first: a new route.".to_owned(),
            (Tool::Meeting, _) if self.meets_after.is_some() => {
                "Click the leg of the other robot, or its point.".to_owned()
            }
            (tool, _) => tool.doc().to_owned(),
        };
        ui.label(RichText::new(text).weak().small());
        ui.label(RichText::new("Escape ends the tool.").weak().small());
    }

    fn show_route_choice(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        let routes = mission_of(workspace).map_or(&[][..], |mission| &mission.routes);
        if !routes.is_empty() && self.tool == Tool::Leg {
            let button = ui.selectable_label(self.is_new_route, "New route");
            let button = button.on_hover_text("The next click is where another robot is at first");
            if button.accessible_name("begin a new route").clicked() {
                self.is_new_route = !self.is_new_route;
                self.new_start = None;
            }
        }
        if routes.len() < 2 {
            return;
        }
        let chosen = self.leg_route(workspace);
        let shown = chosen.map_or("", ItemName::as_str);
        let combo = ComboBox::from_id_salt("route of new legs").selected_text(shown);
        let combo = combo.show_ui(ui, |ui| {
            for route in routes {
                let name = ItemName::new(&route.name.value);
                if ui.selectable_label(chosen == Some(name), name.as_str()).clicked() {
                    (self.route, self.is_new_route) = (Some(name), false);
                    self.select([]);
                }
            }
        });
        combo.response.accessible_name("route of new legs");
    }
}
