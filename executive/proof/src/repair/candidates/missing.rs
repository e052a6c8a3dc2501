//! Transitions that are missing: for the end of a task that nothing waits for, and between places
//! that lack one.

use std::collections::BTreeSet;

use armor_robotfile::Span;
use armor_robotfile::tree::Element;

use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;

/// Before the edits of other transitions: nothing in the file is likelier to be meant otherwise.
const MISSING: i32 = 15;
/// The rank of one between places that lack one, next to edits that use such a place.
const JOIN: i32 = 19;
/// The name of an added transition, which no other one may have.
const NAME: &str = "added";

impl MissionElements<'_> {
    /// Transitions from one place to another that the mission lacks.
    pub(super) fn missing_transitions(&self, edits: &mut Vec<FileEdit>) {
        let named: Vec<_> = self.place_names().filter(|place| self.is_named(place)).collect();
        for place in &self.places {
            let Some(name) = value(place, "name") else { continue };
            let components = value(place, "components").unwrap_or("").split_whitespace();
            let is_awaited = |report: &str| {
                self.transitions.iter().any(|it| {
                    let from = value(it, "from").unwrap_or("");
                    value(it, "on") == Some(report) && from.split_whitespace().any(|it| it == name)
                })
            };
            for report in components.map(|it| format!("{it}.done")).filter(|it| !is_awaited(it)) {
                for to in named.iter().filter(|to| **to != name) {
                    edits.push(self.with_transition(place, name, to, &format!(" on=\"{report}\"")));
                }
            }
        }
        let loose = |attribute| self.place_names().filter(move |it| self.is_loose(attribute, it));
        let from: Vec<_> = loose("from").collect();
        let first = self.places.iter().find(|place| value(place, "name") == from.first().copied());
        if let Some(first) = first {
            let to: BTreeSet<_> = loose("to").chain(value(self.element, "goal")).collect();
            let all = loose("to").collect::<Vec<_>>().join(" ");
            let all = Some(all.as_str()).filter(|all| all.contains(' '));
            for to in to.into_iter().chain(all) {
                edits.push(self.with_transition(first, &from.join(" "), to, "").ranked(JOIN));
            }
        }
    }

    /// Whether a fault is at the place, or related to it.
    fn is_named(&self, place: &str) -> bool {
        self.faults.iter().any(|fault| {
            let mut places = fault.at.iter().chain(fault.related.iter().map(|it| &it.0));
            places.any(|at| at.source.path() == self.source.path() && at.text() == place)
        })
    }

    fn with_transition(&self, place: &Element, from: &str, to: &str, waits: &str) -> FileEdit {
        let end = self.element.span.end() - "</mission>".len();
        let attributes = format!("from=\"{from}\" to=\"{to}\"{waits}/>");
        FileEdit {
            replaced: vec![(
                Span::new(end, end),
                format!("<transition name=\"{NAME}\" {attributes}"),
            )],
            at: self.at(place.attribute("name").map_or(place.name_span, |it| it.value_span)),
            result: format!("<transition name=\"…\" {attributes}"),
            element: String::new(),
            question: None,
            is_missing: true,
            rank: MISSING,
        }
    }
}
