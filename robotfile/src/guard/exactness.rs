//! Comparisons with `==` and `!=` of a measured value with a fraction: a measurement is almost never
//! exactly that number. Two comparisons with one number may amount to the same.

use crate::code::Code;
use crate::guard::meaning::{GuardProblem, Meaning};
use crate::guard::node::{Guard, GuardNode, GuardNodeKind, GuardOperator};

/// Returns a finding for each such comparison. An end of the domain is exact: what is outside is
/// moved there.
pub(super) fn inexact(guard: &Guard, text: &str, meanings: &[Meaning]) -> Vec<GuardProblem> {
    let mut problems = Vec::new();
    find_inexact(&guard.root, text, meanings, &mut problems);
    problems
}

fn find_inexact(
    node: &GuardNode,
    text: &str,
    meanings: &[Meaning],
    problems: &mut Vec<GuardProblem>,
) {
    let GuardNodeKind::Binary(operator, left, right) = &node.kind else {
        if let GuardNodeKind::Not(inner) = &node.kind {
            find_inexact(inner, text, meanings, problems);
        }
        return;
    };
    let outcome = match operator {
        GuardOperator::And | GuardOperator::Or => {
            if let Some(constant) = single_number(*operator, left, right) {
                report_single(*operator, node, (left, constant), text, meanings, problems);
                return;
            }
            find_inexact(left, text, meanings, problems);
            find_inexact(right, text, meanings, problems);
            return;
        }
        GuardOperator::Equal => "false",
        GuardOperator::Unequal => "true",
        _ => return,
    };
    for (value, constant) in [(left, right), (right, left)] {
        let Some(number) = fraction(constant) else { continue };
        if !is_measured(value, number, meanings) {
            continue;
        }
        let remedy = "compare with <, <=, > or >=; for a range, with both ends";
        problems.push(describe_inexact(node, constant, outcome, text, remedy));
    }
}

/// Returns the constant for which `x < 40% or x > 40%` is false, or `x <= 40% and x >= 40%` is true.
fn single_number<'a>(
    operator: GuardOperator,
    left: &'a GuardNode,
    right: &'a GuardNode,
) -> Option<&'a GuardNode> {
    use GuardOperator::{Greater, GreaterOrEqual, Less, LessOrEqual};
    let (GuardNodeKind::Binary(first, one, number), GuardNodeKind::Binary(second, other, same)) =
        (&left.kind, &right.kind)
    else {
        return None;
    };
    let excludes = match operator {
        GuardOperator::Or => matches!((first, second), (Less, Greater) | (Greater, Less)),
        _ => {
            matches!((first, second), (LessOrEqual, GreaterOrEqual) | (GreaterOrEqual, LessOrEqual))
        }
    };
    (excludes && one.is_same(other) && fraction(number)? == fraction(same)?).then_some(number)
}

fn report_single(
    operator: GuardOperator,
    node: &GuardNode,
    (left, constant): (&GuardNode, &GuardNode),
    text: &str,
    meanings: &[Meaning],
    problems: &mut Vec<GuardProblem>,
) {
    let GuardNodeKind::Binary(_, value, _) = &left.kind else { return };
    if !fraction(constant).is_some_and(|number| is_measured(value, number, meanings)) {
        return;
    }
    let outcome = if operator == GuardOperator::Or { "true" } else { "false" };
    let remedy = "write one of the two comparisons, or another number in one of them";
    problems.push(describe_inexact(node, constant, outcome, text, remedy));
}

fn describe_inexact(
    node: &GuardNode,
    constant: &GuardNode,
    outcome: &str,
    text: &str,
    remedy: &str,
) -> GuardProblem {
    let part = |node: &GuardNode| text.get(node.at.clone()).unwrap_or_default();
    GuardProblem {
        code: Code::InexactEqual,
        at: node.at.clone(),
        message: format!(
            "`{}` is almost always {outcome}: a measured value is rarely exactly {}",
            part(node),
            part(constant)
        ),
        remedy: remedy.into(),
    }
}

/// The number that is written there, if it is not a whole one.
fn fraction(node: &GuardNode) -> Option<f64> {
    match &node.kind {
        GuardNodeKind::Number(value, unit) => {
            let si = value * unit.map_or(1.0, |unit| unit.to_si);
            (si.fract() != 0.0).then_some(si)
        }
        GuardNodeKind::Minus(inner) => fraction(inner).map(|number| -number),
        _ => None,
    }
}

/// Whether a measured value is part of it, and `number` is not an end of its domain.
fn is_measured(node: &GuardNode, number: f64, meanings: &[Meaning]) -> bool {
    match &node.kind {
        GuardNodeKind::Name(index) => meanings.get(*index).is_some_and(|meaning| {
            meaning.is_measured && ![meaning.within.0, meaning.within.1].contains(&number)
        }),
        GuardNodeKind::Minus(inner) => is_measured(inner, -number, meanings),
        GuardNodeKind::Binary(_, left, right) => {
            is_measured(left, number, meanings) || is_measured(right, number, meanings)
        }
        _ => false,
    }
}
