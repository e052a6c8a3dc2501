//! The view of the system as a pane of the window.

use std::collections::BTreeSet;

use eframe::egui;

use super::choices::SystemPicker;
use super::palette::DraggedKind;
use super::properties::field::{Field, Focus, write};
use super::run;
use super::state::SystemView;
use crate::canvas::{CanvasEvent, Diagram, snapped};
use crate::commands::Command;
use crate::help::pages::HelpPage;
use crate::item::Item;
use crate::pane::{Draft, Pane};
use crate::project::Documents;
use crate::workspace::Workspace;

/// From the pointer to the upper left corner of a block that is dropped.
const DROP_OFFSET: egui::Vec2 = egui::vec2(70.0, 30.0);

impl SystemView {
    fn take_event(&mut self, event: CanvasEvent<Item>, ui: &egui::Ui, workspace: &mut Workspace) {
        match event {
            CanvasEvent::Moved(by) => {
                let unplaced = self.unplaced();
                self.pane.move_selected(by, &self.drawing.diagram, &unplaced, workspace);
            }
            CanvasEvent::Joined(from, to) => self.join(from, to, workspace),
            CanvasEvent::Refused(why) => workspace.messages.warn(format!("Not linked: {why}")),
            CanvasEvent::Loose { from, at } => {
                self.picker = Some(SystemPicker::for_port(&self.drawing, workspace, from, at));
            }
            CanvasEvent::Rewired { wire, stays, to } => self.rewire(wire, stays, to, workspace),
            CanvasEvent::Opened(item @ Item::Decoration { .. })
                if self.drawing.diagram.node(item).is_some() =>
            {
                self.pane.select([item]);
                self.toggle_fold(workspace);
            }
            CanvasEvent::Opened(item) => {
                self.pane.select([item]);
                workspace.settings.properties = true;
                self.wants_focus = Focus::Value;
            }
            CanvasEvent::OpenedEmpty(at) => self.picker = Some(SystemPicker::to_add(workspace, at)),
            CanvasEvent::Menu { of, at } => self.pane.menu = (of, at),
            CanvasEvent::Resized(item, rect) => self.pane.resize(item, rect, workspace),
        }
        ui.ctx().request_repaint();
    }
}

impl Pane for SystemView {
    fn show_left_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.update(workspace);
        if let Some(kind) = self.palette.show(ui, workspace) {
            let at = self.pane.canvas.centre();
            self.add(&kind, at, workspace);
        }
    }

    fn show_right_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.update(workspace);
        self.show_properties(ui, workspace);
    }

    fn show_centre(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.update(workspace);
        let shown =
            self.pane.show(ui, &self.drawing.diagram, &self.drawing.joints, &workspace.settings);
        self.pane.take_enter(ui, &shown, workspace);
        self.show_empty_hint(ui, workspace);
        if let Some((kind, at)) = self.pane.dropped::<DraggedKind>(ui, &shown) {
            self.add(&kind.0, snapped(at - DROP_OFFSET), workspace);
        }
        for event in shown.events {
            self.take_event(event, ui, workspace);
        }
        let (of, at) = self.pane.menu;
        shown.response.context_menu(|ui| self.show_menu(ui, workspace, of, at));
        self.show_picker(ui, workspace);
    }

    fn is_asking(&self) -> bool {
        self.picker.is_some()
    }

    fn drawing_area(&self) -> egui::Rect {
        self.pane.canvas.rect()
    }

    fn can_run(&self, command: Command, workspace: &Workspace) -> Option<bool> {
        self.can_run(command, workspace)
    }

    fn run_command(&mut self, command: Command, ctx: &egui::Context, workspace: &mut Workspace) {
        self.update(workspace);
        self.run_command(command, ctx, workspace);
    }

    fn finish_field(&mut self, workspace: &mut Workspace) -> bool {
        self.drafts.end();
        self.take_drafts(workspace)
    }

    fn field_draft(&self) -> Option<Draft> {
        let (field, text, revision) = self.drafts.current()?;
        let (field, text) = (field.clone(), text.to_owned());
        let change = Box::new(move |documents: &mut Documents| write(documents, &field, &text));
        Some(Draft { revision, change })
    }

    fn help_page(&self, workspace: &Workspace, ctx: &egui::Context) -> Option<HelpPage> {
        let kind_of = |component: &str| {
            let configuration = workspace.project.configuration()?;
            let kind = &configuration.system.component(component)?.kind.value;
            workspace.project.kinds().find(kind).map(|manifest| manifest.kind.clone())
        };
        match self.drafts.focused(ctx) {
            Some(Field::Parameter(component, name)) => {
                let (kind, parameter) = (kind_of(component)?, Some(name.clone()));
                return Some(HelpPage::Kind { kind, parameter });
            }
            Some(Field::Frame(..) | Field::NewFrame) => {
                return HelpPage::find("file-format.md", "<frame>");
            }
            _ => {}
        }
        let item = self.pane.only()?;
        if let Item::Component(name) = item
            && let Some(kind) = kind_of(name.as_str())
        {
            return Some(HelpPage::Kind { kind, parameter: None });
        }
        HelpPage::of_item(item)
    }

    fn whole_drawing(&mut self, workspace: &Workspace) -> &Diagram<Item> {
        self.update(workspace);
        &self.drawing.diagram
    }

    fn show_item(&mut self, item: Item, workspace: &Workspace) {
        self.update(workspace);
        self.pane.show_item(self.shown_item(item), &self.drawing.diagram);
    }

    fn select_items(&mut self, items: BTreeSet<Item>) {
        self.pane.select(items);
    }

    fn paste_text(&mut self, text: &str, workspace: &mut Workspace) {
        self.update(workspace);
        self.paste_text(text, workspace);
    }

    fn findable_items(&self, workspace: &Workspace) -> Vec<(Item, String)> {
        run::list_findable(workspace)
    }
}
