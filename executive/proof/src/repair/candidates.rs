//! The edits that are tried: one attribute of a mission with another value of its kind.

mod arcs;
mod attributes;
mod checks;
mod components;
mod counting;
mod missing;
mod places;
mod times;
mod variables;
mod words;

use std::sync::Arc;

use armor_robotfile::tree::{Attribute, Element, Tree};
use armor_robotfile::{Code, Configuration, Finding, Location, Source, Span, parse_tree};

use super::file_edit::FileEdit;
use super::likeness::{MOST_CLOSE, closeness};

/// Most places and transitions of a mission whose edits are listed: their number grows with the
/// product.
const MAX_ELEMENTS: usize = 60;

/// Lists the edits of the mission and of its sub-missions.
pub(super) fn list_edits(configuration: &Configuration, faults: &[Finding]) -> Vec<FileEdit> {
    let mut edits = Vec::new();
    let read = |source: &'_ Arc<Source>| {
        Some((source.clone(), parse_tree(source.path(), source.text().as_bytes()).ok()?))
    };
    let trees: Vec<_> = configuration.sources.iter().filter_map(read).collect();
    let missions_of = |tree: &'_ Tree| -> Vec<_> {
        tree.root().elements().filter(|it| it.name == "mission").cloned().collect()
    };
    let missions: Vec<_> = trees.iter().map(|(source, tree)| (source, missions_of(tree))).collect();
    let places = missions.iter().flat_map(|it| &it.1).flat_map(Element::elements);
    let activated: Vec<_> = places
        .filter(|it| it.name == "place")
        .filter_map(|place| value(place, "components"))
        .collect();
    for (source, missions) in &missions {
        for mission in missions {
            let mission = MissionElements::of(source, mission, faults, &activated);
            if mission.places.len().max(mission.transitions.len()) <= MAX_ELEMENTS {
                mission.list_edits(&mut edits);
            }
        }
    }
    edits
}

/// A mission as it is written.
#[derive(Clone)]
struct MissionElements<'a> {
    source: &'a Arc<Source>,
    element: &'a Element,
    places: Vec<&'a Element>,
    transitions: Vec<&'a Element>,
    /// Whether its sub-missions are left out.
    no_submissions: bool,
    faults: &'a [Finding],
    /// The components of each place of all missions.
    activated: &'a [&'a str],
}

