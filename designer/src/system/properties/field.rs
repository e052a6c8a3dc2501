//! The fields of the panel, and what each changes in the files.

use armor_robotfile::{Document, Item as Named, NewElement};

use crate::item::Item;
use crate::layout;
use crate::project::{Documents, Refused};
use crate::system::edits;
use crate::system::properties::frames;
use crate::view::View;

/// Which field is to get the focus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::system) enum Focus {
    /// None: it stays where it is.
    #[default]
    Nothing,
    /// The first.
    Name,
    /// The first that needs a value, if one does.
    Value,
}

/// What can be changed in the panel.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(in crate::system) enum Field {
    /// The name of a component.
    Name(String),
    /// An attribute of an item; an empty text removes it.
    Attribute(Item, &'static str),
    /// A parameter of a component; an empty text is a value, too.
    Parameter(String, String),
    /// A parameter that goes back to its default, or that the kind does not have.
    NoParameter(String, String),
    /// The title of a group, the text of a note.
    Text(usize),
    /// The data that time follows; an empty text is the host's clock.
    Clock,
    /// An attribute of a frame; an empty text removes it.
    Frame(String, &'static str),
    /// A frame that is added under this name.
    NewFrame,
    /// A frame that is removed.
    NoFrame(String),
}

/// Makes the change of a field in the files.
pub(in crate::system) fn write(
    documents: &mut Documents,
    field: &Field,
    text: &str,
) -> Result<(), Refused> {
    match field {
        Field::Name(name) => edits::rename(documents, name, text),
        Field::Attribute(item, attribute) => {
            let value = Some(text.trim()).filter(|text| !text.is_empty());
            let absent = || Refused::Rule(format!("{item} no longer exists"));
            let named = item.named().ok_or_else(absent)?;
            Ok(documents.system()?.set_attribute(named, attribute, value)?)
        }
        Field::Parameter(component, name) => {
            Ok(documents.system()?.set_parameter(component, name, Some(text))?)
        }
        Field::NoParameter(component, name) => {
            Ok(documents.system()?.set_parameter(component, name, None)?)
        }
        Field::Text(number) => {
            layout::write_decoration(documents.system()?, View::System, *number, text)
        }
        Field::Clock => set_clock(documents.system()?, text),
        Field::Frame(name, attribute) => {
            frames::write_frame(documents.system()?, name, attribute, text)
        }
        Field::NewFrame => frames::add_frame(documents.system()?, text),
        Field::NoFrame(name) => frames::remove_frame(documents.system()?, name),
    }
}

fn set_clock(document: &mut Document, source: &str) -> Result<(), Refused> {
    let missing = || Refused::Absent { what: "<system>" };
    let mut path = document.find(Named::System).ok_or_else(missing)?;
    let system = document.tree().element(&path).ok_or_else(missing)?;
    let found = system.elements().position(|element| element.name == "clock");
    match (found, source.is_empty()) {
        (Some(number), true) => {
            path.push(number);
            document.remove_element(&path)?;
        }
        (Some(number), false) => {
            path.push(number);
            document.set_attribute_at(&path, "source", Some(source))?;
        }
        (None, true) => {}
        (None, false) => {
            let new = NewElement::new("clock").attribute("source", source);
            document.insert_element(&path, 0, &new)?;
        }
    }
    Ok(())
}

/// Whether a text is a name of the format; an empty one is none.
pub(super) fn check_name(text: &str) -> Result<(), String> {
    if text.is_empty() || armor_wire::name::is_name(text) {
        Ok(())
    } else {
        Err("a name starts with a letter and has letters, digits, _ and -".into())
    }
}
