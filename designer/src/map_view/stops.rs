//! Stays and meetings by mouse, by the menu of an item, and by the buttons of the properties.

use eframe::egui::{self, Pos2};

use crate::item::Item;
use crate::map_view::actions::legs_to;
use crate::map_view::edits;
use crate::map_view::model::mission_of;
use crate::map_view::state::MapView;
use crate::map_view::tools::Tool;
use crate::mission::panel::parts::section;
use crate::name::ItemName;
use crate::workspace::Workspace;

impl MapView {
    /// The steps of routes at a point of the window: the one that is there, or the legs to the point that
    /// is there.
    fn steps_at(&self, at: Pos2, workspace: &Workspace) -> Vec<Item> {
        for item in self.sight().items_at(at) {
            match item {
                Item::Step { .. } => return vec![item],
                Item::MapPoint(_) | Item::Rally(_) => {
                    let legs = legs_to(item, workspace);
                    if !legs.is_empty() {
                        return legs;
                    }
                }
                _ => {}
            }
        }
        Vec::new()
    }

    /// A click of the tools for stays and meetings.
    pub(super) fn add_stop_at(&mut self, at: Pos2, workspace: &mut Workspace) {
        let steps = self.steps_at(at, workspace);
        let Some(last) = steps.last().copied() else {
            workspace.messages.warn("Click a leg, or the point that it leads to.");
            return;
        };
        if self.tool == Tool::Stay {
            let wanted = self.leg_route(workspace);
            let of_route = steps.iter().rev().find(|step| route_of(**step) == wanted);
            self.add_stay(of_route.copied().unwrap_or(last), workspace);
            return;
        }
        let first = self.meets_after.take().unwrap_or(last);
        let other = steps.iter().rev().find(|step| route_of(**step) != route_of(first));
        match other.copied() {
            Some(other) => self.add_meeting(first, other, workspace),
            None => self.meets_after = Some(first),
        }
    }

    /// Adds a stay behind a step.
    fn add_stay(&mut self, after: Item, workspace: &mut Workspace) {
        let Item::Step { route, step } = after else { return };
        let mut added = None;
        workspace.edit(format!("add a stay to route {route}"), |documents| {
            added = Some(edits::add_stay(documents.mission()?, &route, &step)?);
            Ok(())
        });
        self.select_added(added.map(|stay| Item::step(route, stay)), workspace);
    }

    /// Adds a meeting of two routes behind a step of each.
    fn add_meeting(&mut self, one: Item, other: Item, workspace: &mut Workspace) {
        let (Item::Step { route, step }, Item::Step { route: other, step: behind }) = (one, other)
        else {
            return;
        };
        let mut added = None;
        workspace.edit(format!("let routes {route} and {other} meet"), |documents| {
            let ends = [(route.as_str(), step.as_str()), (other.as_str(), behind.as_str())];
            added = Some(edits::add_meeting(documents.mission()?, ends)?);
            Ok(())
        });
        self.select_added(added.map(|meet| Item::step(route, meet)), workspace);
    }

    /// What can follow the step that is selected, for those without a mouse.
    pub(super) fn show_followers(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        let Some(selected @ Item::Step { route, .. }) = self.only() else { return };
        let routes = mission_of(workspace).map_or(&[][..], |mission| &mission.routes);
        let ends = routes.iter().filter(|other| other.name.value != route.as_str());
        let ends = ends.filter_map(|other| {
            let last = other.steps.last()?.name();
            Some(Item::step(&other.name.value, &last.value))
        });
        let ends: Vec<_> = ends.collect();
        section(ui, "Add behind it");
        if ui.button("Stay").accessible_name("add a stay behind it").clicked() {
            self.add_stay(selected, workspace);
        }
        for end in ends {
            let Some(other) = route_of(end) else { continue };
            let button = ui.button(format!("Meeting with {other}"));
            let button = button.on_hover_text(format!("Route {other} waits behind its last step"));
            if button.accessible_name(format!("add a meeting with {other} behind it")).clicked() {
                self.add_meeting(selected, end, workspace);
            }
        }
    }
}

fn route_of(step: Item) -> Option<ItemName> {
    match step {
        Item::Step { route, .. } => Some(route),
        _ => None,
    }
}
