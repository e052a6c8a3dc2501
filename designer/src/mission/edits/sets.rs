//! What has no block of its own: exclusive sets, variables, checks, sub-missions. Those without a
//! name are addressed by their number among their sort.

use armor_robotfile::{Document, EditError, Item, NewElement};

use super::elements::{self, free_name};

/// Adds an exclusive set of these components.
pub fn add_exclusive(document: &mut Document, components: &[&str]) -> Result<(), EditError> {
    let new = NewElement::new("exclusive").attribute("components", components.join(" "));
    add(document, &new, "exclusive", &["variable", "place"])
}

/// Whether a component is in an exclusive set; a set of which nothing is left goes.
pub fn toggle_exclusive(
    document: &mut Document,
    number: usize,
    component: &str,
    is_in: bool,
) -> Result<(), EditError> {
    let path = elements::numbered(document, "exclusive", number)?;
    let element = document.tree().element(&path).ok_or(EditError::NoElement)?;
    let value = element.attribute("components").map(|given| given.value.clone());
    let value = value.unwrap_or_default();
    let mut names: Vec<_> =
        value.split_ascii_whitespace().filter(|name| *name != component).collect();
    if is_in {
        names.push(component);
    }
    if names.is_empty() {
        return document.remove_element(&path);
    }
    document.set_attribute_at(&path, "components", Some(&names.join(" ")))
}

/// Adds a variable that follows a field of data; or, without one, a counter that transitions set.
pub fn add_variable(
    document: &mut Document,
    preferred: &str,
    source: Option<&str>,
) -> Result<String, EditError> {
    let name = free_name(document, "variable", preferred);
    let counter = [("min", "0"), ("max", "3"), ("initial", "0")];
    match source {
        Some(source) => document.add(Item::Variable(&name), &[("source", source)])?,
        None => document.add(Item::Variable(&name), &counter)?,
    }
    Ok(name)
}

/// Adds a check.
pub fn add_check(document: &mut Document, text: &str) -> Result<(), EditError> {
    let before = ["variable", "place", "exclusive", "transition", "submission"];
    add(document, &NewElement::new("check").text(text), "check", &before)
}

/// Changes the text of a check.
pub fn set_check(document: &mut Document, number: usize, text: &str) -> Result<(), EditError> {
    let path = elements::numbered(document, "check", number)?;
    document.set_text_at(&path, text)
}

/// Puts another mission's file into this one.
pub fn add_submission(document: &mut Document, file: &str) -> Result<(), EditError> {
    let new = NewElement::new("submission").attribute("ref", file);
    add(document, &new, "submission", &["variable", "place", "exclusive", "transition"])
}

/// Sets `ref`, `in` or `out` of a sub-mission.
pub fn set_submission(
    document: &mut Document,
    number: usize,
    attribute: &str,
    value: Option<&str>,
) -> Result<(), EditError> {
    let path = elements::numbered(document, "submission", number)?;
    document.set_attribute_at(&path, attribute, value)
}

/// Adds an element behind the last of its sort, or else behind the last of those before it.
fn add(
    document: &mut Document,
    new: &NewElement,
    sort: &str,
    before: &[&str],
) -> Result<(), EditError> {
    let mission = document.find(Item::Mission).ok_or(EditError::NoElement)?;
    let names: Vec<_> =
        elements::elements(document).map(|(_, element)| element.name.clone()).collect();
    let last = |sorts: &[&str]| names.iter().rposition(|name| sorts.contains(&name.as_str()));
    let index = last(&[sort]).or_else(|| last(before)).map_or(0, |last| last + 1);
    document.insert_element(&mission, index, new)
}
