//! Running the open file, playing a recording, and watching what runs already.

use std::path::{Path, PathBuf};

use armor_inspect::systems::RunRecord;

use crate::app::Designer;
use crate::app::dialogs::{Dialog, Then};
use crate::commands::Command;
use crate::live::{attach, running};
use crate::view::View;

impl Designer {
    /// Runs the open file, saved first if it is not.
    pub(super) fn ask_to_run(&mut self) {
        if self.workspace.project.path().is_none() {
            self.after_saving = Some(Then::Run);
            self.dialog = Some(Dialog::save_as(&self.workspace.project));
        } else if self.has_to_be_saved() {
            // Saving completes a draft without errors, and states the errors of another file.
            self.after_saving = Some(Then::Run);
            self.workspace.order_command(Command::Save);
        } else {
            self.start_run();
        }
    }

    fn has_to_be_saved(&self) -> bool {
        let project = &self.workspace.project;
        project.is_dirty() || project.is_draft() || project.has_errors()
    }

    /// Runs the file as it is on the disk.
    pub(super) fn start_run(&mut self) {
        let Some(path) = self.workspace.project.path().map(ToOwned::to_owned) else { return };
        self.turn_to_running();
        if let Err(error) = self.workspace.live.start(&path) {
            self.workspace.messages.warn(error.to_string());
        }
    }

    /// Shows what runs: in this view if it can, otherwise in the live view.
    fn turn_to_running(&mut self) {
        let pane = self.panes.iter_mut().find(|(view, _)| *view == self.view);
        if !pane.is_some_and(|(_, pane)| pane.show_running()) {
            self.view = View::Live;
        }
    }

    /// Plays a recording in the live view, after the user has agreed to stop what runs.
    pub(super) fn ask_to_play(&mut self, recording: PathBuf) {
        if self.runs_robot() {
            self.dialog = Some(Dialog::StopAndPlay(recording));
        } else {
            self.start_playback(&recording);
        }
    }

    /// Plays a recording in place of what is watched.
    pub(super) fn start_playback(&mut self, recording: &Path) {
        self.view = View::Live;
        self.first_page = false;
        match self.workspace.live.play(recording) {
            Ok(()) => self.keeper.remember_file(recording),
            Err(error) => self.workspace.messages.warn(error.to_string()),
        }
    }

    /// Whether a robot runs that this window has started: it stops with the window.
    pub(super) fn runs_robot(&self) -> bool {
        self.workspace.live.run().is_some() && !self.workspace.live.is_playing()
    }

    /// Watches the system whose registry listens at `registry`, or the only one of this host; the
    /// file that it runs is opened if none is open.
    pub(super) fn attach_to_system(&mut self, registry: Option<&str>) {
        let variable = |name| std::env::var(name).ok().filter(|value| !value.is_empty());
        let named = variable("ARMOR_REGISTRY");
        let registry = registry.or(named.as_deref());
        // Behind a proxy the system is on another host, even if one of this host has its address.
        let is_remote = variable("ARMOR_VIA").is_some();
        let mut records = if is_remote { Vec::new() } else { running().unwrap_or_default() };
        if let Some(registry) = registry {
            records.retain(|record| record.registry.to_string() == registry);
        }
        match (records.as_slice(), registry) {
            ([record], _) => {
                let record = record.clone();
                if self.workspace.project.path().is_none() {
                    self.open(&record.resolve(&record.file));
                }
                attach(&mut self.workspace, &record.registry.to_string(), Some(record));
            }
            ([], None) => {
                let text = "No system of yours runs on this host. Run one, or enter the address of \
                            its registry.";
                self.workspace.messages.warn(text);
            }
            // On another host, or another caller's.
            (_, Some(registry)) => attach(&mut self.workspace, registry, None),
            (several, None) => {
                let names: Vec<_> = several.iter().map(in_words).collect();
                let text = format!("Several systems run; choose one: {}", names.join(", "));
                self.workspace.messages.warn(text);
            }
        }
        // Behind the opening of its file, which makes the views again.
        self.turn_to_running();
    }
}

fn in_words(record: &RunRecord) -> String {
    format!("{} at {}", record.system, record.registry)
}
