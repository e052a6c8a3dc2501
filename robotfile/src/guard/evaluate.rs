//! Evaluates guards: true, false, or unknown (Kleene's strong three-valued logic).

use crate::guard::node::{Guard, GuardNode, GuardNodeKind, GuardOperator};
use armor_wire::schema::Scalar;

impl Guard {
    /// Returns whether it is true, given the values of [`Guard::names`] in their order, numbers in
    /// SI. None of a value is a value that is not known; none of the answer, that it is not known
    /// whether the guard is true. NaN, a division by zero, and a value of another type are not
    /// known.
    pub fn holds(&self, values: &[Option<Scalar>]) -> Option<bool> {
        GuardValues { values, open: &[] }.evaluate_truth(&self.root)
    }

    /// Returns whether it is true for all values of the names that are `open`; none if that depends
    /// on them.
    pub fn holds_whatever(&self, values: &[Option<Scalar>], open: &[bool]) -> Option<bool> {
        GuardValues { values, open }.evaluate_truth(&self.root)
    }
}

struct GuardValues<'a> {
    values: &'a [Option<Scalar>],
    /// The names for which even `known` is undecided.
    open: &'a [bool],
}

enum GuardValue<'a> {
    Number(f64),
    Truth(bool),
    Text(&'a str),
}

impl<'a> GuardValues<'a> {
    fn evaluate_truth(&self, node: &'a GuardNode) -> Option<bool> {
        match self.evaluate_node(node)? {
            GuardValue::Truth(truth) => Some(truth),
            _ => None,
        }
    }

    fn evaluate_number(&self, node: &'a GuardNode) -> Option<f64> {
        match self.evaluate_node(node)? {
            GuardValue::Number(number) => Some(number),
            _ => None,
        }
    }

    fn named_value(&self, index: usize) -> Option<GuardValue<'a>> {
        match self.values.get(index)?.as_ref()? {
            Scalar::Number(number) if number.is_nan() => None,
            Scalar::Number(number) => Some(GuardValue::Number(*number)),
            Scalar::Flag(flag) => Some(GuardValue::Truth(*flag)),
            Scalar::Text(text) => Some(GuardValue::Text(text)),
        }
    }

    fn evaluate_node(&self, node: &'a GuardNode) -> Option<GuardValue<'a>> {
        Some(match &node.kind {
            GuardNodeKind::Number(value, unit) => {
                GuardValue::Number(value * unit.map_or(1.0, |u| u.to_si))
            }
            GuardNodeKind::Truth(truth) => GuardValue::Truth(*truth),
            GuardNodeKind::Text(text) => GuardValue::Text(text),
            GuardNodeKind::Name(index) => return self.named_value(*index),
            GuardNodeKind::Known(index) if self.open.get(*index) == Some(&true) => return None,
            GuardNodeKind::Known(index) => GuardValue::Truth(self.named_value(*index).is_some()),
            GuardNodeKind::Not(inner) => GuardValue::Truth(!self.evaluate_truth(inner)?),
            GuardNodeKind::Minus(inner) => GuardValue::Number(-self.evaluate_number(inner)?),
            GuardNodeKind::Binary(operator, left, right) => {
                return self.evaluate_operator(*operator, left, right);
            }
        })
    }

    fn evaluate_operator(
        &self,
        operator: GuardOperator,
        left: &'a GuardNode,
        right: &'a GuardNode,
    ) -> Option<GuardValue<'a>> {
        let decided = match operator {
            // One that is decided decides, whatever the other one may be.
            GuardOperator::And | GuardOperator::Or => {
                let absorbing = operator == GuardOperator::Or;
                let (left, right) = (self.evaluate_truth(left), self.evaluate_truth(right));
                if left == Some(absorbing) || right == Some(absorbing) {
                    absorbing
                } else {
                    left?;
                    right?;
                    !absorbing
                }
            }
            _ if operator.is_comparison() => {
                compare_values(operator, &self.evaluate_node(left)?, &self.evaluate_node(right)?)?
            }
            _ => {
                let (left, right) = (self.evaluate_number(left)?, self.evaluate_number(right)?);
                let result = match operator {
                    GuardOperator::Plus => left + right,
                    GuardOperator::Minus => left - right,
                    GuardOperator::Times => left * right,
                    _ if right == 0.0 => return None,
                    _ => left / right,
                };
                return (!result.is_nan()).then_some(GuardValue::Number(result));
            }
        };
        Some(GuardValue::Truth(decided))
    }
}

fn compare_values(
    operator: GuardOperator,
    left: &GuardValue<'_>,
    right: &GuardValue<'_>,
) -> Option<bool> {
    let is_equal = match (left, right) {
        (GuardValue::Number(left), GuardValue::Number(right)) => match operator {
            GuardOperator::Less => return Some(left < right),
            GuardOperator::LessOrEqual => return Some(left <= right),
            GuardOperator::Greater => return Some(left > right),
            GuardOperator::GreaterOrEqual => return Some(left >= right),
            _ => left == right,
        },
        (GuardValue::Truth(left), GuardValue::Truth(right)) => left == right,
        (GuardValue::Text(left), GuardValue::Text(right)) => left == right,
        _ => return None,
    };
    match operator {
        GuardOperator::Equal => Some(is_equal),
        GuardOperator::Unequal => Some(!is_equal),
        _ => None,
    }
}
