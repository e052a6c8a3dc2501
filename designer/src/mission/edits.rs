//! Edits of a mission as changes of its file, which has a mission. Each is a whole: it happens or
//! changes nothing, if the caller works on a copy, as a project's edit does.

mod arcs;
mod elements;
mod removal;
mod sets;

use armor_robotfile::{Document, EditError, Item, NewElement, Position};

pub use arcs::{add_arc, arc_element, lead_arc, remove_arc, set_arc_kind, set_weight};
pub use elements::{free, free_name, names_of};
pub use removal::remove;
pub use sets::{
    add_check, add_exclusive, add_submission, add_variable, set_check, set_submission,
    toggle_exclusive,
};

/// Adds a place under a name that is free, shown at `at`. The first one is where the mission
/// begins.
pub fn add_place(
    document: &mut Document,
    preferred: &str,
    components: &[&str],
    at: Position,
) -> Result<String, EditError> {
    let name = free_name(document, "place", preferred);
    let is_first = elements::names(document, "place").next().is_none();
    let list = components.join(" ");
    let mut attributes = Vec::new();
    if is_first {
        attributes.push(("initial", "true"));
    }
    if !components.is_empty() {
        attributes.push(("components", list.as_str()));
    }
    document.add(Item::Place(&name), &attributes)?;
    document.set_positions(&[(Item::Place(&name), Some(at))])?;
    Ok(name)
}

/// Adds a transition under a name that is free, from these places to those, shown at `at`.
pub fn add_transition(
    document: &mut Document,
    preferred: &str,
    from: &[&str],
    to: &[&str],
    at: Option<Position>,
) -> Result<String, EditError> {
    let name = free_name(document, "transition", preferred);
    let (from, to) = (from.join(" "), to.join(" "));
    let given = [("from", from.as_str()), ("to", to.as_str())];
    let given: Vec<_> = given.into_iter().filter(|(_, places)| !places.is_empty()).collect();
    document.add(Item::Transition(&name), &given)?;
    if at.is_some() {
        document.set_positions(&[(Item::Transition(&name), at)])?;
    }
    Ok(name)
}

/// Whether a component is active while a place is marked.
pub fn set_component(
    document: &mut Document,
    place: &str,
    component: &str,
    is_active: bool,
) -> Result<(), EditError> {
    let known = elements::list(document, Item::Place(place), "components");
    let others = known.iter().filter(|name| *name != component).map(String::as_str);
    let mut wanted: Vec<_> = others.collect();
    if is_active {
        wanted.push(component);
    }
    if !is_active {
        // A place cannot give values to what it does not activate.
        for parameter in elements::place_parameters(document, place, component) {
            document.set_place_parameter(place, component, &parameter, None)?;
        }
    }
    elements::set_list(document, Item::Place(place), "components", &wanted)
}

/// When a transition may fire, as the three attributes that exclude each other say it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Timing {
    /// As soon as it is enabled.
    Immediate,
    /// `timeout`
    Timeout(String),
    /// `after`
    After(String),
    /// `interval`
    Interval(String, String),
}

/// Sets when a transition may fire.
pub fn set_timing(
    document: &mut Document,
    transition: &str,
    timing: &Timing,
) -> Result<(), EditError> {
    let interval = match timing {
        Timing::Interval(from, to) if is_endless(to) => Some(format!("[{from},inf)")),
        Timing::Interval(from, to) => Some(format!("[{from},{to}]")),
        _ => None,
    };
    let (timeout, after) = match timing {
        Timing::Timeout(time) => (Some(time.as_str()), None),
        Timing::After(time) => (None, Some(time.as_str())),
        _ => (None, None),
    };
    let item = Item::Transition(transition);
    // Removals first, so that there are never two of them.
    for (name, value) in [("timeout", timeout), ("after", after), ("interval", interval.as_deref())]
    {
        if value.is_none() {
            document.set_attribute(item, name, None)?;
        }
    }
    for (name, value) in [("timeout", timeout), ("after", after), ("interval", interval.as_deref())]
    {
        if value.is_some() {
            document.set_attribute(item, name, value)?;
        }
    }
    let has_latest = !matches!(timing, Timing::After(_))
        && !matches!(timing, Timing::Interval(_, to) if is_endless(to));
    if has_latest { Ok(()) } else { document.set_attribute(item, "overrun", None) }
}

fn is_endless(text: &str) -> bool {
    matches!(text.trim(), "" | "inf")
}

/// What a transition sets a variable to when it fires; `None` is nothing.
pub fn set_variable(
    document: &mut Document,
    transition: &str,
    variable: &str,
    value: Option<&str>,
) -> Result<(), EditError> {
    let mut path = document.find(Item::Transition(transition)).ok_or(EditError::NoElement)?;
    let element = document.tree().element(&path).ok_or(EditError::NoElement)?;
    let count = element.elements().count();
    let known = element.elements().position(|set| {
        set.name == "set" && set.attribute("variable").is_some_and(|named| named.value == variable)
    });
    match (known, value) {
        (Some(number), value) => {
            path.push(number);
            match value {
                Some(value) => document.set_attribute_at(&path, "value", Some(value)),
                None => document.remove_element(&path),
            }
        }
        (None, Some(value)) => {
            let new = NewElement::new("set").attribute("variable", variable);
            document.insert_element(&path, count, &new.attribute("value", value))
        }
        (None, None) => Ok(()),
    }
}

/// Who decides that a transition fires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decides {
    /// The executive.
    Auto,
    /// The executive asks.
    Confirm,
    /// The operator.
    Operator,
}

/// Sets who decides, and removes the attributes that belong to the other choices.
pub fn set_decides(
    document: &mut Document,
    transition: &str,
    decides: Decides,
) -> Result<(), EditError> {
    let item = Item::Transition(transition);
    let (gone, operator, autonomy): (&[&str], _, _) = match decides {
        Decides::Auto => {
            (&["autonomy", "operator", "answer-within", "unanswered", "lost-link"], None, None)
        }
        Decides::Confirm => (&["operator"], None, Some("confirm")),
        Decides::Operator => (&["autonomy", "answer-within", "unanswered"], Some("true"), None),
    };
    for name in gone {
        document.set_attribute(item, name, None)?;
    }
    if operator.is_some() {
        document.set_attribute(item, "operator", operator)?;
    }
    if autonomy.is_some() {
        document.set_attribute(item, "autonomy", autonomy)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
