//! One drawing of the open files in the window: what the view of the system and the view of the
//! mission share. It knows what is selected, which commands that allows, and how a gesture changes
//! positions, groups and notes; what a component, a place or a link is, the views know.

use std::collections::BTreeSet;
use std::sync::Arc;

use armor_robotfile::Document;
use eframe::egui::{self, Area, Key, Label, Order, Pos2, Rect, RichText, Vec2, vec2};

use crate::canvas::{
    Alignment, Canvas, CanvasOutput, Diagram, JoinRules, Selection, ViewAction, align, snapped,
};
use crate::commands::Command;
use crate::item::Item;
use crate::layout;
use crate::project::{Documents, Refused};
use crate::settings::Settings;
use crate::view::View;
use crate::workspace::Workspace;

/// Space between a new group's frame and what is in it.
const GROUP_MARGIN: f32 = 25.0;
/// The size of a new note.
const NOTE_SIZE: Vec2 = vec2(220.0, 90.0);

/// The menu of a block, a place or a transition.
pub const NODE_MENU: &[Command] = &[
    Command::Properties,
    Command::Rename,
    Command::Link,
    Command::Copy,
    Command::Cut,
    Command::Duplicate,
    Command::Group,
    Command::Delete,
];
/// The menu of a link or an arc.
pub const WIRE_MENU: &[Command] = &[Command::Properties, Command::Delete];
/// The menu of a group or note.
pub const DECORATION_MENU: &[Command] =
    &[Command::Properties, Command::Copy, Command::Duplicate, Command::Delete];
/// The menu of a group of the system.
pub const GROUP_MENU: &[Command] = &[
    Command::Fold,
    Command::Properties,
    Command::Link,
    Command::Copy,
    Command::Duplicate,
    Command::Delete,
];
/// The menu of the empty drawing.
pub const EMPTY_MENU: &[Command] =
    &[Command::Paste, Command::Note, Command::SelectAll, Command::Arrange, Command::ZoomFit];

/// A drawing in a view, with its selection and its menu.
pub struct DiagramPane {
    /// Position, zoom and selection.
    pub canvas: Canvas<Item>,
    /// What the open menu is about (none: the drawing itself), and where in the drawing it is.
    pub menu: (Option<Item>, Pos2),
    /// The view that draws it, which is also the part of the file that keeps its layout.
    view: View,
    /// What is selected in the next drawing: what an edit has just added is not in the present one.
    select_next: Vec<Item>,
}

impl DiagramPane {
    /// Creates a pane that screen readers call `name`; it shows the whole drawing at first.
    pub fn new(name: &'static str, view: View) -> Self {
        Self { canvas: Canvas::new(name), menu: (None, Pos2::ZERO), view, select_next: Vec::new() }
    }

    /// Takes a new drawing: keeps what is selected and still drawn, or selects what was added.
    pub fn set_drawing(&mut self, diagram: &Diagram<Item>) {
        self.canvas.drawing_changed(diagram);
        let wanted = std::mem::take(&mut self.select_next).into_iter();
        let added: Selection<Item> = wanted.filter(|item| diagram.holds(*item)).collect();
        if !added.is_empty() {
            self.canvas.selection = added;
        }
    }

    /// Selects items once they are drawn.
    pub fn select_when_drawn(&mut self, items: impl IntoIterator<Item = Item>) {
        self.select_next = items.into_iter().collect();
    }

    /// Selects exactly these items.
    pub fn select(&mut self, items: impl IntoIterator<Item = Item>) {
        self.canvas.selection = items.into_iter().collect();
    }

    /// Returns what is selected, in the order of items, so that an edit does not depend on the
    /// order of clicks.
    pub fn selected(&self) -> BTreeSet<Item> {
        self.canvas.selection.iter().collect()
    }

    /// Returns what is selected, if it is one thing.
    pub fn only(&self) -> Option<Item> {
        self.canvas.selection.only()
    }

    /// Selects an item and brings it into view; one that is not drawn leaves nothing selected.
    pub fn show_item(&mut self, item: Item, diagram: &Diagram<Item>) {
        if diagram.holds(item) {
            self.canvas.go_to(diagram, item);
        } else {
            self.canvas.selection.clear();
        }
    }

    /// Returns where what is selected is drawn; links and arcs have no position of their own.
    pub fn selected_areas(&self, diagram: &Diagram<Item>) -> Vec<(Item, Rect)> {
        let is_wire = |item: &Item| {
            matches!(item, Item::Link { .. } | Item::Arc { .. } | Item::Submission(_))
        };
        let items = self.selected().into_iter().filter(|item| !is_wire(item));
        items.filter_map(|item| Some((item, diagram.rect(item)?))).collect()
    }

