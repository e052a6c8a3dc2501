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
/// The elements that name a place, with the attribute that does so.
const KINDS: [(&str, &str); 3] = [("read", "place"), ("arc", "from"), ("inhibitor", "place")];

impl MissionElements<'_> {
    /// The other kinds of each arc, and each arc with one token.
    pub(super) fn arcs_of_transition(&self, transition: &Element, edits: &mut Vec<FileEdit>) {
        let close = CLOSE * self.closeness(transition);
        for arc in transition.elements() {
            if let Some(weight) = arc.attribute("weight").filter(|it| it.value != "1") {
                let edit = self.without_attribute(transition, weight);
                edits.push(edit.ranked(WEIGHT - close));
            }
            let own = KINDS.iter().find(|(kind, by)| *kind == arc.name && value(arc, by).is_some());
            let Some((own, by)) = own else { continue };
            let Some(place) = arc.attribute(by) else { continue };
            for (kind, by) in KINDS.iter().filter(|(kind, _)| kind != own) {
                let edit = FileEdit::new(
                    vec![(arc.name_span, (*kind).to_owned()), (place.name_span, (*by).to_owned())],
                    self.at(arc.tag_span),
                    format!("<{kind} {by}=\"{}\"/>", place.value),
                    value(transition, "name"),
                );
                // With content, the end tag would have to follow.
                if arc.tag_span == arc.span {
                    let empty = if *kind == "inhibitor" { INHIBITOR } else { 0 };
                    edits.push(edit.ranked(KIND + empty - close));
                }
            }
        }
    }
}
