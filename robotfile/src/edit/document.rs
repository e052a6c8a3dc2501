//! A file that is being edited: its tree, and the edits that address elements by their path.

use std::path::Path;

use crate::edit::error::EditError;
use crate::edit::new_element::NewElement;
use crate::edit::patch::Patches;
use crate::edit::{attribute, placement, removal};
use crate::findings::Findings;
use crate::source::Source;
use crate::tree::{Element, Tree};
use crate::xml::{parse, parse_tree};

/// A file being edited. It is always well-formed XML within the limits; whether it means anything
/// is for [`crate::check`].
///
/// The methods that take a path address an element by its number among its parent's elements, level
/// by level, as [`Tree::element`] does; the others take the names of the file. Every edit either
/// happens as a whole or leaves the document as it was.
#[derive(Clone, Debug)]
pub struct Document {
    pub(super) tree: Tree,
    /// Counts the edits.
    pub(super) revision: u64,
}

impl Document {
    /// Opens the bytes of the file called `path`.
    ///
    /// # Errors
    /// The findings, if they are no XML or break a limit.
    pub fn open(path: &Path, bytes: &[u8]) -> Result<Self, Findings> {
        parse_tree(path, bytes).map(|tree| Self { tree, revision: 0 })
    }

    /// Returns the bytes of the file as it is now.
    pub fn bytes(&self) -> &[u8] {
        self.text().as_bytes()
    }

    /// The file as a tree.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Gives an attribute a value; `None` removes it. An unchanged value keeps its bytes.
    ///
    /// # Errors
    /// If there is no such element, the name is malformed, or the value contains a character that
    /// XML does not allow.
    pub fn set_attribute_at(
        &mut self,
        path: &[usize],
        name: &str,
        value: Option<&str>,
    ) -> Result<(), EditError> {
        let mut patches = Patches::default();
        attribute::set(self.source(), self.element(path)?, name, value, &mut patches)?;
        self.apply(patches)
    }

    /// Gives an element another text; its elements and comments stay.
    ///
    /// # Errors
    /// If there is no such element, or the text contains a character that XML does not allow.
    pub fn set_text_at(&mut self, path: &[usize], text: &str) -> Result<(), EditError> {
        let mut patches = Patches::default();
        attribute::set_text(self.source(), self.element(path)?, text, &mut patches);
        self.apply(patches)
    }

    /// Puts a new element into `parent`, before its element number `index` or, if `index` is their
    /// count, after the last. It is indented as its neighbours are.
    ///
    /// # Errors
    /// If there is no such parent or place in it, a name is none, or the result breaks a limit.
    pub fn insert_element(
        &mut self,
        parent: &[usize],
        index: usize,
        new: &NewElement,
    ) -> Result<(), EditError> {
        self.insert_elements(parent, index, std::slice::from_ref(new))
    }

    /// Removes an element, with its lines if nothing else is on them. Comments around it stay. A
    /// parent in which nothing is left becomes an empty element, `<system/>`.
    ///
    /// # Errors
    /// If there is no such element, or it is the outermost one.
    pub fn remove_element(&mut self, path: &[usize]) -> Result<(), EditError> {
        let (parent, index) = self.parent(path)?;
        let mut patches = Patches::default();
        removal::remove(self.source(), parent, &[index], &mut patches);
        self.apply(patches)
    }

    /// Moves an element among its parent's so that its number becomes `index`. Comments directly
    /// above it, and behind it on its last line, go with it.
    ///
    /// # Errors
    /// If there is no such element, it is the outermost one, or `index` is beyond the last.
    pub fn move_element(&mut self, path: &[usize], index: usize) -> Result<(), EditError> {
        let (parent, from) = self.parent(path)?;
        let elements: Vec<_> = parent.elements().collect();
        if index >= elements.len() {
            return Err(EditError::NoElement);
        }
        if index == from {
            return Ok(());
        }
        let mut patches = Patches::default();
        let moved = removal::take(self.source(), parent, elements[from], &mut patches);
        let others: Vec<_> =
            elements.iter().enumerate().filter(|(n, _)| *n != from).map(|(_, e)| *e).collect();
        let chain = self.chain(&path[..path.len() - 1])?;
        let place = placement::find(self.source(), &chain, &others, index);
        place.put(&moved, &mut patches);
        self.apply(patches)
    }

    /// Works out the insertion of elements, one after the other, before number `index`.
    pub(super) fn insert(
        &self,
        parent: &[usize],
        index: usize,
        new: &[NewElement],
        patches: &mut Patches,
    ) -> Result<(), EditError> {
        let chain = self.chain(parent)?;
        let siblings: Vec<_> = chain.last().into_iter().flat_map(|e| e.elements()).collect();
        if index > siblings.len() {
            return Err(EditError::NoElement);
        }
        let place = placement::find(self.source(), &chain, &siblings, index);
        let rendered: Result<Vec<_>, _> = new.iter().map(|new| new.render(&place)).collect();
        let rendered = rendered?;
        if !rendered.is_empty() {
            place.put(&rendered.join(&place.between()), patches);
        }
        Ok(())
    }

    /// Applies the changes, if the result can be read again.
    pub(super) fn apply(&mut self, patches: Patches) -> Result<(), EditError> {
        if patches.is_empty() {
            return Ok(());
        }
        let text = patches.apply(self.text());
        let mut findings = Findings::default();
        let (_, tree) = parse(self.source().path(), text.as_bytes(), &mut findings);
        match tree.filter(|_| !findings.has_errors()) {
            Some(tree) => {
                self.tree = tree;
                self.revision += 1;
                Ok(())
            }
            None => Err(EditError::Refused(findings.finish())),
        }
    }

    pub(super) fn source(&self) -> &Source {
        self.tree.source()
    }

    pub(super) fn text(&self) -> &str {
        self.source().text()
    }

    pub(super) fn element(&self, path: &[usize]) -> Result<&Element, EditError> {
        self.tree.element(path).ok_or(EditError::NoElement)
    }

    /// The parent of an element, and the element's number in it.
    pub(super) fn parent(&self, path: &[usize]) -> Result<(&Element, usize), EditError> {
        self.element(path)?;
        let (index, parent) = path.split_last().ok_or(EditError::Outermost)?;
        Ok((self.element(parent)?, *index))
    }

    /// The elements from the outermost to the one at `path`.
    pub(super) fn chain(&self, path: &[usize]) -> Result<Vec<&Element>, EditError> {
        let mut chain = vec![self.tree.root()];
        for n in path {
            let inner = chain.last().and_then(|element| element.elements().nth(*n));
            chain.push(inner.ok_or(EditError::NoElement)?);
        }
        Ok(chain)
    }
}
