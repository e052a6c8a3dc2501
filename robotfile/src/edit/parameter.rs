//! Parameters, of a component and of a place.

use crate::edit::document::Document;
use crate::edit::error::EditError;
use crate::edit::item::Item;
use crate::edit::item::check_name;
use crate::edit::new_element::NewElement;
use crate::edit::patch::Patches;
use crate::edit::{attribute, removal};
use crate::tree::Element;

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
        self.assign(Item::Component(component), &[("name", parameter)], value)
    }

    /// Gives a parameter of a component a value while a place is marked; `None` leaves it as it is
    /// in the system.
    ///
    /// # Errors
    /// If there is no such place, or a name is none.
    pub fn set_place_parameter(
        &mut self,
        place: &str,
        component: &str,
        parameter: &str,
        value: Option<&str>,
    ) -> Result<(), EditError> {
        let keys = [("component", component), ("name", parameter)];
        self.assign(Item::Place(place), &keys, value)
    }

    /// Gives the `<parameter>` of an item that has these attributes a value, adding it if there is
    /// none; without a value, removes all of them.
    fn assign(
        &mut self,
        item: Item<'_>,
        keys: &[(&str, &str)],
        value: Option<&str>,
    ) -> Result<(), EditError> {
        let path = self.path_of(item)?;
        let parent = self.element(&path)?;
        let is_it = |element: &Element| {
            element.name == "parameter"
                && keys.iter().all(|(key, wanted)| {
                    element.attribute(key).is_some_and(|given| given.value == *wanted)
                })
        };
        let found: Vec<_> = parent.elements().enumerate().filter(|(_, e)| is_it(e)).collect();
        let mut patches = Patches::default();
        match (found.first(), value) {
            (Some((_, element)), Some(_)) => {
                attribute::set(self.source(), element, "value", value, &mut patches)?;
            }
            (None, Some(value)) => {
                let mut new = NewElement::new("parameter");
                for (key, name) in keys {
                    check_name(name)?;
                    new = new.attribute(*key, *name);
                }
                let new = new.attribute("value", value);
                self.insert(&path, parent.elements().count(), &[new], &mut patches)?;
            }
            (None, None) => {}
            (Some(_), None) => {
                let numbers: Vec<_> = found.iter().map(|(n, _)| *n).collect();
                removal::remove(self.source(), parent, &numbers, &mut patches);
            }
        }
        self.apply(patches)
    }
}
