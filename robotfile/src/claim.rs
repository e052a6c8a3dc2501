//! Claims: the language of `<check>`, statements about the net of a mission over formulas of
//! tokens, places and components. This module parses them; the executive decides it.
//! `docs/file-format.md` has the grammar. Pure, linear in the text, no panics whatever the text.
//!
//! ```
//! use armor_robotfile::claim::{Claim, Statement};
//!
//! let claim = Claim::parse("duration(home or hold) <= 20min").unwrap();
//! assert!(matches!(claim.statement, Statement::Duration { .. }));
//! assert_eq!(claim.names()[1].1.as_str(), "hold");
//! ```

mod parse;
#[cfg(test)]
mod tests;

use std::fmt;
use std::ops::Range;
use std::time::Duration;

/// A claim as read.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// The statement.
    pub statement: Statement,
}

/// The statements about a mission.
#[derive(Clone, Debug, PartialEq)]
pub enum Statement {
    /// In every marking that can come.
    Always(Formula),
    /// In no marking that can come.
    Never(Formula),
    /// In some marking that can come.
    Reachable(Formula),
    /// Whatever has fired, some firings more lead to it.
    AlwaysReachable(Formula),
    /// Every run comes to it.
    Eventually(Formula),
    /// Every run that comes to the first comes to the second, then or later.
    LeadsTo(Formula, Formula),
    /// The time from the start to the first marking of the kind.
    Duration {
        /// The formula that ends the time.
        until: Formula,
        /// `<` and `<=` bound the longest, `>` and `>=` the shortest.
        relation: Relation,
        /// By this.
        limit: Duration,
    },
    /// A transition that can fire.
    Fires(Name),
    /// A transition that never fires.
    Dead(Name),
    /// A place never has more than this number of tokens; without a number, it has some bound.
    Bounded(Name, Option<u32>),
}

/// A condition that a marking satisfies or not.
#[derive(Clone, Debug, PartialEq)]
pub enum Formula {
    /// `true`, `false`.
    Truth(bool),
    /// A place has a token.
    Marked(Name),
    /// A place is marked that activates the component.
    Active(Name),
    /// Counts of tokens, or values of variables, are compared.
    Compare(Sum, Relation, Sum),
    /// The formula is false.
    Not(Box<Formula>),
    /// Both are true.
    And(Box<Formula>, Box<Formula>),
    /// At least one of them is true.
    Or(Box<Formula>, Box<Formula>),
}

/// The tokens of places and the values of variables, each as often as it is named, and a number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sum {
    /// Places and variables that transitions set.
    pub places: Vec<Name>,
    /// Added to them.
    pub number: u64,
}

/// A comparison of two counts or times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// `<`
    Less,
    /// `<=`
    LessOrEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterOrEqual,
    /// `==`
    Equal,
    /// `!=`
    Unequal,
}

/// A name in a claim: `home`, or `dock.near` of a sub-mission. Two are equal if they are spelt alike,
/// wherever they are.
#[derive(Clone, Debug)]
pub struct Name {
    text: String,
    /// The bytes of the text where it occurs.
    pub(crate) at: Range<usize>,
}

/// The kind of thing that a name refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sort {
    /// A place.
    Place,
    /// A place, whose tokens are meant, or a variable that transitions set.
    Count,
    /// A transition.
    Transition,
    /// A component.
    Component,
}

/// Why a text is not a claim.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message} ({remedy})")]
pub struct ClaimError {
    /// The bytes of the text that it is about.
    pub at: Range<usize>,
    /// The problem.
    pub message: String,
    /// The remedy.
    pub remedy: String,
}

impl Claim {
    /// Everything it names, in the order of the text.
    pub fn names(&self) -> Vec<(Sort, &Name)> {
        let mut names = Vec::new();
        match &self.statement {
            Statement::Fires(name) | Statement::Dead(name) => names.push((Sort::Transition, name)),
            Statement::Bounded(place, _) => names.push((Sort::Place, place)),
            _ => self.formulas().iter().for_each(|formula| formula.gather(&mut names)),
        }
        names
    }

    /// Its comparisons, in the order of the text.
    pub(crate) fn comparisons(&self) -> Vec<(&Sum, Relation, &Sum)> {
        let mut found = Vec::new();
        self.formulas().iter().for_each(|formula| formula.gather_comparisons(&mut found));
        found
    }

    fn formulas(&self) -> Vec<&Formula> {
        match &self.statement {
            Statement::Always(formula)
            | Statement::Never(formula)
            | Statement::Reachable(formula)
            | Statement::AlwaysReachable(formula)
            | Statement::Eventually(formula)
            | Statement::Duration { until: formula, .. } => vec![formula],
            Statement::LeadsTo(from, to) => vec![from, to],
            Statement::Fires(_) | Statement::Dead(_) | Statement::Bounded(..) => Vec::new(),
        }
    }
}

impl Formula {
    /// Recursion is bounded by the depth and length that are read.
    fn gather<'a>(&'a self, names: &mut Vec<(Sort, &'a Name)>) {
        match self {
            Self::Truth(_) => {}
            Self::Marked(place) => names.push((Sort::Place, place)),
            Self::Active(component) => names.push((Sort::Component, component)),
            Self::Compare(left, _, right) => {
                let places = left.places.iter().chain(&right.places);
                names.extend(places.map(|place| (Sort::Count, place)));
            }
            Self::Not(inner) => inner.gather(names),
            Self::And(left, right) | Self::Or(left, right) => {
                left.gather(names);
                right.gather(names);
            }
        }
    }

    fn gather_comparisons<'a>(&'a self, found: &mut Vec<(&'a Sum, Relation, &'a Sum)>) {
        match self {
            Self::Compare(left, relation, right) => found.push((left, *relation, right)),
            Self::Not(inner) => inner.gather_comparisons(found),
            Self::And(left, right) | Self::Or(left, right) => {
                left.gather_comparisons(found);
                right.gather_comparisons(found);
            }
            Self::Truth(_) | Self::Marked(_) | Self::Active(_) => {}
        }
    }
}

impl PartialEq for Name {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl Name {
    /// It as written.
    pub fn as_str(&self) -> &str {
        &self.text
    }
}

impl Relation {
    /// It as written.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Less => "<",
            Self::LessOrEqual => "<=",
            Self::Greater => ">",
            Self::GreaterOrEqual => ">=",
            Self::Equal => "==",
            Self::Unequal => "!=",
        }
    }
}

impl Sort {
    /// How people call it.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Place => "place",
            Self::Count => "place or variable",
            Self::Transition => "transition",
            Self::Component => "component",
        }
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
