//! What is selected, while it runs.

use armor_inspect::words::{describe_call, format_duration, format_short_time};
use armor_inspect::{CONFIGD, CONFIGURATION, ObservedLink, ObservedProcess, SystemPicture};
use armor_sdk::control::Status;
use eframe::egui::{self, CollapsingHeader, Grid, RichText};

use super::parameters;
use super::plots::Plots;
use super::tone::{self, Tone};
use super::values;
use super::watched::Watched;
use super::words::printable;
use armor_picture::theme::ThemeColours;

/// A component: what it does, what it publishes and gets, its parameters.
pub fn component(
    ui: &mut egui::Ui,
    watched: &Watched,
    name: &str,
    plots: &mut Plots,
    panel: &mut parameters::Panel,
) {
    let picture = watched.watch.picture();
    ui.heading(name);
    let Some(process) = picture.processes.get(name) else {
        ui.weak("No process of this name has been seen.");
        return;
    };
    state(ui, process, &picture);
    // configd publishes its status under its second name.
    let second = Some(CONFIGURATION).filter(|it| name == CONFIGD && picture.is_second_name(it));
    let process = second.and_then(|second| picture.processes.get(second)).unwrap_or(process);
    if let Some(status) = &process.status {
        facts(ui, process, status);
        outputs(ui, watched, status, plots);
        inputs(ui, status, picture.has_ended());
    }
    let is_component = ![CONFIGD, CONFIGURATION, "executive", "registry"].contains(&name);
    if is_component {
        let header = CollapsingHeader::new("Parameters").id_salt(("live parameters of", name));
        header.show(ui, |ui| panel.show(ui, watched, name));
    }
}

fn state(ui: &mut egui::Ui, process: &ObservedProcess, picture: &SystemPicture) {
    let colours = ThemeColours::of(ui.visuals());
    let (tone, word) = Tone::seen(Some(process), picture, colours);
    ui.horizontal_wrapped(|ui| {
        let word = RichText::new(word).strong();
        ui.colored_label(tone.ink(colours), word).on_hover_text(tone::doc(process.condition));
        if !picture.has_ended() {
            let for_s = picture.now.saturating_sub(process.since).as_secs_f64();
            ui.weak(format!("for {}", format_duration(for_s)));
        }
    });
    if let Some(cut) = picture.find_cut(&process.entry.host) {
        let text = format!("{} is {}", cut.host, cut.describe_link());
        ui.colored_label(colours.error, printable(ui, &text));
    }
    if !process.problem.is_empty() && !picture.has_ended() {
        ui.colored_label(colours.warning, printable(ui, &process.problem));
    }
    if let Some(call) = &process.call {
        ui.colored_label(colours.warning, describe_call(call));
    }
}

fn facts(ui: &mut egui::Ui, process: &ObservedProcess, status: &Status) {
    let colours = ThemeColours::of(ui.visuals());
    if !status.last_error.is_empty() {
        ui.colored_label(colours.error, printable(ui, &status.last_error));
    }
    let entry = &process.entry;
    let clock = status
        .clock_error_s
        .map_or("unknown".to_owned(), |error_s| format!("within {}", format_short_time(error_s)));
    let rows = [
        ("kind", entry.kind.clone()),
        ("process", format!("{} on {}", entry.pid, entry.host)),
        ("runs for", format_duration(status.uptime_s)),
        ("calls of exec", describe_exec_calls(status)),
        ("clock", clock),
        ("starts seen", process.starts.to_string()),
    ];
    Grid::new(("facts", &entry.name)).num_columns(2).show(ui, |ui| {
        for (name, value) in rows {
            ui.weak(name);
            ui.label(value);
            ui.end_row();
        }
    });
}

fn describe_exec_calls(status: &Status) -> String {
    match status.skipped_ticks {
        0 => status.exec_calls.to_string(),
        skipped => format!("{}; {skipped} ticks skipped", status.exec_calls),
    }
}

/// Each output can be opened; the window subscribes to it only while it is open.
fn outputs(ui: &mut egui::Ui, watched: &Watched, status: &Status, plots: &mut Plots) {
    if status.outputs.is_empty() {
        return;
    }
    ui.add_space(armor_picture::theme::NEAR);
    ui.strong("Outputs");
    for output in &status.outputs {
        let title = format!("{}  {}", output.id, output.type_name);
        let header = CollapsingHeader::new(title).id_salt(("output", &output.data));
        let shown = header.show(ui, |ui| {
            ui.weak(format!("{} published, {} links", output.published, output.links.len()));
            values::show(ui, &watched.values, plots, &output.data);
        });
        let name = format!("output {} of type {}", output.data, output.type_name);
        shown.header_response.accessible_name(name);
    }
}

fn inputs(ui: &mut egui::Ui, status: &Status, has_ended: bool) {
    let fed: Vec<_> = status.inputs.iter().filter(|input| !input.data.is_empty()).collect();
    if fed.is_empty() {
        return;
    }
    let colours = ThemeColours::of(ui.visuals());
    ui.add_space(armor_picture::theme::NEAR);
    ui.strong("Inputs");
    for input in fed {
        ui.horizontal_wrapped(|ui| {
            ui.label(&input.id);
            ui.weak(format!("from {}", input.data));
            if input.connected || has_ended {
                ui.label(format!("{} received", input.received));
            } else {
                ui.colored_label(colours.error, printable(ui, &format!("down: {}", input.problem)));
            }
            if input.lost > 0 {
                ui.colored_label(colours.warning, format!("{} lost", input.lost));
            }
            if input.dropped > 0 {
                ui.label(format!("{} dropped", input.dropped));
            }
            if input.connections > 1 && !has_ended {
                ui.weak(format!("linked {} times", input.connections));
            }
        });
    }
}

/// A link: what it carries, and the values on it.
pub fn link(ui: &mut egui::Ui, watched: &Watched, from: &str, to: &str, plots: &mut Plots) {
    let picture = watched.watch.picture();
    ui.heading("Link");
    ui.label(format!("{from} to {to}"));
    match picture.links.iter().find(|edge| edge.from == from && edge.to == to) {
        Some(edge) => {
            if !picture.has_ended() {
                state_of_link(ui, edge);
            }
            carried(ui, edge);
        }
        None => {
            ui.weak("No report from either end yet.");
        }
    }
    ui.separator();
    values::show(ui, &watched.values, plots, from);
}

fn state_of_link(ui: &mut egui::Ui, edge: &ObservedLink) {
    let colours = ThemeColours::of(ui.visuals());
    ui.strong(super::blocks::in_words(edge));
    if !edge.problem.is_empty() {
        ui.colored_label(colours.error, printable(ui, &edge.problem));
    }
}

fn carried(ui: &mut egui::Ui, edge: &ObservedLink) {
    let rows = [
        ("type", edge.type_name.clone()),
        ("keep", edge.keep.clone()),
        ("carried by", edge.transport.clone()),
        ("sent", edge.sent.to_string()),
        ("received", edge.received.to_string()),
        ("dropped because a process was slow", edge.dropped.to_string()),
        ("skipped between two pulls", edge.skipped.to_string()),
        ("lost in transit", edge.lost.to_string()),
        ("waiting at the provider", edge.queued.to_string()),
        ("waiting at the consumer", edge.waiting.to_string()),
    ];
    Grid::new(("link facts", &edge.to)).num_columns(2).show(ui, |ui| {
        for (name, value) in rows {
            ui.weak(name);
            ui.label(value);
            ui.end_row();
        }
    });
}
