//! Copying and pasting components with the links between them.

use std::collections::{BTreeMap, BTreeSet};

use armor_robotfile::tree::Element;
use armor_robotfile::{Item as Named, NewElement};
use armor_wire::name::split_data;
use eframe::egui::{Pos2, Rect};

use crate::fragment::{Fragment, copied as element_with, same_element, written};
use crate::item::Item;
use crate::project::{Documents, Project, Refused};
use crate::system::drawing::SystemDrawing;
use crate::system::edits::{free, names_of};
use crate::view::View;

/// The names that components are copied under.
type Renamed = BTreeMap<String, String>;

/// What is selected as the text of a file: the components, the links between them, the groups and
/// notes, and where they are drawn. None if it has neither component nor note.
pub fn copied(
    project: &Project,
    drawing: &SystemDrawing,
    selection: &BTreeSet<Item>,
) -> Option<String> {
    let source = project.document_with(Named::System)?;
    let system = source.tree().element(&source.find(Named::System)?)?;
    let names = selection.iter().filter_map(|item| match item {
        Item::Component(name) => Some((name.to_string(), name.to_string())),
        _ => None,
    });
    let names: Renamed = names.collect();
    let elements = system.elements().filter(|element| is_copied(element, &names));
    let elements: Vec<_> = elements.map(same_element).collect();
    written(View::System, &elements, &drawing.diagram, selection)
}

/// Copied are the components, and the links of which both ends are.
fn is_copied(element: &Element, names: &Renamed) -> bool {
    let value = |name: &str| element.attribute(name).map_or("", |a| a.value.as_str());
    match element.name.as_str() {
        "component" => names.contains_key(value("name")),
        "link" => led(element, names).is_some(),
        _ => false,
    }
}

/// Adds a fragment from the clipboard, its upper left corner at `at`; what is added gets
/// names of its own. Returns what was added.
///
/// # Errors
/// If the text is no system, or there is none to add it to.
pub fn paste(
    documents: &mut Documents,
    text: &str,
    at: impl FnOnce(Rect) -> Pos2,
) -> Result<Vec<Item>, Refused> {
    let fragment = Fragment::read(text, View::System)?;
    let document = documents.system()?;
    let mut taken = names_of(document);
    let mut names = Renamed::new();
    let mut elements = Vec::new();
    let mut added = Vec::new();
    for (element, old) in fragment.named("component") {
        let new = free(&mut taken, old);
        elements.push(renamed(element, &new));
        added.push((Item::component(&new), Item::component(old)));
        names.insert(old.to_owned(), new);
    }
    let links = fragment.element.elements().filter(|element| element.name == "link");
    elements.extend(links.filter_map(|element| led(element, &names)));
    document.add_elements(Named::System, &elements)?;
    fragment.place(document, &added, at)
}

/// The element of a component under another name.
fn renamed(element: &Element, name: &str) -> NewElement {
    let value = |attribute: &str, value: &str| match attribute {
        "name" => Some(name.to_owned()),
        _ => Some(value.to_owned()),
    };
    element_with(element, value, |child| Some(same_element(child)))
}

/// A link between components under other names; none if one of them is not copied.
fn led(element: &Element, names: &Renamed) -> Option<NewElement> {
    let end = |attribute: &str| {
        let (component, port) = split_data(&element.attribute(attribute)?.value)?;
        Some(format!("{}.{port}", names.get(component)?))
    };
    let (from, to) = (end("from")?, end("to")?);
    let value = |attribute: &str, value: &str| {
        Some(match attribute {
            "from" => from.clone(),
            "to" => to.clone(),
            _ => value.to_owned(),
        })
    };
    Some(element_with(element, value, |child| Some(same_element(child))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::{add_component, draw, join};

    /// A chain of this many components, copied as a whole; how many edits its paste is.
    fn edits_of_a_paste(count: usize) -> u64 {
        let mut project = Project::new(std::sync::Arc::default());
        let at = |n: usize| Pos2::new(200.0 * n as f32, 0.0);
        let chain = |documents: &mut Documents| {
            let names = (0..count).map(|n| add_component(documents, "eye", at(n)));
            let names = names.collect::<Result<Vec<_>, _>>()?;
            names.windows(2).try_for_each(|pair| {
                join(documents, &format!("{}.seen", pair[0]), &format!("{}.shown", pair[1]))
            })
        };
        project.edit("a chain", chain).unwrap();
        let drawing = draw(&project);
        let all: BTreeSet<_> = drawing.diagram.nodes.iter().map(|node| node.item).collect();
        let text = copied(&project, &drawing, &all).unwrap();
        let mut edits = 0;
        let beneath = |whole: Rect| whole.min + eframe::egui::vec2(0.0, 100.0);
        project
            .edit("paste", |documents| {
                let before = documents.system()?.revision();
                assert_eq!(paste(documents, &text, beneath)?.len(), count);
                edits = documents.system()?.revision() - before;
                Ok(())
            })
            .unwrap();
        let system = &project.configuration().unwrap().system;
        assert_eq!((system.components.len(), system.links.len()), (2 * count, 2 * (count - 1)));
        let last = &system.components[2 * count - 1].name.value;
        let at_last = project.position(Named::Component(last)).unwrap();
        assert_eq!((at_last.x, at_last.y), (200.0 * (count - 1) as f64, 100.0));
        edits
    }

    #[test]
    fn much_is_pasted_in_a_few_edits() {
        assert_eq!((edits_of_a_paste(2), edits_of_a_paste(60)), (2, 2));
    }
}
