//! What is derived from a route: it is shown, and the line to edit is named.

use eframe::egui::{self, RichText};

use super::parts::{PanelRequest, PanelSource, arc_word, go_to, section};
use super::place;
use crate::item::Item;
use crate::mission::derived::{find_step, source_of_step, step_of, step_word};
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

/// A step of a route: what it is derived from, what it has, and how it ends.
pub(super) fn show_step(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    item: &Item,
    requests: &mut Vec<PanelRequest>,
) {
    let source = source_of_step(shown.mission, item).unwrap_or_default();
    let (kind, name) = match (find_step(shown.mission, item), item) {
        (Some(step), Item::Step { route, step: name }) => {
            (step_word(step), format!("{route}.{name}"))
        }
        _ => return,
    };
    show_source(ui, &format!("{} {name}", capitalised(kind)), &source);
    let is_open = shown.opened.contains(item);
    ui.horizontal(|ui| {
        let name = if is_open { "Fold" } else { "Open" };
        if ui.button(name).on_hover_text("Ctrl+Shift+G, or a double-click").clicked() {
            requests.push(PanelRequest::Toggle(*item));
        }
        let hover = "Selects it in the view Map, where it is edited.";
        if ui.button("Show on the map").on_hover_text(hover).clicked() {
            requests.push(PanelRequest::Show(*item));
        }
    });
    let is_own = |name: &str| step_of(shown.mission, name).as_ref() == Some(item);
    section(ui, "Places");
    for place in shown.mission.places.iter().filter(|place| is_own(&place.name.value)) {
        go_to(ui, &place.name.value, Item::place(&place.name.value), requests);
    }
    section(ui, "Leaves by");
    for transition in &shown.mission.transitions {
        let own = &transition.name.value;
        let mut outputs = transition.outputs().map(|arc| &arc.place);
        if let Some(place) = outputs.find(|place| is_own(own) && !is_own(&place.value)) {
            ui.horizontal_wrapped(|ui| {
                go_to(ui, own, Item::transition(own), requests);
                ui.weak("to");
                go_to(ui, &place.value, Item::place(&place.value), requests);
            });
        }
    }
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

pub(super) fn show_arc(ui: &mut egui::Ui, item: &Item, source: &str) {
    show_source(ui, &item.to_string(), source);
}

/// The heading, and where this is changed.
fn show_source(ui: &mut egui::Ui, heading: &str, source: &str) {
    ui.heading(heading);
    let colour = ThemeColours::of(ui.visuals()).text;
    let hint = format!(
        "Derived from {source}. To change it, edit it in the view Map (Ctrl+3), or edit that line in the file."
    );
    ui.label(RichText::new(hint).color(colour));
}
