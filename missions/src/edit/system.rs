//! Edits in the words of `<system>`: parameters, components, links.

use crate::edit::error::EditError;
use crate::edit::patch::Patches;
use crate::edit::{Document, Item, NewElement, attribute, removal};

impl Document {
    /// Assigns a parameter of a component; `None` leaves it to its default.
    ///
    /// # Errors
    /// If there is no such component, or the parameter's name is none.
    pub fn set_parameter(
        &mut self,
        component: &str,
        parameter: &str,
        value: Option<&str>,
    ) -> Result<(), EditError> {
        let path = self.path_of(Item::Component(component))?;
        let new = NewElement::new("parameter").attribute("name", parameter);
        self.assign(&path, &[("name", parameter)], value, new)
    }

    /// Gives the `value` of the element in `path` that has these attributes, adding `new` if there
    /// is none; without a value, removes all of them.
    pub(super) fn assign(
        &mut self,
        path: &[usize],
        attributes: &[(&str, &str)],
        value: Option<&str>,
        new: NewElement,
    ) -> Result<(), EditError> {
        let parent = self.element(path)?;
        let named = |(name, value): &(&str, &str), element: &crate::tree::Element| {
            element.attribute(name).is_some_and(|a| a.value == *value)
        };
        let found = parent.elements().enumerate().filter(|(_, element)| {
            element.name == "parameter" && attributes.iter().all(|a| named(a, element))
        });
        let found: Vec<_> = found.collect();
        let mut patches = Patches::default();
        match (found.first(), value) {
            (Some((_, element)), Some(_)) => {
                attribute::set(self.source(), element, "value", value, &mut patches)?;
            }
            (None, Some(value)) => {
                for (_, name) in attributes {
                    super::item::check_name(name)?;
                }
                let new = new.attribute("value", value);
                self.insert(path, parent.elements().count(), &[new], &mut patches)?;
            }
            (_, None) => {
                let indices: Vec<_> = found.iter().map(|(n, _)| *n).collect();
                if !indices.is_empty() {
                    removal::remove(self.source(), parent, &indices, &mut patches);
                }
            }
        }
        self.apply(patches)
    }
}
