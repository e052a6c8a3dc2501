//! A place: its name and role, the components that it activates, the values that it gives them.

use armor_robotfile::mission::{ArcKind, Place};
use eframe::egui::{self, RichText};

use super::parts::{PanelRequest, PanelSource, go_to, section};
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::form::{Form, is_name, row};

pub(super) fn show(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    place: &Place,
    form: &mut Form,
    requests: &mut Vec<PanelRequest>,
) {
    let name = &place.name.value;
    let item = Item::place(name);
    ui.heading("Place");
    row(ui, "Name", "The name that transitions and checks use.", |ui| {
        form.line(ui, "name of the place", name, &is_name, |new| {
            Some(Change::Rename(item, new.to_owned()))
        });
    });
    roles(ui, shown, place, form);
    components(ui, shown, place, form);
    parameters(ui, shown, place, form);
    neighbours(ui, shown, place, requests);
}

fn roles(ui: &mut egui::Ui, shown: &PanelSource<'_>, place: &Place, form: &mut Form) {
    let name = &place.name.value;
    let item = Item::place(name);
    let attribute = |key, value: Option<String>| Change::Attribute(item, key, value);
    if place.components.is_empty() {
        row(ui, "Tokens", "Tokens in it at the start of the mission.", |ui| {
            let form = form.unread(shown.unread(&item, "initial"));
            form.number(ui, "tokens at the start", place.initial.into(), 0..=999, |tokens| {
                attribute("initial", tokens_text(tokens))
            });
        });
    } else {
        let is_initial = place.initial > 0;
        let form = form.unread(shown.unread(&item, "initial"));
        form.flag(ui, "Initial: the mission begins here", is_initial, |is_set| {
            attribute("initial", is_set.then(|| "true".into()))
        });
    }
    let is = |role: &Option<armor_robotfile::Spanned<String>>| {
        role.as_ref().is_some_and(|place| place.value == *name)
    };
    let of_mission =
        |key, is_set: bool| Change::Attribute(Item::Mission, key, is_set.then(|| name.clone()));
    form.flag(ui, "Goal: the mission ends successfully here", is(&shown.mission.goal), |is_set| {
        of_mission("goal", is_set)
    });
    form.flag(
        ui,
        "Safe: where the mission goes when something fails",
        is(&shown.mission.safe),
        |is_set| of_mission("safe", is_set),
    );
    let is_safety = place.class == armor_robotfile::mission::Class::Safety;
    let form = form.unread(shown.unread(&item, "class"));
    form.flag(ui, "Safety class: has priority and continues during a pause", is_safety, |is_set| {
        attribute("class", is_set.then(|| "safety".into()))
    });
    if !place.components.is_empty() {
        let doc = "Where its token goes when one of its components fails for good.";
        row(ui, "On failure", doc, |ui| {
            let value = place.on_failure.as_ref().map(|place| place.value.clone());
            let mut choices = vec![(None, "the safe place".to_owned())];
            let others = shown.places().into_iter().filter(|other| other != name);
            choices.extend(others.map(|other| (Some(other.clone()), other)));
            form.choice(ui, "on failure", &value, &choices, |choice| {
                attribute("on-failure", choice.clone())
            });
        });
    }
}

fn tokens_text(tokens: i64) -> Option<String> {
    match tokens {
        0 => None,
        1 => Some("true".into()),
        more => Some(more.to_string()),
    }
}

fn components(ui: &mut egui::Ui, shown: &PanelSource<'_>, place: &Place, form: &mut Form) {
    section(ui, "Active while marked");
    let system = &shown.configuration.system;
    if system.components.is_empty() {
        ui.weak("The system has no components yet.");
    }
    for component in &system.components {
        let name = &component.name.value;
        let is_active = place.activates(name);
        let rival = rival(shown, place, name);
        let why = shown.kinds.explain_uncontrolled(component).or_else(|| {
            let rival = rival.filter(|_| !is_active)?;
            Some(format!("excludes {rival}, which is active here"))
        });
        ui.horizontal(|ui| {
            ui.add_enabled_ui(is_active || why.is_none(), |ui| {
                let change = |is_active| Change::Component {
                    place: place.name.value.clone(),
                    component: name.clone(),
                    is_active,
                };
                form.flag(ui, name, is_active, change)
                    .on_hover_text(format!("kind {}", component.kind.value))
                    .on_disabled_hover_text(why.as_deref().unwrap_or_default())
                    .accessible_name(format!("{name} is active in {}", place.name.value));
            });
            match why {
                Some(why) => ui.label(RichText::new(why).weak().small()),
                None => ui.label(RichText::new(&component.kind.value).weak().small()),
            };
        });
    }
    // Components that the system does not have (any longer) can be removed.
    for gone in place.components.iter().filter(|name| system.component(name).is_none()) {
        form.flag(ui, &format!("{} (not in the system)", gone.value), true, |is_active| {
            Change::Component {
                place: place.name.value.clone(),
                component: gone.value.clone(),
                is_active,
            }
        });
    }
}

