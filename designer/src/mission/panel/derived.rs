//! What is derived from a route: it is shown, and the line to edit is named.

use eframe::egui::{self, RichText};

use super::parts::{PanelRequest, PanelSource, arc_word, go_to, section};
use super::place;
use crate::item::Item;
use crate::mission::words::conditions;
use armor_picture::theme::ThemeColours;

pub(super) fn show_place(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    name: &str,
    source: &str,
    requests: &mut Vec<PanelRequest>,
) {
    show_source(ui, &format!("Place {name}"), source);
    let Some(place) = shown.mission.place(name) else { return };
    section(ui, "Active while marked");
    if place.components.is_empty() {
        ui.weak("no component");
    }
    for component in &place.components {
        ui.label(&component.value);
    }
    if !place.parameters.is_empty() {
        section(ui, "Parameter values while marked");
    }
    for given in &place.parameters {
        let (component, parameter) = (&given.component.value, &given.parameter);
        ui.label(format!("{component}.{} = {}", parameter.name.value, parameter.value.value));
    }
    place::neighbours(ui, shown, place, requests);
}

pub(super) fn show_transition(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    name: &str,
    source: &str,
    requests: &mut Vec<PanelRequest>,
) {
    show_source(ui, &format!("Transition {name}"), source);
    let mut transitions = shown.mission.transitions.iter();
    let Some(transition) = transitions.find(|it| it.name.value == name) else { return };
    section(ui, "Arcs");
    for arc in &transition.arcs {
        ui.horizontal(|ui| {
            ui.label(RichText::new(arc_word(arc.kind)).weak());
            go_to(ui, &arc.place.value, Item::place(&arc.place.value), requests);
        });
    }
    section(ui, "Fires");
    let lines = conditions(transition);
    if lines.is_empty() {
        ui.weak("immediately");
    }
    for line in lines {
        ui.label(line);
    }
}

pub(super) fn show_arc(ui: &mut egui::Ui, item: &Item, source: &str) {
    show_source(ui, &item.to_string(), source);
}

/// The heading, and where this is changed.
fn show_source(ui: &mut egui::Ui, heading: &str, source: &str) {
    ui.heading(heading);
    let colour = ThemeColours::of(ui.visuals()).text;
    let hint = format!(
        "Derived from {source}. To change it, edit it in the view Map (Ctrl+4), or edit that line in the file."
    );
    ui.label(RichText::new(hint).color(colour));
}
