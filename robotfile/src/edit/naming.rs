//! Items renamed, with everything in the file that names them.

use crate::edit::attribute;
use crate::edit::attribute::{quote, text_run};
use crate::edit::document::Document;
use crate::edit::error::EditError;
use crate::edit::item::Item;
use crate::edit::item::{check_name, check_qualified};
use crate::edit::mention::{Mention, MentionRole, mentions};
use crate::edit::new_element::{escape_text, escape_value};
use crate::edit::patch::Patches;
use crate::edit::words::{ListForm, occurrences, replaced};
use crate::findings::Findings;
use crate::source::{Location, Source, Span};
use crate::start_tag::unescape;

impl Document {
    /// Renames an item and everything in the file that names it: links, lists, arcs, the goal,
    /// reports, sources, the layout, and the words of guards and checks. In a guard a name before a
    /// dot is a component's; one by itself is, of the things that have it, rather a variable's. In a
    /// check it is a place's, but a transition's in `fires(…)` and `dead(…)` and a component's in
    /// `active(…)`. A component of another file is renamed in what names it here, and so is a place or
    /// transition of a sub-mission, by its qualified name: `dock.creep`. Checks and the layout name
    /// what is derived from a route or a step of it; these names follow.
    ///
    /// # Errors
    /// If there is no such item, the new name is none or another's, or the item is one without name.
    pub fn rename(&mut self, item: Item<'_>, new: &str) -> Result<(), EditError> {
        let (Some(old), Some(renamed)) = (item.name(), item.renamed(new)) else {
            return Err(EditError::Nameless { what: item.to_string() });
        };
        self.check_known(item)?;
        if item.is_of_submission() {
            check_qualified(new)?;
        } else {
            check_name(new)?;
        }
        if old == new {
            return Ok(());
        }
        self.refuse_taken(renamed)?;
        if self.is_elsewhere(item)
            && let Some(mention) = mentions(&self.tree, renamed).first()
        {
            return Err(self.taken(renamed.to_string(), mention.element));
        }
        let mut patches = Patches::default();
        let derived = [item, renamed].map(|item| item.derived_name().unwrap_or_default());
        for mention in mentions(&self.tree, item) {
            let rename = |form: ListForm, value: &str| match form {
                ListForm::Derived => {
                    let [old, new] = &derived;
                    replaced(value, &occurrences(form, value, old), new)
                }
                form => replaced(value, &occurrences(form, value, old), new),
            };
            self.rewrite(&mention, rename, &mut patches);
        }
        self.apply(patches)
    }

    /// Where an item is named, its own name and its block in the layout left out.
    pub fn mentions(&self, item: Item<'_>) -> Vec<Location> {
        let found = mentions(&self.tree, item);
        let others = found.iter().filter(|m| m.role != MentionRole::Definition && !m.is_layout());
        others.map(|mention| mention.at(self.tree.source())).collect()
    }

    pub(super) fn check_known(&self, item: Item<'_>) -> Result<(), EditError> {
        let is_derived = self.derivation(item).is_some();
        if self.is_elsewhere(item) && !is_derived { Ok(()) } else { self.path_of(item).map(|_| ()) }
    }

    /// Whether an item is defined in another file: a component of its system, or a place or
    /// transition of a sub-mission.
    fn is_elsewhere(&self, item: Item<'_>) -> bool {
        let is_component = matches!(item, Item::Component(_));
        item.is_of_submission() || is_component && self.find(Item::System).is_none()
    }

    /// Changes the value in which an item is named. The text around the name stays as it is
    /// written, unless the name itself is written with references.
    pub(super) fn rewrite(
        &self,
        mention: &Mention<'_>,
        change: impl Fn(ListForm, &str) -> String,
        patches: &mut Patches,
    ) {
        let wanted = change(mention.form, &mention.value());
        let text = self.text();
        let range = match mention.attribute {
            Some(attribute) => attribute.value_span.start()..attribute.value_span.end(),
            None => match text_run(text, mention.element) {
                Some(run) => run,
                None => {
                    return attribute::set_text(self.source(), mention.element, &wanted, patches);
                }
            },
        };
        let changed = around_references(&text[range.clone()], |raw| change(mention.form, raw));
        let written = match mention.attribute {
            _ if unescape_raw(&changed) == wanted => changed,
            Some(attribute) => escape_value(&wanted, quote(text, attribute)),
            None => escape_text(&wanted),
        };
        patches.replace(range, written);
    }
}

/// Represents a reference; XML does not allow the character itself.
const REFERENCE: char = '\u{1}';

/// Changes a text as it is written, its references being left alone.
fn around_references(raw: &str, change: impl Fn(&str) -> String) -> String {
    let mut masked = String::with_capacity(raw.len());
    let mut references = Vec::new();
    let mut rest = raw;
    while let Some((before, from)) = rest.find('&').map(|at| rest.split_at(at)) {
        let (reference, after) = from.split_at(from.find(';').map_or(from.len(), |end| end + 1));
        masked += before;
        masked.push(REFERENCE);
        references.push(reference);
        rest = after;
    }
    masked += rest;
    let mut references = references.into_iter();
    let restore = |c| match c {
        REFERENCE => references.next().unwrap_or_default().to_owned(),
        c => String::from(c),
    };
    change(&masked).chars().map(restore).collect()
}

/// Returns the text with its references replaced.
fn unescape_raw(raw: &str) -> String {
    let source = Source::new("", raw);
    let all = Location::new(&source, Span::new(0, raw.len()));
    unescape(&all, &mut Findings::default())
}
