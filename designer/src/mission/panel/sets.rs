//! Variables, exclusive sets and sub-missions.

use eframe::egui::{self, RichText};

use super::fields::data_fields;
use super::parts::{PanelSource, section};
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::form::{Form, given, is_name, row};
use crate::panels::fields::anything;

/// The variables, each with its source and domain.
pub(super) fn variables(ui: &mut egui::Ui, shown: &PanelSource<'_>, form: &mut Form) {
    section(ui, "Variables used in guards");
    for variable in &shown.mission.variables {
        let name = &variable.name.value;
        let item = Item::variable(name);
        let set = |key, value: Option<String>| Change::Attribute(item, key, value);
        form.of(item);
        row(ui, "Name", "The name that guards use.", |ui| {
            form.line(ui, &format!("name of {name}"), name, &is_name, |new| {
                Some(Change::Rename(item, new.to_owned()))
            });
        });
        let source = variable.source.as_ref().map_or("", |source| source.value.as_str());
        row(ui, "Follows", "A field of data: component.output.field.", |ui| {
            form.hinted(
                ui,
                &format!("source of {name}"),
                "power.state.level",
                source,
                &anything,
                |text| Some(set("source", given(text))),
            );
        });
        row(ui, "Domain", "Its least and greatest value; values outside are clamped.", |ui| {
            let least = variable.minimum.as_ref().map_or("", |end| end.at.text());
            let form = form.unread(shown.unread(&item, "min"));
            form.hinted(ui, &format!("least {name}"), "least", least, &is_quantity, |text| {
                Some(set("min", given(text)))
            });
            let most = variable.maximum.as_ref().map_or("", |end| end.at.text());
            let form = form.unread(shown.unread(&item, "max"));
            form.hinted(ui, &format!("greatest {name}"), "greatest", most, &is_quantity, |text| {
                Some(set("max", given(text)))
            });
        });
        if variable.source.is_none() {
            row(ui, "At the start", "A whole number; default: its least value.", |ui| {
                let initial = variable.initial.as_ref().map(|initial| initial.value.to_string());
                let initial = initial.unwrap_or_default();
                let form = form.unread(shown.unread(&item, "initial"));
                form.hinted(
                    ui,
                    &format!("{name} at the start"),
                    "least",
                    &initial,
                    &is_whole,
                    |text| Some(set("initial", given(text))),
                );
            });
        }
        if ui.button(format!("Remove {item}")).clicked() {
            form.change(Change::Remove(vec![item]));
        }
        ui.add_space(armor_picture::theme::NEAR);
    }
    let fields = data_fields(shown.configuration, shown.kinds);
    ui.menu_button("Add a variable…", |ui| {
        egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
            let counter = ui.button("Set by transitions");
            if counter.on_hover_text("A whole number, such as a count of rounds.").clicked() {
                form.change(Change::AddVariable("count".into(), None));
            }
            for field in &fields {
                if ui.button(&field.name).on_hover_text(&field.is).clicked() {
                    let preferred =
                        field.name.rsplit('.').next().unwrap_or("value").replace('_', "-");
                    form.change(Change::AddVariable(preferred, Some(field.name.clone())));
                }
            }
            if fields.is_empty() {
                ui.weak("The kinds of the components are not known.");
            }
        });
    });
}

fn is_quantity(text: &str) -> Result<(), String> {
    match text.trim() {
        "" => Ok(()),
        text => armor_wire::quantity::parse(text).map(|_| ()).map_err(|error| error.to_string()),
    }
}

fn is_whole(text: &str) -> Result<(), String> {
    match text.trim() {
        "" => Ok(()),
        text => {
            text.parse::<i64>().map(|_| ()).map_err(|_| format!("{text} is not a whole number"))
        }
    }
}

/// The exclusive sets as checklists.
pub(super) fn exclusives(ui: &mut egui::Ui, shown: &PanelSource<'_>, form: &mut Form) {
    section(ui, "Exclusive: at most one is active");
    for (number, set) in shown.mission.exclusives.iter().enumerate() {
        form.of(Item::Exclusive(number));
        ui.horizontal(|ui| {
            ui.label(RichText::new(format!("Set {}", number + 1)).weak());
            let remove = format!("Remove exclusive set {}", number + 1);
            if ui.button("remove").on_hover_text(&remove).accessible_name(remove).clicked() {
                form.change(Change::Remove(vec![Item::Exclusive(number)]));
            }
        });
        let known = shown.components();
        let gone = set.components.iter().map(|name| name.value.clone());
        let gone: Vec<_> = gone.filter(|name| !known.contains(name)).collect();
        for component in known.into_iter().chain(gone) {
            let is_in = set.components.iter().any(|name| name.value == component);
            // What no place activates is always active and excludes nothing.
            let may = is_in || shown.mission.controls(&component);
            let mut is_now = is_in;
            let label = format!("{component} in exclusive set {}", number + 1);
            let checkbox = egui::Checkbox::new(&mut is_now, &component);
            let checkbox = ui.add_enabled(may, checkbox).accessible_name(label);
            checkbox.on_disabled_hover_text("no place activates it");
            if is_now != is_in {
                form.change(Change::Exclusive(number, component.clone(), is_now));
            }
        }
    }
    let controlled = shown.components().into_iter().filter(|name| shown.mission.controls(name));
    let controlled: Vec<_> = controlled.collect();
    let add = ui.add_enabled(controlled.len() > 1, egui::Button::new("Add an exclusive set"));
    let add = add.on_disabled_hover_text("Two components must be in places first.");
    if add.clicked() {
        form.change(Change::AddExclusive(controlled.into_iter().take(2).collect()));
    }
}

/// The sub-missions' files, and a new one.
pub(super) fn submissions(ui: &mut egui::Ui, shown: &PanelSource<'_>, form: &mut Form) {
    section(ui, "Sub-missions");
    for number in 0..shown.mission.submissions.len() {
        form.of(Item::Submission(number));
        submission(ui, shown, number, form);
        ui.add_space(armor_picture::theme::NEAR);
    }
    form.of("mission");
    row(ui, "Add a file", "Another mission over the same system, such as dock.xml.", |ui| {
        form.hinted(ui, "file of a new sub-mission", "dock.xml", "", &anything, |text| {
            given(text).map(Change::AddSubmission)
        });
    });
}

/// One sub-mission: its file and the places it joins.
pub(super) fn submission(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    number: usize,
    form: &mut Form,
) {
    let Some(submission) = shown.mission.submissions.get(number) else { return };
    let title = format!("sub-mission {}", number + 1);
    row(ui, "File", "The file of the sub-mission.", |ui| {
        form.line(ui, &format!("file of {title}"), &submission.file.value, &anything, |text| {
            given(text).map(|file| Change::Submission(number, "ref", Some(file)))
        });
    });
    let ends = [
        ("Entered from", "in", "The place whose token begins it.", &submission.enter),
        ("Leaves to", "out", "The place that gets a token at its goal.", &submission.leave),
    ];
    for (label, key, doc, value) in ends {
        let mut choices = vec![(None, "none".to_owned())];
        choices.extend(shown.places().into_iter().map(|place| (Some(place.clone()), place)));
        let value = value.as_ref().map(|place| place.value.clone());
        row(ui, label, doc, |ui| {
            form.choice(ui, &format!("{key} of {title}"), &value, &choices, |place| {
                Change::Submission(number, key, place.clone())
            });
        });
    }
    if ui.button(format!("Remove {title}")).clicked() {
        form.change(Change::Remove(vec![Item::Submission(number)]));
    }
}
