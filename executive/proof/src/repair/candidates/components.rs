//! Other components in a place.

use armor_robotfile::Code;
use armor_robotfile::tree::{Attribute, Element};

use super::places::CLOSE;
use super::words::{add_word, remove_word, replace_word};
use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;
use crate::repair::likeness::MOST_CLOSE;

/// Ranks, next to those of places.
const AWAITED: i32 = 21;
const REPLACED: i32 = 24;
const REMOVED: i32 = 25;
const ADDED: i32 = 25;
/// How much likelier it is that a component is meant that the places before and after activate, or
/// too many if no other place activates it.
const AS_NEIGHBOUR: i32 = 3;
const ODD: i32 = 4;
/// How much less likely it is that the only component of a place, which no other place activates, is
/// wrong.
const LONE: i32 = 6;
/// How much likelier a component is that another place activates together with one of this place.
const PARTNER: i32 = 2;
/// How much likelier a list is that another place has, too.
const KNOWN_LIST: i32 = 1;

impl MissionElements<'_> {
    /// Other components in the places: those whose report is waited for, and those that a link
    /// lacks.
    pub(super) fn components_of_places(&self, edits: &mut Vec<FileEdit>) {
        for transition in &self.transitions {
            let closeness = self.closeness(transition);
            let Some((awaited, _)) = value(transition, "on").and_then(|it| it.split_once('.'))
            else {
                continue;
            };
            if closeness == MOST_CLOSE && self.has_fault(&[Code::ReportNeverSent]) {
                let from = value(transition, "from").unwrap_or("");
                let is_before = |place: &Element| {
                    value(place, "name").is_some_and(|it| from.split_whitespace().any(|f| f == it))
                };
                for place in self.places.iter().filter(|place| is_before(place)) {
                    self.replace_component(place, awaited, AWAITED - CLOSE * closeness, edits);
                    let Some(list) = place.attribute("components") else { continue };
                    let added = add_word(&list.value, awaited);
                    let added = added.map(|new| self.with_components(place, list, &new));
                    edits.extend(added.map(|it| {
                        let rank = it.rank + AWAITED - CLOSE * closeness;
                        it.ranked(rank)
                    }));
                }
            }
        }
        if !self.has_fault(&[Code::LoopInterrupted, Code::FrozenProducer]) {
            return;
        }
        let all = self.activated.iter().flat_map(|it| it.split_whitespace());
        let all: std::collections::BTreeSet<_> = all.collect();
        for place in &self.places {
            let Some(list) = place.attribute("components") else { continue };
            let close = CLOSE * self.closeness(place);
            let has = |list: &str, name: &str| list.split_whitespace().any(|it| it == name);
            // One of the lists is that of this place.
            let count = |name: &str| self.activated.iter().filter(|it| has(it, name)).count();
            let is_usual = |name: &str| count(name) > usize::from(has(&list.value, name));
            let is_partner = |new: &str| {
                self.activated
                    .iter()
                    .any(|it| has(it, new) && list.value.split_whitespace().any(|own| has(it, own)))
            };
            for (at, old) in list.value.split_whitespace().enumerate() {
                let odd = if is_usual(old) { 0 } else { ODD };
                let removed = remove_word(&list.value, at);
                edits.extend(
                    removed.map(|new| {
                        self.with_value(place, list, &new).ranked(REMOVED - odd - close)
                    }),
                );
            }
            for new in all.iter().filter(|it| is_usual(it)) {
                // A component that no other place activates is meant here.
                let is_meant = |old: &str| !is_usual(old);
                let all_meant = list.value.split_whitespace().all(is_meant);
                let rank = REPLACED + if all_meant { LONE } else { -AS_NEIGHBOUR };
                self.replace_component(place, new, rank - close, edits);
                let partner = if is_partner(new) { PARTNER } else { 0 };
                let added = add_word(&list.value, new);
                edits.extend(
                    added.map(|it| {
                        self.with_value(place, list, &it).ranked(ADDED - partner - close)
                    }),
                );
            }
        }
    }

    /// A component in place of each of those that a place activates.
    fn replace_component(&self, place: &Element, new: &str, rank: i32, edits: &mut Vec<FileEdit>) {
        let Some(list) = place.attribute("components") else { return };
        for at in 0..list.value.split_whitespace().count() {
            let replaced = replace_word(&list.value, at, new);
            let replaced = replaced.map(|new| self.with_components(place, list, &new));
            edits.extend(replaced.map(|it| {
                let rank = it.rank + rank;
                it.ranked(rank)
            }));
        }
    }

    /// A place with other components, likelier if another place activates the same.
    fn with_components(&self, place: &Element, list: &Attribute, new: &str) -> FileEdit {
        let sorted = |list: &str| {
            let names: std::collections::BTreeSet<_> =
                list.split_whitespace().map(str::to_owned).collect();
            names
        };
        let is_known = self.activated.iter().any(|it| sorted(it) == sorted(new));
        let edit = self.with_value(place, list, new);
        edit.ranked(if is_known { -KNOWN_LIST } else { 0 })
    }
}
