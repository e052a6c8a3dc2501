//! Copying and pasting: through the clipboard as a file of its own, so that it works between
//! windows and files, and a person can read it.

use std::collections::{BTreeMap, BTreeSet};

use armor_missions::tree::Element;
use armor_missions::{Document, Item as Named, NewElement};
use eframe::egui::{Pos2, Rect, Vec2};

use super::gestures::position;
use crate::canvas::Diagram;
use crate::desk::{Desk, View};
use crate::item::Item;
use crate::layout;
use crate::mission::edits::{self, free_name};
use crate::project::{Documents, Refused};

/// A file with nothing but a mission to copy into.
const EMPTY: &str = "<armor version=\"1\">\n  <mission>\n  </mission>\n</armor>\n";

/// What is selected as the text of a file: places, transitions, groups and notes, and where they
/// are drawn. None if it has none of them.
pub(super) fn copied(desk: &Desk, diagram: &Diagram, selection: &BTreeSet<Item>) -> Option<String> {
    let source = desk.project.document_with(Named::Mission)?;
    let mut file = Document::open("clipboard".as_ref(), EMPTY.as_bytes()).ok()?;
    for item in selection {
        if let (Item::Place(_) | Item::Transition(_), Some(named)) = (item, item.named()) {
            let element = source.tree().element(&source.find(named)?)?;
            let count = file.tree().element(&[0])?.elements().count();
            file.insert_element(&[0], count, &edits::same_element(element)).ok()?;
        }
    }
    for item in selection {
        let Some(area) = diagram.rect(item) else { continue };
        match item {
            Item::Place(_) | Item::Transition(_) => {
                file.set_positions(&[(item.named()?, Some(position(area.min)))]).ok()?;
            }
            Item::Decoration { .. } => {
                let decoration = diagram.decorations.iter().find(|d| d.item == *item)?;
                let (is_note, text) = (decoration.is_note, &decoration.text);
                layout::add_decoration(&mut file, View::Mission, is_note, area, text).ok()?;
            }
            _ => {}
        }
    }
    let text = std::str::from_utf8(file.bytes()).ok()?;
    (text != EMPTY).then(|| text.to_owned())
}

/// Adds what a text from the clipboard says, its upper left corner at `at`. Places and transitions
/// get names of their own; arcs lead to what was copied with them, else to places of this mission
/// with the same name, and are left out if there are none. Answers what was added.
///
/// # Errors
/// If the text is no part of a mission.
pub(super) fn paste(
    documents: &mut Documents,
    text: &str,
    at: &dyn Fn(Rect) -> Pos2,
) -> Result<Vec<Item>, Refused> {
    let nothing = || Refused::Rule("the clipboard holds no part of a mission".into());
    let file = Document::open("clipboard".as_ref(), text.as_bytes()).map_err(|_| nothing())?;
    let mission = file.find(Named::Mission).and_then(|path| file.tree().element(&path).cloned());
    let mission = mission.ok_or_else(nothing)?;
    let shown = layout::read(&file, View::Mission);
    let document = documents.mission()?;
    let places = add_places(document, &mission)?;
    let transitions = add_transitions(document, &mission, &places)?;
    let corners = shown.blocks.values().chain(shown.transitions.values());
    let areas = corners.map(|corner| Rect::from_min_size(*corner, Vec2::splat(1.0)));
    let areas = areas.chain(shown.decorations.iter().map(|decoration| decoration.rect));
    let whole = areas.reduce(Rect::union).unwrap_or(Rect::ZERO);
    let shift = at(whole) - whole.min;
    let mut added: Vec<Item> = Vec::new();
    for (old, new) in &places {
        let corner = shown.blocks.get(old).copied().unwrap_or(whole.min) + shift;
        document.set_positions(&[(Named::Place(new), Some(position(corner)))])?;
        added.push(Item::Place(new.clone()));
    }
    for (old, new) in &transitions {
        let corner = shown.transitions.get(old).copied().unwrap_or(whole.min) + shift;
        document.set_positions(&[(Named::Transition(new), Some(position(corner)))])?;
        added.push(Item::Transition(new.clone()));
    }
    for decoration in &shown.decorations {
        let number = layout::read(document, View::Mission).decorations.len();
        let (area, text) = (decoration.rect.translate(shift), &decoration.text);
        layout::add_decoration(document, View::Mission, decoration.is_note, area, text)?;
        added.push(Item::Decoration { view: View::Mission, number });
    }
    if added.is_empty() { Err(nothing()) } else { Ok(added) }
}

