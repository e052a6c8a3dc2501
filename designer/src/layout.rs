//! Where the file states that things are drawn: the `<layout>` of the system or of the mission,
//! with a `<block>` for each thing and the `<group>`s and `<note>`s of the drawing.

mod folding;

use std::collections::BTreeMap;

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, ElementEdit, Item as Named, NewElement, Position};
use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::Decoration;
use crate::item::Item;
use crate::project::Refused;
use crate::view::View;
pub use folding::{fold, unfold};

/// A group or note that states no size has this one.
const DEFAULT_SIZE: Vec2 = Vec2::new(240.0, 120.0);

/// The contents of a layout.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// Positions by the name of a component or place.
    pub blocks: BTreeMap<String, Pos2>,
    /// Positions by the name of a transition.
    pub transitions: BTreeMap<String, Pos2>,
    /// Groups and notes, in their order, also those in folded groups.
    pub decorations: Vec<Decoration<Item>>,
    /// The groups of the system that are folded, except those inside others.
    pub folded: Vec<FoldedGroup>,
}

/// A group that is drawn as one block. In the file it contains the blocks, groups and notes that it
/// hides.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoldedGroup {
    /// Its number among the groups and notes.
    pub number: usize,
    /// The names of the components in it.
    pub members: Vec<String>,
    /// The numbers of the groups and notes in it.
    pub inner: Vec<usize>,
}

/// The element of the file that a view draws.
pub fn owner(view: View) -> Named<'static> {
    match view {
        View::Mission | View::Map => Named::Mission,
        View::System | View::Live => Named::System,
    }
}

/// Reads the layout of a view.
pub fn read(document: &Document, view: View) -> Layout {
    let mut layout = Layout::default();
    let Some(owner) = document.find(owner(view)).and_then(|path| document.tree().element(&path))
    else {
        return layout;
    };
    for part in owner.elements().filter(|element| element.name == "layout") {
        blocks(part, &mut layout);
    }
    layout.folded = if view == View::Mission { Vec::new() } else { folded_groups(owner) };
    for (number, (_, element)) in decorations(owner).into_iter().enumerate() {
        let at = position(element).unwrap_or(Pos2::ZERO);
        let number_of = |name| number_in(element, name).filter(|size| *size > 0.0);
        let size = Vec2::new(
            number_of("width").unwrap_or(DEFAULT_SIZE.x),
            number_of("height").unwrap_or(DEFAULT_SIZE.y),
        );
        let is_note = element.name == "note";
        let title = || element.attribute("title").map(|title| title.value.clone());
        layout.decorations.push(Decoration {
            item: Item::Decoration { view, number },
            rect: Rect::from_min_size(at, size),
            text: if is_note { element.text().0 } else { title().unwrap_or_default() },
            is_note,
        });
    }
    layout
}

/// Blocks may be anywhere in a layout; the recursion is bounded by the depth of the tree.
fn blocks(parent: &Element, layout: &mut Layout) {
    for element in parent.elements() {
        if element.name != "block" {
            blocks(element, layout);
            continue;
        }
        let Some(at) = position(element) else { continue };
        if let Some(name) = element.attribute("of") {
            layout.blocks.entry(name.value.clone()).or_insert(at);
        } else if let Some(name) = element.attribute("transition") {
            layout.transitions.entry(name.value.clone()).or_insert(at);
        }
    }
}

fn position(element: &Element) -> Option<Pos2> {
    Some(Pos2::new(number_in(element, "x")?, number_in(element, "y")?))
}

fn number_in(element: &Element, name: &str) -> Option<f32> {
    let number: f32 = element.attribute(name)?.value.trim().parse().ok()?;
    // Farther away it could not be found again.
    (number.is_finite() && number.abs() <= 1e6).then_some(number)
}

/// The groups and notes of a system or mission, each with the numbers that lead to it, those in
/// groups after these.
fn decorations(owner: &Element) -> Vec<(Vec<usize>, &Element)> {
    let mut found = Vec::new();
    for (n, layout) in owner.elements().enumerate().filter(|(_, e)| e.name == "layout") {
        collect_decorations(layout, &[n], &mut found);
    }
    found
}

/// The recursion is bounded by the depth of the tree.
fn collect_decorations<'a>(
    parent: &'a Element,
    path: &[usize],
    found: &mut Vec<(Vec<usize>, &'a Element)>,
) {
    for (n, element) in parent.elements().enumerate() {
        if matches!(element.name.as_str(), "group" | "note") {
            let path = [path, &[n]].concat();
            found.push((path.clone(), element));
            if element.name == "group" {
                collect_decorations(element, &path, found);
            }
        }
    }
}

fn is_folded(element: &Element) -> bool {
    element.name == "group"
        && element.attribute("folded").is_some_and(|folded| folded.value.trim() == "true")
}

