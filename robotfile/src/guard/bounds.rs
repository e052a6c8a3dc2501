//! The possible results of a guard, given the domains of its variables: a comparison with a
//! constant result is probably a mistake.

use crate::code::Code;
use crate::guard::contradiction::deciding_name;
use crate::guard::count::Count;
use crate::guard::meaning::{GuardProblem, Meaning};
use crate::guard::node::{Guard, GuardNode, GuardNodeKind, GuardOperator};

/// Returns a finding for each comparison that is always true or always false; or for the whole
/// guard.
pub(super) fn constants(guard: &Guard, text: &str, meanings: &[Meaning]) -> Vec<GuardProblem> {
    let mut bounds = GuardBounds { guard, text, meanings, problems: Vec::new() };
    bounds.report_fixed_values(&guard.root);
    if !bounds.problems.is_empty() {
        return bounds.problems;
    }
    let whole = bounds.find_truth(&guard.root);
    if let (Some(truth), true) = (whole, bounds.problems.is_empty()) {
        bounds.report_constant(&guard.root, truth, String::new(), None);
    }
    bounds.problems
}

/// Returns whether the guard is false whenever every value is known.
pub(crate) fn is_never_true(guard: &Guard, meanings: &[Meaning]) -> bool {
    let mut bounds = GuardBounds { guard, text: "", meanings, problems: Vec::new() };
    bounds.find_truth(&guard.root) == Some(false)
}

/// The least and the greatest number that `count` can come to.
pub(crate) fn range_of(count: &Count, meanings: &[Meaning]) -> (f64, f64) {
    let Count(guard) = count;
    GuardBounds { guard, text: "", meanings, problems: Vec::new() }.find_range(&guard.root)
}

struct GuardBounds<'a> {
    guard: &'a Guard,
    text: &'a str,
    meanings: &'a [Meaning],
    problems: Vec<GuardProblem>,
}

