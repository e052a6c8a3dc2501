//! The view as a pane of the window: its panels, its middle, and what it answers.

use std::collections::BTreeSet;
use std::path::Path;

use armor_picture::theme::ThemeColours;
use eframe::egui::{
    self, Align2, Key, Modifiers, Popup, Rect, Sense, Shape, Stroke, StrokeKind, Vec2,
};

use crate::canvas::{ARROWS, Diagram, keep_arrow_keys, paint_hint};
use crate::commands::Command;
use crate::export::{ExportError, export_shown};
use crate::help::pages::HelpPage;
use crate::item::Item;
use crate::map_view::commands::list_findable;
use crate::map_view::hit::MapHit;
use crate::map_view::model::placement_of;
use crate::map_view::names;
use crate::map_view::painting::{
    Looks, length_text, paint_lattice, paint_note, paint_scale_bar, paint_scene,
};
use crate::map_view::panel;
use crate::map_view::position_text::{degrees, metres};
use crate::map_view::state::{MapFit, MapGesture, MapView};
use crate::map_view::tools::Tool;
use crate::mission::changes::Change;
use crate::mission::panel::parts::PanelRequest;
use crate::pane::{Draft, Pane};
use crate::project::Documents;
use crate::workspace::Workspace;

/// The size of an exported map.
const EXPORT_SIZE: Vec2 = Vec2::new(1_200.0, 900.0);
/// The menu of an item.
const ITEM_MENU: &[Command] = &[
    Command::Properties,
    Command::Rename,
    Command::Link,
    Command::Copy,
    Command::Duplicate,
    Command::ZoomSelected,
    Command::Delete,
];

impl MapView {
    /// Allots the space of the map, and brings into it what is wanted.
    fn take_window(&mut self, ui: &mut egui::Ui) -> egui::Response {
        let (rect, _) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
        let is_changed = rect.size() != self.window.size() || self.pictures.take_opened();
        if self.stays_fitted && is_changed {
            self.fit = Some(MapFit::Everything);
        }
        self.window = rect;
        if rect.width() > 10.0
            && let Some(fit) = self.fit.take()
        {
            let everything = || {
                let drawn = self.scene.bounds();
                let below = self.pictures.bounds().into_iter().chain(self.others.bounds());
                drawn.into_iter().chain(below).reduce(|one, two| one.union(two))
            };
            let area = match fit {
                MapFit::Everything => everything(),
                MapFit::Area(area) => Some(area),
            };
            if let Some(area) = area {
                self.camera.fit(rect, area);
            }
        }
        ui.interact(rect, ui.scope_id().with(names::NAME), Sense::click_and_drag())
    }

