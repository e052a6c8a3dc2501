//! The files while one edit is made on them.

use std::sync::Arc;

use armor_robotfile::{Document, EditError, Item, NewElement};

use crate::project::files::OpenFile;

/// Why an edit was not made.
#[derive(Debug, thiserror::Error)]
pub enum Refused {
    /// The file does not allow it.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// A file is no XML.
    #[error("{file} is not well-formed XML: fix it in a text editor first")]
    Broken {
        /// Which one.
        file: String,
    },
    /// No open file has a system, or a mission.
    #[error("the open files have no {what}")]
    Absent {
        /// `<system>` or `<mission>`.
        what: &'static str,
    },
    /// A rule of the drawing does not allow it.
    #[error("{0}")]
    Rule(String),
}

/// The files as trees. A file that is not changed is not copied.
pub struct Documents {
    list: Vec<Arc<Document>>,
    /// The number of files that are drawn and edited; those after them are changed along.
    own: usize,
}

impl Documents {
    pub(super) fn of(files: &[OpenFile]) -> Result<Self, Refused> {
        let documents = files.iter().map(|file| {
            let broken = || Refused::Broken { file: file.shown_path().display().to_string() };
            file.shared_document().ok_or_else(broken)
        });
        let own = files.iter().filter(|file| !file.is_companion).count();
        Ok(Self { list: documents.collect::<Result<_, _>>()?, own })
    }

    pub(super) fn give_back(self, files: &mut [OpenFile]) {
        for (file, document) in files.iter_mut().zip(self.list) {
            file.set_document(document);
        }
    }

    pub(super) fn texts(&self) -> Vec<Arc<str>> {
        self.list.iter().map(|document| document.tree().source().text().into()).collect()
    }

    /// The file with the system.
    ///
    /// # Errors
    /// If none has one.
    pub fn system(&mut self) -> Result<&mut Document, Refused> {
        self.with(Item::System).ok_or(Refused::Absent { what: "<system>" })
    }

    /// The file with the mission. If there is none, the file that was given gets one.
    ///
    /// # Errors
    /// If it cannot be added.
    pub fn mission(&mut self) -> Result<&mut Document, Refused> {
        if self.with(Item::Mission).is_none() {
            let given = Arc::make_mut(&mut self.list[0]);
            let count = given.tree().root().elements().count();
            given.insert_element(&[], count, &NewElement::new("mission"))?;
        }
        self.with(Item::Mission).ok_or(Refused::Absent { what: "<mission>" })
    }

    /// Whether there is a mission.
    pub fn has_mission(&self) -> bool {
        self.list[..self.own].iter().any(|document| document.find(Item::Mission).is_some())
    }

    /// The files, the one that was given first.
    pub fn all(&mut self) -> impl Iterator<Item = &mut Document> {
        self.list.iter_mut().map(Arc::make_mut)
    }

    fn with(&mut self, owner: Item<'_>) -> Option<&mut Document> {
        let own = &mut self.list[..self.own];
        let document = own.iter_mut().find(|document| document.find(owner).is_some())?;
        Some(Arc::make_mut(document))
    }
}