impl<'a> MissionElements<'a> {
    fn of(
        source: &'a Arc<Source>,
        element: &'a Element,
        faults: &'a [Finding],
        activated: &'a [&'a str],
    ) -> Self {
        let called = |name: &'static str| element.elements().filter(move |it| it.name == name);
        Self {
            source,
            element,
            places: called("place").collect(),
            transitions: called("transition").collect(),
            no_submissions: false,
            faults,
            activated,
        }
    }

    fn list_edits(&self, edits: &mut Vec<FileEdit>) {
        for number in 0..self.transitions.len() {
            self.places_of_transition(number, edits);
            self.values_of_transition(self.transitions[number], edits);
            self.times_of_transition(self.transitions[number], edits);
            self.counts_of_transition(self.transitions[number], edits);
            self.conditions_of_transition(self.transitions[number], edits);
        }
        self.marks(edits);
        self.components_of_places(edits);
        self.variables(edits);
        self.missing_transitions(edits);
        for submission in self.submissions() {
            self.places_of_submission(submission, edits);
        }
        self.checks(edits);
    }

    fn place_names(&self) -> impl Iterator<Item = &'a str> {
        self.places.iter().filter_map(|place| value(place, "name"))
    }

    fn submissions(&self) -> impl Iterator<Item = &'a Element> {
        let is_included = !self.no_submissions;
        self.element.elements().filter(move |it| is_included && it.name == "submission")
    }

    fn at(&self, span: Span) -> Location {
        Location::new(self.source, span)
    }

    /// How close the faults are to an element.
    fn closeness(&self, element: &Element) -> i32 {
        // A value that is set may lie outside of its domain.
        let is_inside = |at: &Location| {
            at.source.path() == self.source.path()
                && element.span.start() <= at.span.start()
                && at.span.end() <= element.span.end()
        };
        let sets_outside = |fault: &Finding| {
            fault.code == Code::ValueOutside && fault.at.as_ref().is_some_and(is_inside)
        };
        if self.faults.iter().any(sets_outside) {
            return MOST_CLOSE;
        }
        // The values of a variable come from the transitions that set it.
        let mut sets = element.elements().filter(|it| it.name == "set");
        let sets_compared = sets.any(|set| {
            let shown = value(set, "variable").map(|name| format!("because {name} is "));
            shown.is_some_and(|shown| self.faults.iter().any(|it| it.message.contains(&shown)))
        });
        if sets_compared {
            return MOST_CLOSE;
        }
        self.closeness_of_guard(element)
    }

    /// How close the faults are to an element, whatever it sets.
    fn closeness_of_guard(&self, element: &Element) -> i32 {
        closeness(self.faults, &self.at(element.tag_span), value(element, "name").unwrap_or(""))
    }

    fn has_fault(&self, codes: &[Code]) -> bool {
        self.faults.iter().any(|fault| codes.contains(&fault.code))
    }

    /// An attribute with another value.
    fn with_value(&self, element: &Element, attribute: &Attribute, new: &str) -> FileEdit {
        FileEdit::new(
            vec![(attribute.value_span, escape(new))],
            self.at(attribute.value_span),
            format!("{}=\"{new}\"", attribute.name),
            value(element, "name"),
        )
    }

    /// A further attribute, behind the last one.
    fn with_attribute(&self, element: &Element, name: &str, new: &str) -> Option<FileEdit> {
        let last = element.attributes.last()?.value_span.end() + 1;
        let of_name = element.attribute("name").map_or(element.name_span, |it| it.value_span);
        Some(FileEdit::new(
            vec![(Span::new(last, last), format!(" {name}=\"{}\"", escape(new)))],
            self.at(of_name),
            format!("{name}=\"{new}\""),
            value(element, "name"),
        ))
    }

    /// An element without one of its attributes.
    fn without_attribute(&self, element: &Element, attribute: &Attribute) -> FileEdit {
        let span = Span::new(attribute.name_span.start(), attribute.value_span.end() + 1);
        FileEdit::new(
            vec![(span, String::new())],
            self.at(span),
            format!("no {}=\"{}\"", attribute.name, attribute.value),
            value(element, "name"),
        )
    }

    /// An element inside of another one removed.
    fn without_inner(&self, element: &Element, inner: &Element) -> FileEdit {
        let place = value(inner, "place").unwrap_or("");
        FileEdit::new(
            vec![(inner.span, String::new())],
            self.at(inner.tag_span),
            format!("no <{} place=\"{place}\"/>", inner.name),
            value(element, "name"),
        )
    }

    /// The values of two attributes exchanged.
    fn exchanged(&self, element: &Element, first: &str, second: &str) -> Option<FileEdit> {
        let (one, other) = (element.attribute(first)?, element.attribute(second)?);
        if one.value == other.value {
            return None;
        }
        let span = Span::new(
            one.name_span.start().min(other.name_span.start()),
            one.span().end().max(other.span().end()),
        );
        Some(FileEdit::new(
            vec![(one.value_span, escape(&other.value)), (other.value_span, escape(&one.value))],
            self.at(span),
            format!("{first}=\"{}\" {second}=\"{}\"", other.value, one.value),
            value(element, "name"),
        ))
    }
}

fn value<'a>(element: &'a Element, attribute: &str) -> Option<&'a str> {
    element.attribute(attribute).map(|it| it.value.as_str())
}

/// The text of an attribute's value.
fn escape(value: &str) -> String {
    value.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
