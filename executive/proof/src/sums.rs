//! What sums of tokens that no firing changes exclude: no state is looked at for it.

use armor_petri::analysis::invariants::{Semiflow, Semiflows};
use armor_petri::{Net, PlaceId};

use crate::formula::PlaceFormula;

/// Alternatives of a formula that are looked at one by one.
const MAX_ALTERNATIVES: usize = 256;

/// A count of tokens that is at least so many.
type TokenCount = (Vec<(PlaceId, i64)>, i64);

/// Whether some sum excludes each alternative of the formula.
pub(super) fn exclude(sums: &Semiflows<PlaceId>, net: &Net, formula: &PlaceFormula) -> bool {
    let Some(alternatives) = alternatives(formula) else { return false };
    let is_excluded = |counts: &Vec<TokenCount>| {
        counts.iter().any(|count| decide_never(count) || is_beyond(sums, net, count))
            || sums.semiflows.iter().any(|flow| excludes(flow, net, counts))
    };
    alternatives.iter().all(is_excluded)
}

/// Whether each alternative of the formula asks for tokens in two places that are never marked
/// together.
pub(super) fn are_apart(
    formula: &PlaceFormula,
    are_apart: &dyn Fn(PlaceId, PlaceId) -> bool,
) -> bool {
    let Some(alternatives) = alternatives(formula) else { return false };
    let find_place = |count: &TokenCount| match count.0.as_slice() {
        [(place, weight)] if *weight > 0 && count.1 > 0 => Some(*place),
        _ => None,
    };
    alternatives.iter().all(|counts| {
        let places: Vec<_> = counts.iter().filter_map(find_place).collect();
        let mut pairs = places.iter().flat_map(|one| places.iter().map(move |other| (one, other)));
        pairs.any(|(one, other)| one != other && are_apart(*one, *other))
    })
}

/// The formula as alternatives, each of counts that all hold; none if they are too many.
fn alternatives(formula: &PlaceFormula) -> Option<Vec<Vec<TokenCount>>> {
    let found = match formula {
        PlaceFormula::AtLeast(counts, least) => vec![vec![(counts.clone(), *least)]],
        PlaceFormula::Any(parts) => {
            let parts: Option<Vec<_>> = parts.iter().map(alternatives).collect();
            parts?.into_iter().flatten().collect()
        }
        PlaceFormula::All(parts) => {
            let mut product = vec![Vec::new()];
            for part in parts {
                let part = alternatives(part)?;
                if product.len() * part.len() > MAX_ALTERNATIVES {
                    return None;
                }
                let join =
                    |one: &Vec<TokenCount>, two: &Vec<TokenCount>| [one.as_slice(), two].concat();
                product =
                    product.iter().flat_map(|one| part.iter().map(|two| join(one, two))).collect();
            }
            product
        }
    };
    (found.len() <= MAX_ALTERNATIVES).then_some(found)
}

/// Whether no tokens at all make it so many.
fn decide_never((counts, least): &TokenCount) -> bool {
    *least > 0 && counts.iter().all(|(_, count)| *count <= 0)
}

/// Whether several sums together leave less to the places of a count than it asks for.
fn is_beyond(sums: &Semiflows<PlaceId>, net: &Net, (counts, least): &TokenCount) -> bool {
    if counts.iter().any(|(_, count)| *count != 1) {
        return false;
    }
    let mut open: Vec<PlaceId> = counts.iter().map(|(place, _)| *place).collect();
    let mut most = 0;
    for flow in &sums.semiflows {
        let is_open = |weighed: &&(PlaceId, u64)| open.contains(&weighed.0);
        let within: Vec<_> = flow.weights.iter().filter(is_open).collect();
        if let Some(lightest) = within.iter().map(|(_, weight)| *weight).min() {
            most += total(flow, net) / i128::from(lightest);
            open.retain(|place| !within.iter().any(|weighed| weighed.0 == *place));
        }
    }
    open.is_empty() && most < i128::from(*least)
}

/// The tokens of a sum, weighed: the same in every marking.
fn total(flow: &Semiflow<PlaceId>, net: &Net) -> i128 {
    let tokens = |place: &PlaceId| i128::from(net.initial()[place.index()]);
    flow.weights.iter().map(|(place, weight)| i128::from(*weight) * tokens(place)).sum()
}

/// Whether the counts together ask for more of the sum than there is, or leave less than there is.
fn excludes(flow: &Semiflow<PlaceId>, net: &Net, counts: &[TokenCount]) -> bool {
    let weight = |place: &PlaceId| {
        flow.weights
            .iter()
            .find(|weighed| weighed.0 == *place)
            .map_or(0, |weighed| i128::from(weighed.1))
    };
    let sum = total(flow, net);
    // What is asked for: counts of different places add up.
    let mut taken: Vec<PlaceId> = Vec::new();
    let mut asked = 0;
    for (counts, least) in counts {
        let is_plain = counts.iter().all(|(place, count)| *count == 1 && !taken.contains(place));
        if is_plain && *least > 0 {
            let lightest = counts.iter().map(|(place, _)| weight(place)).min().unwrap_or(0);
            asked += lightest * i128::from(*least);
            taken.extend(counts.iter().map(|(place, _)| *place));
        }
    }
    // What is left: counts that say "at most" and have all places of the sum among them.
    let at_most: Vec<_> =
        counts.iter().filter(|(counts, _)| counts.iter().all(|(_, count)| *count == -1)).collect();
    let is_counted = |place| at_most.iter().any(|(counts, _)| counts.contains(&(place, -1)));
    let heaviest =
        |counts: &[(PlaceId, i64)]| counts.iter().map(|(p, _)| weight(p)).max().unwrap_or(0);
    let left: i128 =
        at_most.iter().map(|(counts, least)| heaviest(counts) * i128::from(-least)).sum();
    let is_covered = flow.weights.iter().all(|(place, _)| is_counted(*place));
    asked > sum || is_covered && left < sum
}
