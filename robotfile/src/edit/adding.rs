//! Items added, and their attributes set.

use crate::edit::document::Document;
use crate::edit::error::EditError;
use crate::edit::item::Item;
use crate::edit::item::{STEPS, check_name, check_port};
use crate::edit::new_element::NewElement;
use crate::edit::patch::Patches;
use crate::source::Location;
use crate::tree::Element;

/// The order in which new elements of a system and of a mission are written.
const ORDER: &[&str] = &[
    "system",
    "clock",
    "host",
    "frame",
    "component",
    "link",
    "mission",
    "map",
    "point",
    "zone",
    "line",
    "rally",
    "symbol",
    "route",
    "leg",
    "stay",
    "meet",
    "otherwise",
    "variable",
    "place",
    "exclusive",
    "transition",
    "submission",
    "check",
    "layout",
];

impl Document {
    /// Adds an item with these attributes, after the last of its kind. Its name, or a link's two
    /// ends, are the item's and not among the attributes.
    ///
    /// # Errors
    /// If there is one of its name, or a link between the same ends, a component of a link is missing, the system or mission that it belongs to is missing, or a name is none.
    pub fn add(&mut self, item: Item<'_>, attributes: &[(&str, &str)]) -> Result<(), EditError> {
        if let Item::Step { route, step } = item {
            return self.add_leg(route, step, None, attributes);
        }
        let (owner, sort) = item.names();
        let mut new = NewElement::new(sort);
        if let Some(name) = item.name() {
            check_name(name)?;
            new = new.attribute("name", name);
        }
        if let Item::Link { from, to } = item {
            self.check_link(from, to)?;
            new = new.attribute("from", from).attribute("to", to);
        }
        self.refuse_taken(item)?;
        for (name, value) in attributes {
            new = new.attribute(*name, *value);
        }
        let parent = match owner {
            "system" => self.path_of(Item::System)?,
            "mission" => self.path_of(Item::Mission)?,
            "map" => self.path_of(Item::Map)?,
            _ => Vec::new(),
        };
        let index = number_for(self.element(&parent)?, sort);
        self.insert_element(&parent, index, &new)
    }

    /// Adds a leg to a route, before one of its steps, or after the last.
    ///
    /// # Errors
    /// If there is no such route or step, the route has a step of this name, or it is none.
    pub fn add_leg(
        &mut self,
        route: &str,
        leg: &str,
        before: Option<&str>,
        attributes: &[(&str, &str)],
    ) -> Result<(), EditError> {
        check_name(leg)?;
        let path = self.path_of(Item::Route(route))?;
        self.refuse_taken(Item::Step { route, step: leg })?;
        let index = match before {
            Some(step) => self.path_of(Item::Step { route, step })?.last().copied(),
            None => {
                let steps = self.element(&path)?.elements().map(|step| step.name.as_str());
                let names: Vec<_> = steps.collect();
                names.iter().rposition(|name| STEPS.contains(name)).map(|last| last + 1)
            }
        };
        let mut new = NewElement::new("leg").attribute("name", leg);
        for (name, value) in attributes {
            new = new.attribute(*name, *value);
        }
        // Without a step it is the first element: before what ends steps early.
        self.insert_element(&path, index.unwrap_or(0), &new)
    }

    /// Gives an attribute of an item a value; `None` removes it. Setting the name renames the item,
    /// see [`Document::rename`].
    ///
    /// # Errors
    /// If there is no such item, or the name or the ends that the item is known by would be none or
    /// those of another one.
    pub fn set_attribute(
        &mut self,
        item: Item<'_>,
        name: &str,
        value: Option<&str>,
    ) -> Result<(), EditError> {
        let path = self.path_of(item)?;
        match (item, name) {
            (Item::System | Item::Mission | Item::Map, _) => {}
            (Item::Link { from, .. }, "to") => {
                let to = value.unwrap_or_default();
                self.check_link(from, to)?;
                self.refuse_linked(item, Item::Link { from, to })?;
            }
            (Item::Link { to, .. }, "from") => {
                let from = value.unwrap_or_default();
                self.check_link(from, to)?;
                self.refuse_linked(item, Item::Link { from, to })?;
            }
            (Item::Link { .. }, _) => {}
            (_, "name") => return self.rename(item, value.unwrap_or_default()),
            _ => {}
        }
        self.set_attribute_at(&path, name, value)
    }

    /// Refuses ends that are none, or of components that the system does not have.
    fn check_link(&self, from: &str, to: &str) -> Result<(), EditError> {
        let (provider, _) = check_port(from)?;
        let (consumer, _) = check_port(to)?;
        self.path_of(Item::Component(provider))?;
        self.path_of(Item::Component(consumer))?;
        Ok(())
    }

    /// Refuses an item if there is one that is known by the same name, or links the same ends. Whether
    /// an input takes a second link is in the manifests: the check finds it.
    pub(super) fn refuse_taken(&self, item: Item<'_>) -> Result<(), EditError> {
        match self.find(item) {
            Some(path) => Err(self.taken(item.to_string(), self.element(&path)?)),
            None => Ok(()),
        }
    }

    /// Refuses to change a link to one that exists already, unless it is itself.
    fn refuse_linked(&self, link: Item<'_>, changed: Item<'_>) -> Result<(), EditError> {
        if self.find(link) == self.find(changed) { Ok(()) } else { self.refuse_taken(changed) }
    }

    pub(super) fn taken(&self, what: String, element: &Element) -> EditError {
        EditError::Taken { what, at: Location::new(self.tree().source(), element.name_span) }
    }

    /// Adds elements to `parent`, after the last of their kind.
    pub(super) fn insert_sorted(
        &self,
        parent: &[usize],
        new: &NewElement,
        patches: &mut Patches,
    ) -> Result<(), EditError> {
        let index = number_for(self.element(parent)?, new.name());
        self.insert(parent, index, std::slice::from_ref(new), patches)
    }
}

/// Returns the position of a kind in the order; none if it is unknown.
pub(super) fn rank(sort: &str) -> Option<usize> {
    ORDER.iter().position(|known| *known == sort)
}

/// Returns the index of a new element of this kind in its parent: after the last of its kind, else
/// before the first that comes after it in the order.
pub(super) fn number_for(parent: &Element, sort: &str) -> usize {
    let names: Vec<_> = parent.elements().map(|element| element.name.as_str()).collect();
    match names.iter().rposition(|name| *name == sort) {
        Some(last) => last + 1,
        None => names.iter().position(|name| rank(name) > rank(sort)).unwrap_or(names.len()),
    }
}
