//! The list of all commands: type a part of a name, Enter runs it.

use eframe::egui::{self, Align2, Id, Modal, Vec2};

use crate::app::Designer;
use crate::commands::{COMMANDS, Command, about};
use crate::panels::pick::{Entry, Picked};

impl Designer {
    pub(super) fn show_commands(&mut self, ctx: &egui::Context) {
        let Some(mut list) = self.commands.take() else { return };
        let runnable = COMMANDS.iter().filter(|entry| self.may(entry.command));
        let entries = runnable.map(|entry| Entry {
            name: entry.name.to_owned(),
            about: entry.doc.to_owned(),
            value: entry.command,
        });
        let entries: Vec<Entry<Command>> = entries.collect();
        let id = Id::unique("all commands");
        let area = Modal::default_area(id).anchor(Align2::CENTER_TOP, Vec2::new(0.0, 70.0));
        let modal = Modal::new(id).area(area).show(ctx, |ui| {
            ui.set_width(440.0);
            list.picker.show_with(ui, "Type what to do", &entries, |command| {
                about(*command).keys.map(|keys| ctx.format_shortcut(&keys)).unwrap_or_default()
            })
        });
        match modal.inner {
            Picked::Open if !modal.backdrop_response.clicked() => self.commands = Some(list),
            Picked::One(command) => self.workspace.order_command(command),
            _ => {}
        }
    }

    pub(super) fn show_shortcuts(&mut self, ctx: &egui::Context) {
        if self.shortcuts && crate::help::shortcuts::show(ctx) {
            self.shortcuts = false;
        }
    }
}
