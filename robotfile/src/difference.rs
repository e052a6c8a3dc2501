//! The changes from one configuration to another, in the words of a user: which components,
//! parameters, links, places and transitions came, went, or are others. Comments, order and layout
//! are not in it, except the order of transitions, which decides between equals.

mod drawn;
mod items;

use std::collections::BTreeMap;
use std::fmt;

use crate::model::Configuration;
use items::{Aspect, ComparedItem};

/// The subject of a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Subject {
    /// The system itself: its name, its clock.
    System,
    /// Another host.
    Host,
    /// A frame of the file.
    Frame,
    /// A component; its name is the component's.
    Component,
    /// A parameter; its name is `component.parameter`.
    Parameter,
    /// A link; its name is `component.output -> component.input`.
    Link,
    /// The mission itself: its name, its goal, its checks.
    Mission,
    /// The map of the mission itself: its origin, its symbols.
    Map,
    /// A point, rally point, zone or line on the map.
    Mark,
    /// A route over the map; its legs are places.
    Route,
    /// A variable.
    Variable,
    /// A place.
    Place,
    /// A set of exclusive components; its name is theirs.
    Exclusive,
    /// A transition.
    Transition,
    /// A mission put into this one; its name is its file, with `(2)` if it is included again.
    Submission,
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::System => "system",
            Self::Host => "host",
            Self::Frame => "frame",
            Self::Component => "component",
            Self::Parameter => "parameter",
            Self::Link => "link",
            Self::Mission => "mission",
            Self::Map => "map",
            Self::Mark => "mark",
            Self::Route => "route",
            Self::Variable => "variable",
            Self::Place => "place",
            Self::Exclusive => "exclusive",
            Self::Transition => "transition",
            Self::Submission => "submission",
        })
    }
}

/// The change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// It was added.
    Added {
        /// The new value, in a few words; may be empty.
        what: String,
    },
    /// It is not there any more.
    Removed {
        /// The old value, in a few words; may be empty.
        what: String,
    },
    /// Its value changed.
    Changed {
        /// Which attribute of it; empty for the value of a parameter.
        aspect: String,
        /// The old value; empty if there was none.
        before: String,
        /// The new value; empty if there is none.
        after: String,
    },
}

/// One thing that is not as before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The kind of thing.
    pub subject: Subject,
    /// Which one; empty for the system and the mission.
    pub name: String,
    /// The change.
    pub change: Change,
}

/// `parameter driver.speed: 0.9m/s → 1.2m/s`.
impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.subject)?;
        if !self.name.is_empty() {
            write!(f, " {}", self.name)?;
        }
        match &self.change {
            Change::Added { what } if what.is_empty() => f.write_str(" added"),
            Change::Added { what } => write!(f, " added: {what}"),
            Change::Removed { what } if what.is_empty() => f.write_str(" removed"),
            Change::Removed { what } => write!(f, " removed; it was {what}"),
            Change::Changed { aspect, before, after } => {
                let space = if aspect.is_empty() { "" } else { " " };
                write!(f, ":{space}{aspect} {} → {}", or_empty(before), or_empty(after))
            }
        }
    }
}

fn or_empty(text: &str) -> &str {
    if text.is_empty() { "(none)" } else { text }
}

/// Returns all differences from `before` to `after`: first the system's, then the mission's, each
/// kind in the order of the file, with removals before additions.
pub fn differences(before: &Configuration, after: &Configuration) -> Vec<Difference> {
    let (old, new) = (items::of(before), items::of(after));
    let mut found = Vec::new();
    compare_items(&old, &new, &mut found);
    found.extend(another_order(before, after));
    // A stable sort: within a kind the order stays as found.
    found.sort_by_key(|difference| difference.subject);
    found
}

fn compare_items(old: &[ComparedItem], new: &[ComparedItem], found: &mut Vec<Difference>) {
    let index = |items: &[ComparedItem]| -> BTreeMap<(Subject, String), usize> {
        // Of two with one name the first counts, as everywhere; such a file is refused anyhow.
        let numbered = items.iter().enumerate().rev();
        numbered.map(|(at, item)| ((item.subject, item.name.clone()), at)).collect()
    };
    let (old_at, new_at) = (index(old), index(new));
    let owner_is_in = |item: &ComparedItem, index: &BTreeMap<(Subject, String), usize>| {
        let owner = item.owner.as_ref();
        owner.is_none_or(|owner| index.contains_key(&(Subject::Component, owner.clone())))
    };
    let difference = |item: &ComparedItem, change| Difference {
        subject: item.subject,
        name: item.name.clone(),
        change,
    };
    for item in old {
        match new_at.get(&(item.subject, item.name.clone())) {
            Some(at) => {
                let changes = changed_aspects(&item.aspects, &new[*at].aspects);
                found.extend(changes.map(|change| difference(item, change)));
            }
            // The parts of a removed component are not listed again.
            None if !owner_is_in(item, &new_at) => {}
            None => found.push(difference(item, Change::Removed { what: item.in_words() })),
        }
    }
    for item in new {
        let known = old_at.contains_key(&(item.subject, item.name.clone()));
        if !known && owner_is_in(item, &old_at) {
            found.push(difference(item, Change::Added { what: item.in_words() }));
        }
    }
}

fn changed_aspects<'a>(
    old: &'a [Aspect],
    new: &'a [Aspect],
) -> impl Iterator<Item = Change> + use<'a> {
    let in_new = |name: &str| new.iter().find(|aspect| aspect.name == name);
    let in_old = |name: &str| old.iter().find(|aspect| aspect.name == name);
    let changed = |aspect: &Aspect, before: Option<&Aspect>, after: Option<&Aspect>| {
        let shown =
            |aspect: Option<&Aspect>| aspect.map(|aspect| aspect.shown.clone()).unwrap_or_default();
        let (is, was) = (after.map(|a| &a.value), before.map(|a| &a.value));
        (is != was).then(|| Change::Changed {
            aspect: aspect.name.clone(),
            before: shown(before),
            after: shown(after),
        })
    };
    let kept = old.iter().filter_map(move |aspect| {
        let after = in_new(&aspect.name);
        changed(aspect, Some(aspect), after)
    });
    let added = new.iter().filter(move |aspect| in_old(&aspect.name).is_none());
    kept.chain(added.filter_map(move |aspect| changed(aspect, None, Some(aspect))))
}

/// Returns a difference if the order of the transitions changed that both have.
fn another_order(before: &Configuration, after: &Configuration) -> Option<Difference> {
    let names = |of: &Configuration| -> Vec<String> {
        let transitions = of.mission.iter().flat_map(|mission| &mission.transitions);
        transitions.map(|transition| transition.name.value.clone()).collect()
    };
    let (old, new) = (names(before), names(after));
    let common = |names: &[String], others: &[String]| -> Vec<String> {
        let others: std::collections::BTreeSet<_> = others.iter().collect();
        names.iter().filter(|name| others.contains(name)).cloned().collect()
    };
    let (was, is) = (common(&old, &new), common(&new, &old));
    (was != is).then(|| Difference {
        subject: Subject::Mission,
        name: String::new(),
        change: Change::Changed {
            aspect: "order of transitions".into(),
            before: was.join(" "),
            after: is.join(" "),
        },
    })
}

#[cfg(test)]
mod tests;
