//! Every place of a file that names a thing, and the role of the name there.

use std::sync::Arc;

use crate::claim::Sort;
use crate::edit::item::{Item, find};
use crate::edit::words::{ListForm, occurrences};
use crate::source::{Location, Source};
use crate::tree::{Attribute, Element, Tree};

/// A place that names a thing.
pub(crate) struct Mention<'a> {
    /// The element around [`Self::element`].
    pub(crate) parent: &'a Element,
    /// The element that names it.
    pub(crate) element: &'a Element,
    /// The number of the element in its parent.
    pub(crate) index: usize,
    /// The attribute that names it; none if it is the element's text.
    pub(crate) attribute: Option<&'a Attribute>,
    /// How it is named there.
    pub(crate) form: ListForm,
    /// The role of the name.
    pub(crate) role: MentionRole,
}

/// The role of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MentionRole {
    /// Here it gets its name.
    Definition,
    /// The whole element is about it: a link, a parameter that a place gives, a block of the layout.
    Whole,
    /// It is one of several.
    Listed,
    /// The element would mean something else without it.
    Needed,
}

impl Mention<'_> {
    /// The value, or the text, in which it is named.
    pub(crate) fn value(&self) -> String {
        self.attribute.map_or_else(|| self.element.text().0, |attribute| attribute.value.clone())
    }

    /// Returns whether the element is its block in the layout.
    pub(crate) fn is_layout(&self) -> bool {
        self.element.name == "block"
    }

    /// Returns whether it is not used here: the name is declared, or drawn.
    pub(crate) fn is_definition_or_layout(&self) -> bool {
        self.role == MentionRole::Definition || self.is_layout()
    }

    /// The text that names it.
    pub(crate) fn at(&self, source: &Arc<Source>) -> Location {
        let span = match self.attribute {
            Some(attribute) => attribute.value_span,
            None => self.element.text().1.unwrap_or(self.element.span),
        };
        Location::new(source, span)
    }
}

/// Every place in the tree that names the item, in the order of the file.
pub(crate) fn mentions<'a>(tree: &'a Tree, item: Item<'_>) -> Vec<Mention<'a>> {
    let Some(name) = item.name() else { return Vec::new() };
    let derived = item.derived_name().unwrap_or_default();
    let expressions = Expressions::of(tree, item);
    let mut found = Vec::new();
    visit_elements(
        tree.root(),
        Within::Armor,
        &mut |within, parent, index, element: &'a Element| {
            if within == Within::Route && !is_of_route(item, parent) {
                return;
            }
            for (attribute, form, role) in find_uses(item, within, &element.name, expressions) {
                let given = match attribute {
                    TEXT => None,
                    attribute => match element.attribute(attribute) {
                        Some(given) => Some(given),
                        None => continue,
                    },
                };
                let value = given.map_or_else(|| element.text().0, |given| given.value.clone());
                let name = if form == ListForm::Derived { derived.as_str() } else { name };
                if !occurrences(form, &value, name).is_empty() {
                    found.push(Mention { parent, element, index, attribute: given, form, role });
                }
            }
        },
    );
    found
}

/// Whether what is in a route may name the item: a step is known by its name in its route only.
fn is_of_route(item: Item<'_>, parent: &Element) -> bool {
    match item {
        Item::Step { route, .. } => {
            parent.attribute("name").is_some_and(|name| name.value == route)
        }
        _ => true,
    }
}

/// Represents the text of an element where the name of an attribute is expected.
const TEXT: &str = "";

/// The kind of element that contains an element.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Within {
    Armor,
    System,
    Mission,
    Place,
    Transition,
    Map,
    Route,
    SystemLayout,
    MissionLayout,
    Elsewhere,
}

impl Within {
    /// Returns the same for the children of an element that is here.
    fn inside(self, element: &str) -> Self {
        match (self, element) {
            (Self::Armor, "system") => Self::System,
            (Self::Armor, "mission") => Self::Mission,
            (Self::Mission, "place") => Self::Place,
            (Self::Mission, "transition") => Self::Transition,
            (Self::Mission, "map") => Self::Map,
            (Self::Mission, "route") => Self::Route,
            (Self::System, "layout") | (Self::SystemLayout, _) => Self::SystemLayout,
            (Self::Mission, "layout") | (Self::MissionLayout, _) => Self::MissionLayout,
            _ => Self::Elsewhere,
        }
    }
}

/// Recursion is bounded by the tree's depth.
fn visit_elements<'a>(
    parent: &'a Element,
    within: Within,
    see: &mut impl FnMut(Within, &'a Element, usize, &'a Element),
) {
    for (index, element) in parent.elements().enumerate() {
        see(within, parent, index, element);
        visit_elements(element, within.inside(&element.name), see);
    }
}

/// How an item is named in expressions, if at all.
#[derive(Clone, Copy)]
struct Expressions {
    guard: Option<ListForm>,
    check: Option<ListForm>,
}

impl Expressions {
    /// In a guard, a name without a dot belongs to one kind of thing, a variable first, and a name
    /// before a dot is a component's. In a check the surrounding word decides.
    fn of(tree: &Tree, item: Item<'_>) -> Self {
        let name = item.name().unwrap_or_default();
        let order = [
            Item::Variable(name),
            Item::Place(name),
            Item::Component(name),
            Item::Transition(name),
        ];
        let mut before = order.iter().take_while(|sort| **sort != item);
        let is_bare = before.all(|sort| find(tree, *sort).is_none());
        let guard = match (item, is_bare) {
            (Item::Component(_), true) => Some(ListForm::AllWords),
            (Item::Component(_), false) => Some(ListForm::DottedWords),
            (Item::Variable(_) | Item::Place(_) | Item::Transition(_), true) => {
                Some(ListForm::BareWords)
            }
            _ => None,
        };
        let check = match item {
            Item::Place(_) => Some(ListForm::Claimed(Sort::Place)),
            Item::Transition(_) => Some(ListForm::Claimed(Sort::Transition)),
            Item::Component(_) => Some(ListForm::Claimed(Sort::Component)),
            Item::Route(_) | Item::Step { .. } => Some(ListForm::Derived),
            // A place of that name goes before it.
            Item::Variable(_) if find(tree, Item::Place(name)).is_none() => {
                Some(ListForm::Claimed(Sort::Place))
            }
            _ => None,
        };
        Self { guard, check }
    }
}

