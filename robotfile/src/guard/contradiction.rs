//! Comparisons of one value that no value satisfies together, as in `x > 300 and x < 250`; and those of
//! which every value satisfies one, as in `x < 300 or x > 250`: their negations exclude each other.

use std::collections::BTreeMap;

use crate::guard::meaning::Meaning;
use crate::guard::node::{GuardNode, GuardNodeKind, GuardOperator};

/// Returns the name whose conditions decide an `and` or an `or`, as its index in the guard: the
/// `and` is false, or the `or` is true, for every value.
pub(super) fn deciding_name(
    node: &GuardNode,
    operator: GuardOperator,
    meanings: &[Meaning],
) -> Option<usize> {
    let mut values = BTreeMap::new();
    restrict(node, operator == GuardOperator::Or, meanings, &mut values)
}

/// The values that a name may have.
#[derive(Default)]
pub(super) struct PossibleValues<'a> {
    numbers: NumberRange,
    text: Option<&'a str>,
    excluded_texts: Vec<&'a str>,
    truth: Option<bool>,
}

/// Numbers between two ends, each of them included or not, without some single ones.
struct NumberRange {
    low: (f64, bool),
    high: (f64, bool),
    excluded: Vec<f64>,
}

impl Default for NumberRange {
    fn default() -> Self {
        let (low, high) = ((f64::NEG_INFINITY, true), (f64::INFINITY, true));
        Self { low, high, excluded: Vec::new() }
    }
}

/// Restricts the values by all conditions that must be true together, or by their negations; returns
/// the first name that has no value left.
pub(super) fn restrict<'a>(
    node: &'a GuardNode,
    is_negated: bool,
    meanings: &[Meaning],
    values: &mut BTreeMap<usize, PossibleValues<'a>>,
) -> Option<usize> {
    let joining = if is_negated { GuardOperator::Or } else { GuardOperator::And };
    match &node.kind {
        GuardNodeKind::Binary(operator, left, right) if *operator == joining => {
            restrict(left, is_negated, meanings, values)
                .or_else(|| restrict(right, is_negated, meanings, values))
        }
        GuardNodeKind::Not(inner) => restrict(inner, !is_negated, meanings, values),
        GuardNodeKind::Name(name) => {
            let is_left = values.entry(*name).or_default().keep_truth(!is_negated);
            (!is_left).then_some(*name)
        }
        GuardNodeKind::Binary(operator, left, right) if operator.is_comparison() => {
            let (name, operator, constant) = match (&left.kind, &right.kind) {
                (GuardNodeKind::Name(name), _) => (*name, *operator, right),
                (_, GuardNodeKind::Name(name)) => (*name, mirrored(*operator), left),
                _ => return None,
            };
            let operator = if is_negated { opposite(operator) } else { operator };
            let known = values.entry(name).or_insert_with(|| PossibleValues::of(name, meanings));
            let is_left = known.keep(operator, constant);
            (!is_left).then_some(name)
        }
        _ => None,
    }
}

impl<'a> PossibleValues<'a> {
    fn of(name: usize, meanings: &[Meaning]) -> Self {
        let mut values = Self::default();
        if let Some(meaning) = meanings.get(name) {
            values.numbers.low.0 = meaning.within.0;
            values.numbers.high.0 = meaning.within.1;
        }
        values
    }

    /// Keeps the values that compare so with a constant; returns whether there are any left.
    fn keep(&mut self, operator: GuardOperator, constant: &'a GuardNode) -> bool {
        match &constant.kind {
            GuardNodeKind::Text(text) if operator == GuardOperator::Equal => {
                let differs = self.text.replace(text).is_some_and(|other| other != text);
                !differs && !self.excluded_texts.contains(&text.as_str())
            }
            GuardNodeKind::Text(text) if operator == GuardOperator::Unequal => {
                self.excluded_texts.push(text);
                self.text != Some(text)
            }
            GuardNodeKind::Truth(truth) => match operator {
                GuardOperator::Equal => self.keep_truth(*truth),
                GuardOperator::Unequal => self.keep_truth(!*truth),
                _ => true,
            },
            _ => match written_number(constant) {
                Some(number) => self.numbers.keep(operator, number),
                None => true,
            },
        }
    }

    fn keep_truth(&mut self, truth: bool) -> bool {
        self.truth.replace(truth).is_none_or(|other| other == truth)
    }
}

impl NumberRange {
    fn keep(&mut self, operator: GuardOperator, number: f64) -> bool {
        match operator {
            GuardOperator::Less => self.lower((number, false)),
            GuardOperator::LessOrEqual => self.lower((number, true)),
            GuardOperator::Greater => self.raise((number, false)),
            GuardOperator::GreaterOrEqual => self.raise((number, true)),
            GuardOperator::Equal => {
                self.lower((number, true));
                self.raise((number, true));
            }
            GuardOperator::Unequal => self.excluded.push(number),
            _ => {}
        }
        let ((low, with_low), (high, with_high)) = (self.low, self.high);
        let is_point = low == high && with_low && with_high;
        low < high || (is_point && !self.excluded.contains(&low))
    }

    fn lower(&mut self, (end, is_included): (f64, bool)) {
        if end < self.high.0 || (end == self.high.0 && !is_included) {
            self.high = (end, is_included);
        }
    }

    fn raise(&mut self, (end, is_included): (f64, bool)) {
        if end > self.low.0 || (end == self.low.0 && !is_included) {
            self.low = (end, is_included);
        }
    }
}

fn written_number(node: &GuardNode) -> Option<f64> {
    match &node.kind {
        GuardNodeKind::Number(value, unit) => Some(value * unit.map_or(1.0, |unit| unit.to_si)),
        GuardNodeKind::Minus(inner) => written_number(inner).map(|number| -number),
        _ => None,
    }
}

/// The operator with its sides exchanged.
fn mirrored(operator: GuardOperator) -> GuardOperator {
    match operator {
        GuardOperator::Less => GuardOperator::Greater,
        GuardOperator::LessOrEqual => GuardOperator::GreaterOrEqual,
        GuardOperator::Greater => GuardOperator::Less,
        GuardOperator::GreaterOrEqual => GuardOperator::LessOrEqual,
        other => other,
    }
}

/// The operator that is true where this one is false.
fn opposite(operator: GuardOperator) -> GuardOperator {
    match operator {
        GuardOperator::Less => GuardOperator::GreaterOrEqual,
        GuardOperator::LessOrEqual => GuardOperator::Greater,
        GuardOperator::Greater => GuardOperator::LessOrEqual,
        GuardOperator::GreaterOrEqual => GuardOperator::Less,
        GuardOperator::Equal => GuardOperator::Unequal,
        GuardOperator::Unequal => GuardOperator::Equal,
        other => other,
    }
}
