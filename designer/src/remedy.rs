//! Remedies of findings that a click can apply.

use std::sync::Arc;

use armor_robotfile::tree::Element;
use armor_robotfile::{Finding, OfferedEdit};

use crate::project::Project;
use crate::window_words::{attribute, in_window_words};
use crate::workspace::Workspace;

/// The tooltip of a button that applies a remedy.
pub const APPLIES: &str = "Makes this change. Undo reverts it.";

/// A remedy that a click applies.
#[derive(Clone, Debug)]
pub struct Offer {
    /// The text of the button.
    pub label: String,
    /// What it does.
    pub edit: OfferedEdit,
}

/// Returns the remedies of a finding that a click can apply: those that were proven to help, or the
/// name that was probably meant.
pub fn offers(finding: &Finding, project: &Project) -> Vec<Offer> {
    if !finding.edits.is_empty() {
        let label = |edit: &OfferedEdit| {
            let words = match edit.result.as_str() {
                result if result.starts_with('<') => format!("Change it to {result}"),
                result if result.starts_with("no ") => format!("Have {result}"),
                result => format!("Write {result}"),
            };
            match edit.element.as_str() {
                "" => in_window_words(&words),
                element => in_window_words(&format!("{words} ({element})")),
            }
        };
        let offer = |edit: &OfferedEdit| Offer { label: label(edit), edit: edit.clone() };
        return finding.edits.iter().map(offer).collect();
    }
    meant_name(finding).or_else(|| meant_attributes(finding, project)).into_iter().collect()
}

/// What the remedy proposes for attributes of the element that the finding is about.
fn meant_attributes(finding: &Finding, project: &Project) -> Option<Offer> {
    let (_, mut rest) = finding.remedy.split_once("did you mean ")?;
    let at = finding.at.as_ref()?;
    let files = project.files().iter();
    let file = files.into_iter().find(|file| file.shown_path() == at.source.path())?;
    let element = element_at(file.document()?.tree().root(), at.span.start())?;
    let (mut replaced, mut words) = (Vec::new(), Vec::new());
    while let Some((name, value, after)) = attribute(rest) {
        let is_whole = !value.contains(['…', '&', '<', '"']);
        let known = element.attribute(name).filter(|_| is_whole)?;
        replaced.push((known.value_span, value.to_owned()));
        words.push(in_window_words(&format!("write {name}=\"{value}\"")));
        rest = after.trim_start();
    }
    (rest.starts_with('?') && !replaced.is_empty()).then(|| Offer {
        label: capitalized(&words.join(", ")),
        edit: OfferedEdit {
            source: Arc::clone(&at.source),
            replaced,
            result: String::new(),
            element: String::new(),
        },
    })
}

/// The innermost element at a byte.
fn element_at(element: &Element, at: usize) -> Option<&Element> {
    let is_in = element.span.start() <= at && at < element.span.end();
    is_in.then(|| element.elements().find_map(|inner| element_at(inner, at)).unwrap_or(element))
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The name that the remedy proposes for the one that the finding is about.
fn meant_name(finding: &Finding) -> Option<Offer> {
    let is_name = |text: &str| {
        !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || "-_.".contains(c))
    };
    let (_, meant) = finding.remedy.split_once("did you mean ")?;
    let (meant, _) = meant.split_once('?')?;
    let at = finding.at.as_ref()?;
    let written = at.text();
    let dots = |text: &str| text.matches('.').count();
    let is_alike = is_name(meant) && is_name(written) && dots(meant) == dots(written);
    (is_alike && meant != written).then(|| Offer {
        label: format!("Change {written} to {meant}"),
        edit: OfferedEdit {
            source: Arc::clone(&at.source),
            replaced: vec![(at.span, meant.to_owned())],
            result: meant.to_owned(),
            element: String::new(),
        },
    })
}

impl Workspace {
    /// Whether an offered edit can be made: its file is open and has the text that it was made for.
    pub fn can_apply(&self, edit: &OfferedEdit) -> bool {
        self.file_of(edit).is_some()
    }

    /// Makes an offered edit, as one step of the history.
    pub fn apply_offer(&mut self, offer: &Offer) {
        let Some(file) = self.file_of(&offer.edit) else {
            self.messages.warn("The file has changed: wait until it is checked again.");
            return;
        };
        self.project.replace_text(file, offer.label.clone(), offer.edit.text().into());
    }

    fn file_of(&self, edit: &OfferedEdit) -> Option<usize> {
        let source = &edit.source;
        self.project
            .files()
            .iter()
            .position(|file| file.shown_path() == source.path() && **file.text() == *source.text())
    }
}
