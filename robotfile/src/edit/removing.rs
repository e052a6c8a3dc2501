//! Items removed, with everything in the file that names them.

use std::collections::{BTreeMap, BTreeSet};

use crate::edit::document::Document;
use crate::edit::error::EditError;
use crate::edit::item::Item;
use crate::edit::mention::{Mention, MentionRole, mentions};
use crate::edit::patch::Patches;
use crate::edit::words::{ListForm, list, occurrences, without};
use crate::edit::{attribute, removal};
use crate::source::{Source, Span};
use crate::tree::Element;

impl Document {
    /// Removes an item. A component goes with its links, the parameters that places give it, its
    /// part in lists (an exclusive set of fewer than two goes too) and its block in the layout; other
    /// items go with their block.
    ///
    /// # Errors
    /// If there is no such item, or if something that would mean another thing without it still
    /// names it: a transition or guard, a variable, the clock, a check; the goal.
    pub fn remove(&mut self, item: Item<'_>) -> Result<(), EditError> {
        self.remove_all(&[item])
    }

    /// Removes items as one edit; a mention in an item that is removed too does not prevent the
    /// removal.
    ///
    /// # Errors
    /// As [`Document::remove`], of any of them.
    pub fn remove_all(&mut self, items: &[Item<'_>]) -> Result<(), EditError> {
        let mut gone = RemovedElements::default();
        let mut named = Vec::new();
        for item in items {
            match item.name() {
                Some(name) => {
                    self.check_known(*item)?;
                    named.push((*item, name, mentions(self.tree(), *item)));
                }
                None => {
                    let path = self.path_of(*item)?;
                    let (parent, index) = self.parent(&path)?;
                    gone.add(parent, index);
                }
            }
        }
        let goes = |mention: &&Mention<'_>| {
            matches!(mention.role, MentionRole::Definition | MentionRole::Whole)
        };
        let whole = named.iter().flat_map(|(.., mentions)| mentions.iter().filter(goes));
        let mut going: BTreeSet<Span> = whole.map(|mention| mention.element.span).collect();
        going.extend(gone.spans());
        let mut lists: BTreeMap<usize, (&Mention<'_>, Vec<&str>)> = BTreeMap::new();
        for (item, name, mentions) in &named {
            self.refuse_needed(*item, mentions, &going)?;
            // Elements inside a removed element are removed with it.
            for mention in mentions.iter().filter(|m| !going.contains(&m.parent.span)) {
                match mention.role {
                    MentionRole::Definition | MentionRole::Whole => {
                        gone.add(mention.parent, mention.index);
                    }
                    MentionRole::Needed => {}
                    MentionRole::Listed if going.contains(&mention.element.span) => {}
                    MentionRole::Listed => {
                        let at = mention.attribute.map_or(0, |given| given.value_span.start());
                        lists.entry(at).or_insert((mention, Vec::new())).1.push(name);
                    }
                }
            }
        }
        let mut patches = Patches::default();
        for (mention, names) in lists.values() {
            self.shorten(mention, names, &mut gone, &mut patches)?;
        }
        gone.remove(self.tree().source(), &mut patches);
        self.apply(patches)
    }

    /// Takes names out of a list; a list that means nothing any more goes with its element.
    fn shorten<'a>(
        &self,
        mention: &Mention<'a>,
        names: &[&str],
        gone: &mut RemovedElements<'a>,
        patches: &mut Patches,
    ) -> Result<(), EditError> {
        let left = |form: ListForm, value: &str| {
            let all = names.iter();
            all.fold(value.to_owned(), |left, name| without(&left, &occurrences(form, &left, name)))
        };
        let count = list(&left(mention.form, &mention.value())).count();
        match (mention.element.name.as_str(), count) {
            ("exclusive", 0 | 1) => gone.add(mention.parent, mention.index),
            (_, 0) => {
                let source = self.tree().source();
                attribute::set(source, mention.element, "components", None, patches)?;
            }
            _ => self.rewrite(mention, left, patches),
        }
        Ok(())
    }

    fn refuse_needed(
        &self,
        item: Item<'_>,
        mentions: &[Mention<'_>],
        going: &BTreeSet<Span>,
    ) -> Result<(), EditError> {
        let needed = mentions.iter().filter(|mention| {
            mention.role == MentionRole::Needed
                && !going.contains(&mention.element.span)
                && !going.contains(&mention.parent.span)
        });
        let at: Vec<_> = needed.map(|mention| mention.at(self.tree().source())).collect();
        if at.is_empty() {
            return Ok(());
        }
        Err(EditError::StillNamed { what: item.to_string(), at })
    }
}

/// Elements that go, by their parents.
#[derive(Default)]
pub(super) struct RemovedElements<'a>(Vec<(&'a Element, Vec<usize>)>);

impl<'a> RemovedElements<'a> {
    pub(super) fn add(&mut self, parent: &'a Element, index: usize) {
        match self.0.iter_mut().find(|(known, _)| known.span == parent.span) {
            Some((_, numbers)) => numbers.push(index),
            None => self.0.push((parent, vec![index])),
        }
    }

    /// The elements that go.
    fn spans(&self) -> impl Iterator<Item = Span> {
        self.0.iter().flat_map(|(parent, numbers)| {
            let elements = parent.elements().enumerate();
            elements.filter(|(n, _)| numbers.contains(n)).map(|(_, element)| element.span)
        })
    }

    pub(super) fn remove(self, source: &Source, patches: &mut Patches) {
        for (parent, numbers) in self.0 {
            removal::remove(source, parent, &numbers, patches);
        }
    }
}
