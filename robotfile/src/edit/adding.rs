//! Items added, and their attributes set.

use crate::edit::document::Document;
use crate::edit::error::EditError;
use crate::edit::item::Item;
use crate::edit::item::{check_name, check_port};
use crate::edit::new_element::NewElement;
use crate::edit::patch::Patches;
use crate::source::Location;
use crate::tree::Element;

/// The order in which new elements of a system and of a mission are written.
const ORDER: &[&str] = &[
    "system",
    "clock",
    "host",
    "component",
    "link",
    "mission",
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
    /// If there is one of its name, an input of a link is fed already or a component of it is
    /// missing, the system or mission that it belongs to is missing, or a name is none.
    pub fn add(&mut self, item: Item<'_>, attributes: &[(&str, &str)]) -> Result<(), EditError> {
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
            _ => Vec::new(),
        };
        let index = number_for(self.element(&parent)?, sort);
        self.insert_element(&parent, index, &new)
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
            (Item::System | Item::Mission, _) => {}
            (Item::Link { from, .. }, "to") => {
                let to = value.unwrap_or_default();
                self.check_link(from, to)?;
                self.refuse_fed(Some(item), to)?;
            }
            (Item::Link { to, .. }, "from") => self.check_link(value.unwrap_or_default(), to)?,
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

    /// Refuses an item if there is one that is known by the same name, or feeds the same input.
    pub(super) fn refuse_taken(&self, item: Item<'_>) -> Result<(), EditError> {
        if let Item::Link { to, .. } = item {
            return self.refuse_fed(None, to);
        }
        match self.find(item) {
            Some(path) => Err(self.taken(item.to_string(), self.element(&path)?)),
            None => Ok(()),
        }
    }

    /// Refuses an input that a link feeds, other than the one that is being changed.
    fn refuse_fed(&self, changed: Option<Item<'_>>, to: &str) -> Result<(), EditError> {
        let Some(system) = self.find(Item::System) else { return Ok(()) };
        let own = changed.and_then(|link| self.find(link)).and_then(|path| path.last().copied());
        let mut links = self.element(&system)?.elements().enumerate();
        let feeds = |element: &Element| {
            element.name == "link" && element.attribute("to").is_some_and(|a| a.value == to)
        };
        match links.find(|(n, element)| Some(*n) != own && feeds(element)) {
            Some((_, element)) => Err(self.taken(format!("a link to {to}"), element)),
            None => Ok(()),
        }
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