fn elements<'a>(
    mission: &'a Element,
    sort: &'a str,
) -> impl Iterator<Item = (&'a Element, &'a str)> {
    let of_sort = mission.elements().filter(move |element| element.name == sort);
    of_sort.filter_map(|element| Some((element, element.attribute("name")?.value.as_str())))
}

/// Adds the places under names that are free; answers the new name of each.
fn add_places(
    document: &mut Document,
    mission: &Element,
) -> Result<BTreeMap<String, String>, Refused> {
    let is_first = document
        .find(Named::Mission)
        .and_then(|path| document.tree().element(&path))
        .is_none_or(|mission| !mission.elements().any(|element| element.name == "place"));
    let mut names = BTreeMap::new();
    for (element, old) in elements(mission, "place") {
        let new = free_name(document, "place", old);
        let attributes: Vec<_> = element
            .attributes
            .iter()
            .filter(|attribute| !attribute.name.contains(':') && attribute.name != "name")
            // Two beginnings are hardly meant.
            .filter(|attribute| is_first || attribute.name != "initial")
            .map(|attribute| (attribute.name.as_str(), attribute.value.as_str()))
            .collect();
        document.add(Named::Place(&new), &attributes)?;
        copy_children(document, Named::Place(&new), element, &|child| {
            Some(edits::same_element(child))
        })?;
        names.insert(old.to_owned(), new);
    }
    Ok(names)
}

fn add_transitions(
    document: &mut Document,
    mission: &Element,
    places: &BTreeMap<String, String>,
) -> Result<BTreeMap<String, String>, Refused> {
    let mut names = BTreeMap::new();
    for (element, old) in elements(mission, "transition") {
        let new = free_name(document, "transition", old);
        let known = |place: &str| -> Option<String> {
            let copied = places.get(place).cloned();
            copied.or_else(|| document.find(Named::Place(place)).map(|_| place.to_owned()))
        };
        let attributes: Vec<(String, String)> = element
            .attributes
            .iter()
            .filter(|attribute| !attribute.name.contains(':') && attribute.name != "name")
            .filter_map(|attribute| {
                let value = &attribute.value;
                let value = match attribute.name.as_str() {
                    "from" | "to" => {
                        let names = value.split_ascii_whitespace().filter_map(known);
                        Some(names.collect::<Vec<_>>().join(" ")).filter(|list| !list.is_empty())?
                    }
                    "on-stop-fail" | "on-start-fail" | "overrun" => known(value)?,
                    _ => value.clone(),
                };
                Some((attribute.name.clone(), value))
            })
            .collect();
        let children = |child: &Element| -> Option<NewElement> {
            let place = ["place", "from", "to"].iter().find_map(|name| child.attribute(name))?;
            Some(edits::renamed_element(child, &place.name, &known(&place.value)?))
        };
        let children: Vec<_> = element.elements().filter_map(children).collect();
        let attributes: Vec<_> =
            attributes.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        document.add(Named::Transition(&new), &attributes)?;
        let path = document.find(Named::Transition(&new)).unwrap_or_default();
        for (number, child) in children.iter().enumerate() {
            document.insert_element(&path, number, child)?;
        }
        names.insert(old.to_owned(), new);
    }
    Ok(names)
}

fn copy_children(
    document: &mut Document,
    item: Named<'_>,
    from: &Element,
    copy: &dyn Fn(&Element) -> Option<NewElement>,
) -> Result<(), Refused> {
    let path = document.find(item).unwrap_or_default();
    for (number, child) in from.elements().filter_map(copy).enumerate() {
        document.insert_element(&path, number, &child)?;
    }
    Ok(())
}
