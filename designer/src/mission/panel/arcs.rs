//! The arcs of a transition, and one that is selected by itself.

use armor_robotfile::mission::{Arc, ArcKind, Transition};
use eframe::egui;

use super::{Shown, Wish, arc_word, go_to, section};
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
    (ArcKind::Reset, "takes all tokens there are (reset)"),
];

pub(super) fn show(
    ui: &mut egui::Ui,
    shown: &Shown<'_>,
    transition: &Transition,
    form: &mut Form,
    wishes: &mut Vec<Wish>,
) {
    section(ui, "Arcs");
    for arc in &transition.arcs {
        let item = item_of(transition, arc);
        ui.horizontal(|ui| {
            go_to(ui, arc_word(arc.kind), item.clone(), wishes);
            let weight = if arc.weight > 1 { format!("{} x ", arc.weight) } else { String::new() };
            let place = Item::Place(arc.place.value.clone());
            go_to(ui, &format!("{weight}{}", arc.place.value), place, wishes);
            let remove = format!("Remove {item}");
            if ui.small_button("remove").on_hover_text(&remove).accessible_name(remove).clicked() {
                form.change(Change::Remove(vec![item.clone()]));
            }
        });
    }
    if transition.arcs.is_empty() {
        wrong(ui, "it joins no place: drag from its edges to places, or add an arc here");
    }
    ui.menu_button("Add an arc..", |ui| {
        for (kind, what) in KINDS {
            ui.menu_button(what, |ui| {
                for place in shown.places() {
                    let has = |arc: &Arc| arc.kind == kind && arc.place.value == place;
                    if !transition.arcs.iter().any(has) && ui.button(&place).clicked() {
                        let transition = transition.name.value.clone();
                        form.change(Change::AddArc(Item::Arc { transition, place, kind }));
                    }
                }
            });
        }
    });
}

/// An arc by itself.
pub(super) fn show_one(ui: &mut egui::Ui, shown: &Shown<'_>, item: &Item, form: &mut Form) {
    let Item::Arc { transition, place, kind } = item else { return };
    let transitions = &shown.mission.transitions;
    let owner = transitions.iter().find(|known| known.name.value == *transition);
    let arcs = owner.into_iter().flat_map(|owner| &owner.arcs);
    let arc = arcs.into_iter().find(|arc| arc.kind == *kind && arc.place.value == *place);
    let Some(arc) = arc else { return };
    ui.heading("Arc");
    ui.label(format!("{transition} {} {place}", arc_word(*kind)));
    let choices: Vec<_> = KINDS.iter().map(|(kind, what)| (*kind, (*what).to_owned())).collect();
    row(ui, "Kind", "What it does.", |ui| {
        form.choice(ui, "kind of arc", kind, &choices, |to| Change::ArcKind(item.clone(), *to));
    });
    if *kind == ArcKind::Reset {
        return;
    }
    row(ui, "Weight", "How many tokens it moves or looks for.", |ui| {
        let weight = i64::from(arc.weight);
        let form = form.unread(unread_weight(shown, item));
        form.number(ui, "weight", weight, 1..=999_999_999, |weight| {
            Change::Weight(item.clone(), u32::try_from(weight).unwrap_or(1))
        });
    });
    if let Some(why) = weight_refused(shown.mission, place, *kind, arc.weight) {
        wrong(ui, &why);
    }
}

/// What the file says of the weight, if that is not understood.
fn unread_weight<'a>(shown: &'a Shown<'_>, item: &Item) -> Option<&'a str> {
    let Item::Arc { transition, place, kind } = item else { return None };
    let document = shown.project.document_with(armor_robotfile::Item::Mission)?;
    let path = arc_element(document, transition, place, *kind)?;
    shown.project.unread_at(document, &path, "weight")
}

fn item_of(transition: &Transition, arc: &Arc) -> Item {
    Item::Arc {
        transition: transition.name.value.clone(),
        place: arc.place.value.clone(),
        kind: arc.kind,
    }
}
