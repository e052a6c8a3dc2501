//! The edits of a system, each on the files as a whole: pure, so that any sequence of them can be
//! tried without a window.

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, Item as Named};
use armor_wire::name::{MAX_NAME_LEN, is_name};
use eframe::egui::{Pos2, Rect};

use crate::canvas::{Diagram, arrange};
use crate::fragment::Names;
use crate::item::Item;
use crate::layout;
use crate::project::{Documents, Refused};
use crate::view::View;

/// Names that the programs of the system have themselves.
const TAKEN: &[&str] = &["registry", "configd", "configuration", "executive", "launcher", "all"];

/// A name that no component has yet, like the preferred one.
pub fn free_name(document: &Document, preferred: &str) -> String {
    free(&mut names_of(document), preferred)
}

/// The names that no component can be given: those of the others and of the system's programs.
pub(super) fn names_of(document: &Document) -> Names {
    let path = document.find(Named::System);
    let system = path.and_then(|path| document.tree().element(&path));
    let components = system.into_iter().flat_map(Element::elements);
    let components = components.filter(|element| element.name == "component");
    let names = components.filter_map(|component| component.attribute("name"));
    Names::new(names.map(|name| name.value.as_str()).chain(TAKEN.iter().copied()))
}

/// A name like the preferred one, taken from then on.
pub(super) fn free(names: &mut Names, preferred: &str) -> String {
    let preferred: String =
        preferred.chars().filter(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_')).collect();
    let preferred = if is_name(&preferred) { preferred } else { "component".to_owned() };
    // "laser-2" counts on as "laser-3".
    let stem = match preferred.rsplit_once('-') {
        Some((stem, number)) if number.bytes().all(|b| b.is_ascii_digit()) => stem,
        _ => &preferred,
    };
    names.free(&preferred, &stem[..stem.len().min(MAX_NAME_LEN - 5)])
}

/// Adds a component of a kind and returns its name.
///
/// # Errors
/// If there is no system in the files.
pub fn add_component(documents: &mut Documents, kind: &str, at: Pos2) -> Result<String, Refused> {
    let document = documents.system()?;
    let name = free_name(document, kind);
    document.add(Named::Component(&name), &[("kind", kind)])?;
    layout::place(document, View::System, &[(Item::component(&name), at)])?;
    Ok(name)
}

/// Links an output to an input, both as `component.port`.
///
/// # Errors
/// If there is such a link already, or a component is missing.
pub fn join(documents: &mut Documents, from: &str, to: &str) -> Result<(), Refused> {
    documents.system()?.add(Named::Link { from, to }, &[])?;
    Ok(())
}

/// Leads a link elsewhere: to another input, or from another output. Its attributes stay.
///
/// # Errors
/// If there is such a link already, or the link is not there.
pub fn rewire(
    documents: &mut Documents,
    (from, to): (&str, &str),
    (new_from, new_to): (&str, &str),
) -> Result<(), Refused> {
    let document = documents.system()?;
    if new_to != to {
        document.set_attribute(Named::Link { from, to }, "to", Some(new_to))?;
    }
    if new_from != from {
        document.set_attribute(Named::Link { from, to: new_to }, "from", Some(new_from))?;
    }
    Ok(())
}

/// Renames a component in all open files.
///
/// # Errors
/// If the name is none or another's, or one that a program of the system has.
pub fn rename(documents: &mut Documents, old: &str, new: &str) -> Result<(), Refused> {
    if TAKEN.contains(&new) {
        return Err(Refused::Rule(format!("{new} is reserved for a program of the system")));
    }
    if documents.system()?.find(Named::Component(new)).is_some() && old != new {
        return Err(Refused::Rule(format!("a component called {new} already exists")));
    }
    for document in documents.all() {
        let is_here = document.find(Named::Component(old)).is_some();
        if is_here || !document.mentions(Named::Component(old)).is_empty() {
            document.rename(Named::Component(old), new)?;
        }
    }
    Ok(())
}

/// Removes components with their links, links, groups and notes.
///
/// # Errors
/// If the mission cannot do without one of the components.
pub fn remove<'a>(
    documents: &mut Documents,
    items: impl IntoIterator<Item = &'a Item>,
) -> Result<(), Refused> {
    let items: Vec<_> = items.into_iter().collect();
    let components = || {
        items.iter().filter_map(|item| match item {
            Item::Component(name) => Some(Named::Component(name.as_str())),
            _ => None,
        })
    };
    for document in documents.all() {
        let is_known = |item: &Named<'_>| {
            document.find(*item).is_some() || !document.mentions(*item).is_empty()
        };
        let known: Vec<_> = components().filter(is_known).collect();
        document.remove_all(&known)?;
    }
    let document = documents.system()?;
    let links = items.iter().filter_map(|item| match item {
        // It may have been removed with its component.
        Item::Link { from, to } => {
            Some(Named::Link { from, to }).filter(|link| document.find(*link).is_some())
        }
        _ => None,
    });
    let links: Vec<_> = links.collect();
    document.remove_all(&links)?;
    let decorations = items.iter().filter_map(|item| match item {
        Item::Decoration { view: View::System, number } => Some(*number),
        _ => None,
    });
    let decorations: Vec<_> = decorations.collect();
    if !decorations.is_empty() {
        layout::remove_decorations(document, View::System, decorations)?;
    }
    Ok(())
}

/// Puts blocks, groups and notes at these places.
///
/// # Errors
/// If one does not exist.
pub fn place(documents: &mut Documents, places: &[(Item, Pos2)]) -> Result<(), Refused> {
    layout::place(documents.system()?, View::System, places)
}

/// Gives the places of nodes that are arranged again: all, or those given. The middle of what is
/// arranged stays where it is. `shape` is the width of the window to its height.
pub fn arrange_all(diagram: &Diagram<Item>, only: &[usize], shape: f32) -> Vec<(Item, Pos2)> {
    let all: Vec<usize> = (0..diagram.nodes.len()).collect();
    let wanted = if only.len() > 1 { only } else { &all };
    let sizes: Vec<_> = diagram.nodes.iter().map(|node| node.rect.size()).collect();
    let links: Vec<_> = diagram.wires.iter().map(|wire| (wire.from.node, wire.to.node)).collect();
    let positions = arrange::arrange(&sizes, &links, wanted, shape);
    let old = wanted.iter().map(|n| diagram.nodes[*n].rect).reduce(Rect::union);
    let corner = old.map_or(Pos2::new(40.0, 40.0), |old| crate::canvas::snapped(old.min));
    let places = wanted.iter().zip(positions);
    places.map(|(n, at)| (diagram.nodes[*n].item, corner + at)).collect()
}