/// The attributes of an element that may name an item.
fn find_uses(
    item: Item<'_>,
    within: Within,
    element: &str,
    expressions: Expressions,
) -> Vec<(&'static str, ListForm, MentionRole)> {
    use Within as W;
    let needed = |attributes: &[&'static str], form| {
        attributes.iter().map(|attribute| (*attribute, form, MentionRole::Needed)).collect()
    };
    let definition = ("name", ListForm::Whole, MentionRole::Definition);
    let mut uses: Vec<_> = match (item, within, element) {
        (Item::Frame(_), W::System, "frame") => {
            vec![definition, ("in", ListForm::Whole, MentionRole::Needed)]
        }
        (Item::Component(_), W::System, "component")
        | (Item::Transition(_), W::Mission, "transition")
        | (Item::Variable(_), W::Mission, "variable") => vec![definition],
        (Item::Component(_), W::System, "link") => {
            vec![
                ("from", ListForm::Dotted, MentionRole::Whole),
                ("to", ListForm::Dotted, MentionRole::Whole),
            ]
        }
        (Item::Component(_), W::System, "clock") | (Item::Component(_), W::Mission, "variable") => {
            needed(&["source"], ListForm::Dotted)
        }
        (Item::Component(_), W::Mission, "place" | "exclusive") => {
            vec![("components", ListForm::List, MentionRole::Listed)]
        }
        (Item::Component(_), W::Place, "parameter") => {
            vec![("component", ListForm::Whole, MentionRole::Whole)]
        }
        (Item::Component(_), W::Mission, "transition") => needed(&["on"], ListForm::Dotted),
        (Item::Place(_), W::Armor, "mission") => needed(&["goal", "safe"], ListForm::Whole),
        (Item::Place(_), W::Mission, "place") => {
            vec![definition, ("on-failure", ListForm::Whole, MentionRole::Needed)]
        }
        (Item::Place(_), W::Mission, "transition") => {
            let mut uses: Vec<_> = needed(&["from", "to"], ListForm::List);
            uses.extend::<Vec<_>>(needed(
                &["on-stop-fail", "on-start-fail", "overrun"],
                ListForm::Whole,
            ));
            uses
        }
        (Item::MapPoint(_), W::Map, "point")
        | (Item::Rally(_), W::Map, "rally")
        | (Item::Zone(_), W::Map, "zone")
        | (Item::MapLine(_), W::Map, "line") => vec![definition],
        (Item::Route(_), W::Mission, "route") => vec![definition],
        (Item::Step { .. }, W::Route, "leg" | "stay" | "meet") => vec![definition],
        (Item::Route(_) | Item::Step { .. }, W::MissionLayout, "block") => vec![
            ("of", ListForm::Derived, MentionRole::Whole),
            ("transition", ListForm::Derived, MentionRole::Whole),
        ],
        (Item::Route(_), W::Route, "meet") => needed(&["with"], ListForm::Whole),
        (Item::MapPoint(_) | Item::Rally(_), W::Mission, "route") => {
            needed(&["start"], ListForm::Whole)
        }
        (Item::MapPoint(_) | Item::Rally(_), W::Route, "leg" | "otherwise") => {
            needed(&["to"], ListForm::Whole)
        }
        (Item::Place(_), W::Mission, "route") => needed(&["in", "out", "safe"], ListForm::Whole),
        (Item::Component(_), W::Mission, "route") => {
            let mut uses: Vec<_> = needed(&["mover", "pace", "pose"], ListForm::Dotted);
            uses.extend::<Vec<_>>(needed(&["fence"], ListForm::Whole));
            uses.push(("components", ListForm::List, MentionRole::Listed));
            uses
        }
        (Item::Component(_), W::Route, "leg" | "stay") => {
            let mut uses: Vec<_> = needed(&["on"], ListForm::Dotted);
            uses.push(("components", ListForm::List, MentionRole::Listed));
            uses
        }
        (Item::Variable(_), W::Transition, "set") => needed(&["variable"], ListForm::Whole),
        (Item::Place(_), W::Transition, _) => needed(&["from", "to", "place"], ListForm::Whole),
        (Item::Place(_), W::Mission, "submission") => needed(&["in", "out"], ListForm::Whole),
        (Item::Component(_), W::SystemLayout, "block")
        | (Item::Place(_), W::MissionLayout, "block") => {
            vec![("of", ListForm::Whole, MentionRole::Whole)]
        }
        (Item::Transition(_), W::MissionLayout, "block") => {
            vec![("transition", ListForm::Whole, MentionRole::Whole)]
        }
        _ => Vec::new(),
    };
    let (attribute, form) = match (within, element) {
        (W::Mission, "transition") | (W::Route, "otherwise") => ("when", expressions.guard),
        (W::Transition, "set") => ("value", expressions.guard),
        (W::Mission, "check") => (TEXT, expressions.check),
        _ => return uses,
    };
    uses.extend(form.map(|form| (attribute, form, MentionRole::Needed)));
    uses
}
