//! The running systems of this host to attach to, and the processes of the one that is watched.

use std::time::{Duration, Instant};

use armor_inspect::SystemPicture;
use armor_inspect::systems::RunRecord;
use eframe::egui::{self, Button, RichText, ScrollArea, TextEdit};

use super::hosts;
use super::session::{Session, Standing, running};
use super::tone::{self, Tone};
use super::words;
use crate::commands::Command;
use crate::item::Item;
use crate::panels::fields::is_entered;
use crate::workspace::Workspace;
use armor_picture::theme::ThemeColours;

/// Pause between two searches for systems of this host, while none is watched.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// The panel.
#[derive(Debug, Default)]
pub struct Panel {
    address: String,
    found: Vec<RunRecord>,
    looked: Option<Instant>,
}

impl Panel {
    /// Shows it. Returns the process that was chosen, if any.
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        workspace: &mut Workspace,
        selected: Option<&str>,
    ) -> Option<String> {
        show_standing(ui, workspace);
        ui.separator();
        match workspace.live.watched() {
            Some(watched) => {
                let picture = watched.watch.picture();
                show_owner(ui, &workspace.live, workspace.project.path());
                hosts::show(ui, &picture);
                show_processes(ui, &picture, selected)
            }
            None => {
                if let Some((registry, record)) = self.offer(ui) {
                    let file = record.as_ref().and_then(|record| {
                        let open = workspace.project.path();
                        let is_open = open.is_some_and(|open| record.runs(open));
                        (!is_open).then(|| record.resolve(&record.file))
                    });
                    workspace.opened = file.filter(|file| file.exists());
                    attach(workspace, &registry, record);
                }
                None
            }
        }
    }

    /// The systems that can be attached to.
    fn offer(&mut self, ui: &mut egui::Ui) -> Option<(String, Option<RunRecord>)> {
        if self.looked.is_none_or(|looked| looked.elapsed() >= LOOK_EVERY) {
            self.looked = Some(Instant::now());
            self.found = running().unwrap_or_default();
        }
        ui.ctx().request_repaint_after(LOOK_EVERY);
        let mut chosen = None;
        ui.strong("Running here");
        if self.found.is_empty() {
            ui.weak("No system of yours runs on this host.");
        }
        for record in &self.found {
            // Systems of one name differ by address and start.
            let name = format!("Watch {}", words::name_run(record));
            let button = ui.button(format!("Watch {}", record.system)).accessible_name(name);
            ui.weak(format!(
                "{}, started {}",
                record.registry,
                words::time_of_day(record.started_s)
            ));
            let button = button.on_hover_text(format!(
                "registry {}\n{}\nprocess {}",
                record.registry,
                record.resolve(&record.file).display(),
                record.pid
            ));
            if button.clicked() {
                chosen = Some((record.registry.to_string(), Some(record.clone())));
            }
        }
        ui.add_space(armor_picture::theme::NEAR);
        ui.strong("Elsewhere");
        ui.horizontal(|ui| {
            let edit = TextEdit::singleline(&mut self.address).hint_text("address:port");
            let edit = ui.add(edit.desired_width(130.0)).accessible_name("address of a registry");
            let entered = is_entered(ui, &edit);
            let is_address = self.address.parse::<std::net::SocketAddr>().is_ok()
                || self
                    .address
                    .rsplit_once(':')
                    .is_some_and(|(_, port)| port.parse::<u16>().is_ok());
            let watch = ui.add_enabled(is_address, Button::new("Watch"));
            if (watch.clicked() || entered) && is_address {
                chosen = Some((self.address.clone(), None));
            }
        });
        ui.weak("As for `armor ps --registry`.");
        chosen
    }
}

/// Watches a system; a failure is shown as a message.
pub fn attach(workspace: &mut Workspace, registry: &str, record: Option<RunRecord>) {
    if let Err(error) = workspace.live.attach(registry, record) {
        workspace.messages.warn(format!("Cannot watch it: {error}"));
    }
}

