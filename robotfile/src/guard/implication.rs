//! Whether one condition is true whenever another one is: a guard that another one implies, and parts of
//! one guard that change nothing in it.

use std::collections::BTreeMap;

use crate::code::Code;
use crate::guard::contradiction::restrict;
use crate::guard::meaning::GuardProblem;
use crate::guard::node::{Guard, GuardNode, GuardNodeKind, GuardOperator};

/// Most combinations of conditions that are looked at: each `or` in an `and` multiplies them.
const MAX_TERMS: usize = 64;
/// Most conditions of one chain that are compared with each other.
const MAX_CHAIN: usize = 32;

/// A condition that must be true, or false.
type Literal<'a> = (&'a GuardNode, bool);

/// Returns whether `other` is certainly true whenever `one` is. It names nothing that `one` does not name,
/// whose value may be unknown.
pub(crate) fn implies(one: &Guard, other: &Guard) -> bool {
    let index = |name: &crate::guard::Name| {
        one.names.iter().position(|known| known.as_str() == name.as_str())
    };
    let Some(indices) = other.names.iter().map(index).collect::<Option<Vec<_>>>() else {
        return false;
    };
    let other = renumber(&other.root, &indices);
    let (Some(ones), Some(others)) = (find_terms(&one.root, false), find_terms(&other, true))
    else {
        return false;
    };
    // One that is never true implies everything, and is a finding of its own.
    let is_never_true = ones.iter().all(|term| is_contradictory(term));
    if ones.len() * others.len() > MAX_TERMS || is_never_true {
        return false;
    }
    let mut both =
        ones.iter().flat_map(|one| others.iter().map(move |other| [&one[..], other].concat()));
    both.all(|term| is_contradictory(&term))
}

/// Returns a finding for each condition of an `and` or `or` that another one of it implies, so that it
/// changes nothing.
pub(super) fn redundant(guard: &Guard, text: &str) -> Vec<GuardProblem> {
    let mut problems = Vec::new();
    find_redundant(&guard.root, text, &mut problems);
    problems
}

fn find_redundant(node: &GuardNode, text: &str, problems: &mut Vec<GuardProblem>) {
    match &node.kind {
        GuardNodeKind::Not(inner) => find_redundant(inner, text, problems),
        GuardNodeKind::Binary(operator @ (GuardOperator::And | GuardOperator::Or), ..) => {
            let mut chain = Vec::new();
            collect_chain(node, *operator, &mut chain);
            if chain.len() <= MAX_CHAIN {
                report_chain(&chain, *operator, text, problems);
            }
            for part in chain {
                find_redundant(part, text, problems);
            }
        }
        _ => {}
    }
}

fn collect_chain<'a>(node: &'a GuardNode, operator: GuardOperator, chain: &mut Vec<&'a GuardNode>) {
    match &node.kind {
        GuardNodeKind::Binary(own, left, right) if *own == operator => {
            collect_chain(left, operator, chain);
            collect_chain(right, operator, chain);
        }
        _ => chain.push(node),
    }
}

/// Reports the first comparison of the chain that another one makes redundant.
fn report_chain(
    chain: &[&GuardNode],
    operator: GuardOperator,
    text: &str,
    problems: &mut Vec<GuardProblem>,
) {
    let text_of = |node: &GuardNode| text.get(node.at.clone()).unwrap_or_default();
    let leaf_implies = |one: &GuardNode, other: &GuardNode| {
        is_comparison(one)
            && is_comparison(other)
            && is_contradictory(&[(one, false), (other, true)])
    };
    for (number, part) in chain.iter().enumerate().rev() {
        let others = chain.iter().enumerate().filter(|(other, _)| *other != number);
        let mut makes_redundant = others.filter(|(_, other)| match operator {
            GuardOperator::And => leaf_implies(other, part),
            _ => leaf_implies(part, other),
        });
        let Some((_, other)) = makes_redundant.next() else { continue };
        let (own, other) = (text_of(part), text_of(other));
        let why = match operator {
            GuardOperator::And => format!("it is true whenever `{other}` is"),
            _ => format!("whenever it is true, `{other}` is true, too"),
        };
        problems.push(GuardProblem {
            code: Code::ConditionImplied,
            at: part.at.clone(),
            message: format!("`{own}` changes nothing: {why}"),
            remedy: "change one of the two conditions, or remove this one".into(),
        });
        return;
    }
}

