//! The mission as a whole: its name, what was proven of it, and what has no position in the
//! drawing.

use armor_proof::time_in_words as time;
use armor_robotfile::mission::{Mission, Resume};
use armor_robotfile::{FiringTrace, MissionDuration, Severity, Spanned};
use eframe::egui::{self, RichText};

use super::parts::{PanelRequest, PanelSource, section, show_finding};
use super::{claims, sets};
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::form::{Form, given, is_name, is_time, row};
use armor_picture::theme::ThemeColours;

pub(super) fn show(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    form: &mut Form,
    requests: &mut Vec<PanelRequest>,
) {
    ui.heading("Mission");
    let mission = shown.mission;
    attributes(ui, shown, mission, form);
    proof(ui, shown, requests);
    claims::show(ui, shown, form, requests);
    sets::variables(ui, shown, form);
    sets::exclusives(ui, shown, form);
    sets::submissions(ui, shown, form);
}

fn attributes(ui: &mut egui::Ui, shown: &PanelSource<'_>, mission: &Mission, form: &mut Form) {
    let set = |key, value: Option<String>| Change::Attribute(Item::Mission, key, value);
    let name = mission.name.as_ref().map_or("", |name| name.value.as_str());
    let is_name_or_none = |text: &str| if text.is_empty() { Ok(()) } else { is_name(text) };
    row(ui, "Name", "The mission's name.", |ui| {
        form.line(ui, "name of the mission", name, &is_name_or_none, |text| {
            Some(set("name", given(text)))
        });
    });
    let ends = [
        ("Goal", "goal", "The mission ends successfully when this place is marked.", &mission.goal),
        ("Safe place", "safe", "Where the mission goes when something fails.", &mission.safe),
    ];
    for (label, key, doc, value) in ends {
        let mut choices = vec![(None, "none".to_owned())];
        choices.extend(shown.places().into_iter().map(|place| (Some(place.clone()), place)));
        let value = value.as_ref().map(|place: &Spanned<String>| place.value.clone());
        row(ui, label, doc, |ui| {
            form.choice(ui, label, &value, &choices, |place| set(key, place.clone()));
        });
    }
    let resume = mission.resume.as_deref().copied();
    let choices = [
        (None, "continue (default)".to_owned()),
        (Some(Resume::Continue), "continue".to_owned()),
        (Some(Resume::Hold), "wait for the operator".to_owned()),
        (Some(Resume::Safe), "go to the safe place".to_owned()),
    ];
    row(ui, "Resume", "What the mission does after a power loss.", |ui| {
        let form = form.unread(shown.unread(&Item::Mission, "resume"));
        form.choice(ui, "after a restart", &resume, &choices, |resume| {
            let value = resume.map(|resume| match resume {
                Resume::Continue => "continue",
                Resume::Hold => "hold",
                Resume::Safe => "safe",
            });
            set("resume", value.map(str::to_owned))
        });
    });
    let period = mission.period.as_ref().map_or("", |period| period.at.text());
    row(
        ui,
        "Period",
        "Time between two evaluations of the net; empty: evaluated on every change.",
        |ui| {
            let form = form.unread(shown.unread(&Item::Mission, "period"));
            form.hinted(ui, "period", "on every change", period, &is_time, |text| {
                Some(set("period", given(text)))
            });
        },
    );
}

/// What was found of the mission, in a few words.
fn proof(ui: &mut egui::Ui, shown: &PanelSource<'_>, requests: &mut Vec<PanelRequest>) {
    section(ui, "Proof");
    let colours = ThemeColours::of(ui.visuals());
    let counted = |severity| shown.marks.all().counted(severity);
    let (verdict, colour) = match (counted(Severity::Error), counted(Severity::Warning)) {
        _ if shown.is_checking => ("proving…".to_owned(), colours.weak),
        (Some(errors), _) => (format!("not proven: {errors}"), colours.error),
        (None, Some(doubts)) => (format!("proven, with {doubts}"), colours.warning),
        (None, None) => ("proven: no problems".to_owned(), colours.good),
    };
    ui.label(RichText::new(verdict).color(colour));
    let with_traces = shown.marks.all().iter().filter(|found| found.trace.is_some());
    for finding in with_traces.filter(|found| found.code != armor_robotfile::Code::CheckFails) {
        show_finding(ui, finding, shown.project, requests);
    }
    if let Some(takes) = shown.marks.takes() {
        durations(ui, takes, requests);
    }
}

fn durations(ui: &mut egui::Ui, takes: &MissionDuration, requests: &mut Vec<PanelRequest>) {
    let play = |firings: &[String], circle: &[String], is_late| {
        PanelRequest::Play(FiringTrace {
            firings: firings.to_vec(),
            circle: circle.to_vec(),
            is_late,
        })
    };
    let seconds = |s: f64| time(std::time::Duration::try_from_secs_f64(s).unwrap_or_default());
    ui.horizontal(|ui| {
        ui.label(format!("Shortest: {}", seconds(takes.shortest_s)));
        let button = ui.button("play").accessible_name("Play the shortest run");
        if button.on_hover_text(takes.shortest_trace.join(", ")).clicked() {
            requests.push(play(&takes.shortest_trace, &[], false));
        }
    });
    ui.horizontal(|ui| {
        match takes.longest_s {
            Some(longest) => ui.label(format!("Longest: {}", seconds(longest))),
            None => ui.label("Longest: unbounded"),
        };
        let button = ui.button("play").accessible_name("Play the longest run");
        if button.on_hover_text(takes.longest_trace.join(", ")).clicked() {
            requests.push(play(&takes.longest_trace, &takes.longest_circle, true));
        }
    });
    let end = if takes.always_goal {
        "It always ends at the goal."
    } else {
        "It may end in the safe place."
    };
    ui.label(RichText::new(end).weak().small());
}
