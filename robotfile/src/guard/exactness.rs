//! Comparisons with `==` and `!=` of a measured value with a fraction: a measurement is almost never
//! exactly that number.

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
        let part = |node: &GuardNode| text.get(node.at.clone()).unwrap_or_default();
        problems.push(GuardProblem {
            code: Code::InexactEqual,
            at: node.at.clone(),
            message: format!(
                "`{}` is almost always {outcome}: a measured value is rarely exactly {}",
                part(node),
                part(constant)
            ),
            remedy: "compare with <, <=, > or >=; for a range, with both ends".into(),
        });
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
