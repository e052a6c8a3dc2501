//! Guards: what `when="…"` says. A small typed language over variables and fields of data: read
//! here from its text, judged against the types of the data, and evaluated in a logic of three
//! values, since what has not arrived yet is neither true nor false. `docs/file-format.md` has the
//! grammar. Pure, in time linear in the text, and without panics whatever the text.
//!
//! ```
//! use armor_robotfile::guard::{Guard, Scalar};
//!
//! let guard = Guard::parse("battery < 30% and not charger.state.docked").unwrap();
//! assert_eq!(guard.names()[1].data(), Some("charger.state"));
//! let holds = |level, docked| guard.holds(&[level, docked]);
//! assert_eq!(holds(Some(Scalar::Number(0.2)), Some(Scalar::Flag(false))), Some(true));
//! assert_eq!(holds(Some(Scalar::Number(0.2)), None), None);
//! assert_eq!(holds(Some(Scalar::Number(0.9)), None), Some(false));
//! ```

mod bounds;
mod count;
mod evaluate;
mod judge;
mod measure;
mod name;
mod parse;
mod print;
#[cfg(test)]
mod tests;
mod token;

use std::ops::Range;

use armor_wire::quantity::Unit;

pub use armor_wire::schema::Scalar;
pub(crate) use bounds::range_of;
pub use count::{Count, MAX_COUNT};
pub(crate) use judge::{Meaning, Type, judge};
pub(crate) use measure::Measure;
pub use name::Name;
pub use parse::{MAX_DEPTH, MAX_LEN};
pub(crate) use token::{Token, tokens};

/// A guard as read. Two are equal if they say the same, however it is spaced.
#[derive(Clone)]
pub struct Guard {
    root: Node,
    names: Vec<Name>,
}

/// Why a text is not a guard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message} ({remedy})")]
pub struct GuardError {
    /// The bytes of the text that it is about.
    pub at: Range<usize>,
    /// What is wrong there.
    pub message: String,
    /// What to do.
    pub remedy: String,
}

impl Guard {
    /// The names it speaks of, each once, in the order of the text.
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
struct Node {
    kind: Kind,
    /// The bytes of the text it was read from.
    at: Range<usize>,
}

#[derive(Clone)]
enum Kind {
    /// As written, with its unit; never negative.
    Number(f64, Option<&'static Unit>),
    Truth(bool),
    Text(String),
    /// An index into the guard's names.
    Name(usize),
    /// Whether a value is there for the name.
    Known(usize),
    Not(Box<Node>),
    Minus(Box<Node>),
    Binary(Operator, Box<Node>, Box<Node>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operator {
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

impl Operator {
    fn as_str(self) -> &'static str {
        match self {
            Operator::Or => "or",
            Operator::And => "and",
            Operator::Less => "<",
            Operator::LessOrEqual => "<=",
            Operator::Greater => ">",
            Operator::GreaterOrEqual => ">=",
            Operator::Equal => "==",
            Operator::Unequal => "!=",
            Operator::Plus => "+",
            Operator::Minus => "-",
            Operator::Times => "*",
            Operator::By => "/",
        }
    }

    fn is_comparison(self) -> bool {
        use Operator::{Equal, Greater, GreaterOrEqual, Less, LessOrEqual, Unequal};
        matches!(self, Less | LessOrEqual | Greater | GreaterOrEqual | Equal | Unequal)
    }

    /// Binds the tighter the higher; `not` is 3, a sign 7.
    fn rank(self) -> u8 {
        match self {
            Operator::Or => 1,
            Operator::And => 2,
            comparison if comparison.is_comparison() => 4,
            Operator::Plus | Operator::Minus => 5,
            _ => 6,
        }
    }
}