fn folded_groups(owner: &Element) -> Vec<FoldedGroup> {
    let all = decorations(owner);
    let mut folded: Vec<(Vec<usize>, FoldedGroup)> = Vec::new();
    for (number, (path, element)) in all.iter().enumerate() {
        if let Some((_, outer)) = folded.iter_mut().find(|(outer, _)| path.starts_with(outer)) {
            outer.inner.push(number);
        } else if is_folded(element) {
            let mut members = Vec::new();
            collect_members(element, &mut members);
            folded.push((path.clone(), FoldedGroup { number, members, inner: Vec::new() }));
        }
    }
    folded.into_iter().map(|(_, group)| group).collect()
}

/// The recursion is bounded by the depth of the tree.
fn collect_members(parent: &Element, members: &mut Vec<String>) {
    for element in parent.elements() {
        let of = element.attribute("of").filter(|_| element.name == "block");
        members.extend(of.map(|name| name.value.clone()));
        collect_members(element, members);
    }
}

fn path_of(document: &Document, view: View, number: usize) -> Option<Vec<usize>> {
    let mut path = document.find(owner(view))?;
    let element = document.tree().element(&path)?;
    let (inner, _) = decorations(element).into_iter().nth(number)?;
    path.extend(inner);
    Some(path)
}

fn gone() -> Refused {
    Refused::Rule("that group or note no longer exists".into())
}

/// Puts blocks, groups and notes at these places, with their upper left corners. What a folded
/// group hides moves with it.
///
/// # Errors
/// If one does not exist.
pub fn place(document: &mut Document, view: View, places: &[(Item, Pos2)]) -> Result<(), Refused> {
    let layout = read(document, view);
    let mut places = places.to_vec();
    for group in &layout.folded {
        let item = Item::Decoration { view, number: group.number };
        let Some((_, to)) = places.iter().find(|(moved, _)| *moved == item) else { continue };
        let by = *to - layout.decorations[group.number].rect.min;
        let blocks = group.members.iter().filter_map(|name| {
            Some((Item::component(name), *layout.blocks.get(name.as_str())? + by))
        });
        let inner = group.inner.iter().map(|number| {
            let at = layout.decorations[*number].rect.min + by;
            (Item::Decoration { view, number: *number }, at)
        });
        places.extend(blocks.chain(inner).collect::<Vec<_>>());
    }
    // The block of a folded step of a route is where its first place is.
    let first_places = places.iter().filter_map(|(item, at)| match item {
        Item::Step { route, step } => Some((Item::place(format!("{route}.{step}")), *at)),
        _ => None,
    });
    let first_places: Vec<_> =
        first_places.filter(|(first, _)| places.iter().all(|(item, _)| item != first)).collect();
    places.extend(first_places);
    let rounded = |at: Pos2| Position { x: at.x.round().into(), y: at.y.round().into() };
    let blocks = places.iter().filter_map(|(item, at)| match item {
        Item::Component(_) | Item::Place(_) | Item::Transition(_) => {
            Some((item.named()?, Some(rounded(*at))))
        }
        _ => None,
    });
    document.set_positions(&blocks.collect::<Vec<_>>())?;
    let shown = layout.decorations;
    let rects = places.iter().filter_map(|(item, at)| match item {
        Item::Decoration { number, .. } => {
            Some((*number, Rect::from_min_size(*at, shown.get(*number)?.rect.size())))
        }
        _ => None,
    });
    place_decorations(document, view, &rects.collect::<Vec<_>>())
}

/// Adds a group or note and returns its item.
///
/// # Errors
/// If there is nothing to draw in the file, or the text cannot be written in XML.
pub fn add_decoration(
    document: &mut Document,
    view: View,
    is_note: bool,
    rect: Rect,
    text: &str,
) -> Result<Item, Refused> {
    let number = first_new_number(document, view);
    let item = Item::Decoration { view, number };
    add_decorations(document, view, &[Decoration { item, rect, text: text.to_owned(), is_note }])?;
    Ok(item)
}

/// The number that the next group or note gets: new ones are the last of the first layout.
pub fn first_new_number(document: &Document, view: View) -> usize {
    let element = document.find(owner(view)).and_then(|path| document.tree().element(&path));
    let Some(owner) = element else { return 0 };
    let first = owner.elements().position(|element| element.name == "layout");
    decorations(owner).iter().take_while(|(path, _)| Some(path[0]) == first).count()
}

