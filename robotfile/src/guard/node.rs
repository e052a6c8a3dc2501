//! The tree of a guard.

use std::ops::Range;

use armor_wire::quantity::Unit;

use crate::guard::name::Name;

/// A parsed guard. Two are equal if they differ only in spacing.
#[derive(Clone)]
pub struct Guard {
    pub(super) root: GuardNode,
    pub(super) names: Vec<Name>,
}

/// Why a text is not a guard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message} ({remedy})")]
pub struct GuardError {
    /// The bytes of the text that it is about.
    pub at: Range<usize>,
    /// The problem.
    pub message: String,
    /// The remedy.
    pub remedy: String,
}

impl Guard {
    /// Returns the names in it, each once, in the order of the text.
    pub fn names(&self) -> &[Name] {
        &self.names
    }
}

impl PartialEq for Guard {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

#[derive(Clone)]
pub(super) struct GuardNode {
    pub(super) kind: GuardNodeKind,
    /// The bytes of the text it was read from.
    pub(super) at: Range<usize>,
}

impl GuardNode {
    /// Returns whether it is written like `other`, apart from spaces and parentheses.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        use GuardNodeKind::{Binary, Known, Minus, Name, Not, Number, Text, Truth};
        match (&self.kind, &other.kind) {
            (Number(a, unit), Number(b, with)) => {
                a.total_cmp(b).is_eq() && unit.map(|unit| unit.name) == with.map(|unit| unit.name)
            }
            (Truth(a), Truth(b)) => a == b,
            (Text(a), Text(b)) => a == b,
            (Name(a), Name(b)) | (Known(a), Known(b)) => a == b,
            (Not(a), Not(b)) | (Minus(a), Minus(b)) => a.is_same(b),
            (Binary(a, left, right), Binary(b, other_left, other_right)) => {
                a == b && left.is_same(other_left) && right.is_same(other_right)
            }
            _ => false,
        }
    }

    /// Returns whether it contains a name.
    pub(super) fn has_name(&self) -> bool {
        match &self.kind {
            GuardNodeKind::Name(_) | GuardNodeKind::Known(_) => true,
            GuardNodeKind::Not(inner) | GuardNodeKind::Minus(inner) => inner.has_name(),
            GuardNodeKind::Binary(_, left, right) => left.has_name() || right.has_name(),
            _ => false,
        }
    }
}

#[derive(Clone)]
pub(super) enum GuardNodeKind {
    /// As written, with its unit; never negative.
    Number(f64, Option<&'static Unit>),
    Truth(bool),
    Text(String),
    /// An index into the guard's names.
    Name(usize),
    /// Whether the name has a value.
    Known(usize),
    Not(Box<GuardNode>),
    Minus(Box<GuardNode>),
    Binary(GuardOperator, Box<GuardNode>, Box<GuardNode>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GuardOperator {
    Or,
    And,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    Unequal,
    Plus,
    Minus,
    Times,
    By,
}

impl GuardOperator {
    pub(super) fn as_str(self) -> &'static str {
        match self {
            GuardOperator::Or => "or",
            GuardOperator::And => "and",
            GuardOperator::Less => "<",
            GuardOperator::LessOrEqual => "<=",
            GuardOperator::Greater => ">",
            GuardOperator::GreaterOrEqual => ">=",
            GuardOperator::Equal => "==",
            GuardOperator::Unequal => "!=",
            GuardOperator::Plus => "+",
            GuardOperator::Minus => "-",
            GuardOperator::Times => "*",
            GuardOperator::By => "/",
        }
    }

    pub(super) fn is_comparison(self) -> bool {
        use GuardOperator::{Equal, Greater, GreaterOrEqual, Less, LessOrEqual, Unequal};
        matches!(self, Less | LessOrEqual | Greater | GreaterOrEqual | Equal | Unequal)
    }

    /// Binds the tighter the higher; `not` is 3, a sign 7.
    pub(super) fn rank(self) -> u8 {
        match self {
            GuardOperator::Or => 1,
            GuardOperator::And => 2,
            comparison if comparison.is_comparison() => 4,
            GuardOperator::Plus | GuardOperator::Minus => 5,
            _ => 6,
        }
    }
}