    fn handle_keys(&mut self, ui: &egui::Ui, response: &egui::Response, workspace: &mut Workspace) {
        keep_arrow_keys(ui, response);
        for (key, direction) in ARROWS {
            // With shift first: a pattern without it takes both.
            if ui.input_mut(|input| input.consume_key(Modifiers::SHIFT, key)) {
                self.move_selected(self.nudge_m(direction), workspace);
            } else if ui.input_mut(|input| input.consume_key(Modifiers::NONE, key)) {
                self.select_neighbour(direction);
            }
        }
        if ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Home)) {
            self.fit_everything();
        }
        if ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Enter)) {
            match self.draft.is_empty() {
                true => workspace.order_command(Command::Properties),
                false => self.finish_draft(workspace),
            }
        }
    }

    fn paint(&mut self, ui: &egui::Ui, hovered: Option<MapHit>, workspace: &Workspace) {
        let colours = ThemeColours::of(ui.visuals());
        let painter = ui.painter().with_clip_rect(self.window);
        painter.rect_filled(self.window, 0.0, colours.background);
        paint_lattice(&painter, &self.camera, self.window, colours);
        self.pictures.paint(&painter, &self.camera, self.window, &self.layers);
        let looks = Looks {
            is_selected: &|item| {
                let of_route = match item {
                    Item::Step { route, .. } => Some(Item::Route(route)),
                    _ => None,
                };
                self.selection.contains(&item)
                    || of_route.is_some_and(|route| self.selection.contains(&route))
            },
            only: self.only(),
            hovered,
            corner: self.corner.map(MapHit::Corner),
            keeps_lines: self.keeps_lines,
            colours,
        };
        self.paint_others(&painter, colours);
        paint_scene(&painter, &self.sight(), &looks);
        self.paint_times(&painter, colours);
        self.paint_rehearsal(&painter, colours);
        self.paint_live(&painter, colours);
        self.paint_draft(&painter, colours);
        paint_scale_bar(&painter, &self.camera, self.window, colours);
        self.paint_coordinates(&painter, workspace, colours);
    }

    /// What is being drawn or dragged.
    fn paint_draft(&self, painter: &egui::Painter, colours: &ThemeColours) {
        let stroke = Stroke::new(1.5, colours.accent);
        match self.gesture {
            MapGesture::Frame { from, to } => {
                let fill = colours.accent.gamma_multiply(0.1);
                let frame = Rect::from_two_pos(from, to);
                painter.rect(frame, 0.0, fill, stroke, StrokeKind::Middle);
            }
            MapGesture::NewCorner { to, .. } | MapGesture::NewLeg { to, .. } => {
                painter.circle_stroke(self.sight().at(to), 6.0, stroke);
            }
            _ => {}
        }
        let pointer = self.pointer.filter(|at| self.window.contains(*at));
        let start = self.new_start.into_iter();
        let mut line: Vec<_> =
            start.chain(self.draft.iter().copied()).map(|at| self.sight().at(at)).collect();
        if line.is_empty() {
            return;
        }
        for at in &line {
            painter.circle(*at, 4.0, colours.background, stroke);
        }
        line.extend(pointer);
        painter.extend(Shape::dashed_line(&line, stroke, 6.0, 4.0));
        if self.tool == Tool::Measure {
            let ends = self.draft.iter().zip(self.draft.iter().skip(1));
            let drawn_m: f64 = ends.map(|(one, other)| one.distance_m(*other)).sum();
            let last = self.draft.last().zip(pointer);
            let rest_m =
                last.map_or(0.0, |(last, at)| last.distance_m(self.camera.to_map(self.window, at)));
            let at = pointer.or(line.last().copied()).unwrap_or_default() + Vec2::new(12.0, 12.0);
            let text = length_text(drawn_m + rest_m);
            paint_note(painter, at, Align2::LEFT_TOP, &text, colours);
        }
    }

    /// Where on the map, and in the world, the pointer is.
    fn paint_coordinates(
        &self,
        painter: &egui::Painter,
        workspace: &Workspace,
        colours: &ThemeColours,
    ) {
        let Some(at) = self.pointer.filter(|at| self.window.contains(*at)) else { return };
        let here = self.camera.to_map(self.window, at);
        let placement = placement_of(workspace);
        let geo = placement.and_then(|placement| placement.geo_from_map(here).ok());
        let mut text = format!("x {} m, y {} m", metres(here.x_m()), metres(here.y_m()));
        if let Some(geo) = geo {
            let latitude = degrees(geo.latitude_deg(), ['N', 'S']);
            let longitude = degrees(geo.longitude_deg(), ['E', 'W']);
            text += &format!("   {latitude} {longitude}");
        }
        let corner = self.window.right_bottom() - Vec2::splat(8.0);
        paint_note(painter, corner, Align2::RIGHT_BOTTOM, &text, colours);
    }

    fn show_menu(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        let (of, at) = self.menu;
        if of.is_some() {
            for command in ITEM_MENU {
                let may = self.may(*command, workspace).unwrap_or(false);
                workspace.offer_command(ui, *command, may);
            }
            ui.separator();
        }
        for (is_rally, text) in [(false, "Add a point here"), (true, "Add a rally point here")] {
            if ui.button(text).clicked() {
                self.add_point(is_rally, at, workspace);
                ui.close();
            }
        }
        if ui.button("Add a leg to here").clicked() {
            let at = self.camera.to_window(self.window, at);
            self.add_leg_at(at, workspace);
            ui.close();
        }
    }

    /// What to do on a map with nothing on it.
    fn show_empty_hint(&self, painter: &egui::Painter, colours: &ThemeColours) {
        if self.scene.items.is_empty() && self.draft.is_empty() && self.new_start.is_none() {
            let text = "Nothing is drawn on the map: choose a tool at the left, and click here.";
            paint_hint(painter, self.window, text, colours.weak);
        }
    }

    /// Makes changes of the properties, each a step of the history, and keeps what was renamed
    /// selected.
    fn make(&mut self, changes: Vec<Result<Change, String>>, workspace: &mut Workspace) -> bool {
        let mut are_made = true;
        for change in changes {
            let change = match change {
                Ok(change) => change,
                Err(why) => {
                    workspace.messages.warn(why);
                    are_made = false;
                    continue;
                }
            };
            let is_made = workspace.edit(change.what(), |documents| change.apply(documents));
            are_made &= is_made;
            if let Change::Rename(item, name) = &change
                && is_made
            {
                self.select_next = renamed(*item, name).into_iter().collect();
            }
        }
        are_made
    }
}

