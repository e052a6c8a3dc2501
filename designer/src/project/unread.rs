//! Values in the files that could not be understood, to be shown where they can be fixed.

use armor_robotfile::{Code, Document, Item};

use crate::project::Project;

impl Project {
    /// Returns the text of an attribute whose value could not be understood.
    pub fn unread(&self, item: Item<'_>, attribute: &str) -> Option<&str> {
        let document = self.document_with(item)?;
        self.unread_at(document, &document.find(item)?, attribute)
    }

    /// The same of the element at a path of a document.
    pub fn unread_at<'a>(
        &self,
        document: &'a Document,
        path: &[usize],
        attribute: &str,
    ) -> Option<&'a str> {
        let tree = document.tree();
        let attribute = tree.element(path)?.attribute(attribute)?;
        let found = self.reading.findings.iter().filter(|f| f.code == Code::BadValue);
        let mut places = found.filter_map(|finding| finding.at.as_ref());
        let is_it = places
            .any(|at| at.source.path() == tree.source().path() && at.span == attribute.value_span);
        is_it.then_some(attribute.value.as_str())
    }
}
