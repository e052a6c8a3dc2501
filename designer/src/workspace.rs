//! What all views share: the open files, the running system, the settings and the messages.

use std::path::PathBuf;

use armor_robotfile::FiringTrace;
use eframe::egui;

use crate::commands::{Command, about};
use crate::item::Item;
use crate::live::session::Session;
use crate::messages::Messages;
use crate::project::elsewhere::{Elsewhere, NameChange};
use crate::project::{Documents, Project, Refused};
use crate::settings::Settings;

/// What every view works with.
pub struct Workspace {
    /// The open files.
    pub project: Project,
    /// The running system, if one is watched.
    pub live: Session,
    /// The user's settings.
    pub settings: Settings,
    /// Whether the panel with what can be added is open, for these files.
    pub palette: bool,
    /// The messages.
    pub messages: Messages,
    /// Commands that are to be run at the end of this frame.
    pub commands: Vec<Command>,
    /// An item that is to be shown at the end of this frame, in whichever view has it.
    pub shown: Option<Item>,
    /// Firings that another view wants to have played on the net of the mission.
    pub played: Option<FiringTrace>,
    /// Files that name what was just renamed or removed: to be asked about.
    pub elsewhere: Option<Elsewhere>,
    /// A file that is to be opened at the end of this frame.
    pub opened: Option<PathBuf>,
}

impl Workspace {
    /// Runs a command once the frame is drawn.
    pub fn order_command(&mut self, command: Command) {
        self.commands.push(command);
    }

    /// A line of a menu at the pointer that runs a command.
    pub fn offer_command(&mut self, ui: &mut egui::Ui, command: Command, may: bool) {
        let entry = about(command);
        let mut button = egui::Button::new(entry.name);
        if let Some(keys) = entry.keys {
            button = button.shortcut_text(ui.ctx().format_shortcut(&keys));
        }
        let button = ui.add_enabled(may, button).on_hover_text(entry.doc);
        if button.accessible_name(format!("here: {}", entry.name)).clicked() {
            self.order_command(command);
            ui.close();
        }
    }

    /// Opens or folds the palette as the settings have it, or as the open files need it.
    pub fn arrange_palette(&mut self) {
        let system = self.project.configuration().map(|configuration| &configuration.system);
        let is_empty = system.is_none_or(|system| system.components.is_empty());
        self.palette = self.settings.palette.unwrap_or(is_empty);
    }

    /// Opens the palette, or folds it, from now on.
    pub fn set_palette(&mut self, is_open: bool) {
        self.palette = is_open;
        self.settings.palette = Some(is_open);
    }

    /// Looks for other files that name components, places or transitions that were just renamed or
    /// removed.
    pub fn ask_elsewhere(&mut self, change: NameChange) {
        self.elsewhere = self.project.find_elsewhere(change);
    }

    /// Makes one edit of the files as one step of the history. A refusal is shown as a message.
    /// Returns whether the edit was made.
    pub fn edit(
        &mut self,
        what: impl Into<String>,
        edit: impl FnOnce(&mut Documents) -> Result<(), Refused>,
    ) -> bool {
        match self.project.edit(what, edit) {
            Ok(()) => true,
            Err(refused) => {
                self.messages.warn(refused.to_string());
                false
            }
        }
    }
}