/// Adds groups and notes, whatever their items are.
///
/// # Errors
/// As for one.
pub fn add_decorations(
    document: &mut Document,
    view: View,
    new: &[Decoration<Item>],
) -> Result<(), Refused> {
    if new.is_empty() {
        return Ok(());
    }
    let new: Vec<_> = new.iter().map(element_of).collect();
    let missing = || Refused::Rule("the file has neither a system nor a mission".into());
    let mut path = document.find(owner(view)).ok_or_else(missing)?;
    let parent = document.tree().element(&path).ok_or_else(missing)?;
    let found = parent.elements().position(|element| element.name == "layout");
    let last = parent.elements().count();
    match found {
        Some(layout) => {
            path.push(layout);
            let count = document.tree().element(&path).map_or(0, |e| e.elements().count());
            document.insert_elements(&path, count, &new)?;
        }
        None => {
            let layout = new.into_iter().fold(NewElement::new("layout"), NewElement::child);
            document.insert_element(&path, last, &layout)?;
        }
    }
    Ok(())
}

fn element_of(decoration: &Decoration<Item>) -> NewElement {
    let Decoration { rect, text, is_note, .. } = decoration;
    let new = if *is_note { NewElement::new("note") } else { NewElement::new("group") };
    let new = if *is_note { new } else { new.attribute("title", text) };
    let new = bounds(*rect).into_iter().fold(new, |new, (name, value)| new.attribute(name, value));
    if *is_note { new.text(text) } else { new }
}

fn bounds(rect: Rect) -> [(&'static str, String); 4] {
    let values =
        [("x", rect.min.x), ("y", rect.min.y), ("width", rect.width()), ("height", rect.height())];
    values.map(|(name, value)| (name, written(value)))
}

/// Gives a group or note another place and size.
///
/// # Errors
/// If it does not exist.
pub fn place_decoration(
    document: &mut Document,
    view: View,
    number: usize,
    rect: Rect,
) -> Result<(), Refused> {
    place_decorations(document, view, &[(number, rect)])
}

fn place_decorations(
    document: &mut Document,
    view: View,
    places: &[(usize, Rect)],
) -> Result<(), Refused> {
    let mut edits = Vec::new();
    for (number, rect) in places {
        let path = path_of(document, view, *number).ok_or_else(gone)?;
        let edit =
            |(name, value)| ElementEdit::Attribute { path: path.clone(), name, value: Some(value) };
        edits.extend(bounds(*rect).map(edit));
    }
    Ok(document.edit_elements(&edits)?)
}

/// Gives a group another title, or a note another text.
///
/// # Errors
/// If it does not exist, or the text cannot be written in XML.
pub fn write_decoration(
    document: &mut Document,
    view: View,
    number: usize,
    text: &str,
) -> Result<(), Refused> {
    let path = path_of(document, view, number).ok_or_else(gone)?;
    let is_note = document.tree().element(&path).is_some_and(|element| element.name == "note");
    if is_note {
        document.set_text_at(&path, text)?;
    } else {
        document.set_attribute_at(&path, "title", Some(text))?;
    }
    Ok(())
}

/// Removes groups and notes.
///
/// # Errors
/// If one does not exist.
pub fn remove_decorations(
    document: &mut Document,
    view: View,
    numbers: impl IntoIterator<Item = usize>,
) -> Result<(), Refused> {
    let numbers = numbers.into_iter();
    let edits = numbers
        .map(|number| path_of(document, view, number).map(ElementEdit::Removal).ok_or_else(gone));
    let edits = edits.collect::<Result<Vec<_>, _>>()?;
    Ok(document.edit_elements(&edits)?)
}

fn written(value: f32) -> String {
    format!("{}", value.round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_and_notes_are_read_as_they_were_written() {
        let file = "<armor version=\"1\">\n  <system>\n  </system>\n</armor>\n";
        let mut document = Document::open("a.xml".as_ref(), file.as_bytes()).unwrap();
        let area = Rect::from_min_size(Pos2::new(-20.0, 40.0), Vec2::new(300.0, 200.0));
        add_decoration(&mut document, View::System, false, area, "Sensors & more").unwrap();
        add_decoration(&mut document, View::System, true, area, "Feed <this>").unwrap();
        let layout = read(&document, View::System);
        assert_eq!(layout.decorations.len(), 2);
        assert_eq!(
            (layout.decorations[0].text.as_str(), layout.decorations[0].rect),
            ("Sensors & more", area)
        );
        assert_eq!(
            (layout.decorations[1].text.as_str(), layout.decorations[1].is_note),
            ("Feed <this>", true)
        );
        let other = area.translate(Vec2::splat(10.0));
        place_decoration(&mut document, View::System, 1, other).unwrap();
        write_decoration(&mut document, View::System, 0, "Eyes").unwrap();
        let layout = read(&document, View::System);
        assert_eq!(
            (layout.decorations[1].rect, layout.decorations[0].text.as_str()),
            (other, "Eyes")
        );
        remove_decorations(&mut document, View::System, [1, 0]).unwrap();
        assert!(read(&document, View::System).decorations.is_empty());
        assert!(write_decoration(&mut document, View::System, 0, "").is_err());
    }
}
