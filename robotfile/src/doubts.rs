//! What a file says, though not so that it could be read: there is a finding about it, and nothing
//! that may follow from it is another one.

use std::collections::BTreeSet;

use armor_wire::name::is_name;

use crate::suggestion::suggest_similar;
use crate::tree::Element;

/// What is doubtful in a system or a mission.
#[derive(Clone, Debug, Default)]
pub(crate) struct Doubts {
    /// Names, of components or of places, that are there and not well said.
    names: BTreeSet<String>,
    /// Whether there is one whose name is not said at all.
    is_nameless: bool,
    /// Components in whose element something is wrong beside the name.
    half_read: BTreeSet<String>,
    /// Words of links that could not be read: components and ports that they may have meant.
    ends: BTreeSet<String>,
    /// Whether a link does not say at all where it leads.
    is_endless: bool,
    /// Whether something is wrong in what says how tokens move.
    pub(crate) moves: bool,
    /// Whether something is wrong in what says where tokens are at the start.
    pub(crate) start: bool,
}

impl Doubts {
    /// Takes a component or place that could not be read whole.
    pub(crate) fn named(&mut self, element: &Element) {
        match element.attribute("name") {
            Some(name) => {
                self.names.insert(name.value.clone());
                self.names.extend(words(&name.value));
            }
            None => self.is_nameless = true,
        }
    }

    /// Takes a component or place that was read; its name may be none.
    pub(crate) fn read(&mut self, element: &Element, name: Option<&str>) {
        if !name.is_some_and(is_name) {
            self.named(element);
        }
    }

    /// Takes a component with something else that could not be read.
    pub(crate) fn half_read(&mut self, name: &str) {
        self.half_read.insert(name.to_owned());
    }

    /// Takes a link that could not be read.
    pub(crate) fn link(&mut self, element: &Element) {
        let mut ends =
            element.attribute("to").into_iter().flat_map(|to| words(&to.value)).peekable();
        self.is_endless |= ends.peek().is_none();
        self.ends.extend(ends);
    }

    /// Whether an element that is not known was probably meant as a `wanted`.
    pub(crate) fn is_meant(element: &Element, wanted: &str) -> bool {
        let name = element.name.to_ascii_lowercase();
        element.name != wanted && suggest_similar(&name, std::iter::once(wanted)).is_some()
    }

    /// Whether something of that name may be there.
    pub(crate) fn may_hold(&self, name: &str) -> bool {
        self.is_nameless || self.names.contains(name)
    }

    /// Whether the name, as it was written, is there and malformed.
    pub(crate) fn is_malformed(&self, name: &str) -> bool {
        !is_name(name) && self.names.contains(name)
    }

    /// Whether something of the component may be missing only because it could not be read.
    pub(crate) fn is_half_read(&self, component: &str) -> bool {
        self.half_read.contains(component)
    }

    /// Whether a link may lead there.
    pub(crate) fn may_feed(&self, component: &str, input: &str) -> bool {
        self.is_endless || self.ends.contains(component) || self.ends.contains(input)
    }
}

/// What is made of the characters of names.
fn words(text: &str) -> impl Iterator<Item = String> {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '-' | '_')));
    words.filter(|word| !word.is_empty()).map(str::to_owned)
}