impl GuardBounds<'_> {
    /// Returns the constant result, if there is one whenever every value is known.
    fn find_truth(&mut self, node: &GuardNode) -> Option<bool> {
        match &node.kind {
            GuardNodeKind::Truth(truth) => Some(*truth),
            GuardNodeKind::Not(inner) => self.find_truth(inner).map(|truth| !truth),
            GuardNodeKind::Binary(
                operator @ (GuardOperator::And | GuardOperator::Or),
                left,
                right,
            ) => {
                let absorbing = *operator == GuardOperator::Or;
                let (left, right) = (self.find_truth(left), self.find_truth(right));
                if left == Some(absorbing) || right == Some(absorbing) {
                    return Some(absorbing);
                }
                if let Some(constant) = left.and(right) {
                    return Some(constant);
                }
                let name = deciding_name(node, *operator, self.meanings)?;
                self.report_decided(node, absorbing, name);
                Some(absorbing)
            }
            GuardNodeKind::Binary(operator, left, right)
                if operator.is_comparison() && left.has_name() && left.is_same(right) =>
            {
                let truth = matches!(
                    operator,
                    GuardOperator::LessOrEqual
                        | GuardOperator::GreaterOrEqual
                        | GuardOperator::Equal
                );
                self.report_same(node, truth);
                Some(truth)
            }
            GuardNodeKind::Binary(operator, left, right) if operator.is_comparison() => {
                let truth =
                    compare_ranges(*operator, self.find_range(left), self.find_range(right))?;
                let mut names = Vec::new();
                self.describe_domains(left, &mut names);
                self.describe_domains(right, &mut names);
                self.report_constant(
                    node,
                    truth,
                    names.join(", "),
                    self.guess_percent(left, right),
                );
                Some(truth)
            }
            _ => None,
        }
    }

    /// Least and greatest value of a number.
    fn find_range(&self, node: &GuardNode) -> (f64, f64) {
        let (low, high) = match &node.kind {
            GuardNodeKind::Number(value, unit) => {
                let si = value * unit.map_or(1.0, |unit| unit.to_si);
                (si, si)
            }
            GuardNodeKind::Name(index) => {
                self.meanings.get(*index).map_or(ANY, |meaning| meaning.within)
            }
            GuardNodeKind::Minus(inner) => {
                let (low, high) = self.find_range(inner);
                (-high, -low)
            }
            GuardNodeKind::Binary(operator, left, right) => {
                combine_ranges(*operator, self.find_range(left), self.find_range(right))
            }
            _ => ANY,
        };
        if low.is_nan() || high.is_nan() { ANY } else { (low, high) }
    }

    fn describe_domains(&self, node: &GuardNode, out: &mut Vec<String>) {
        match &node.kind {
            GuardNodeKind::Name(index) => {
                if let Some(meaning) = self.meanings.get(*index) {
                    out.push(format!("{} is {}", self.guard.names[*index], meaning.domain));
                }
            }
            GuardNodeKind::Not(inner) | GuardNodeKind::Minus(inner) => {
                self.describe_domains(inner, out);
            }
            GuardNodeKind::Binary(_, left, right) => {
                self.describe_domains(left, out);
                self.describe_domains(right, out);
            }
            _ => {}
        }
    }

    /// Reports a chain of conditions that the name at this index decides.
    fn report_decided(&mut self, node: &GuardNode, truth: bool, name: usize) {
        let text = self.text_of(node);
        let name = &self.guard.names[name];
        let (why, remedy) = if truth {
            (
                format!("every value of {name} satisfies one of its conditions"),
                "remove it, or change one of the conditions",
            )
        } else {
            (
                format!("no value of {name} satisfies all its conditions"),
                "what depends on it never happens; change one of the conditions, or write or between them",
            )
        };
        let message = format!("`{text}` is always {truth}: {why}");
        self.report_problem(node, message, remedy);
    }

    /// Returns the number with a percent sign, if it is written without one and compared with a
    /// fraction of one.
    fn guess_percent(&self, left: &GuardNode, right: &GuardNode) -> Option<String> {
        [(left, right), (right, left)].into_iter().find_map(|(number, other)| {
            let GuardNodeKind::Number(value, None) = number.kind else { return None };
            let (low, high) = self.find_range(other);
            // A counter counts whole things, not percent.
            let is_fraction = low >= 0.0 && high <= 1.0 && self.is_measured(other);
            (is_fraction && value > 1.0 && value <= 100.0).then(|| format!("{value}%"))
        })
    }

    fn is_measured(&self, node: &GuardNode) -> bool {
        match &node.kind {
            GuardNodeKind::Name(index) => {
                self.meanings.get(*index).is_some_and(|meaning| meaning.is_measured)
            }
            GuardNodeKind::Not(inner) | GuardNodeKind::Minus(inner) => self.is_measured(inner),
            GuardNodeKind::Binary(_, left, right) => {
                self.is_measured(left) || self.is_measured(right)
            }
            _ => false,
        }
    }

    /// Reports a comparison of something with itself.
    fn report_same(&mut self, node: &GuardNode, truth: bool) {
        let message =
            format!("`{}` is always {truth}: both sides are the same", self.text_of(node));
        self.report_problem(node, message, "compare it with something else");
    }

    /// Reports calculations whose result is fixed: divisions by a number that is always 0, where what
    /// is divided has no value, and something minus or divided by itself.
    fn report_fixed_values(&mut self, node: &GuardNode) {
        match &node.kind {
            GuardNodeKind::Not(inner) | GuardNodeKind::Minus(inner) => {
                self.report_fixed_values(inner);
            }
            GuardNodeKind::Binary(operator, left, right) => {
                let is_same = left.has_name() && left.is_same(right);
                let (what, remedy) = match operator {
                    GuardOperator::By if self.find_range(right) == (0.0, 0.0) => {
                        ("has no value: it is divided by 0", "divide by another number")
                    }
                    GuardOperator::By if is_same => {
                        ("is always 1: both sides are the same", "divide by something else")
                    }
                    GuardOperator::Minus if is_same => {
                        ("is always 0: both sides are the same", "subtract something else")
                    }
                    _ => {
                        self.report_fixed_values(left);
                        self.report_fixed_values(right);
                        return;
                    }
                };
                let message = format!("`{}` {what}", self.text_of(node));
                self.report_problem(node, message, remedy);
            }
            _ => {}
        }
    }

    fn report_constant(
        &mut self,
        node: &GuardNode,
        truth: bool,
        why: String,
        meant: Option<String>,
    ) {
        let text = self.text_of(node);
        let is_whole = node.at == self.guard.root.at;
        let remedy = match (truth, why.is_empty()) {
            (true, false) => "remove it, or compare with a value within the domain",
            (false, false) => {
                "what depends on it never happens; compare with a value within the domain"
            }
            (true, true) => "remove it, or name data or a variable in it",
            (false, true) if is_whole => {
                "the transition never fires: write a condition with data or a variable, or remove the \
                 transition"
            }
            (false, true) => "name data or a variable in it, or remove it",
        };
        let remedy = match meant {
            Some(meant) => format!("did you mean {meant}? Otherwise {remedy}"),
            None => remedy.to_owned(),
        };
        let message = match (&node.kind, why.is_empty()) {
            (GuardNodeKind::Truth(_), _) if is_whole => format!("this guard is always {truth}"),
            (_, true) => format!("`{text}` is always {truth}: it contains no value that changes"),
            (_, false) => format!("`{text}` is always {truth}: {why}"),
        };
        self.report_problem(node, message, remedy);
    }

    fn text_of(&self, node: &GuardNode) -> &str {
        self.text.get(node.at.clone()).unwrap_or_default()
    }

    fn report_problem(&mut self, node: &GuardNode, message: String, remedy: impl Into<String>) {
        let (code, at) = (Code::GuardConstant, node.at.clone());
        self.problems.push(GuardProblem { code, at, message, remedy: remedy.into() });
    }
}

