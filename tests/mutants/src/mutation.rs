//! Seeded mutations of the examples: each is one change of one file, which stays well-formed XML.

use std::collections::BTreeSet;

use armor_robotfile::Span;
use fastrand::Rng;

use crate::edits;
use crate::example::Example;

/// A kind of mutation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MutationKind {
    /// An element is deleted with all it contains.
    DeleteElement,
    /// An attribute is deleted.
    DeleteAttribute,
    /// An element is written twice.
    DuplicateElement,
    /// An element is moved to another place of the file.
    MoveElement,
    /// A name is changed where it is given or used, and only there.
    RenameOnce,
    /// Two values of the same sort are exchanged.
    SwapValues,
    /// A name is replaced by another one that exists.
    ReplaceReference,
    /// A name is added to a list, or one is removed from it.
    ChangeList,
    /// A number is changed.
    ChangeNumber,
    /// The unit of a number is changed or deleted.
    ChangeUnit,
    /// An attribute is copied to another element of the same name, which lacks it.
    CopyAttribute,
    /// A guard or a check is negated, or one of its comparisons is turned round.
    TurnGuard,
}

impl MutationKind {
    /// All kinds, in the order of the table.
    pub const ALL: [Self; 12] = [
        Self::DeleteElement,
        Self::DeleteAttribute,
        Self::DuplicateElement,
        Self::MoveElement,
        Self::RenameOnce,
        Self::SwapValues,
        Self::ReplaceReference,
        Self::ChangeList,
        Self::ChangeNumber,
        Self::ChangeUnit,
        Self::CopyAttribute,
        Self::TurnGuard,
    ];

    /// Its name in the table.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::DeleteElement => "an element deleted",
            Self::DeleteAttribute => "an attribute deleted",
            Self::DuplicateElement => "an element duplicated",
            Self::MoveElement => "an element moved",
            Self::RenameOnce => "a name misspelt at one place",
            Self::SwapValues => "two values swapped",
            Self::ReplaceReference => "a reference replaced by another name",
            Self::ChangeList => "a name added to or removed from a list",
            Self::ChangeNumber => "a number changed",
            Self::ChangeUnit => "a unit changed",
            Self::CopyAttribute => "an attribute added",
            Self::TurnGuard => "a guard or check negated or turned",
        }
    }

    fn mutate(self, example: &Example, random: &mut Rng) -> Option<Edit> {
        match self {
            Self::DeleteElement => edits::delete_element(example, random),
            Self::DeleteAttribute => edits::delete_attribute(example, random),
            Self::DuplicateElement => edits::duplicate_element(example, random),
            Self::MoveElement => edits::move_element(example, random),
            Self::RenameOnce => edits::rename_once(example, random),
            Self::SwapValues => edits::swap_values(example, random),
            Self::ReplaceReference => edits::replace_reference(example, random),
            Self::ChangeList => edits::change_list(example, random),
            Self::ChangeNumber => edits::change_number(example, random),
            Self::ChangeUnit => edits::change_unit(example, random),
            Self::CopyAttribute => edits::copy_attribute(example, random),
            Self::TurnGuard => edits::turn_guard(example, random),
        }
    }
}

/// What a mutation does to the text of an example.
#[derive(Debug, Default)]
pub struct Edit {
    /// The mutation in a few words.
    pub what: String,
    patches: Vec<(Span, String)>,
}

impl Edit {
    /// An edit that has changed nothing yet.
    pub fn described(what: impl Into<String>) -> Self {
        Self { what: what.into(), patches: Vec::new() }
    }

    /// Replaces a piece of the text, which no other change of this edit overlaps.
    #[must_use]
    pub fn replacing(mut self, span: Span, text: impl Into<String>) -> Self {
        self.patches.push((span, text.into()));
        self
    }

    fn apply_to(mut self, text: &str) -> String {
        self.patches.sort_by_key(|(span, _)| std::cmp::Reverse(span.start()));
        let mut text = text.to_owned();
        for (span, new) in self.patches {
            text.replace_range(span.start()..span.end(), &new);
        }
        text
    }
}

/// An example with one mutation.
#[derive(Clone, Debug)]
pub struct Mutant {
    /// Its number, from 0.
    pub number: usize,
    /// The number of the example among those that were mutated.
    pub example: usize,
    /// The kind of mutation.
    pub kind: MutationKind,
    /// The mutation in a few words.
    pub what: String,
    /// The mutated text.
    pub text: String,
}

/// Attempts in a row without a new mutant after which there are probably no more.
const MAX_ATTEMPTS: usize = 10_000;

/// Returns `count` different mutants, the same ones for the same seed; fewer if there are not so
/// many.
pub fn generate_mutants(examples: &[Example], seed: u64, count: usize) -> Vec<Mutant> {
    let mut random = Rng::with_seed(seed);
    let mut known: BTreeSet<(usize, String)> =
        examples.iter().enumerate().map(|(at, example)| (at, example.text.clone())).collect();
    let mut mutants = Vec::new();
    let mut attempts = 0;
    while mutants.len() < count && attempts < MAX_ATTEMPTS {
        attempts += 1;
        let kind = MutationKind::ALL[random.usize(..MutationKind::ALL.len())];
        let example = random.usize(..examples.len());
        let Some(edit) = kind.mutate(&examples[example], &mut random) else { continue };
        let what = edit.what.clone();
        let text = edit.apply_to(&examples[example].text);
        if known.insert((example, text.clone())) {
            mutants.push(Mutant { number: mutants.len(), example, kind, what, text });
            attempts = 0;
        }
    }
    mutants
}