    /// Shows the drawing.
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        diagram: &Diagram<Item>,
        rules: &dyn JoinRules,
        settings: &Settings,
    ) -> CanvasOutput<Item> {
        self.canvas.minimap = settings.minimap;
        self.canvas.snap = settings.snap;
        let shown = self.canvas.show(ui, diagram, rules);
        self.canvas.show_tooltip(&shown, diagram);
        shown
    }

    /// Opens the properties if Enter is pressed on the drawing.
    pub fn take_enter(&self, ui: &egui::Ui, shown: &CanvasOutput<Item>, workspace: &mut Workspace) {
        if shown.response.has_focus() && ui.input(|i| i.key_pressed(Key::Enter)) {
            workspace.order_command(Command::Properties);
        }
    }

    /// Returns what was dropped on the drawing from a palette, and where.
    pub fn dropped<Part: Send + Sync + 'static>(
        &self,
        ui: &egui::Ui,
        shown: &CanvasOutput<Item>,
    ) -> Option<(Arc<Part>, Pos2)> {
        let part = shown.response.dnd_release_payload::<Part>()?;
        let at = ui.input(|i| i.pointer.latest_pos())?;
        Some((part, self.canvas.to_drawing(at)))
    }

    /// Returns whether a command can be run now; `None` if the pane does not know it. A drawing
    /// that is not editable is only looked at and copied from.
    pub fn can_run(
        &self,
        command: Command,
        workspace: &Workspace,
        is_editable: bool,
    ) -> Option<bool> {
        use Command as C;
        let selected = self.canvas.selection.len();
        let has_file = workspace.project.configuration().is_some();
        Some(match command {
            C::Cut | C::Duplicate | C::Delete | C::Group => selected > 0 && is_editable,
            C::Copy | C::ZoomSelected => selected > 0,
            C::SelectAll | C::ZoomFit => has_file,
            C::Arrange | C::Add | C::Note | C::Paste => has_file && is_editable,
            C::Properties => selected == 1,
            C::AlignLeft | C::AlignRight | C::AlignTop | C::AlignBottom => {
                selected > 1 && is_editable
            }
            C::SpaceAcross | C::SpaceDown => selected > 2 && is_editable,
            C::SelectNone | C::ZoomIn | C::ZoomOut | C::ZoomActual => true,
            _ => return None,
        })
    }

    /// Runs a command that is the same in every drawing.
    pub fn run(
        &mut self,
        command: Command,
        ctx: &egui::Context,
        diagram: &Diagram<Item>,
        workspace: &mut Workspace,
    ) {
        if command == Command::Paste {
            ctx.send_viewport_cmd(egui::ViewportCommand::RequestPaste);
        } else if let Some(how) = alignment_of(command) {
            let places = align(&self.selected_areas(diagram), how);
            self.place("align", &places, workspace);
        } else if let Some(action) = view_action_of(command) {
            self.canvas.perform_action(action, diagram);
        }
    }

    /// Moves what is selected. `unplaced` is where nodes are drawn that have no position in the
    /// file: the first edit of one position writes all of them, so that nothing else moves.
    pub fn move_selected(
        &self,
        by: Vec2,
        diagram: &Diagram<Item>,
        unplaced: &[(Item, Pos2)],
        workspace: &mut Workspace,
    ) {
        let areas = self.selected_areas(diagram).into_iter();
        let mut places: Vec<_> = areas.map(|(item, area)| (item, area.min + by)).collect();
        let what = match self.only() {
            Some(item) => format!("move {item}"),
            None => format!("move {} items", places.len()),
        };
        let rest = unplaced.iter().filter(|(item, _)| !self.canvas.selection.contains(*item));
        places.extend(rest.copied());
        self.place(&what, &places, workspace);
    }

    /// Writes positions of nodes, groups and notes, as one step of the history.
    pub fn place(&self, what: &str, places: &[(Item, Pos2)], workspace: &mut Workspace) {
        let view = self.view;
        workspace
            .edit(what, |documents| layout::place(document_of(documents, view)?, view, places));
    }

    /// Gives a group or note another size.
    pub fn resize(&self, item: Item, rect: Rect, workspace: &mut Workspace) {
        if let Item::Decoration { view, number } = item {
            workspace.edit("resize", |documents| {
                layout::place_decoration(document_of(documents, view)?, view, number, rect)
            });
        }
    }

    /// Puts a text on the clipboard; without one it warns that nothing was copied and returns
    /// false.
    pub fn copy(
        &self,
        text: Option<String>,
        ctx: &egui::Context,
        workspace: &mut Workspace,
    ) -> bool {
        match text {
            Some(text) => {
                ctx.copy_text(text);
                true
            }
            None => {
                workspace.messages.warn(format!("Nothing copied: select {}.", self.copyable()));
                false
            }
        }
    }

    /// Warns that the selection has nothing that can be duplicated.
    pub fn warn_not_duplicated(&self, workspace: &mut Workspace) {
        workspace.messages.warn(format!("Nothing duplicated: select {}.", self.copyable()));
    }

    /// Where a pasted fragment goes: its middle at the pointer, or in the middle of the view.
    pub fn paste_corner(&self) -> impl Fn(Rect) -> Pos2 + use<> {
        let middle = self.canvas.spot();
        move |whole: Rect| snapped(middle - whole.size() / 2.0)
    }

    /// Returns the name of the step that removes what is selected.
    pub fn removal_name(&self) -> String {
        match self.only() {
            Some(item) => format!("remove {item}"),
            None => format!("remove {} items", self.canvas.selection.len()),
        }
    }

    /// Adds a note beneath what is selected, or a group around it; returns whether it was added.
    pub fn decorate(
        &mut self,
        is_note: bool,
        diagram: &Diagram<Item>,
        workspace: &mut Workspace,
    ) -> bool {
        let areas = self.selected_areas(diagram);
        let selected = areas.iter().map(|(_, area)| *area).reduce(Rect::union);
        let (rect, text, what) = if is_note {
            let at = match selected {
                Some(area) => area.left_bottom() + self.copy_offset(),
                None => {
                    let middle = self.canvas.spot() + NOTE_SIZE / 2.0;
                    diagram.free_spot(middle, NOTE_SIZE) - NOTE_SIZE / 2.0
                }
            };
            (Rect::from_min_size(at, NOTE_SIZE), "Note", "add a note")
        } else {
            let Some(area) = selected else { return false };
            let mut area = area.expand(GROUP_MARGIN);
            area.min.y -= GROUP_MARGIN;
            (area, "Group", "add a group")
        };
        let (view, mut item) = (self.view, None);
        let is_added = workspace.edit(what, |documents| {
            let document = document_of(documents, view)?;
            item = Some(layout::add_decoration(document, view, is_note, rect, text)?);
            Ok(())
        });
        if is_added {
            self.select_when_drawn(item);
            workspace.settings.properties = true;
        }
        is_added
    }

    /// Returns how far a copy is placed from its original; a net's nodes are smaller than their
    /// texts.
    pub fn copy_offset(&self) -> Vec2 {
        match self.view {
            View::System | View::Live => vec2(30.0, 30.0),
            View::Mission | View::Map => vec2(40.0, 40.0),
        }
    }

    fn copyable(&self) -> &'static str {
        match self.view {
            View::System | View::Live => "components, groups or notes",
            View::Mission | View::Map => "places, transitions, groups or notes",
        }
    }
}

