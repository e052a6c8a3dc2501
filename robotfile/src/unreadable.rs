//! Parts of the file that are present but unreadable. Each already has a finding; recording them here
//! suppresses follow-on findings.

use std::collections::BTreeSet;

use armor_wire::name::is_name;

use crate::suggestion::suggest_similar;
use crate::tree::Element;

/// Malformed names that a name is compared with: the effort stays bounded whatever a file contains.
const MAX_MALFORMED: usize = 16;

/// The unreadable parts of a system or a mission.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnreadableParts {
    /// Malformed names of components or places, and the words in them that may have been meant.
    names: BTreeSet<String>,
    /// Whether a component or place has no name at all.
    has_nameless: bool,
    /// Components with an unreadable part apart from the name.
    half_read: BTreeSet<String>,
    /// Words of unreadable links: components and ports that may have been meant.
    link_words: BTreeSet<String>,
    /// Whether a link does not specify where it leads.
    has_endless_link: bool,
    /// Whether a part is unreadable that specifies how tokens move.
    pub(crate) in_moves: bool,
    /// Whether a part is unreadable that specifies where tokens are at the start.
    pub(crate) in_start: bool,
    /// Whether a part of the map is unreadable.
    pub(crate) in_map: bool,
}

impl UnreadableParts {
    /// Records a component or place that could not be read completely.
    pub(crate) fn add_element(&mut self, element: &Element) {
        match element.attribute("name") {
            Some(name) => {
                self.names.insert(name.value.clone());
                self.names.extend(words_of(&name.value));
            }
            None => self.has_nameless = true,
        }
    }

    /// Records a component or place that was read, if its name is missing or malformed.
    pub(crate) fn add_if_misnamed(&mut self, element: &Element, name: Option<&str>) {
        if !name.is_some_and(is_name) {
            self.add_element(element);
        }
    }

    /// Records a component of which another part than the name could not be read.
    pub(crate) fn add_half_read(&mut self, name: &str) {
        self.half_read.insert(name.to_owned());
    }

    /// Records a link that could not be read.
    pub(crate) fn add_link(&mut self, element: &Element) {
        let mut words =
            element.attribute("to").into_iter().flat_map(|to| words_of(&to.value)).peekable();
        self.has_endless_link |= words.peek().is_none();
        self.link_words.extend(words);
    }

    /// Returns whether an unreadable part may have this name: exactly, or but for a typing mistake.
    pub(crate) fn may_contain(&self, name: &str) -> bool {
        let malformed = self.names.iter().map(String::as_str).filter(|name| !is_name(name));
        self.has_nameless
            || self.names.contains(name)
            || suggest_similar(name, malformed.take(MAX_MALFORMED)).is_some()
    }

    /// Returns whether the name occurs exactly like this and is malformed.
    pub(crate) fn is_malformed(&self, name: &str) -> bool {
        !is_name(name) && self.names.contains(name)
    }

    /// Returns whether a part of the component may seem missing because it is unreadable.
    pub(crate) fn is_half_read(&self, component: &str) -> bool {
        self.half_read.contains(component)
    }

    /// Returns whether an unreadable link may lead to the input.
    pub(crate) fn may_feed(&self, component: &str, input: &str) -> bool {
        self.has_endless_link
            || self.link_words.contains(component)
            || self.link_words.contains(input)
    }
}

/// Returns the longest sequences of characters that names are made of.
fn words_of(text: &str) -> impl Iterator<Item = String> {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '-' | '_')));
    words.filter(|word| !word.is_empty()).map(str::to_owned)
}