/// A component that is active here and excludes this one.
fn rival(shown: &PanelSource<'_>, place: &Place, component: &str) -> Option<String> {
    let sets = shown.mission.exclusives.iter();
    let sets = sets.filter(|set| set.components.iter().any(|name| name.value == component));
    let mut others = sets.flat_map(|set| &set.components);
    let found = others.find(|other| other.value != component && place.activates(&other.value));
    found.map(|other| other.value.clone())
}

fn parameters(ui: &mut egui::Ui, shown: &PanelSource<'_>, place: &Place, form: &mut Form) {
    if place.components.is_empty() {
        return;
    }
    section(ui, "Parameter values while marked");
    let change = |component: &str, parameter: &str, value: Option<String>| Change::PlaceParameter {
        place: place.name.value.clone(),
        component: component.to_owned(),
        parameter: parameter.to_owned(),
        value,
    };
    for given in &place.parameters {
        let (component, parameter) = (&given.component.value, &given.parameter.name.value);
        let manifest = kind_of(shown, component);
        let declared = manifest.and_then(|m| m.parameters.iter().find(|p| p.name == *parameter));
        let judge = |text: &str| declared.map_or(Ok(()), |p| p.parse(text).map(|_| ()));
        let doc = declared.map_or_else(String::new, |declared| declared.doc.clone());
        let name = format!("{component}.{parameter}");
        row(ui, &name, &doc, |ui| {
            let shown = form.line(ui, &name, &given.parameter.value.value, &judge, |value| {
                Some(change(component, parameter, Some(value.to_owned())))
            });
            let remove = format!("Remove {name}");
            if ui.button("remove").on_hover_text(&remove).accessible_name(remove).clicked() {
                form.change(change(component, parameter, None));
            }
            shown
        });
    }
    ui.menu_button("Add a value…", |ui| {
        for component in &place.components {
            let Some(manifest) = kind_of(shown, &component.value) else { continue };
            for parameter in &manifest.parameters {
                let is_given = place.parameters.iter().any(|given| {
                    given.component.value == component.value
                        && given.parameter.name.value == parameter.name
                });
                let name = format!("{}.{}", component.value, parameter.name);
                if !is_given && ui.button(&name).on_hover_text(&parameter.doc).clicked() {
                    let value = parameter.default_with_unit().unwrap_or_default();
                    form.change(change(&component.value, &parameter.name, Some(value)));
                }
            }
        }
    });
}

fn kind_of<'a>(
    shown: &'a PanelSource<'_>,
    component: &str,
) -> Option<&'a armor_wire::manifest::Manifest> {
    let component = shown.configuration.system.component(component)?;
    shown.kinds.find(&component.kind.value)
}

pub(super) fn neighbours(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    place: &Place,
    requests: &mut Vec<PanelRequest>,
) {
    section(ui, "Arcs");
    let name = &place.name.value;
    let mut is_lonely = true;
    for transition in &shown.mission.transitions {
        for arc in transition.arcs.iter().filter(|arc| arc.place.value == *name) {
            is_lonely = false;
            let weight = if arc.weight > 1 { format!(" {}", arc.weight) } else { String::new() };
            let word = match arc.kind {
                ArcKind::Put => "in by",
                ArcKind::Take => "out by",
                ArcKind::Read => "read by",
                ArcKind::Inhibitor => "holds up",
                ArcKind::Reset => "emptied by",
            };
            ui.horizontal(|ui| {
                ui.label(RichText::new(format!("{word}{weight}")).weak());
                let item = Item::transition(&transition.name.value);
                go_to(ui, &transition.name.value, item, requests);
            });
        }
    }
    for (number, submission) in shown.mission.submissions.iter().enumerate() {
        for (word, end) in [("out by", &submission.enter), ("in by", &submission.leave)] {
            if end.as_ref().is_some_and(|end| end.value == *name) {
                is_lonely = false;
                ui.horizontal(|ui| {
                    ui.label(RichText::new(word).weak());
                    go_to(ui, &submission.file.value, Item::Submission(number), requests);
                });
            }
        }
    }
    if is_lonely {
        ui.weak("None. Drag from the handle at its right edge to another place.");
    }
}
