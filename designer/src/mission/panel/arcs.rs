//! The arcs of a transition, and one that is selected by itself.

use armor_robotfile::mission::{Arc, ArcKind, Transition};
use eframe::egui;

use super::parts::{PanelRequest, PanelSource, arc_word, go_to, section};
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::edits::arc_element;
use crate::mission::form::{Form, row, wrong};
use crate::mission::rules::weight_refused;

/// All kinds, with what they do.
const KINDS: [(ArcKind, &str); 5] = [
    (ArcKind::Take, "takes tokens"),
    (ArcKind::Put, "puts tokens"),
    (ArcKind::Read, "needs tokens and leaves them (read)"),
    (ArcKind::Inhibitor, "waits while there are tokens (inhibitor)"),
    (ArcKind::Reset, "takes all tokens (reset)"),
];

pub(super) fn show(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    transition: &Transition,
    form: &mut Form,
    requests: &mut Vec<PanelRequest>,
) {
    section(ui, "Arcs");
    for arc in &transition.arcs {
        let item = item_of(transition, arc);
        ui.horizontal(|ui| {
            go_to(ui, arc_word(arc.kind), item, requests);
            let weight = if arc.weight > 1 { format!("{} x ", arc.weight) } else { String::new() };
            let place = Item::place(&arc.place.value);
            go_to(ui, &format!("{weight}{}", arc.place.value), place, requests);
            let remove = format!("Remove {item}");
            if ui.button("remove").on_hover_text(&remove).accessible_name(remove).clicked() {
                form.change(Change::Remove(vec![item]));
            }
        });
    }
    if transition.arcs.is_empty() {
        wrong(ui, "not connected to any place: drag from its edges to places, or add an arc here");
    }
    ui.menu_button("Add an arc…", |ui| {
        for (kind, what) in KINDS {
            ui.menu_button(what, |ui| {
                for place in shown.places() {
                    let has = |arc: &Arc| arc.kind == kind && arc.place.value == place;
                    if !transition.arcs.iter().any(has) && ui.button(&place).clicked() {
                        let arc = Item::arc(&transition.name.value, &place, kind);
                        form.change(Change::AddArc(arc));
                    }
                }
            });
        }
    });
}

/// A selected arc.
pub(super) fn show_one(ui: &mut egui::Ui, shown: &PanelSource<'_>, item: &Item, form: &mut Form) {
    let Item::Arc { transition, place, kind } = item else { return };
    let transitions = &shown.mission.transitions;
    let owner = transitions.iter().find(|known| *transition == known.name.value);
    let arcs = owner.into_iter().flat_map(|owner| &owner.arcs);
    let arc = arcs.into_iter().find(|arc| arc.kind == *kind && *place == arc.place.value);
    let Some(arc) = arc else { return };
    ui.heading("Arc");
    ui.label(format!("{transition} {} {place}", arc_word(*kind)));
    let choices: Vec<_> = KINDS.iter().map(|(kind, what)| (*kind, (*what).to_owned())).collect();
    row(ui, "Kind", "What it does.", |ui| {
        form.choice(ui, "kind of arc", kind, &choices, |to| Change::ArcKind(*item, *to));
    });
    if *kind == ArcKind::Reset {
        return;
    }
    row(ui, "Weight", "How many tokens it moves or tests.", |ui| {
        let weight = i64::from(arc.weight);
        let form = form.unread(unread_weight(shown, item));
        form.number(ui, "weight", weight, 1..=999_999_999, |weight| {
            Change::Weight(*item, u32::try_from(weight).unwrap_or(1))
        });
    });
    if let Some(why) = weight_refused(shown.mission, place, *kind, arc.weight) {
        wrong(ui, &why);
    }
}

/// The file's text of the weight, if that is not understood.
fn unread_weight<'a>(shown: &'a PanelSource<'_>, item: &Item) -> Option<&'a str> {
    let Item::Arc { transition, place, kind } = item else { return None };
    let document = shown.project.document_with(armor_robotfile::Item::Mission)?;
    let path = arc_element(document, transition, place, *kind)?;
    shown.project.unread_at(document, &path, "weight")
}

fn item_of(transition: &Transition, arc: &Arc) -> Item {
    Item::arc(&transition.name.value, &arc.place.value, arc.kind)
}
