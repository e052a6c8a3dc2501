//! The panel of what is selected: a component with its parameters and ports, a link, a note, or the
//! system itself.

mod component;
mod editors;
pub(super) mod field;
mod frames;
mod link;

use std::collections::BTreeSet;

use eframe::egui::{self, Button, ComboBox, ScrollArea};

use self::field::{Field, Focus, check_name, write};
use crate::canvas::Direction;
use crate::commands::{Command, about};
use crate::item::Item;
use crate::layout;
use crate::panels::fields::{Form, anything};
use crate::project::elsewhere::NameChange;
use crate::system::rules::Joint;
use crate::system::state::SystemView;
use crate::workspace::Workspace;

impl SystemView {
    pub(super) fn show_properties(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        ui.add_space(armor_picture::theme::NEAR);
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 6.0;
            let only = self.pane.only();
            match (only, self.pane.canvas.selection.len()) {
                (Some(Item::Component(name)), _) => self.component_properties(ui, workspace, &name),
                (Some(Item::Link { from, to }), _) => {
                    self.link_properties(ui, workspace, &from, &to);
                }
                (Some(item @ Item::Decoration { .. }), _) => self.decoration(ui, item, workspace),
                (_, 0) => self.system_properties(ui, workspace),
                (_, count) => several(ui, workspace, count),
            }
        });
        self.take_drafts(workspace);
    }

    /// Makes the changes of the fields that were left; returns whether none was refused.
    pub(super) fn take_drafts(&mut self, workspace: &mut Workspace) -> bool {
        let drafts = self.drafts.finish();
        drafts.iter().fold(true, |all, (field, text)| self.apply(field, text, workspace) && all)
    }

    fn decoration(&mut self, ui: &mut egui::Ui, item: Item, workspace: &mut Workspace) {
        let Item::Decoration { view, number } = item else { return };
        let document = workspace.project.document_with(armor_robotfile::Item::System);
        let layout = document.map(|document| layout::read(document, view)).unwrap_or_default();
        let Some(decoration) = layout.decorations.get(number) else { return };
        ui.strong(if decoration.is_note { "Note" } else { "Group" });
        let name = if decoration.is_note { "Text" } else { "Title" };
        let rows = if decoration.is_note { 6 } else { 1 };
        let form = Form { name, hint: "", width: 0.0, rows };
        let field = Field::Text(number);
        let response = self.drafts.text(ui, &field, &decoration.text, form, &anything);
        self.focus(&response);
        self.show_fold_button(ui, workspace);
    }

    fn system_properties(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        let Some(configuration) = workspace.project.configuration() else {
            ui.weak("There is no system in this file.");
            return;
        };
        let system = &configuration.system;
        ui.strong("System");
        let name = system.name.as_ref().map_or("", |name| name.value.as_str());
        ui.label("Name");
        let form = Form { name: "System name", hint: "the robot's name", width: 0.0, rows: 1 };
        let field = Field::Attribute(Item::System, "name");
        self.drafts.text(ui, &field, name, form, &check_name);
        ui.label("Time follows");
        let source = system.clock.as_ref().map(|clock| clock.source.data()).unwrap_or_default();
        let shown = if source.is_empty() { "the clock of this computer" } else { &source };
        let clocks = self.clocks();
        ComboBox::from_id_salt("clock")
            .selected_text(shown)
            .width(ui.available_width())
            .show_ui(ui, |ui| {
                for clock in std::iter::once(String::new()).chain(clocks) {
                    let text = if clock.is_empty() { "the clock of this computer" } else { &clock };
                    if ui.selectable_label(clock == source, text).clicked() {
                        self.drafts.set(Field::Clock, clock.as_str());
                    }
                }
            })
            .response
            .accessible_name("system clock");
        self.show_frames(ui, workspace, system);
        ui.add_space(armor_picture::theme::NEAR);
        ui.weak(format!("{} components, {} links", system.components.len(), system.links.len()));
        ui.weak("Select a block or a link to see its properties.");
    }

    /// The outputs that can be the system's clock.
    fn clocks(&self) -> Vec<String> {
        let joints = self.drawing.joints.ports.iter().flatten().chain(&self.drawing.hidden.joints);
        let clocks = joints.filter(|joint| {
            joint.direction == Direction::Out
                && joint.message.as_ref().is_some_and(|(name, ..)| name == "Clock")
        });
        // A port of a folded group is also one of a component in it.
        let clocks: BTreeSet<_> = clocks.map(Joint::data).collect();
        clocks.into_iter().collect()
    }

    /// Gives a field the focus, if one was asked for.
    fn focus(&mut self, response: &egui::Response) {
        if std::mem::take(&mut self.wants_focus) != Focus::Nothing {
            response.request_focus();
            response.scroll_to_me(None);
        }
    }

    fn apply(&mut self, field: &Field, text: &str, workspace: &mut Workspace) -> bool {
        let what = match field {
            Field::Name(name) => format!("rename {name} to {text}"),
            Field::Attribute(item, attribute) => format!("set {attribute} of {item}"),
            Field::Parameter(component, name) => format!("set {component}.{name}"),
            Field::NoParameter(component, name) => format!("clear {component}.{name}"),
            Field::Text(_) => "edit text".to_owned(),
            Field::Clock => "set the clock".to_owned(),
            Field::Frame(name, attribute) => format!("set {attribute} of frame {name}"),
            Field::NewFrame => format!("add frame {text}"),
            Field::NoFrame(name) => format!("remove frame {name}"),
        };
        let is_made = workspace.edit(what, |documents| write(documents, field, text));
        if is_made && let Field::Name(old) = field {
            self.pane.select_when_drawn([Item::component(text)]);
            if old != text {
                let (item, new) = (Item::component(old), text.to_owned());
                workspace.ask_elsewhere(NameChange::Rename { item, new });
            }
        }
        is_made
    }
}

fn several(ui: &mut egui::Ui, workspace: &mut Workspace, count: usize) {
    ui.strong(format!("{count} selected"));
    for command in [
        Command::AlignLeft,
        Command::AlignRight,
        Command::AlignTop,
        Command::AlignBottom,
        Command::SpaceAcross,
        Command::SpaceDown,
        Command::Arrange,
        Command::Group,
        Command::Duplicate,
        Command::Delete,
    ] {
        let entry = about(command);
        let keys = entry.keys.map(|keys| ui.ctx().format_shortcut(&keys)).unwrap_or_default();
        let button = Button::new(entry.name).shortcut_text(keys);
        let button = ui.add_sized([ui.available_width(), 0.0], button).on_hover_text(entry.doc);
        if button.accessible_name(format!("selected: {}", entry.name)).clicked() {
            workspace.order_command(command);
        }
    }
}
