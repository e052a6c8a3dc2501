//! Copying and pasting: through the clipboard as a file of its own, so that it works between
//! windows and files, and a person can read it. However much it is, it is a few edits of the file.

use std::collections::{BTreeMap, BTreeSet};

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, Item as Named, NewElement};
use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::{Decoration, Diagram};
use crate::item::Item;
use crate::layout::{self, Layout};
use crate::project::Refused;
use crate::view::View;

/// Distance between pasted elements that the clipboard gives no position.
const SHIFT: f32 = 30.0;

/// Elements of a system or mission as the text of a file, with the groups and notes that are
/// selected, and where it all is drawn. None if there is none of them.
pub fn written(
    view: View,
    elements: &[NewElement],
    diagram: &Diagram<Item>,
    selection: &BTreeSet<Item>,
) -> Option<String> {
    let owner = word(view);
    let empty = format!("<armor version=\"1\">\n  <{owner}>\n  </{owner}>\n</armor>\n");
    let mut file = Document::open("clipboard".as_ref(), empty.as_bytes()).ok()?;
    file.add_elements(layout::owner(view), elements).ok()?;
    let nodes = diagram.nodes.iter().filter(|node| selection.contains(&node.item));
    let places: Vec<_> = nodes.map(|node| (node.item, node.rect.min)).collect();
    layout::place(&mut file, view, &places).ok()?;
    let all = diagram.decorations.iter();
    let decorations: Vec<_> = all.filter(|d| selection.contains(&d.item)).cloned().collect();
    layout::add_decorations(&mut file, view, &decorations).ok()?;
    let text = std::str::from_utf8(file.bytes()).ok()?;
    (text != empty).then(|| text.to_owned())
}

/// A system or mission read from the clipboard.
pub struct Fragment {
    view: View,
    /// Its `<system>` or `<mission>`.
    pub element: Element,
    layout: Layout,
}

impl Fragment {
    /// Reads it.
    ///
    /// # Errors
    /// If it is no part of what the view shows.
    pub fn read(text: &str, view: View) -> Result<Self, Refused> {
        let file = Document::open("clipboard".as_ref(), text.as_bytes()).ok();
        let found = file.and_then(|file| {
            let element = file.tree().element(&file.find(layout::owner(view))?)?.clone();
            Some(Self { view, element, layout: layout::read(&file, view) })
        });
        found.ok_or_else(|| nothing(view))
    }

    /// Its elements of a sort, each with its name.
    pub fn named<'a>(&'a self, sort: &'a str) -> impl Iterator<Item = (&'a Element, &'a str)> {
        let of_sort = self.element.elements().filter(move |element| element.name == sort);
        of_sort.filter_map(|element| Some((element, element.attribute("name")?.value.as_str())))
    }

    /// Places what was added, each given with what it was copied from, and its groups and notes,
    /// all together with the upper left corner at `at`. Returns everything that was added.
    ///
    /// # Errors
    /// If there is nothing in it.
    pub fn place(
        &self,
        document: &mut Document,
        added: &[(Item, Item)],
        at: impl FnOnce(Rect) -> Pos2,
    ) -> Result<Vec<Item>, Refused> {
        let corners = added.iter().filter_map(|(_, old)| self.corner(old));
        let areas = corners.map(|corner| Rect::from_min_size(corner, Vec2::splat(1.0)));
        let areas = areas.chain(self.layout.decorations.iter().map(|decoration| decoration.rect));
        let whole = areas.reduce(Rect::union).unwrap_or(Rect::ZERO);
        let shift = at(whole) - whole.min;
        let places = added.iter().enumerate().map(|(number, (new, old))| {
            let free = whole.min + Vec2::splat(SHIFT * number as f32);
            (*new, self.corner(old).unwrap_or(free) + shift)
        });
        layout::place(document, self.view, &places.collect::<Vec<_>>())?;
        let number = layout::first_new_number(document, self.view);
        let moved = self.layout.decorations.iter().enumerate().map(|(n, decoration)| Decoration {
            item: Item::Decoration { view: self.view, number: number + n },
            rect: decoration.rect.translate(shift),
            ..decoration.clone()
        });
        let moved: Vec<_> = moved.collect();
        layout::add_decorations(document, self.view, &moved)?;
        let items = added.iter().map(|(new, _)| *new);
        let items: Vec<_> = items.chain(moved.into_iter().map(|moved| moved.item)).collect();
        if items.is_empty() { Err(nothing(self.view)) } else { Ok(items) }
    }

    fn corner(&self, item: &Item) -> Option<Pos2> {
        match item {
            Item::Component(name) | Item::Place(name) => {
                self.layout.blocks.get(name.as_str()).copied()
            }
            Item::Transition(name) => self.layout.transitions.get(name.as_str()).copied(),
            _ => None,
        }
    }
}

fn word(view: View) -> &'static str {
    if layout::owner(view) == Named::Mission { "mission" } else { "system" }
}

fn nothing(view: View) -> Refused {
    Refused::Rule(format!("the clipboard holds no part of a {}", word(view)))
}

/// An element of a file as a new one, comments and foreign attributes left out.
pub fn same_element(element: &Element) -> NewElement {
    copied(element, |_, value| Some(value.to_owned()), |child| Some(same_element(child)))
}

/// The same with other values of its attributes and other elements in it; what has none is left
/// out.
pub fn copied(
    element: &Element,
    value: impl Fn(&str, &str) -> Option<String>,
    child: impl Fn(&Element) -> Option<NewElement>,
) -> NewElement {
    let mut new = NewElement::new(element.name.as_str());
    for attribute in element.attributes.iter().filter(|attribute| !attribute.name.contains(':')) {
        if let Some(value) = value(&attribute.name, &attribute.value) {
            new = new.attribute(attribute.name.as_str(), value);
        }
    }
    let new = element.elements().filter_map(child).fold(new, NewElement::child);
    let (text, _) = element.text();
    if text.is_empty() { new } else { new.text(text) }
}

/// Names that are taken, and others made from a preferred name.
pub struct Names {
    taken: BTreeSet<String>,
    /// The number to try next behind a stem.
    next: BTreeMap<String, u64>,
}

impl Names {
    /// All names that are taken.
    pub fn new<'a>(taken: impl IntoIterator<Item = &'a str>) -> Self {
        let taken = taken.into_iter().map(str::to_owned).collect();
        Self { taken, next: BTreeMap::new() }
    }

    /// All of them.
    pub fn all(&self) -> impl Iterator<Item = &str> {
        self.taken.iter().map(String::as_str)
    }

    /// Returns the preferred name if it is free, otherwise its stem with the first free number. The
    /// name is taken from then on.
    pub fn free(&mut self, preferred: &str, stem: &str) -> String {
        if self.taken.insert(preferred.to_owned()) {
            return preferred.to_owned();
        }
        let next = self.next.entry(stem.to_owned()).or_insert(2);
        loop {
            let name = format!("{stem}-{next}");
            *next += 1;
            if self.taken.insert(name.clone()) {
                return name;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_given_once() {
        let mut names = Names::new(["laser", "laser-3"]);
        let mut free = |preferred| names.free(preferred, "laser");
        assert_eq!(free("scanner"), "scanner");
        assert_eq!(
            [free("laser"), free("laser"), free("laser-3")],
            ["laser-2", "laser-4", "laser-5"]
        );
    }
}