fn is_comparison(node: &GuardNode) -> bool {
    matches!(&node.kind, GuardNodeKind::Binary(operator, ..) if operator.is_comparison())
}

/// The tree with other numbers for its names.
fn renumber(node: &GuardNode, indices: &[usize]) -> GuardNode {
    let boxed = |inner: &GuardNode| Box::new(renumber(inner, indices));
    let kind = match &node.kind {
        GuardNodeKind::Name(index) => GuardNodeKind::Name(indices[*index]),
        GuardNodeKind::Known(index) => GuardNodeKind::Known(indices[*index]),
        GuardNodeKind::Not(inner) => GuardNodeKind::Not(boxed(inner)),
        GuardNodeKind::Minus(inner) => GuardNodeKind::Minus(boxed(inner)),
        GuardNodeKind::Binary(operator, left, right) => {
            GuardNodeKind::Binary(*operator, boxed(left), boxed(right))
        }
        other => other.clone(),
    };
    GuardNode { kind, at: node.at.clone() }
}

/// Returns the terms of a condition, or of its negation: it is true if all literals of one term are. None
/// if they are too many.
fn find_terms(node: &GuardNode, is_negated: bool) -> Option<Vec<Vec<Literal<'_>>>> {
    let terms = match &node.kind {
        GuardNodeKind::Not(inner) => find_terms(inner, !is_negated)?,
        GuardNodeKind::Binary(operator @ (GuardOperator::And | GuardOperator::Or), left, right) => {
            let (left, right) = (find_terms(left, is_negated)?, find_terms(right, is_negated)?);
            let is_product = (*operator == GuardOperator::And) != is_negated;
            if !is_product {
                left.into_iter().chain(right).collect()
            } else if left.len() * right.len() > MAX_TERMS {
                return None;
            } else {
                let both = |one| right.iter().map(move |other: &Vec<_>| [one, &other[..]].concat());
                left.iter().flat_map(|one| both(&one[..])).collect()
            }
        }
        _ => vec![vec![(node, is_negated)]],
    };
    (terms.len() <= MAX_TERMS).then_some(terms)
}

/// Whether no values make all of these true.
fn is_contradictory(term: &[Literal<'_>]) -> bool {
    let mut values = BTreeMap::new();
    let excluded = term.iter().any(|(node, is_negated)| match node.kind {
        GuardNodeKind::Truth(truth) => truth == *is_negated,
        _ => restrict(node, *is_negated, &[], &mut values).is_some(),
    });
    let opposes = |(node, is_negated): &Literal<'_>| {
        term.iter().any(|(other, other_negated)| is_negated != other_negated && node.is_same(other))
    };
    excluded || term.iter().any(opposes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_implied(one: &str, other: &str) -> bool {
        let parse = |text| Guard::parse(text).expect("a guard");
        implies(&parse(one), &parse(other))
    }

    #[test]
    fn a_condition_implies_what_is_true_whenever_it_is() {
        for (one, other) in [
            ("a < 2", "a < 3"),
            ("a < 2", "a <= 2"),
            ("a == 2", "a >= 2"),
            ("a > 3 and b", "a > 2"),
            ("t < 2 and b < 40%", "t == 2 or b <= 40%"),
            ("a", "not not a"),
            ("a < 1 or a > 5", "a != 3"),
            ("s == 'x'", "s != 'y'"),
            ("a + b > 2 and c", "a + b > 2"),
            ("not (a > 2 or b)", "a <= 2"),
            ("20 cm > x.y.z", "x.y.z < 1m"),
        ] {
            assert!(is_implied(one, other), "{one} -> {other}");
        }
        for (one, other) in [
            ("a < 3", "a < 2"),
            ("a <= 2", "a < 2"),
            ("a > 2", "a > 2 and b"),
            ("a < 2", "b < 2"),
            ("a < 2", "a < 2 or b < 2"),
            ("a + b > 2", "a + b > 1"),
            ("a or b", "a"),
            ("a > 3 and a < 2", "a == 0"),
        ] {
            assert!(!is_implied(one, other), "{one} -> {other}");
        }
    }

    #[test]
    fn many_alternatives_are_not_looked_at() {
        let alternatives = |name: &str| format!("({name} == 1 or {name} == 2 or {name} == 3)");
        let names = ["a", "b", "c", "d", "e", "f"];
        let text = names.map(alternatives).join(" and ");
        assert!(!is_implied(&text, &text));
    }
}
