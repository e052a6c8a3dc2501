//! What a guard can be at all, given the domains of its variables: a comparison that comes out the
//! same whatever happens is probably not what was meant.

use super::judge::{Meaning, Problem};
use super::{Count, Guard, Kind, Node, Operator};
use crate::code::Code;

/// A finding for each comparison that always, or never, holds; or for the whole guard.
pub(super) fn constants(guard: &Guard, text: &str, meanings: &[Meaning]) -> Vec<Problem> {
    let mut bounds = Bounds { guard, text, meanings, problems: Vec::new() };
    let whole = bounds.truth(&guard.root);
    if let (Some(truth), true) = (whole, bounds.problems.is_empty()) {
        bounds.report(&guard.root, truth, String::new());
    }
    bounds.problems
}

/// The least and the greatest number that `count` can come to.
pub(crate) fn range_of(count: &Count, meanings: &[Meaning]) -> (f64, f64) {
    let Count(guard) = count;
    Bounds { guard, text: "", meanings, problems: Vec::new() }.range(&guard.root)
}

struct Bounds<'a> {
    guard: &'a Guard,
    text: &'a str,
    meanings: &'a [Meaning],
    problems: Vec<Problem>,
}

impl Bounds<'_> {
    /// What it always is, if that is so as soon as every value is known.
    fn truth(&mut self, node: &Node) -> Option<bool> {
        match &node.kind {
            Kind::Truth(truth) => Some(*truth),
            Kind::Not(inner) => self.truth(inner).map(|truth| !truth),
            Kind::Binary(operator @ (Operator::And | Operator::Or), left, right) => {
                let absorbing = *operator == Operator::Or;
                let (left, right) = (self.truth(left), self.truth(right));
                if left == Some(absorbing) || right == Some(absorbing) {
                    return Some(absorbing);
                }
                left.and(right)
            }
            Kind::Binary(operator, left, right) if operator.is_comparison() => {
                let truth = decided(*operator, self.range(left), self.range(right))?;
                let mut names = Vec::new();
                self.domains(left, &mut names);
                self.domains(right, &mut names);
                self.report(node, truth, names.join(", "));
                Some(truth)
            }
            _ => None,
        }
    }

    /// Least and greatest value of a number.
    fn range(&self, node: &Node) -> (f64, f64) {
        let (low, high) = match &node.kind {
            Kind::Number(value, unit) => {
                let si = value * unit.map_or(1.0, |unit| unit.to_si);
                (si, si)
            }
            Kind::Name(index) => self.meanings.get(*index).map_or(ANY, |meaning| meaning.within),
            Kind::Minus(inner) => {
                let (low, high) = self.range(inner);
                (-high, -low)
            }
            Kind::Binary(operator, left, right) => {
                combined(*operator, self.range(left), self.range(right))
            }
            _ => ANY,
        };
        if low.is_nan() || high.is_nan() { ANY } else { (low, high) }
    }

    fn domains(&self, node: &Node, out: &mut Vec<String>) {
        match &node.kind {
            Kind::Name(index) => {
                if let Some(meaning) = self.meanings.get(*index) {
                    out.push(format!("{} is {}", self.guard.names[*index], meaning.domain));
                }
            }
            Kind::Not(inner) | Kind::Minus(inner) => self.domains(inner, out),
            Kind::Binary(_, left, right) => {
                self.domains(left, out);
                self.domains(right, out);
            }
            _ => {}
        }
    }

    fn report(&mut self, node: &Node, truth: bool, why: String) {
        let text = self.text.get(node.at.clone()).unwrap_or_default();
        let why = if why.is_empty() { why } else { format!(": {why}") };
        let remedy = if truth {
            "remove it, or compare with a value within the domain"
        } else {
            "what depends on it never happens; compare with a value within the domain"
        };
        self.problems.push(Problem {
            code: Code::GuardConstant,
            at: node.at.clone(),
            message: format!("`{text}` is always {truth}{why}"),
            remedy: remedy.into(),
        });
    }
}

const ANY: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

fn combined(operator: Operator, left: (f64, f64), right: (f64, f64)) -> (f64, f64) {
    let span = |values: [f64; 4]| {
        if values.iter().any(|value| value.is_nan()) {
            return ANY;
        }
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        })
    };
    match operator {
        Operator::Plus => (left.0 + right.0, left.1 + right.1),
        Operator::Minus => (left.0 - right.1, left.1 - right.0),
        Operator::Times => {
            span([left.0 * right.0, left.0 * right.1, left.1 * right.0, left.1 * right.1])
        }
        Operator::By if right.0 > 0.0 || right.1 < 0.0 => {
            span([left.0 / right.0, left.0 / right.1, left.1 / right.0, left.1 / right.1])
        }
        _ => ANY,
    }
}

fn decided(operator: Operator, left: (f64, f64), right: (f64, f64)) -> Option<bool> {
    let (never, always) = match operator {
        Operator::Less => (left.0 >= right.1, left.1 < right.0),
        Operator::LessOrEqual => (left.0 > right.1, left.1 <= right.0),
        Operator::Greater => (left.1 <= right.0, left.0 > right.1),
        Operator::GreaterOrEqual => (left.1 < right.0, left.0 >= right.1),
        Operator::Equal | Operator::Unequal => {
            let apart = left.1 < right.0 || right.1 < left.0;
            let one = left.0 == left.1 && left == right;
            let is_equal = if apart { Some(false) } else { one.then_some(true) };
            return is_equal.map(|equal| equal == (operator == Operator::Equal));
        }
        _ => return None,
    };
    if never { Some(false) } else { always.then_some(true) }
}