/// Shows the name of what is dragged from a palette at the pointer.
pub fn show_dragged(ui: &egui::Ui, name: &str) {
    let Some(at) = ui.input(|i| i.pointer.latest_pos()) else { return };
    let area = Area::new(egui::Id::unique("dragged part")).order(Order::Tooltip);
    area.fixed_pos(at - vec2(50.0, 14.0)).interactable(false).show(ui.ctx(), |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.add(Label::new(RichText::new(name).strong()).selectable(false).extend());
        });
    });
}

/// Returns the file that a view draws.
fn document_of(documents: &mut Documents, view: View) -> Result<&mut Document, Refused> {
    match view {
        View::System | View::Live => documents.system(),
        View::Mission | View::Map => documents.mission(),
    }
}

/// Returns how a command aligns, if it does.
fn alignment_of(command: Command) -> Option<Alignment> {
    Some(match command {
        Command::AlignLeft => Alignment::Left,
        Command::AlignRight => Alignment::Right,
        Command::AlignTop => Alignment::Top,
        Command::AlignBottom => Alignment::Bottom,
        Command::SpaceAcross => Alignment::Across,
        Command::SpaceDown => Alignment::Down,
        _ => return None,
    })
}

/// Returns what a command changes about how a drawing is looked at, if it does.
pub fn view_action_of(command: Command) -> Option<ViewAction> {
    Some(match command {
        Command::SelectAll => ViewAction::SelectAll,
        Command::SelectNone => ViewAction::SelectNone,
        Command::ZoomIn => ViewAction::ZoomIn,
        Command::ZoomOut => ViewAction::ZoomOut,
        Command::ZoomActual => ViewAction::ZoomActual,
        Command::ZoomFit => ViewAction::ZoomFit,
        Command::ZoomSelected => ViewAction::ZoomSelected,
        _ => return None,
    })
}
