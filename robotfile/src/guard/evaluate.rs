//! Whether a guard holds: true, false, or not known (Kleene's strong logic of three values).

use super::{Guard, Kind, Node, Operator, Scalar};

impl Guard {
    /// Whether it holds, given the values of [`Guard::names`] in their order, numbers in SI. None
    /// of a value is a value that is not known; none of the answer, that it is not known whether
    /// the guard holds. NaN, a division by zero, and what is not of the expected type are not
    /// known.
    pub fn holds(&self, values: &[Option<Scalar>]) -> Option<bool> {
        Values { values, open: &[] }.truth(&self.root)
    }

    /// Whether it holds whatever the values are of the names that are `open`; none if that depends
    /// on them.
    pub fn holds_whatever(&self, values: &[Option<Scalar>], open: &[bool]) -> Option<bool> {
        Values { values, open }.truth(&self.root)
    }
}

struct Values<'a> {
    values: &'a [Option<Scalar>],
    /// Names of which not even that is said whether they are known.
    open: &'a [bool],
}

enum Found<'a> {
    Number(f64),
    Truth(bool),
    Text(&'a str),
}

impl<'a> Values<'a> {
    fn truth(&self, node: &'a Node) -> Option<bool> {
        match self.value(node)? {
            Found::Truth(truth) => Some(truth),
            _ => None,
        }
    }

    fn number(&self, node: &'a Node) -> Option<f64> {
        match self.value(node)? {
            Found::Number(number) => Some(number),
            _ => None,
        }
    }

    fn named(&self, index: usize) -> Option<Found<'a>> {
        match self.values.get(index)?.as_ref()? {
            Scalar::Number(number) if number.is_nan() => None,
            Scalar::Number(number) => Some(Found::Number(*number)),
            Scalar::Flag(flag) => Some(Found::Truth(*flag)),
            Scalar::Text(text) => Some(Found::Text(text)),
        }
    }

    fn value(&self, node: &'a Node) -> Option<Found<'a>> {
        Some(match &node.kind {
            Kind::Number(value, unit) => Found::Number(value * unit.map_or(1.0, |u| u.to_si)),
            Kind::Truth(truth) => Found::Truth(*truth),
            Kind::Text(text) => Found::Text(text),
            Kind::Name(index) => return self.named(*index),
            Kind::Known(index) if self.open.get(*index) == Some(&true) => return None,
            Kind::Known(index) => Found::Truth(self.named(*index).is_some()),
            Kind::Not(inner) => Found::Truth(!self.truth(inner)?),
            Kind::Minus(inner) => Found::Number(-self.number(inner)?),
            Kind::Binary(operator, left, right) => return self.joined(*operator, left, right),
        })
    }

    fn joined(&self, operator: Operator, left: &'a Node, right: &'a Node) -> Option<Found<'a>> {
        let decided = match operator {
            // One that is decided decides, whatever the other one may be.
            Operator::And | Operator::Or => {
                let absorbing = operator == Operator::Or;
                let (left, right) = (self.truth(left), self.truth(right));
                if left == Some(absorbing) || right == Some(absorbing) {
                    absorbing
                } else {
                    left?;
                    right?;
                    !absorbing
                }
            }
            _ if operator.is_comparison() => {
                compared(operator, &self.value(left)?, &self.value(right)?)?
            }
            _ => {
                let (left, right) = (self.number(left)?, self.number(right)?);
                let result = match operator {
                    Operator::Plus => left + right,
                    Operator::Minus => left - right,
                    Operator::Times => left * right,
                    _ if right == 0.0 => return None,
                    _ => left / right,
                };
                return (!result.is_nan()).then_some(Found::Number(result));
            }
        };
        Some(Found::Truth(decided))
    }
}

fn compared(operator: Operator, left: &Found<'_>, right: &Found<'_>) -> Option<bool> {
    let is_equal = match (left, right) {
        (Found::Number(left), Found::Number(right)) => match operator {
            Operator::Less => return Some(left < right),
            Operator::LessOrEqual => return Some(left <= right),
            Operator::Greater => return Some(left > right),
            Operator::GreaterOrEqual => return Some(left >= right),
            _ => left == right,
        },
        (Found::Truth(left), Found::Truth(right)) => left == right,
        (Found::Text(left), Found::Text(right)) => left == right,
        _ => return None,
    };
    match operator {
        Operator::Equal => Some(is_equal),
        Operator::Unequal => Some(!is_equal),
        _ => None,
    }
}
