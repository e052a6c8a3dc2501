//! A transition: its name, its arcs, and when it fires.

use armor_robotfile::mission::{Autonomy, Class, LostLink, Missed, Transition};
use eframe::egui::{self, RichText};

use super::parts::{PanelRequest, PanelSource, section};
use super::{arcs, timing, waits};
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::edits::Decides;
use crate::mission::form::{Form, given, is_count, is_date, is_name, is_time, row};

pub(super) fn show(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    transition: &Transition,
    form: &mut Form,
    requests: &mut Vec<PanelRequest>,
) {
    let name = &transition.name.value;
    let item = Item::transition(name);
    ui.heading("Transition");
    row(ui, "Name", "The name that operators and checks use.", |ui| {
        form.line(ui, "name of the transition", name, &is_name, |new| {
            Some(Change::Rename(item, new.to_owned()))
        });
    });
    arcs::show(ui, shown, transition, form, requests);
    section(ui, "Fires");
    timing::timing(ui, shown, transition, form);
    waits::report(ui, shown, transition, form);
    waits::guard(ui, shown, transition, form);
    decides(ui, shown, transition, form);
    sets(ui, shown, transition, form);
    section(ui, "Priority");
    let set = |key, value: Option<String>| Change::Attribute(item, key, value);
    row(ui, "Priority", "The higher priority fires first.", |ui| {
        let range = -999_999_999..=999_999_999;
        let form = form.unread(shown.unread(&item, "priority"));
        form.number(ui, "priority", transition.priority.into(), range, |priority| {
            set("priority", (priority != 0).then(|| priority.to_string()))
        });
    });
    let is_safety = transition.class == Class::Safety;
    let form = form.unread(shown.unread(&item, "class"));
    form.flag(
        ui,
        "Safety class: has priority over all others and continues during a pause",
        is_safety,
        |is_set| set("class", is_set.then(|| "safety".into())),
    );
    let dated = egui::CollapsingHeader::new("Dates").default_open(has_dates(transition));
    let unread = ["not-before", "not-after", "missed"].map(|key| shown.unread(&item, key));
    let must_be_seen = unread.iter().any(Option::is_some);
    dated.open(must_be_seen.then_some(true)).show(ui, |ui| {
        dates(ui, shown, transition, form);
    });
    let has_failures = transition.on_stop_fail.is_some()
        || transition.on_start_fail.is_some()
        || transition.overrun.is_some();
    egui::CollapsingHeader::new("When something fails").default_open(has_failures).show(ui, |ui| {
        failures(ui, shown, transition, form);
    });
}

/// What it sets variables to that follow no data.
fn sets(ui: &mut egui::Ui, shown: &PanelSource<'_>, transition: &Transition, form: &mut Form) {
    let free = shown.mission.variables.iter().filter(|variable| variable.source.is_none());
    let names: Vec<_> = free.map(|variable| variable.name.value.clone()).collect();
    if names.is_empty() && transition.sets.is_empty() {
        return;
    }
    section(ui, "Sets variables");
    let owner = transition.name.value.clone();
    for name in &names {
        let known = transition.sets.iter().find(|set| set.variable.value == *name);
        let value = known.map_or("", |set| set.value.value.as_str());
        row(ui, name, "A whole number, such as round + 1; empty: unchanged.", |ui| {
            let label = format!("sets {name} to");
            form.hinted(ui, &label, "unchanged", value, &is_count, |text| {
                Some(Change::SetVariable(owner.clone(), name.clone(), given(text)))
            });
        });
    }
}

