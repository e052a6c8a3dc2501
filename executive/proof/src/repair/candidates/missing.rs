//! Transitions that are missing: for the end of a task that nothing waits for, and between places
//! that lack one.

use std::collections::{BTreeMap, BTreeSet};

use armor_robotfile::Span;
use armor_robotfile::tree::Element;

use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;

/// Before the edits of other transitions: nothing in the file is likelier to be meant otherwise.
const MISSING: i32 = 15;
/// The rank of one between places that lack one, next to edits that use such a place.
const JOIN: i32 = 19;
/// The rank of one to such places and another one.
const FORK: i32 = 21;
/// The rank of a timeout, before a place that leads elsewhere.
const TIMEOUT: i32 = 16;
/// How much likelier it leads where another exit of the place leads, to the safe place, or where the
/// timeouts of other places lead.
const AS_OTHER_EXIT: i32 = 4;
const TO_SAFE: i32 = 2;
const AS_OTHER_TIMEOUT: i32 = 1;
/// The text of a fault about a mission without a longest time.
const WITHOUT_END: &str = "may be waited for without end";
/// The name of an added transition, which no other one may have.
const NAME: &str = "added";

impl MissionElements<'_> {
    /// Transitions from one place to another that the mission lacks.
    pub(super) fn missing_transitions(&self, edits: &mut Vec<FileEdit>) {
        self.missing_timeouts(edits);
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
            // A fork to places to one of which others lead back. The file begins where it does.
            let lost = loose("to").collect::<Vec<_>>().join(" ");
            let begins = self.transitions.first().and_then(|it| value(it, "from"));
            for also in self.place_names().filter(|it| !lost.is_empty() && !from.contains(it)) {
                if lost.split(' ').any(|it| it == also) || self.is_loose("from", also) {
                    continue;
                }
                let rank = FORK - i32::from(begins == Some(also));
                let to = format!("{also} {lost}");
                edits.push(self.with_transition(first, &from.join(" "), &to, "").ranked(rank));
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
        let edit = FileEdit::new(
            vec![(Span::new(end, end), format!("<transition name=\"{NAME}\" {attributes}"))],
            self.at(place.attribute("name").map_or(place.name_span, |it| it.value_span)),
            format!("<transition name=\"…\" {attributes}"),
            None,
        );
        FileEdit { is_missing: true, ..edit.ranked(MISSING) }
    }

    /// A timeout of each place that is waited in without end, as other places have one.
    fn missing_timeouts(&self, edits: &mut Vec<FileEdit>) {
        let timeouts = self.transitions.iter().filter_map(|transition| {
            Some((value(transition, "timeout")?, value(transition, "to")?))
        });
        let timeouts: Vec<_> = timeouts.collect();
        let Some((last, _)) = timeouts.last() else { return };
        for place in &self.places {
            let Some(name) = value(place, "name") else { continue };
            let leads_on = |it: &&&Element| value(it, "from") == Some(name);
            let own: Vec<_> = self.transitions.iter().filter(leads_on).collect();
            let has_timeout = own.iter().any(|it| value(it, "timeout").is_some());
            let mut names = own.iter().filter_map(|it| value(it, "name"));
            if has_timeout || !names.any(|it| self.is_waited_for(it)) {
                continue;
            }
            let is_other = |it: &&Element| !value(it, "on").is_some_and(|on| on.ends_with(".done"));
            let exits = own.iter().map(|it| **it).filter(is_other).filter_map(|it| value(it, "to"));
            let mut to: BTreeMap<&str, i32> = BTreeMap::new();
            let mut count = |place, likelier| *to.entry(place).or_default() += likelier;
            exits.collect::<BTreeSet<_>>().into_iter().for_each(|it| count(it, AS_OTHER_EXIT));
            value(self.element, "safe").into_iter().for_each(|it| count(it, TO_SAFE));
            let others: BTreeSet<_> = timeouts.iter().map(|it| it.1).collect();
            others.into_iter().for_each(|it| count(it, AS_OTHER_TIMEOUT));
            for (to, likelier) in to.into_iter().filter(|(to, _)| *to != name) {
                let same = timeouts.iter().find(|it| it.1 == to).map_or(last, |it| &it.0);
                let waits = format!(" timeout=\"{same}\"");
                edits
                    .push(self.with_transition(place, name, to, &waits).ranked(TIMEOUT - likelier));
            }
        }
    }

    /// Whether a fault is that the transition may be waited for without end.
    fn is_waited_for(&self, name: &str) -> bool {
        let listed = [format!(" {name} or "), format!(" or {name} "), format!(" {name} may be")];
        self.faults.iter().any(|fault| {
            fault.message.contains(WITHOUT_END)
                && listed.iter().any(|it| fault.message.contains(it))
        })
    }
}
