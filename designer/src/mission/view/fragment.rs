//! Copying and pasting places and transitions with the arcs between them.

use std::collections::{BTreeMap, BTreeSet};

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, Item as Named, NewElement};
use eframe::egui::{Pos2, Rect};

use crate::canvas::Diagram;
use crate::fragment::{Fragment, copied as element_with, same_element, written};
use crate::item::Item;
use crate::mission::edits::{free, names_of};
use crate::project::{Documents, Refused};
use crate::view::View;
use crate::workspace::Workspace;

/// What is selected as the text of a file: places, transitions, groups and notes, and where they
/// are drawn. None if it has none of them.
pub(super) fn copied(
    workspace: &Workspace,
    diagram: &Diagram<Item>,
    selection: &BTreeSet<Item>,
) -> Option<String> {
    let source = workspace.project.document_with(Named::Mission)?;
    let mission = source.tree().element(&source.find(Named::Mission)?)?;
    let is_selected = |element: &&Element| {
        let name = element.attribute("name").map_or("", |name| name.value.as_str());
        selection.contains(&match element.name.as_str() {
            "place" => Item::place(name),
            "transition" => Item::transition(name),
            _ => return false,
        })
    };
    let elements: Vec<_> = mission.elements().filter(is_selected).map(same_element).collect();
    written(View::Mission, &elements, diagram, selection)
}

/// Adds a fragment from the clipboard, its upper left corner at `at`. Places and transitions
/// get names of their own; arcs lead to what was copied with them, else to places of this mission
/// with the same name, and are left out if there are none. Returns what was added.
///
/// # Errors
/// If the text is no part of a mission.
pub(super) fn paste(
    documents: &mut Documents,
    text: &str,
    at: &dyn Fn(Rect) -> Pos2,
) -> Result<Vec<Item>, Refused> {
    let fragment = Fragment::read(text, View::Mission)?;
    let document = documents.mission()?;
    let (mut elements, mut added) = (Vec::new(), Vec::new());
    let places = Places::copied(&fragment, document, &mut elements);
    for (old, new) in &places.renamed {
        added.push((Item::place(new), Item::place(old)));
    }
    let mut taken = names_of(document, "transition");
    for (element, old) in fragment.named("transition") {
        let new = free(&mut taken, old);
        elements.push(places.transition(element, &new));
        added.push((Item::transition(new), Item::transition(old)));
    }
    document.add_elements(Named::Mission, &elements)?;
    fragment.place(document, &added, at)
}

/// The places that arcs may lead to.
struct Places {
    /// The new name of each place that is copied.
    renamed: BTreeMap<String, String>,
    /// Those of the mission.
    known: BTreeSet<String>,
}

impl Places {
    /// Makes the elements of the places that are copied, under names that are free.
    fn copied(fragment: &Fragment, document: &Document, elements: &mut Vec<NewElement>) -> Self {
        let mut taken = names_of(document, "place");
        let known: BTreeSet<_> = taken.all().map(str::to_owned).collect();
        let mut renamed = BTreeMap::new();
        for (element, old) in fragment.named("place") {
            let new = free(&mut taken, old);
            let value = |attribute: &str, value: &str| match attribute {
                "name" => Some(new.clone()),
                // Two initial places are probably a mistake.
                "initial" if !known.is_empty() => None,
                _ => Some(value.to_owned()),
            };
            elements.push(element_with(element, value, |child| Some(same_element(child))));
            renamed.insert(old.to_owned(), new);
        }
        Self { renamed, known }
    }

    /// The name of a place here, if it exists.
    fn name<'a>(&'a self, old: &'a str) -> Option<&'a str> {
        let copied = self.renamed.get(old).map(String::as_str);
        copied.or_else(|| self.known.contains(old).then_some(old))
    }

    /// A transition under another name, its arcs led to the places that are there.
    fn transition(&self, element: &Element, new: &str) -> NewElement {
        let value = |attribute: &str, value: &str| match attribute {
            "name" => Some(new.to_owned()),
            "from" | "to" => {
                let names = value.split_ascii_whitespace().filter_map(|old| self.name(old));
                Some(names.collect::<Vec<_>>().join(" ")).filter(|list| !list.is_empty())
            }
            "on-stop-fail" | "on-start-fail" | "overrun" => self.name(value).map(str::to_owned),
            _ => Some(value.to_owned()),
        };
        element_with(element, value, |child| self.arc(child))
    }

    /// An arc; none if it leads to a place that is not there. Whatever else stands in a transition
    /// names no place.
    fn arc(&self, child: &Element) -> Option<NewElement> {
        let is_end = |attribute: &str| matches!(attribute, "place" | "from" | "to");
        let mut ends = child.attributes.iter().filter(|attribute| is_end(&attribute.name));
        if !ends.all(|end| self.name(&end.value).is_some()) {
            return None;
        }
        let value = |attribute: &str, value: &str| match is_end(attribute) {
            true => self.name(value).map(str::to_owned),
            false => Some(value.to_owned()),
        };
        Some(element_with(child, value, |inner| Some(same_element(inner))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Project;

    /// How many edits it is to paste this many places with their transitions.
    fn edits_of_a_paste(count: usize) -> u64 {
        let place = |n: usize| {
            format!(
                "<place name=\"p{n}\"/><transition name=\"t{n}\" from=\"p{n} nowhere\">\
                 <arc to=\"p0\" weight=\"2\"/><read place=\"nowhere\"/>\
                 <set variable=\"round\" value=\"1\"/></transition>"
            )
        };
        let inner: String = (0..count).map(place).collect();
        let text = format!("<armor version=\"1\"><mission>{inner}</mission></armor>");
        let mut project = Project::new(std::sync::Arc::default());
        let mut edits = 0;
        for _ in 0..2 {
            project
                .edit("paste", |documents| {
                    let before = documents.mission()?.revision();
                    paste(documents, &text, &|whole| whole.min)?;
                    edits = documents.mission()?.revision() - before;
                    Ok(())
                })
                .unwrap();
        }
        let text = project.files()[0].text();
        assert!(!text.contains("nowhere"), "arcs to what is not there are left out: {text}");
        assert_eq!(text.matches("<set variable=\"round\" value=\"1\"/>").count(), 2 * count);
        assert!(text.contains("<transition name=\"t-2\" from=\"p-2\">"), "{text}");
        edits
    }

    #[test]
    fn much_is_pasted_in_a_few_edits() {
        assert_eq!((edits_of_a_paste(2), edits_of_a_paste(60)), (2, 2));
    }
}