fn decides(ui: &mut egui::Ui, shown: &PanelSource<'_>, transition: &Transition, form: &mut Form) {
    let name = transition.name.value.clone();
    let item = Item::transition(&name);
    let now = match transition.autonomy {
        Autonomy::Auto => Decides::Auto,
        Autonomy::Confirm { .. } => Decides::Confirm,
        Autonomy::Operator => Decides::Operator,
    };
    let choices = [
        (Decides::Auto, "the robot".to_owned()),
        (Decides::Confirm, "the robot, after asking".to_owned()),
        (Decides::Operator, "the operator".to_owned()),
    ];
    row(ui, "Decides", "Who decides that it fires.", |ui| {
        let unread = ["autonomy", "operator"].into_iter().find_map(|key| shown.unread(&item, key));
        let form = form.unread(unread);
        form.choice(ui, "who decides", &now, &choices, |decides| {
            Change::Decides(name.clone(), *decides)
        });
    });
    if now == Decides::Auto {
        return;
    }
    let set = |key, value: Option<String>| Change::Attribute(item, key, value);
    if let Autonomy::Confirm { within, fire_unanswered } = transition.autonomy {
        let text = within.map_or_else(String::new, crate::mission::form::time_text);
        row(ui, "Waits", "How long it waits for an answer; empty: forever.", |ui| {
            let form = form.unread(shown.unread(&item, "answer-within"));
            form.hinted(ui, "answer within", "forever", &text, &is_time, |text| {
                Some(set("answer-within", given(text)))
            });
        });
        if within.is_some() {
            let form = form.unread(shown.unread(&item, "unanswered"));
            form.flag(ui, "Fires without an answer", fire_unanswered, |is_set| {
                set("unanswered", is_set.then(|| "fire".into()))
            });
        }
    }
    let lost = transition.lost_link.as_deref().copied();
    let choices = [
        (None, "default".to_owned()),
        (Some(LostLink::Fire), "fires".to_owned()),
        (Some(LostLink::Wait), "waits".to_owned()),
    ];
    row(ui, "Lost link", "What happens when the link to the operator is lost.", |ui| {
        let form = form.unread(shown.unread(&item, "lost-link"));
        form.choice(ui, "when the link is lost", &lost, &choices, |lost| {
            let value = lost.map(|lost| if lost == LostLink::Fire { "fire" } else { "wait" });
            set("lost-link", value.map(str::to_owned))
        });
    });
}

fn has_dates(transition: &Transition) -> bool {
    transition.not_before.is_some() || transition.not_after.is_some()
}

fn dates(ui: &mut egui::Ui, shown: &PanelSource<'_>, transition: &Transition, form: &mut Form) {
    let item = Item::transition(&transition.name.value);
    let set = |key, value: Option<String>| Change::Attribute(item, key, value);
    let hint = "2026-11-21T14:30Z";
    let first = transition.not_before.as_ref().map_or("", |date| date.at.text());
    row(ui, "Not before", "A date in UTC.", |ui| {
        let form = form.unread(shown.unread(&item, "not-before"));
        form.hinted(ui, "not before this date", hint, first, &is_date, |text| {
            Some(set("not-before", given(text)))
        });
    });
    let last = transition.not_after.as_ref().map_or("", |date| date.at.text());
    row(ui, "Not after", "A date in UTC.", |ui| {
        let form = form.unread(shown.unread(&item, "not-after"));
        form.hinted(ui, "not after this date", hint, last, &is_date, |text| {
            Some(set("not-after", given(text)))
        });
    });
    if transition.not_after.is_some() {
        let missed = transition.missed.as_deref().copied().unwrap_or_default();
        let choices = [
            (Missed::Skip, "never fires".to_owned()),
            (Missed::Fire, "fires once, late".to_owned()),
            (Missed::Fail, "the mission goes to its safe place".to_owned()),
        ];
        row(ui, "Missed", "What happens when this date passes before it has fired.", |ui| {
            let form = form.unread(shown.unread(&item, "missed"));
            form.choice(ui, "when the date is missed", &missed, &choices, |missed| {
                let value = match missed {
                    Missed::Skip => None,
                    Missed::Fire => Some("fire".to_owned()),
                    Missed::Fail => Some("fail".to_owned()),
                };
                set("missed", value)
            });
        });
    }
    ui.label(RichText::new("In UTC, by the clock of the robot.").weak().small());
}

fn failures(ui: &mut egui::Ui, shown: &PanelSource<'_>, transition: &Transition, form: &mut Form) {
    let item = Item::transition(&transition.name.value);
    let mut targets = vec![
        ("Stop failed", "on-stop-fail", "when a component does not stop", &transition.on_stop_fail),
        (
            "Start failed",
            "on-start-fail",
            "when a component does not start",
            &transition.on_start_fail,
        ),
    ];
    if transition.interval.as_ref().is_none_or(|interval| interval.latest.is_some()) {
        targets.push(("Overrun", "overrun", "when it fires late", &transition.overrun));
    }
    for (label, key, doc, value) in targets {
        let nothing = if key == "overrun" { "nothing more" } else { "the safe place" };
        let mut choices = vec![(None, nothing.to_owned())];
        choices.extend(shown.places().into_iter().map(|place| (Some(place.clone()), place)));
        let value = value.as_ref().map(|place| place.value.clone());
        row(ui, label, &format!("The place that gets a token {doc}."), |ui| {
            form.choice(ui, doc, &value, &choices, |place| {
                Change::Attribute(item, key, place.clone())
            });
        });
    }
}
