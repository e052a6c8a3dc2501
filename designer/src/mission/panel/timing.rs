//! When a transition fires, counted from when it is enabled.

use armor_robotfile::mission::Transition;
use eframe::egui;

use super::parts::PanelSource;
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::edits::Timing;
use crate::mission::form::{Form, given, is_time, row};

/// As the file shows it, also what is not understood of it.
fn text_of(shown: &PanelSource<'_>, transition: &Transition) -> Timing {
    let item = Item::transition(&transition.name.value);
    let unread = |attribute| shown.unread(&item, attribute).map(str::to_owned);
    let Some(interval) = &transition.interval else {
        let timeout = || unread("timeout").map(Timing::Timeout);
        let after = || unread("after").map(Timing::After);
        let between = || unread("interval").map(|text| ends_of(&text));
        return timeout().or_else(after).or_else(between).unwrap_or(Timing::Immediate);
    };
    let text = interval.at.text();
    match interval.value.latest {
        _ if text.starts_with('[') => ends_of(text),
        Some(_) => Timing::Timeout(text.to_owned()),
        None => Timing::After(text.to_owned()),
    }
}

/// The two ends of `[2s,5s]`; of anything else, all is the first.
fn ends_of(text: &str) -> Timing {
    let inner = text.trim().trim_start_matches('[').trim_end_matches([']', ')']);
    let (from, to) = inner.split_once(',').unwrap_or((inner, ""));
    Timing::Interval(from.trim().to_owned(), to.trim().to_owned())
}

pub(super) fn timing(
    ui: &mut egui::Ui,
    shown: &PanelSource<'_>,
    transition: &Transition,
    form: &mut Form,
) {
    let name = transition.name.value.clone();
    let now = text_of(shown, transition);
    let set = |timing: Timing| Change::Timing(name.clone(), timing);
    let own = match &now {
        Timing::Timeout(time) | Timing::After(time) | Timing::Interval(time, _)
            if given(time).is_some() && is_time(time).is_ok() =>
        {
            time.clone()
        }
        _ => "10s".to_owned(),
    };
    // The sort of timing; the times themselves have their own fields.
    let sort = |timing: &Timing| match timing {
        Timing::Immediate => 0,
        Timing::Timeout(_) => 1,
        Timing::After(_) => 2,
        Timing::Interval(..) => 3,
    };
    let sorts = [
        (0, "immediately".to_owned()),
        (1, "after a time (timeout)".to_owned()),
        (2, "after a time, or later".to_owned()),
        (3, "between two times".to_owned()),
    ];
    row(ui, "When", "Counted from when everything it waits for is present.", |ui| {
        form.choice(ui, "when it fires", &sort(&now), &sorts, |sort| {
            set(match sort {
                1 => Timing::Timeout(own.clone()),
                2 => Timing::After(own.clone()),
                3 => Timing::Interval(own.clone(), "inf".into()),
                _ => Timing::Immediate,
            })
        });
    });
    let needed = |text: &str| match given(text) {
        Some(text) => is_time(&text),
        None => Err("a time is needed, such as 90s or 10min".into()),
    };
    match now {
        Timing::Immediate => {}
        Timing::Timeout(time) => {
            row(ui, "Time", "With its unit: 90s, 10min, 0.2s.", |ui| {
                form.line(ui, "timeout", &time, &needed, |text| {
                    given(text).map(|time| set(Timing::Timeout(time)))
                });
            });
        }
        Timing::After(time) => {
            row(ui, "Not before", "With its unit: 90s, 10min, 0.2s.", |ui| {
                form.line(ui, "not before this time", &time, &needed, |text| {
                    given(text).map(|time| set(Timing::After(time)))
                });
            });
        }
        Timing::Interval(from, to) => {
            row(ui, "From", "The earliest, with its unit.", |ui| {
                form.line(ui, "earliest time", &from, &needed, |text| {
                    given(text).map(|time| set(Timing::Interval(time, to.clone())))
                });
            });
            let is_end = |text: &str| match text.trim() {
                "" | "inf" => Ok(()),
                text => is_time(text),
            };
            row(ui, "To", "The latest, with its unit; inf: no limit.", |ui| {
                form.line(ui, "latest time", &to, &is_end, |text| {
                    Some(set(Timing::Interval(from.clone(), text.trim().to_owned())))
                });
            });
        }
    }
}
