//! Several changes as one edit: computed on one tree, applied together and read again once.

use std::collections::{BTreeMap, BTreeSet};

use crate::edit::adding::{number_for, rank};
use crate::edit::attribute;
use crate::edit::document::Document;
use crate::edit::error::EditError;
use crate::edit::item::Item;
use crate::edit::new_element::NewElement;
use crate::edit::patch::Patches;
use crate::edit::removing::RemovedElements;

/// One of several changes that are made together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ElementEdit {
    /// An attribute gets a value, or is removed.
    Attribute {
        /// The element.
        path: Vec<usize>,
        /// The attribute.
        name: &'static str,
        /// Its value; none removes it.
        value: Option<String>,
    },
    /// An element is removed, as by [`Document::remove_element`].
    Removal(Vec<usize>),
}

impl ElementEdit {
    fn path(&self) -> &[usize] {
        match self {
            Self::Attribute { path, .. } | Self::Removal(path) => path,
        }
    }
}

impl Document {
    /// Changes elements, as one edit. All paths refer to the document before the edit; a change in
    /// an element that is removed has no effect.
    ///
    /// # Errors
    /// As [`Document::set_attribute_at`] and [`Document::remove_element`], of any of them.
    pub fn edit_elements(&mut self, edits: &[ElementEdit]) -> Result<(), EditError> {
        let removed = edits.iter().filter_map(|edit| match edit {
            ElementEdit::Removal(path) => Some(path.as_slice()),
            ElementEdit::Attribute { .. } => None,
        });
        let removed: BTreeSet<&[usize]> = removed.collect();
        let (mut gone, mut patches) = (RemovedElements::default(), Patches::default());
        for edit in edits {
            let path = edit.path();
            if (1..path.len()).any(|depth| removed.contains(&path[..depth])) {
                continue;
            }
            match edit {
                ElementEdit::Removal(path) => {
                    let (parent, index) = self.parent(path)?;
                    gone.add(parent, index);
                }
                ElementEdit::Attribute { .. } if removed.contains(path) => {}
                ElementEdit::Attribute { name, value, .. } => {
                    let (element, value) = (self.element(path)?, value.as_deref());
                    attribute::set(self.source(), element, name, value, &mut patches)?;
                }
            }
        }
        gone.remove(self.source(), &mut patches);
        self.apply(patches)
    }

    /// Adds elements to the system or the mission, as one edit: each after the last of its kind, in
    /// the order given. It does not check that their names are free and that the ends of links
    /// exist: [`crate::check`] does.
    ///
    /// # Errors
    /// If `owner` is missing, a name is none of XML, or the result breaks a limit.
    pub fn add_elements(&mut self, owner: Item<'_>, new: &[NewElement]) -> Result<(), EditError> {
        let path = self.path_of(owner)?;
        let parent = self.element(&path)?;
        let mut sorted: Vec<_> = new.iter().collect();
        sorted.sort_by_key(|element| rank(element.name()));
        // Elements for one position are inserted together.
        let mut places: BTreeMap<usize, Vec<NewElement>> = BTreeMap::new();
        for element in sorted {
            places.entry(number_for(parent, element.name())).or_default().push(element.clone());
        }
        let mut patches = Patches::default();
        for (index, elements) in &places {
            self.insert(&path, *index, elements, &mut patches)?;
        }
        self.apply(patches)
    }

    /// Puts elements into `parent`, as [`Document::insert_element`], as one edit.
    ///
    /// # Errors
    /// As there.
    pub fn insert_elements(
        &mut self,
        parent: &[usize],
        index: usize,
        new: &[NewElement],
    ) -> Result<(), EditError> {
        let mut patches = Patches::default();
        self.insert(parent, index, new, &mut patches)?;
        self.apply(patches)
    }

    /// Returns how many times the document was read again since it was opened: once for each edit
    /// that changed it. Tests use it to measure the cost of an edit.
    pub fn revision(&self) -> u64 {
        self.revision
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document(text: &str) -> Document {
        Document::open("a.xml".as_ref(), text.as_bytes()).unwrap()
    }

    fn element(sort: &str, name: &str) -> NewElement {
        NewElement::new(sort).attribute("name", name)
    }

    #[test]
    fn elements_are_added_behind_the_last_of_their_sort_in_one_edit() {
        let new = [element("link", "l"), element("component", "b"), element("component", "c")];
        for (before, after) in [
            (
                "<armor>\n  <system/>\n</armor>\n",
                "<armor>\n  <system>\n    <component name=\"b\"/>\n    <component name=\"c\"/>\n    \
                 <link name=\"l\"/>\n  </system>\n</armor>\n",
            ),
            (
                "<armor>\n  <system>\n    <component name=\"a\"/> <!-- first -->\n    \
                 <layout/>\n  </system>\n</armor>\n",
                "<armor>\n  <system>\n    <component name=\"a\"/> <!-- first -->\n    \
                 <component name=\"b\"/>\n    <component name=\"c\"/>\n    <link name=\"l\"/>\n    \
                 <layout/>\n  </system>\n</armor>\n",
            ),
            (
                "<armor><system><component name=\"a\"/><link name=\"k\"/></system></armor>",
                "<armor><system><component name=\"a\"/><component name=\"b\"/>\
                 <component name=\"c\"/><link name=\"k\"/><link name=\"l\"/></system></armor>",
            ),
        ] {
            let mut document = document(before);
            document.add_elements(Item::System, &new).unwrap();
            assert_eq!(std::str::from_utf8(document.bytes()).unwrap(), after);
            assert_eq!(document.revision(), 1);
        }
        let mut document = document("<armor/>");
        assert!(document.add_elements(Item::System, &new).is_err());
    }

    #[test]
    fn changes_inside_a_removed_element_have_no_effect() {
        let text = "<armor>\n  <system>\n    <a x=\"1\">\n      <b y=\"2\"/>\n    </a>\n    \
                    <c z=\"3\"/>\n  </system>\n</armor>\n";
        let mut document = document(text);
        let set = |path: &[usize], name, value: Option<&str>| ElementEdit::Attribute {
            path: path.to_vec(),
            name,
            value: value.map(str::to_owned),
        };
        let edits = [
            set(&[0, 0], "x", Some("10")),
            set(&[0, 0, 0], "y", None),
            ElementEdit::Removal(vec![0, 0, 0]),
            ElementEdit::Removal(vec![0, 0]),
            set(&[0, 1], "z", Some("30")),
        ];
        document.edit_elements(&edits).unwrap();
        let after = "<armor>\n  <system>\n    <c z=\"30\"/>\n  </system>\n</armor>\n";
        assert_eq!(std::str::from_utf8(document.bytes()).unwrap(), after);
        assert_eq!(document.revision(), 1);
        assert!(document.edit_elements(&[ElementEdit::Removal(vec![7])]).is_err());
    }
}
