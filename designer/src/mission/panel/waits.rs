//! What a transition waits for next to time: a report, a guard.

use armor_robotfile::mission::Transition;
use armor_wire::manifest::RESERVED_EVENTS;
use eframe::egui;

use super::fields::data_fields;
use super::parts::PanelSource;
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::form::{Form, given, is_guard, is_name, row, wrong};
use crate::window_words::in_window_words;

pub(super) fn report(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    transition: &Transition,
    form: &mut Form,
) {
    let item = Item::transition(&transition.name.value);
    let on = transition.on.as_ref();
    let component = on.map(|on| on.component.value.clone());
    let event = on.map_or_else(|| "done".to_owned(), |on| on.event.value.clone());
    let mut choices = vec![(None, "no report".to_owned())];
    let (heard, others) = reporters(shown, transition);
    choices.extend(heard.into_iter().map(|name| (Some(name.clone()), name)));
    choices.extend(
        others.into_iter().map(|name| (Some(name.clone()), format!("{name} (frozen here)"))),
    );
    let set = |component: &str, event: &str| {
        Change::Attribute(item, "on", Some(format!("{component}.{event}")))
    };
    row(ui, "Report of", "The component whose report it waits for.", |ui| {
        let form = form.unread(shown.unread(&item, "on"));
        form.choice(ui, "report of", &component, &choices, |choice| match choice {
            Some(component) => set(component, &event),
            None => Change::Attribute(item, "on", None),
        });
    });
    let Some(component) = component else { return };
    row(ui, "Report", "done, failed, or a named event of the component.", |ui| {
        form.line(ui, "report", &event, &is_name, |event| Some(set(&component, event.trim())));
        ui.horizontal_wrapped(|ui| {
            for known in events(shown, &component) {
                if known != event && ui.button(&known).clicked() {
                    form.change(set(&component, &known));
                }
            }
        });
    });
}

/// The components that are active in a place this transition starts from, and the others.
fn reporters(shown: &PanelSource<'_>, transition: &Transition) -> (Vec<String>, Vec<String>) {
    let starts =
        transition.arcs.iter().filter(|arc| arc.kind != armor_robotfile::mission::ArcKind::Put);
    let places: Vec<_> = starts.filter_map(|arc| shown.mission.place(&arc.place.value)).collect();
    shown.components().into_iter().partition(|component| {
        !shown.mission.controls(component) || places.iter().any(|place| place.activates(component))
    })
}

/// Reports that a component is known to send: those that its kind may send, with the events that it
/// declares, and those that other transitions wait for.
fn events(shown: &PanelSource<'_>, component: &str) -> Vec<String> {
    let mut known: Vec<_> = RESERVED_EVENTS.map(str::to_owned).into();
    let system = &shown.configuration.system;
    let found = system.components.iter().find(|one| one.name.value == component);
    if let Some(found) = found
        && let Some(manifest) = shown.kinds.find(&found.kind.value)
    {
        let value = |name: &str| found.parameter(name).map(|given| given.value.value.as_str());
        known = manifest.common_reports().iter().map(|report| (*report).to_owned()).collect();
        known.extend(manifest.event_names(value).into_iter().map(str::to_owned));
    }
    for on in shown.mission.transitions.iter().filter_map(|transition| transition.on.as_ref()) {
        if on.component.value == component && !known.contains(&on.event.value) {
            known.push(on.event.value.clone());
        }
    }
    known
}

pub(super) fn guard(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    transition: &Transition,
    form: &mut Form,
) {
    let item = Item::transition(&transition.name.value);
    let value = transition.when.as_ref().map_or("", |when| when.value.as_str());
    let set = |text: &str| Change::Attribute(item, "when", given(text));
    row(ui, "While", "A guard: the transition is enabled only while it is true.", |ui| {
        let hint = "battery < 30% and not power.state.charging";
        form.hinted(ui, "guard", hint, value, &is_guard, |text| Some(set(text)));
        for finding in shown.marks.found(&item).filter(|found| is_of_guard(found.code)) {
            let remedy = in_window_words(&finding.remedy);
            wrong(ui, &format!("{} ({remedy})", finding.message));
        }
        ui.menu_button("Add a condition…", |ui| {
            egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
                for (name, is) in known_names(shown) {
                    if ui.button(&name).on_hover_text(&is).clicked() {
                        form.change(set(&with_condition(value, &name, &is)));
                    }
                }
            });
        })
        .response
        .on_hover_text("Adds a variable or a field of data to the guard");
    });
}

fn is_of_guard(code: armor_robotfile::Code) -> bool {
    use armor_robotfile::Code;
    matches!(
        code,
        Code::GuardType
            | Code::GuardUnit
            | Code::UnknownVariable
            | Code::UnknownField
            | Code::FieldNotSingle
    )
}

/// Variables, then fields of data, each with what it is.
fn known_names(shown: &PanelSource<'_>) -> Vec<(String, String)> {
    let variables = shown.mission.variables.iter().map(|variable| {
        let source = variable.source.as_ref().map_or("nothing", |source| source.value.as_str());
        (variable.name.value.clone(), format!("a variable that follows {source}"))
    });
    let data = data_fields(shown.configuration, shown.kinds).into_iter();
    variables.chain(data.map(|field| (field.name, field.is))).collect()
}

/// The guard with one condition more, of a form that fits what is looked at.
fn with_condition(guard: &str, name: &str, is: &str) -> String {
    let condition = match is {
        "true or false" => name.to_owned(),
        "a text" => format!("{name} == ''"),
        choice if choice.starts_with("one of ") => {
            let first = choice.trim_start_matches("one of ").split(", ").next().unwrap_or("''");
            format!("{name} == {first}")
        }
        number => {
            let unit = number.split_once(" in ").map_or("", |(_, unit)| unit);
            format!("{name} < 1{unit}")
        }
    };
    match guard.trim() {
        "" => condition,
        guard => format!("{guard} and {condition}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_fits_what_it_looks_at() {
        let check = |guard: &str, is: &str, expected: &str| {
            let text = with_condition(guard, "a.b.c", is);
            assert_eq!(text, expected);
            assert_eq!(is_guard(&text), Ok(()));
        };
        check("", "a number in m/s", "a.b.c < 1m/s");
        check("x > 2", "true or false", "x > 2 and a.b.c");
        check("", "one of 'Full', 'Low'", "a.b.c == 'Full'");
        check("", "a number", "a.b.c < 1");
    }
}
