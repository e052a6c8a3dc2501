//! What a view is: its panels, its commands, and what it shows.

use std::collections::BTreeSet;
use std::path::Path;

use eframe::egui::{self, Rect};

use crate::canvas::Diagram;
use crate::commands::Command;
use crate::export::{self, ExportError};
use crate::help::pages::HelpPage;
use crate::item::Item;
use crate::project::{Documents, Refused};
use crate::workspace::Workspace;

/// One view: what it shows in which part of the window, and which commands it knows.
pub trait Pane {
    /// The panel at the left, if it has one.
    fn show_left_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        let _ = (ui, workspace);
    }

    /// The panel at the right: what is selected.
    fn show_right_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        let _ = (ui, workspace);
    }

    /// The middle.
    fn show_centre(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace);

    /// Where the drawing is in the window, without the panels around it.
    fn drawing_area(&self) -> Rect;

    /// Whether a question is open over the drawing, which takes the keys.
    fn is_asking(&self) -> bool {
        false
    }

    /// Whether a command can be run now; `None` if it is none of this view's.
    fn can_run(&self, command: Command, workspace: &Workspace) -> Option<bool>;

    /// Runs a command of this view's.
    fn run_command(&mut self, command: Command, ctx: &egui::Context, workspace: &mut Workspace);

    /// Applies the text of the field that is being edited, as if the field were left: saving or
    /// closing the files must include it. Returns whether it was accepted; if not, a message
    /// states why.
    fn finish_field(&mut self, workspace: &mut Workspace) -> bool {
        let _ = workspace;
        true
    }

    /// Returns the text of the field that is being edited, to be backed up with the unsaved work.
    fn field_draft(&self) -> Option<Draft> {
        None
    }

    /// The page of the documentation about what is selected or being edited.
    fn help_page(&self, workspace: &Workspace, ctx: &egui::Context) -> Option<HelpPage> {
        let _ = (workspace, ctx);
        None
    }

    /// Shows the system that is watched from now on, in this view. Returns whether it can.
    fn show_running(&mut self) -> bool {
        false
    }

    /// The whole drawing as it is now, for a picture.
    fn whole_drawing(&mut self, workspace: &Workspace) -> &Diagram<Item>;

    /// The items that the drawing has now, but for wires: undo selects what came back.
    fn drawn_items(&mut self, workspace: &Workspace) -> BTreeSet<Item> {
        let drawing = self.whole_drawing(workspace);
        let nodes = drawing.nodes.iter().map(|node| node.item);
        nodes.chain(drawing.decorations.iter().map(|note| note.item)).collect()
    }

    /// Saves the whole drawing as a picture with `scale` pixels for a point.
    ///
    /// # Errors
    /// As [`export::export`].
    fn export(
        &mut self,
        workspace: &Workspace,
        path: &Path,
        is_dark: bool,
        scale: f32,
    ) -> Result<(), ExportError> {
        export::export(self.whole_drawing(workspace), path, is_dark, scale)
    }

    /// Waits for what other threads still load: a picture of the window is taken once.
    fn finish_loading(&mut self, ctx: &egui::Context, workspace: &Workspace) {
        let _ = (ctx, workspace);
    }

    /// Selects an item and brings it into view.
    fn show_item(&mut self, item: Item, workspace: &Workspace);

    /// Selects items without moving the view.
    fn select_items(&mut self, items: BTreeSet<Item>) {
        let _ = items;
    }

    /// Takes what was pasted, if it is for this view.
    fn paste_text(&mut self, text: &str, workspace: &mut Workspace);

    /// Everything that can be found, with the words it is found by.
    fn findable_items(&self, workspace: &Workspace) -> Vec<(Item, String)>;
}

/// The text of a field that is being edited and has not changed the files yet.
pub struct Draft {
    /// Changes with each letter.
    pub revision: u64,
    /// Makes the change that leaving the field would make.
    pub change: Box<Edit>,
}

/// A change of the files.
pub type Edit = dyn FnOnce(&mut Documents) -> Result<(), Refused>;