const ANY: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

fn combine_ranges(operator: GuardOperator, left: (f64, f64), right: (f64, f64)) -> (f64, f64) {
    let span = |values: [f64; 4]| {
        if values.iter().any(|value| value.is_nan()) {
            return ANY;
        }
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        })
    };
    match operator {
        GuardOperator::Plus => (left.0 + right.0, left.1 + right.1),
        GuardOperator::Minus => (left.0 - right.1, left.1 - right.0),
        GuardOperator::Times => {
            span([left.0 * right.0, left.0 * right.1, left.1 * right.0, left.1 * right.1])
        }
        GuardOperator::By if right.0 > 0.0 || right.1 < 0.0 => {
            span([left.0 / right.0, left.0 / right.1, left.1 / right.0, left.1 / right.1])
        }
        _ => ANY,
    }
}

fn compare_ranges(operator: GuardOperator, left: (f64, f64), right: (f64, f64)) -> Option<bool> {
    let (never, always) = match operator {
        GuardOperator::Less => (left.0 >= right.1, left.1 < right.0),
        GuardOperator::LessOrEqual => (left.0 > right.1, left.1 <= right.0),
        GuardOperator::Greater => (left.1 <= right.0, left.0 > right.1),
        GuardOperator::GreaterOrEqual => (left.1 < right.0, left.0 >= right.1),
        GuardOperator::Equal | GuardOperator::Unequal => {
            let apart = left.1 < right.0 || right.1 < left.0;
            let one = left.0 == left.1 && left == right;
            let is_equal = if apart { Some(false) } else { one.then_some(true) };
            return is_equal.map(|equal| equal == (operator == GuardOperator::Equal));
        }
        _ => return None,
    };
    if never { Some(false) } else { always.then_some(true) }
}
