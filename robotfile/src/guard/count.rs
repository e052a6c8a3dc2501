//! The value that a transition sets a variable to: a whole number, computed from numbers and
//! variables in the words of guards, with `+`, `-`, `*`, signs and parentheses.

use std::fmt;
use std::ops::Range;

use crate::guard::name::Name;
use crate::guard::node::{Guard, GuardError, GuardNode, GuardNodeKind, GuardOperator};

/// The greatest number that may be written, and the limit of a variable, positive and negative.
pub const MAX_COUNT: i64 = 1_000_000_000;

/// An expression for a whole number. Two are equal if they differ only in spacing.
#[derive(Clone, Debug, PartialEq)]
pub struct Count(pub(super) Guard);

impl Count {
    /// Reads one.
    ///
    /// # Errors
    /// At the first thing that does not belong there.
    pub fn parse(text: &str) -> Result<Self, GuardError> {
        let read = Guard::parse_value(text)?;
        expect_count(&read, &read.root)?;
        Ok(Self(read))
    }

    /// Returns the variables in it, each once, in the order of the text.
    pub fn names(&self) -> &[Name] {
        self.0.names()
    }

    /// Returns its value, given the values of [`Self::names`] in their order; none if that is more
    /// than can be counted.
    pub fn of(&self, values: &[i64]) -> Option<i64> {
        of(&self.0.root, values)
    }
}

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

fn of(node: &GuardNode, values: &[i64]) -> Option<i64> {
    match &node.kind {
        GuardNodeKind::Number(value, _) => Some(*value as i64),
        GuardNodeKind::Name(index) => values.get(*index).copied(),
        GuardNodeKind::Minus(inner) => of(inner, values)?.checked_neg(),
        GuardNodeKind::Binary(operator, left, right) => {
            let (left, right) = (of(left, values)?, of(right, values)?);
            match operator {
                GuardOperator::Plus => left.checked_add(right),
                GuardOperator::Minus => left.checked_sub(right),
                GuardOperator::Times => left.checked_mul(right),
                _ => None,
            }
        }
        _ => None,
    }
}

fn expect_count(read: &Guard, node: &GuardNode) -> Result<(), GuardError> {
    let wrong = |message: &str, remedy: &str| Err(error(&node.at, message, remedy));
    match &node.kind {
        GuardNodeKind::Number(_, Some(_)) => {
            wrong("a number with a unit is not expected here", "write a whole number without unit")
        }
        GuardNodeKind::Number(value, None) if value.fract() != 0.0 || *value > MAX_COUNT as f64 => {
            let remedy = format!("write a whole number up to {MAX_COUNT}");
            wrong("this is not a whole number in the range", &remedy)
        }
        GuardNodeKind::Number(..) => Ok(()),
        GuardNodeKind::Name(index) if read.names[*index].data().is_some() => wrong(
            "a field of data is not expected here",
            "use numbers and variables that transitions set: a proof can follow only these",
        ),
        GuardNodeKind::Name(_) => Ok(()),
        GuardNodeKind::Minus(inner) => expect_count(read, inner),
        GuardNodeKind::Binary(
            GuardOperator::Plus | GuardOperator::Minus | GuardOperator::Times,
            left,
            right,
        ) => {
            expect_count(read, left)?;
            expect_count(read, right)
        }
        GuardNodeKind::Binary(GuardOperator::By, ..) => {
            wrong("this is a division", "use +, - and *")
        }
        _ => wrong("this is true or false, or a text", "write a whole number, such as round + 1"),
    }
}

fn error(at: &Range<usize>, message: &str, remedy: &str) -> GuardError {
    GuardError { at: at.clone(), message: message.into(), remedy: remedy.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_value_follows_arithmetic() {
        let check = |text: &str, values: &[i64], expected: Option<i64>| {
            let count = Count::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(count.of(values), expected, "{text}");
            assert_eq!(Count::parse(&count.to_string()), Ok(count), "{text} written again");
        };
        check("3", &[], Some(3));
        check("round + 1", &[2], Some(3));
        check("2 * (round - limit) + round", &[7, 5], Some(11));
        check("-round", &[-4], Some(4));
        check("round - - 1", &[i64::MAX], None);
        check("round * round", &[i64::MAX], None);
    }

    #[test]
    fn errors_show_what_is_not_a_whole_number() {
        let check = |text: &str, piece: &str, message: &str| {
            let error = Count::parse(text).expect_err(text);
            assert_eq!(&text[error.at.clone()], piece, "{text}: {error}");
            assert!(error.to_string().contains(message), "{text}: {error}");
        };
        check("round + 1.5", "1.5", "not a whole number");
        check("round + 1s", "1s", "unit");
        check("round / 2", "round / 2", "division");
        check("power.level + 1", "power.level", "field of data");
        check("(round > 1)", "(round > 1)", "true or false");
        check("true", "true", "true or false");
        check("round < 3", "<", "");
        check("round +", "", "ends here");
        check("", "", "is empty");
        check("99999999999", "99999999999", "not a whole number");
    }
}
