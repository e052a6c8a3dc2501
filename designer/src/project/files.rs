//! An open file: its text, the text as a tree, and the text that was saved last.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use armor_robotfile::{Document, Item, Reading};

/// A robot that is drawn from nothing.
pub(super) const NEW_FILE: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <armor version=\"1\">\n  <system name=\"robot\">\n  </system>\n</armor>\n";
/// The name of an unsaved file in findings.
const UNTITLED: &str = "untitled.xml";

/// A file that is open.
pub struct OpenFile {
    path: Option<PathBuf>,
    text: Arc<str>,
    /// None while the text is no XML.
    document: Option<Arc<Document>>,
    saved: Arc<str>,
    /// The bytes of a file that is no UTF-8; its text is then an approximation for display.
    odd: Option<Arc<[u8]>>,
    /// It is changed along with the others, but neither drawn nor edited by itself.
    pub(super) is_companion: bool,
}

impl OpenFile {
    pub(super) fn untitled(text: &str) -> Self {
        let text: Arc<str> = text.into();
        let saved = Arc::clone(&text);
        let mut file = Self {
            path: None,
            saved,
            text: Arc::clone(&text),
            document: None,
            odd: None,
            is_companion: false,
        };
        file.set_text(text);
        file
    }

    pub(super) fn read(path: &Path) -> io::Result<Self> {
        let bytes = armor_robotfile::read_bytes(path)?;
        let mut file = Self::untitled(&String::from_utf8_lossy(&bytes));
        file.set_path(path.to_path_buf());
        if std::str::from_utf8(&bytes).is_err() {
            file.document = None;
            file.odd = Some(bytes.into());
        }
        Ok(file)
    }

    /// A file with this text, whatever the disk has.
    pub(super) fn given(path: &Path, text: &str) -> Self {
        let mut file = Self::untitled(text);
        file.set_path(path.to_path_buf());
        file
    }

    /// Its path; none until it is saved.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Its name in findings.
    pub fn shown_path(&self) -> &Path {
        self.path().unwrap_or(Path::new(UNTITLED))
    }

    /// The whole text.
    pub fn text(&self) -> &Arc<str> {
        &self.text
    }

    /// The text as it was opened or saved last.
    pub fn saved(&self) -> &Arc<str> {
        &self.saved
    }

    /// The text as a tree; none while it is no XML.
    pub fn document(&self) -> Option<&Document> {
        self.document.as_deref()
    }

    pub(super) fn shared_document(&self) -> Option<Arc<Document>> {
        self.document.clone()
    }

    /// Returns whether it has unsaved changes.
    pub fn is_dirty(&self) -> bool {
        !Arc::ptr_eq(&self.text, &self.saved) && self.text != self.saved
    }

    pub(super) fn set_text(&mut self, text: Arc<str>) {
        if Arc::ptr_eq(&self.text, &text) && self.document.is_some() {
            return;
        }
        self.document = Document::open(self.shown_path(), text.as_bytes()).ok().map(Arc::new);
        self.text = text;
        self.odd = None;
    }

    pub(super) fn set_document(&mut self, document: Arc<Document>) {
        if self.document.as_ref().is_some_and(|old| Arc::ptr_eq(old, &document)) {
            return;
        }
        self.text = document.tree().source().text().into();
        self.document = Some(document);
    }

    pub(super) fn set_saved(&mut self, text: Arc<str>) {
        self.saved = text;
    }

    pub(super) fn set_path(&mut self, path: PathBuf) {
        self.path = Some(path);
        // The check reports it.
        self.document = Document::open(self.shown_path(), self.text.as_bytes()).ok().map(Arc::new);
    }

    /// The system file that its mission names, from where the program looks.
    pub(super) fn named_system(&self) -> Option<PathBuf> {
        let document = self.document()?;
        let mission = document.tree().element(&document.find(Item::Mission)?)?;
        let named = &mission.attribute("system")?.value;
        Some(self.path()?.parent().unwrap_or(Path::new("")).join(named))
    }

    /// What is known to be on the disk.
    pub fn on_disk(&self) -> Arc<[u8]> {
        self.odd.clone().unwrap_or_else(|| Arc::clone(&self.saved).into())
    }

    pub(super) fn snapshot(&self) -> (PathBuf, Arc<[u8]>) {
        let bytes = self.odd.clone().unwrap_or_else(|| Arc::clone(&self.text).into());
        (self.shown_path().to_path_buf(), bytes)
    }
}

/// Sub-missions, which are read but not open: each is read again only when it has changed.
#[derive(Default)]
pub(super) struct Disk {
    known: BTreeMap<PathBuf, (Option<SystemTime>, Vec<u8>)>,
}

impl Disk {
    /// What the open files say, with those that they name.
    pub(super) fn read(&mut self, files: &[OpenFile]) -> Reading {
        let open: Vec<_> = files.iter().map(OpenFile::snapshot).collect();
        self.read_snapshot(&open)
    }

    /// The same of texts.
    pub(super) fn read_snapshot(&mut self, open: &[(PathBuf, Arc<[u8]>)]) -> Reading {
        let Some((first, _)) = open.first() else { unreachable!("a file is always open") };
        armor_robotfile::read(first, &mut |path| match open.iter().find(|(known, _)| known == path)
        {
            Some((_, bytes)) => Ok(bytes.to_vec()),
            None => self.bytes(path),
        })
    }

    fn bytes(&mut self, path: &Path) -> io::Result<Vec<u8>> {
        let changed = std::fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
        if let Some((since, bytes)) = self.known.get(path)
            && since.is_some()
            && *since == changed
        {
            return Ok(bytes.clone());
        }
        let bytes = armor_robotfile::read_bytes(path)?;
        self.known.insert(path.to_path_buf(), (changed, bytes.clone()));
        Ok(bytes)
    }
}