/// The item with another name.
fn renamed(item: Item, name: &str) -> Option<Item> {
    Some(match item {
        Item::MapPoint(_) => Item::map_point(name),
        Item::Rally(_) => Item::rally(name),
        Item::Zone(_) => Item::zone(name),
        Item::MapLine(_) => Item::map_line(name),
        Item::Route(_) => Item::route(name),
        Item::Step { route, .. } => Item::step(route, name),
        _ => return None,
    })
}

impl Pane for MapView {
    fn show_left_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.update(workspace);
        self.show_palette(ui, workspace);
    }

    fn show_right_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.update(workspace);
        let selected: Vec<_> = self.selection.iter().copied().collect();
        let mut requests = Vec::new();
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            requests = panel::show(ui, workspace, &self.marks, &selected, &mut self.form);
            self.show_followers(ui, workspace);
            self.show_shaping(ui, workspace);
        });
        let changes = self.form.finish(&mut |change| try_change(change, workspace));
        self.make(changes, workspace);
        for request in requests {
            match request {
                PanelRequest::Show(item) => workspace.shown = Some(item),
                PanelRequest::Apply(offer) => workspace.apply_offer(&offer),
                // Firings are played on the net.
                PanelRequest::Play(trace) => {
                    workspace.played = Some(trace);
                    workspace.order_command(Command::ShowMission);
                }
                PanelRequest::Toggle(_) => workspace.order_command(Command::ShowMission),
            }
        }
    }

    fn drawing_area(&self) -> Rect {
        self.window
    }

    fn show_running(&mut self) -> bool {
        if !self.live.is_open {
            self.live.toggle();
        }
        true
    }

    fn show_centre(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.update(workspace);
        self.pictures.receive(ui.ctx(), workspace);
        self.follow_others(ui, workspace);
        self.show_times(ui, workspace);
        self.show_live(ui, workspace);
        let response = self.take_window(ui);
        let fitted = self.camera;
        self.navigate(ui, &response);
        self.stays_fitted &= self.camera == fitted;
        self.pointer = response.hover_pos().or(response.interact_pointer_pos());
        if !self.click_encounter(&response) {
            self.handle_pointer(ui, &response, workspace);
        }
        let is_free = ui.memory(|m| m.focused().is_none() && m.top_modal_layer().is_none());
        if is_free && !Popup::is_any_open(ui.ctx()) {
            response.request_focus();
        }
        if response.has_focus() {
            self.handle_keys(ui, &response, workspace);
        }
        self.update(workspace);
        let hovered = self.pointer.and_then(|at| self.hit(at));
        self.paint(ui, hovered, workspace);
        self.show_empty_hint(ui.painter(), ThemeColours::of(ui.visuals()));
        if response.has_focus() {
            let line = Stroke::new(1.0, ThemeColours::of(ui.visuals()).accent);
            ui.painter().rect_stroke(self.window, 0.0, line, StrokeKind::Inside);
        }
        self.describe(ui, &response);
        response.context_menu(|ui| self.show_menu(ui, workspace));
    }

    fn can_run(&self, command: Command, workspace: &Workspace) -> Option<bool> {
        self.may(command, workspace)
    }

    fn run_command(&mut self, command: Command, ctx: &egui::Context, workspace: &mut Workspace) {
        self.update(workspace);
        self.run(command, ctx, workspace);
    }

    fn finish_field(&mut self, workspace: &mut Workspace) -> bool {
        let changes = self.form.end(&mut |change| try_change(change, workspace));
        self.make(changes, workspace)
    }

    fn field_draft(&self) -> Option<Draft> {
        let (revision, change) = self.form.draft()?;
        let change = Box::new(move |documents: &mut Documents| change.apply(documents));
        Some(Draft { revision, change })
    }

    fn help_page(&self, _: &Workspace, _: &egui::Context) -> Option<HelpPage> {
        HelpPage::of_item(self.only()?)
    }

    fn whole_drawing(&mut self, _: &Workspace) -> &Diagram<Item> {
        &self.no_diagram
    }

    fn drawn_items(&mut self, workspace: &Workspace) -> BTreeSet<Item> {
        self.update(workspace);
        self.scene.items.iter().map(|entry| entry.item).collect()
    }

    fn export(
        &mut self,
        workspace: &Workspace,
        path: &Path,
        is_dark: bool,
        scale: f32,
    ) -> Result<(), ExportError> {
        self.update(workspace);
        if self.scene.items.is_empty() {
            return Err(ExportError::Empty);
        }
        let (shown, selected) = (self.camera, std::mem::take(&mut self.selection));
        let window = self.window;
        let pointer = self.pointer.take();
        // Textures are those of one window.
        let pictures = std::mem::take(&mut self.pictures);
        self.pictures.follow();
        self.keeps_lines = true;
        let result = export_shown(EXPORT_SIZE, path, is_dark, scale, |ui| {
            self.pictures.receive(ui.ctx(), workspace);
            self.follow_others(ui, workspace);
            self.fit = Some(MapFit::Everything);
            self.take_window(ui);
            self.paint(ui, None, workspace);
            self.pictures.wait(ui.ctx(), workspace);
        });
        (self.camera, self.selection, self.pointer) = (shown, selected, pointer);
        (self.pictures, self.window, self.keeps_lines) = (pictures, window, false);
        result
    }

    fn finish_loading(&mut self, ctx: &egui::Context, workspace: &Workspace) {
        self.pictures.wait(ctx, workspace);
    }

    fn show_item(&mut self, item: Item, workspace: &Workspace) {
        self.update(workspace);
        self.select([item]);
        self.bring_into_view(item);
    }

    fn select_items(&mut self, items: BTreeSet<Item>) {
        self.select(items);
    }

    fn paste_text(&mut self, text: &str, workspace: &mut Workspace) {
        self.update(workspace);
        self.paste_fragment(text, "paste", workspace);
    }

    fn findable_items(&self, workspace: &Workspace) -> Vec<(Item, String)> {
        list_findable(workspace)
    }
}

/// Tries a change of a field: whether a value would be malformed with it.
fn try_change(change: &Change, workspace: &mut Workspace) -> Result<(), String> {
    workspace.project.try_edit(|documents| change.apply(documents))
}
