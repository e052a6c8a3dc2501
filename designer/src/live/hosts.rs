//! The hosts of the watched system: whether each is connected, how far its clock is from that of the
//! launcher's host, and what runs there.

use std::f32::consts::TAU;

use armor_inspect::run_control::{HostLink, HostReport};
use armor_inspect::{ObservedHost, SystemPicture};
use eframe::egui::{self, Color32, RichText, Sense, Stroke, Vec2};

use super::words::printable;
use armor_picture::theme::ThemeColours;

/// Size of the sign of a connection.
const SIGN: f32 = 12.0;

/// Shows the hosts, if there are several.
pub fn show(ui: &mut egui::Ui, picture: &SystemPicture) {
    let hosts = picture.list_hosts();
    if hosts.is_empty() {
        return;
    }
    ui.strong("Hosts");
    for host in &hosts {
        show_host(ui, host, picture.has_ended());
    }
    ui.separator();
}

fn show_host(ui: &mut egui::Ui, host: &ObservedHost<'_>, has_ended: bool) {
    let colours = ThemeColours::of(ui.visuals());
    let report = host.report.filter(|_| !has_ended);
    let name = format!("host {}", printable(ui, host.name));
    ui.horizontal_wrapped(|ui| {
        if let Some(report) = report {
            show_sign(ui, report.link, colours);
        }
        ui.label(RichText::new(name).strong());
        if let Some(report) = report {
            let text = printable(ui, &report.describe_link());
            ui.colored_label(ink(report.link, colours), text);
        }
    });
    let clock = report.and_then(HostReport::describe_clock);
    let runs = match host.processes.is_empty() {
        true => "nothing was seen there".to_owned(),
        false => host.processes.join(", "),
    };
    ui.indent(("host", host.name), |ui| {
        ui.label(printable(ui, &runs));
        if let Some(clock) = clock {
            ui.weak(clock);
        }
    });
}

fn ink(link: HostLink, colours: &ThemeColours) -> Color32 {
    match link {
        HostLink::Connected => colours.good,
        HostLink::CutOff => colours.error,
        HostLink::Awaited => colours.weak,
    }
}

/// A full circle, an empty one, or for a host that is cut off a cross.
fn show_sign(ui: &mut egui::Ui, link: HostLink, colours: &ThemeColours) {
    let (area, _) = ui.allocate_exact_size(Vec2::splat(SIGN), Sense::hover());
    let (middle, radius) = (area.center(), 0.36 * SIGN);
    let stroke = Stroke::new(2.0, ink(link, colours));
    let painter = ui.painter();
    match link {
        HostLink::Connected => drop(painter.circle_filled(middle, radius, stroke.color)),
        HostLink::Awaited => drop(painter.circle_stroke(middle, radius, stroke)),
        HostLink::CutOff => {
            for eighth in [1.0, 3.0] {
                let to_end = radius * 1.2 * Vec2::angled(TAU * eighth / 8.0);
                painter.line_segment([middle - to_end, middle + to_end], stroke);
            }
        }
    }
}
