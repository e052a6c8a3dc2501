//! Other arcs inside of a transition: a place that is read in place of taken, or kept empty in place of
//! read, or one token in place of several.

use armor_robotfile::tree::Element;

use super::places::CLOSE;
use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;

/// Ranks, before those of places: only the arcs of transitions near the faults are changed.
const WEIGHT: i32 = 12;
const KIND: i32 = 14;
/// How much less likely it is that a place is to be empty.
const INHIBITOR: i32 = 10;
/// The same of a place that was read with a weight: fewer tokens than that is a condition, too.
const INHIBITOR_FOR_COUNT: i32 = 2;
/// The same of tokens that were taken with a weight.
const INHIBITOR_FOR_TAKEN: i32 = 16;
/// The same of tokens that are put where they were a condition, or the other way round.
const TO_CONDITION: i32 = 8;
/// How much less likely it is that a weight is wrong which the mission gives twice.
const SAME_WEIGHT: i32 = 18;
/// The elements that name a place, with the attribute that does so.
const KINDS: [(&str, &str); 4] =
    [("read", "place"), ("arc", "from"), ("arc", "to"), ("inhibitor", "place")];

impl MissionElements<'_> {
    /// The other kinds of each arc, and each arc with one token.
    pub(super) fn arcs_of_transition(&self, transition: &Element, edits: &mut Vec<FileEdit>) {
        let close = CLOSE * self.closeness(transition);
        for arc in transition.elements() {
            if let Some(weight) = arc.attribute("weight").filter(|it| it.value != "1") {
                let edit = self.without_attribute(transition, weight);
                let same = if self.has_same_count(arc, &weight.value) { SAME_WEIGHT } else { 0 };
                edits.push(edit.ranked(WEIGHT + same - close));
            }
            let own = KINDS.iter().find(|(kind, by)| *kind == arc.name && value(arc, by).is_some());
            let Some(own) = own else { continue };
            let Some(place) = arc.attribute(own.1) else { continue };
            let count = arc.attribute("weight").filter(|it| it.value != "1");
            for (kind, by) in KINDS.iter().filter(|kind| *kind != own) {
                let weight = count.map(|it| format!(" weight=\"{}\"", it.value));
                let edit = FileEdit::new(
                    vec![(arc.name_span, (*kind).to_owned()), (place.name_span, (*by).to_owned())],
                    self.at(arc.tag_span),
                    format!("<{kind} {by}=\"{}\"{}/>", place.value, weight.unwrap_or_default()),
                    value(transition, "name"),
                );
                // With content, the end tag would have to follow.
                if arc.tag_span == arc.span {
                    let less = match (*kind, own.0, count) {
                        ("inhibitor", "arc", Some(_)) => INHIBITOR_FOR_TAKEN,
                        ("inhibitor", _, Some(_)) => INHIBITOR_FOR_COUNT,
                        ("inhibitor", _, None) => INHIBITOR,
                        // Only an arc that takes tokens is easily written as one that puts them.
                        ("arc", "arc", _) => 0,
                        _ if own.1 == "to" || *by == "to" => TO_CONDITION,
                        _ => 0,
                    };
                    edits.push(edit.ranked(KIND + less - close));
                }
            }
        }
    }
}

impl MissionElements<'_> {
    /// Whether another arc or a check of the mission has the same count of tokens of this place.
    fn has_same_count(&self, arc: &Element, count: &str) -> bool {
        let place_of = |it: &'_ Element| {
            let names = KINDS.iter().filter_map(|(_, by)| value(it, by));
            names.map(ToOwned::to_owned).next()
        };
        let place = place_of(arc);
        let all = self.transitions.iter().flat_map(|it| it.elements());
        let in_arc = all
            .filter(|it| it.span != arc.span && value(it, "weight") == Some(count))
            .any(|it| place_of(it) == place);
        let in_check = self.element.elements().filter(|it| it.name == "check").any(|check| {
            let (text, _) = check.text();
            let bound = text.trim().strip_prefix("bounded(").and_then(|it| it.split_once(')'));
            bound.is_some_and(|(name, most)| {
                Some(name.trim()) == place.as_deref() && most.trim().ends_with(count)
            })
        });
        in_arc || in_check
    }
}
