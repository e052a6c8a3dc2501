//! Copying and pasting: through the clipboard as a file of its own, so that it works between
//! windows and files, and a person can read it.

use std::collections::{BTreeMap, BTreeSet};

use armor_missions::tree::Element;
use armor_missions::{Document, Item as Named};
use eframe::egui::{Pos2, Rect, Vec2};

use crate::desk::View;
use crate::item::Item;
use crate::layout;
use crate::project::{Documents, Project, Refused};
use crate::system::drawing::Drawing;
use crate::system::edits::{free_name, position, renamed_end, same_element};

/// A file with nothing but a system to copy into.
const EMPTY: &str = "<armor version=\"1\">\n  <system>\n  </system>\n</armor>\n";

/// What is selected as the text of a file: the components, the links between them, the groups and
/// notes, and where they are drawn. None if it has neither component nor note.
pub fn copied(project: &Project, drawing: &Drawing, selection: &BTreeSet<Item>) -> Option<String> {
    let source = project.document_with(Named::System)?;
    let system = source.tree().element(&source.find(Named::System)?)?;
    let names: BTreeMap<String, String> = selection
        .iter()
        .filter_map(|item| match item {
            Item::Component(name) => Some((name.clone(), name.clone())),
            _ => None,
        })
        .collect();
    let mut file = Document::open("clipboard".as_ref(), EMPTY.as_bytes()).ok()?;
    for element in system.elements().filter(|element| is_copied(element, &names)) {
        let count = file.tree().element(&[0])?.elements().count();
        file.insert_element(&[0], count, &same_element(element)).ok()?;
    }
    for item in selection {
        let Some(area) = drawing.diagram.rect(item) else { continue };
        match item {
            Item::Component(name) => {
                let place = (Named::Component(name), Some(position(area.min)));
                file.set_positions(&[place]).ok()?;
            }
            Item::Decoration { .. } => {
                let all = &drawing.diagram.decorations;
                let decoration = all.iter().find(|decoration| decoration.item == *item)?;
                let (is_note, text) = (decoration.is_note, &decoration.text);
                layout::add_decoration(&mut file, View::System, is_note, area, text).ok()?;
            }
            _ => {}
        }
    }
    let text = std::str::from_utf8(file.bytes()).ok()?;
    (text != EMPTY).then(|| text.to_owned())
}

/// Copied are the components, and the links of which both ends are.
fn is_copied(element: &Element, names: &BTreeMap<String, String>) -> bool {
    let value = |name: &str| element.attribute(name).map_or("", |a| a.value.as_str());
    match element.name.as_str() {
        "component" => names.contains_key(value("name")),
        "link" => {
            renamed_end(value("from"), names).is_some() && renamed_end(value("to"), names).is_some()
        }
        _ => false,
    }
}

/// Adds what a text from the clipboard says, its upper left corner at `at`; what is added gets
/// names of its own. Answers what was added.
///
/// # Errors
/// If the text is no system, or there is none to add it to.
pub fn paste(
    documents: &mut Documents,
    text: &str,
    at: impl FnOnce(Rect) -> Pos2,
) -> Result<Vec<Item>, Refused> {
    let nothing = || Refused::Rule("the clipboard holds no part of a system".into());
    let file = Document::open("clipboard".as_ref(), text.as_bytes()).map_err(|_| nothing())?;
    let system = file.find(Named::System).and_then(|path| file.tree().element(&path).cloned());
    let system = system.ok_or_else(nothing)?;
    let shown = layout::read(&file, View::System);
    let document = documents.system()?;
    let names = add_components(document, &system)?;
    add_links(document, &system, &names)?;
    let corners = names.keys().filter_map(|name| shown.blocks.get(name));
    let areas = corners.map(|corner| Rect::from_min_size(*corner, Vec2::splat(1.0)));
    let areas = areas.chain(shown.decorations.iter().map(|decoration| decoration.rect));
    let whole = areas.reduce(Rect::union).unwrap_or(Rect::ZERO);
    let shift = at(whole) - whole.min;
    let mut added: Vec<Item> = Vec::new();
    for (number, (old, new)) in names.iter().enumerate() {
        let beside = whole.min + Vec2::splat(30.0 * number as f32);
        let corner = shown.blocks.get(old).copied().unwrap_or(beside) + shift;
        document.set_positions(&[(Named::Component(new), Some(position(corner)))])?;
        added.push(Item::Component(new.clone()));
    }
    for decoration in &shown.decorations {
        let number = layout::read(document, View::System).decorations.len();
        let (area, text) = (decoration.rect.translate(shift), &decoration.text);
        layout::add_decoration(document, View::System, decoration.is_note, area, text)?;
        added.push(Item::Decoration { view: View::System, number });
    }
    if added.is_empty() { Err(nothing()) } else { Ok(added) }
}

/// Adds the components under names that are free; answers the new name of each.
fn add_components(
    document: &mut Document,
    system: &Element,
) -> Result<BTreeMap<String, String>, Refused> {
    let mut names = BTreeMap::new();
    for element in system.elements().filter(|element| element.name == "component") {
        let Some(old) = element.attribute("name").map(|name| name.value.clone()) else { continue };
        let new = free_name(document, &old);
        let own = |name: &str| name == "name";
        let attributes: Vec<_> = element
            .attributes
            .iter()
            .filter(|attribute| !own(&attribute.name) && !attribute.name.contains(':'))
            .map(|attribute| (attribute.name.as_str(), attribute.value.as_str()))
            .collect();
        document.add(Named::Component(&new), &attributes)?;
        let path = document.find(Named::Component(&new)).unwrap_or_default();
        for (n, child) in element.elements().enumerate() {
            document.insert_element(&path, n, &same_element(child))?;
        }
        names.insert(old, new);
    }
    Ok(names)
}

fn add_links(
    document: &mut Document,
    system: &Element,
    names: &BTreeMap<String, String>,
) -> Result<(), Refused> {
    for element in system.elements().filter(|element| element.name == "link") {
        let end = |name: &str| renamed_end(&element.attribute(name)?.value, names);
        let (Some(from), Some(to)) = (end("from"), end("to")) else { continue };
        let attributes: Vec<_> = element
            .attributes
            .iter()
            .filter(|a| !matches!(a.name.as_str(), "from" | "to") && !a.name.contains(':'))
            .map(|attribute| (attribute.name.as_str(), attribute.value.as_str()))
            .collect();
        document.add(Named::Link { from: &from, to: &to }, &attributes)?;
    }
    Ok(())
}
