//! The commands of the view.

use armor_robotfile::Item as Named;
use eframe::egui::{self, Pos2, Vec2};

use crate::commands::Command;
use crate::item::Item;
use crate::map_view::camera::MapBounds;
use crate::map_view::fragment::{self, PasteTarget};
use crate::map_view::model::{mission_of, placement_of};
use crate::map_view::movers::drivers_of_new_route;
use crate::map_view::state::{MapFit, MapView};
use crate::map_view::tools::Tool;
use crate::workspace::Workspace;

/// How much one command makes the map larger.
const ZOOM_STEP: f64 = 1.25;
/// Points of the window for a metre at actual size.
const ACTUAL_SCALE: f64 = 20.0;

impl MapView {
    pub(super) fn may(&self, command: Command, workspace: &Workspace) -> Option<bool> {
        use Command as C;
        let selected = self.selection.len();
        Some(match command {
            C::Delete | C::Copy | C::Cut | C::Duplicate => selected > 0,
            C::Paste => workspace.project.configuration().is_some(),
            C::Properties | C::Rename => selected == 1,
            C::ZoomSelected => selected > 0,
            C::Link => matches!(self.only(), Some(Item::MapPoint(_) | Item::Rally(_))),
            C::Add => workspace.project.configuration().is_some(),
            C::Rehearse => self.may_rehearse(workspace) && !self.rehearsal.is_going_on(),
            C::SelectAll | C::ZoomFit => mission_of(workspace).is_some(),
            C::ToggleTimes
            | C::ToggleProgress
            | C::SelectNone
            | C::ZoomIn
            | C::ZoomOut
            | C::ZoomActual => true,
            _ => return None,
        })
    }

    pub(super) fn run(&mut self, command: Command, ctx: &egui::Context, workspace: &mut Workspace) {
        use Command as C;
        match command {
            C::Delete => self.delete(workspace),
            C::Copy => {
                self.copy(ctx, workspace);
            }
            C::Cut if self.copy(ctx, workspace) => self.delete(workspace),
            C::Duplicate => {
                if let Some(text) = self.copied_text(workspace) {
                    self.paste_fragment(&text, "duplicate", workspace);
                }
            }
            C::Paste => ctx.send_viewport_cmd(egui::ViewportCommand::RequestPaste),
            // Enter ends what is being drawn.
            C::Properties if !self.draft.is_empty() => self.finish_draft(workspace),
            C::Properties | C::Rename => {
                workspace.settings.properties = true;
                self.form.take_focus();
            }
            C::Link => self.add_leg_to_selected(workspace),
            C::Add => {
                let at = self.spot(workspace);
                self.add_point(self.tool == Tool::Rally, at, workspace);
            }
            C::SelectAll => {
                let all: Vec<_> = self.sight().items().map(|entry| entry.item).collect();
                self.select(all);
            }
            C::ToggleTimes => self.times.toggle(),
            C::Rehearse => {
                if !self.times.is_open {
                    self.times.toggle();
                }
                self.rehearsal.request();
            }
            C::ToggleProgress => self.live.toggle(),
            C::SelectNone if self.cancel() => {}
            C::SelectNone => self.select([]),
            C::ZoomFit => self.fit_everything(),
            C::ZoomSelected => {
                let entries = self.scene.items.iter();
                let entries = entries.filter(|entry| self.selection.contains(&entry.item));
                let bounds = entries.filter_map(|entry| entry.shape.bounds());
                self.fit = bounds.reduce(MapBounds::union).map(MapFit::Area);
                self.stays_fitted = false;
            }
            C::ZoomIn => self.zoom_by(ZOOM_STEP),
            C::ZoomOut => self.zoom_by(1.0 / ZOOM_STEP),
            C::ZoomActual => {
                self.camera.set_scale(ACTUAL_SCALE);
                self.stays_fitted = false;
            }
            _ => {}
        }
    }

    /// What is selected, as the text of a file; states why if that is nothing.
    fn copied_text(&self, workspace: &mut Workspace) -> Option<String> {
        let document = workspace.project.document_with(Named::Mission);
        let mission = mission_of(workspace);
        let text = document
            .zip(mission)
            .and_then(|(document, mission)| fragment::copied(document, mission, &self.selection));
        if text.is_none() {
            workspace.messages.warn("Nothing copied: select something that is drawn on the map.");
        }
        text
    }