/// Shows the state of the watched system, and the buttons to change it.
fn show_standing(ui: &mut egui::Ui, workspace: &mut Workspace) {
    let colours = ThemeColours::of(ui.visuals());
    let is_own = workspace.live.run().is_some();
    let plays = workspace.live.is_playing();
    let (word, colour) = match workspace.live.standing() {
        Standing::Idle => ("not watching", colours.weak),
        Standing::Starting => ("starting", colours.accent),
        Standing::Watching => {
            let word = match (plays, is_own) {
                (true, _) => "playing a recording",
                (false, true) => "running",
                (false, false) => "watching",
            };
            (word, colours.good)
        }
        Standing::Lost => ("ended, or unreachable", colours.warning),
        Standing::Stopping => ("stopping", colours.warning),
        Standing::Over => ("ended; showing the last known state", colours.weak),
    };
    ui.colored_label(colour, RichText::new(word).strong());
    if let Some((how, is_fine)) = workspace.live.ended() {
        ui.colored_label(if is_fine { colours.text } else { colours.error }, how);
    }
    if let Some(results) = workspace.live.results() {
        let results = results.to_path_buf();
        let button = ui.button("Open results").on_hover_text(crate::text::path(&results));
        if button.clicked()
            && let Err(error) = open_folder(&results)
        {
            let text = format!("{} cannot be shown: {error}", results.display());
            workspace.messages.warn(text);
        }
        ui.weak(crate::text::path(&results));
    }
    ui.horizontal_wrapped(|ui| {
        for command in [Command::Run, Command::Stop, Command::Detach] {
            let about = crate::commands::about(command);
            let may = workspace.live.may(command);
            let again = command == Command::Stop
                && workspace.live.run().is_some_and(|run| run.times_asked() > 0);
            let name = if again { "Kill" } else { about.name };
            let button = ui.add_enabled(may, Button::new(name)).on_hover_text(about.doc);
            let button = button.on_disabled_hover_text(why_not(command));
            if button.accessible_name(format!("live: {name}")).clicked() {
                workspace.order_command(command);
            }
        }
    });
}

/// Opens a folder in the file manager of the desktop.
fn open_folder(folder: &std::path::Path) -> std::io::Result<()> {
    let mut opener = std::process::Command::new("xdg-open").arg(folder).spawn()?;
    // Its end is waited for, so that no zombie process is left.
    let waits = std::thread::Builder::new().name("open-folder".into());
    waits.spawn(move || drop(opener.wait())).map(|_| ())
}

/// Why a command about what runs cannot be run.
fn why_not(command: Command) -> &'static str {
    match command {
        Command::Run => "It is already running.",
        Command::Stop => "This window has started no run.",
        _ => "This window watches no system that it did not start, nor one that has ended.",
    }
}

/// Which system it is, and whether it is the one that is open.
fn show_owner(ui: &mut egui::Ui, session: &Session, open: Option<&std::path::Path>) {
    let Some(watched) = session.watched() else { return };
    ui.weak(format!("registry {}", watched.registry));
    let Some(record) = &watched.record else { return };
    ui.weak(format!("started {}", words::time_of_day(record.started_s)));
    if let Some(playback) = session.playback() {
        let path = crate::text::path(playback.path());
        ui.weak(format!("recording {}", playback.name())).on_hover_text(path);
        return;
    }
    let file = record.resolve(&record.file);
    if open.is_none_or(|open| !record.runs(open)) {
        let colours = ThemeColours::of(ui.visuals());
        let text = format!("Running: {}, not the open file.", file.display());
        ui.colored_label(colours.warning, text);
    }
}

/// The processes with their states; the one that was chosen.
fn show_processes(
    ui: &mut egui::Ui,
    picture: &SystemPicture,
    selected: Option<&str>,
) -> Option<String> {
    let colours = ThemeColours::of(ui.visuals());
    if !picture.is_found && !picture.has_ended() {
        let text = if picture.was_found {
            "The registry is unreachable; links stay up."
        } else {
            "Searching for the registry."
        };
        ui.colored_label(colours.warning, text);
    }
    let mut chosen = None;
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let processes = picture.processes.iter();
        for (name, process) in processes.filter(|(name, _)| !picture.is_second_name(name)) {
            let (tone, word) = Tone::seen(Some(process), picture, colours);
            let ink = tone.ink(colours);
            ui.horizontal(|ui| {
                let label = ui.selectable_label(selected == Some(name), name);
                let label = label.accessible_name(format!("process {name}: {word}"));
                if label.clicked() {
                    chosen = Some(name.clone());
                }
                ui.colored_label(ink, word).on_hover_text(tone::doc(process.condition));
            });
        }
    });
    chosen
}

/// The name of the component that an item of the drawing stands for.
pub fn component_of(item: &Item) -> Option<&str> {
    match item {
        Item::Component(name) => Some(name),
        _ => None,
    }
}
