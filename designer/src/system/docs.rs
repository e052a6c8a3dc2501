//! The manifest of a kind, as shown in the palette.

use armor_wire::manifest::{Manifest, ParameterManifest, PortManifest};
use eframe::egui::{self, Grid, RichText};

/// The whole manifest, in a tooltip or a panel.
pub(crate) fn show(ui: &mut egui::Ui, kind: &Manifest, origin: &str) {
    ui.set_max_width(440.0);
    ui.strong(&kind.kind);
    ui.label(shown(ui, &kind.summary));
    ports(ui, "Inputs", &kind.inputs);
    ports(ui, "Outputs", &kind.outputs);
    if !kind.parameters.is_empty() {
        ui.add_space(armor_picture::theme::NEAR);
        ui.weak("Parameters");
        Grid::new(("parameters", &kind.kind)).num_columns(3).show(ui, |ui| {
            for parameter in &kind.parameters {
                ui.label(&parameter.name);
                ui.weak(value(parameter));
                ui.label(RichText::new(shown(ui, &parameter.doc)).small());
                ui.end_row();
            }
        });
    }
    ui.add_space(armor_picture::theme::NEAR);
    ui.weak(shown(ui, &format!("from: {origin}")));
}

fn ports(ui: &mut egui::Ui, heading: &str, ports: &[PortManifest]) {
    if ports.is_empty() {
        return;
    }
    ui.add_space(armor_picture::theme::NEAR);
    ui.weak(heading);
    Grid::new((heading, ports[0].id.as_str())).num_columns(3).show(ui, |ui| {
        for port in ports {
            ui.label(match (port.required, port.many) {
                (true, true) => format!("{} (at least one link)", port.id),
                (false, true) => format!("{} (any number of links)", port.id),
                (true, false) => format!("{} (must be fed)", port.id),
                (false, false) => port.id.clone(),
            });
            ui.weak(&port.type_name);
            ui.label(RichText::new(shown(ui, &port.doc)).small());
            ui.end_row();
        }
    });
}

/// The default, or what is allowed.
pub(super) fn value(parameter: &ParameterManifest) -> String {
    match parameter.default_with_unit() {
        None => "needs a value".into(),
        Some(default) if default.is_empty() => "empty".into(),
        Some(default) => default,
    }
}

fn shown(ui: &egui::Ui, text: &str) -> String {
    crate::text::paintable(ui.ctx(), text).into_owned()
}
