//! The panel at the right: what is selected in the mission, or the mission as a whole.

mod arcs;
mod claims;
mod derived;
mod fields;
pub mod parts;
mod place;
mod sets;
mod timing;
mod transition;
mod waits;
mod whole;

use eframe::egui;

use self::parts::{PanelRequest, PanelSource, section, show_finding};
use super::derived::source_of;
use super::form::Form;
use crate::item::Item;

/// Shows what is selected. Returns the requests of the user apart from changes.
pub fn show(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    selected: &[Item],
    form: &mut Form,
) -> Vec<PanelRequest> {
    let mut requests = Vec::new();
    match selected {
        [item @ Item::Place(name)] => {
            if let Some(source) = source_of(shown.mission, name) {
                derived::show_place(ui, shown, name, &source, &mut requests);
            } else if let Some(place) = shown.mission.place(name) {
                place::show(ui, shown, place, form.of(item), &mut requests);
            }
        }
        [item @ Item::Transition(name)] => {
            let transitions = &shown.mission.transitions;
            if let Some(source) = source_of(shown.mission, name) {
                derived::show_transition(ui, shown, name, &source, &mut requests);
            } else if let Some(transition) = transitions.iter().find(|t| *name == t.name.value) {
                transition::show(ui, shown, transition, form.of(item), &mut requests);
            }
        }
        [item @ Item::Arc { transition, .. }] => {
            if let Some(source) = source_of(shown.mission, transition) {
                derived::show_arc(ui, item, &source);
            } else {
                arcs::show_one(ui, shown, item, form.of(item));
            }
        }
        [item @ Item::Step { .. }] => derived::show_step(ui, shown, item, &mut requests),
        [item @ Item::Submission(number)] => {
            sets::submission(ui, shown, *number, form.of(item));
        }
        [] | [Item::Mission | Item::Variable(_) | Item::Exclusive(_) | Item::Check(_)] => {
            whole::show(ui, shown, form.of("mission"), &mut requests);
            return requests;
        }
        many => {
            ui.heading(format!("{} items selected", many.len()));
            ui.label("Drag moves them, Delete removes them, Ctrl+D duplicates them.");
        }
    }
    if let [item] = selected {
        findings(ui, shown, item, &mut requests);
    }
    requests
}

/// What was found of an item, with the firings that show it.
fn findings(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    item: &Item,
    requests: &mut Vec<PanelRequest>,
) {
    let mut found = shown.marks.found(item).peekable();
    if found.peek().is_none() {
        return;
    }
    section(ui, "Findings");
    for finding in found {
        show_finding(ui, finding, shown.project, requests);
    }
}