    fn copy(&self, ctx: &egui::Context, workspace: &mut Workspace) -> bool {
        let text = self.copied_text(workspace);
        let is_copied = text.is_some();
        text.into_iter().for_each(|text| ctx.copy_text(text));
        is_copied
    }

    /// Adds what was copied, and selects it.
    pub(super) fn paste_fragment(&mut self, text: &str, what: &str, workspace: &mut Workspace) {
        let (route, drivers) = (self.leg_route(workspace), drivers_of_new_route(workspace));
        let placement = placement_of(workspace);
        let mut added = Vec::new();
        workspace.edit(what, |documents| {
            let target = PasteTarget {
                placement: placement.as_ref(),
                route: route.as_ref().map(|route| route.as_str()),
                drivers: drivers.as_ref(),
            };
            added = fragment::paste(documents.mission()?, text, target)?;
            Ok(())
        });
        if !added.is_empty() {
            self.select_next = added;
        }
    }

    /// Shows everything from now on, until the view is moved.
    pub(super) fn fit_everything(&mut self) {
        self.fit = Some(MapFit::Everything);
        self.stays_fitted = true;
    }

    fn zoom_by(&mut self, factor: f64) {
        self.stays_fitted = false;
        self.camera.zoom_at(self.window, self.window.center(), factor);
    }

    /// Selects the nearest item in a direction.
    pub(super) fn select_neighbour(&mut self, way: Vec2) {
        let sight = self.sight();
        let at =
            |item: Item| sight.items().find(|it| it.item == item).map(|it| sight.anchor(&it.shape));
        let next = match self.only().and_then(at) {
            None => sight.items().last().map(|entry| entry.item),
            Some(from) => {
                let cost = |to: Pos2| {
                    let apart = to - from;
                    let along = apart.dot(way);
                    // Distance across the direction counts more than distance along it.
                    (along > 1.0).then(|| along + 2.5 * (apart - way * along).length())
                };
                let others = sight
                    .items()
                    .filter_map(|entry| Some((cost(sight.anchor(&entry.shape))?, entry.item)));
                others.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, item)| item)
            }
        };
        if let Some(item) = next {
            self.select([item]);
            self.bring_into_view(item);
        }
    }

    /// Moves the map if an item is not in the window.
    pub(super) fn bring_into_view(&mut self, item: Item) {
        let Some(entry) = self.scene.find(item) else { return };
        let points = entry.shape.points();
        if self.window.width() < 10.0 {
            self.fit = MapBounds::of(points).map(MapFit::Area);
            self.stays_fitted = false;
            return;
        }
        let inner = self.window.shrink(30.0);
        let is_shown =
            points.iter().any(|at| inner.contains(self.camera.to_window(self.window, *at)));
        if let Some(bounds) = MapBounds::of(points.iter().copied()).filter(|_| !is_shown) {
            self.camera.show(bounds.centre());
            self.stays_fitted = false;
        }
    }
}

/// Every item of the map and its routes, with its words.
pub(super) fn list_findable(workspace: &Workspace) -> Vec<(Item, String)> {
    let Some(mission) = mission_of(workspace) else { return Vec::new() };
    let map = mission.map.iter();
    let mut found: Vec<(Item, String)> = Vec::new();
    for map in map {
        found.extend(map.points.iter().map(|it| (Item::map_point(&it.name.value), String::new())));
        found.extend(map.rallies.iter().map(|it| (Item::rally(&it.name.value), String::new())));
        found.extend(map.zones.iter().map(|it| (Item::zone(&it.name.value), String::new())));
        found.extend(map.lines.iter().map(|it| (Item::map_line(&it.name.value), String::new())));
        let symbols = map.symbols.iter().enumerate();
        found.extend(symbols.map(|(number, it)| (Item::Symbol(number), it.sidc.value.clone())));
    }
    for route in &mission.routes {
        found.push((Item::route(&route.name.value), route.mover.component.value.clone()));
        let steps = route.steps.iter();
        found.extend(
            steps.map(|step| (Item::step(&route.name.value, &step.name().value), String::new())),
        );
    }
    found
}
