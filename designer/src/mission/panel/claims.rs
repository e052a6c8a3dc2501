//! The checks: what is to be proven, and whether it is.

use armor_robotfile::{Code, Finding};
use eframe::egui::{self, RichText};

use super::parts::{PanelRequest, PanelSource, section, show_finding};
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::form::{Form, given, is_check};
use armor_picture::theme::ThemeColours;

pub(super) fn show(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    form: &mut Form,
    requests: &mut Vec<PanelRequest>,
) {
    section(ui, "Checks: properties to prove");
    for (number, check) in shown.mission.checks.iter().enumerate() {
        let item = Item::Check(number);
        let found: Vec<_> = shown.marks.found(&item).collect();
        ui.horizontal(|ui| {
            verdict(ui, shown, &found);
            let remove = format!("Remove check {}", number + 1);
            if ui.button("remove").on_hover_text(&remove).accessible_name(remove).clicked() {
                form.change(Change::Remove(vec![item]));
            }
        });
        let name = format!("check {}", number + 1);
        form.line(ui, &name, &check.value, &is_check, |text| {
            given(text).map(|text| Change::Check(number, text))
        });
        for finding in found {
            show_finding(ui, finding, shown.project, requests);
        }
        ui.add_space(armor_picture::theme::NEAR);
    }
    ui.menu_button("Add a check…", |ui| {
        for text in proposals(shown) {
            if ui.button(&text).clicked() {
                form.change(Change::AddCheck(text));
            }
        }
    });
}

fn verdict(ui: &mut egui::Ui, shown: &PanelSource<'_>, found: &[&Finding]) {
    let colours = ThemeColours::of(ui.visuals());
    let is = |code: Code| found.iter().any(|found| found.code == code);
    let (text, colour) = match () {
        () if is(Code::CheckFails) => ("violated", colours.error),
        () if is(Code::CheckUndecided) => ("? undecided", colours.warning),
        () if !found.is_empty() => ("! cannot be read", colours.error),
        () if shown.is_checking => ("… proving", colours.weak),
        () if shown.marks.all().has_errors() => {
            ("? not proven while there are errors", colours.weak)
        }
        () => ("valid", colours.good),
    };
    ui.label(RichText::new(text).color(colour));
}

/// Checks that fit this mission.
fn proposals(shown: &PanelSource<'_>) -> Vec<String> {
    let mission = shown.mission;
    let name = |place: &Option<armor_robotfile::Spanned<String>>| {
        place.as_ref().map(|place| place.value.clone())
    };
    let ends: Vec<_> = [name(&mission.goal), name(&mission.safe)].into_iter().flatten().collect();
    let mut proposals = Vec::new();
    if !ends.is_empty() {
        let end = ends.join(" or ");
        proposals.push(format!("always reachable({end})"));
        proposals.push(format!("eventually {end}"));
        proposals.push(format!("duration({end}) <= 20min"));
    }
    for set in &mission.exclusives {
        if let [one, other, ..] = &set.components[..] {
            proposals.push(format!("never active({}) and active({})", one.value, other.value));
        }
    }
    if let Some(first) = mission.transitions.first() {
        proposals.push(format!("fires({})", first.name.value));
    }
    proposals.retain(|text| mission.checks.iter().all(|known| known.value != *text));
    if proposals.is_empty()
        && let Some(place) = mission.places.first()
    {
        proposals.push(format!("reachable({})", place.name.value));
    }
    proposals
}
