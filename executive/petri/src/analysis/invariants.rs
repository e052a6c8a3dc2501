//! Semiflows of minimal support, in integers: weighted sums of tokens that no firing changes
//! (places), and counts of firings that together change nothing (transitions). The sums give bounds
//! of places, and pairs of places that are never marked together, without enumerating states.

use super::elimination::{EliminationLimits, Solutions, solve_by_elimination};
use super::rules::FiringRules;
use crate::net::{Net, PlaceId, TransitionId};

/// Weights of places or transitions, each positive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Semiflow<Id> {
    /// Each place or transition with its weight, in order.
    pub weights: Vec<(Id, u64)>,
}

/// Semiflows of minimal support.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Semiflows<Id> {
    /// The semiflows found.
    pub semiflows: Vec<Semiflow<Id>>,
    /// Whether these are all. There can be exponentially many, so the search has a limit.
    pub complete: bool,
}

/// Most rows of the elimination.
const ROWS: usize = 20_000;
/// Most additions and comparisons: a few seconds.
const STEPS: u64 = 100_000_000;
/// The same limit for the search of bounds, which only make states smaller.
const STEPS_FOR_BOUNDS: u64 = 5_000_000;

/// Returns the sums of tokens that no firing changes: `y·C = 0`. Places with a reset arc are in
/// none.
pub fn place_semiflows(net: &Net, stop: &dyn Fn() -> bool) -> Semiflows<PlaceId> {
    let rules = FiringRules::new(net);
    let mut matrix = place_rows(net, &rules);
    for (place, _) in rules.all_rules().iter().flat_map(|rule| &rule.reset_to) {
        matrix[*place as usize] = None;
    }
    minimal_semiflows(matrix, net.transitions().len(), PlaceId, stop)
}

/// Returns the counts of firings that restore the marking: `C·x = 0`. Transitions with reset arcs
/// are in none. The firings need not be possible.
pub fn transition_semiflows(net: &Net, stop: &dyn Fn() -> bool) -> Semiflows<TransitionId> {
    let rules = FiringRules::new(net);
    let row = |rule: &super::rules::Rule| rule.reset_to.is_empty().then(|| rule.change.clone());
    let matrix = rules.all_rules().iter().map(row).collect();
    minimal_semiflows(matrix, net.places().len(), TransitionId, stop)
}

/// Solves the matrix without its omitted rows, and returns weights under the original numbers.
fn minimal_semiflows<Id>(
    matrix: Vec<Option<Vec<(u32, i64)>>>,
    columns: usize,
    id: impl Fn(u32) -> Id,
    stop: &dyn Fn() -> bool,
) -> Semiflows<Id> {
    let variables: Vec<u32> =
        (0..matrix.len() as u32).filter(|variable| matrix[*variable as usize].is_some()).collect();
    let matrix: Vec<_> = matrix.into_iter().flatten().collect();
    let effort = EliminationLimits { rows: ROWS, steps: STEPS };
    let Solutions { mut solutions, complete } =
        solve_by_elimination(matrix, columns, u32::MAX, effort, stop);
    solutions.sort();
    let weigh = |weights: Vec<(u32, i64)>| {
        let own = weights.into_iter().map(|(v, weight)| (id(variables[v as usize]), weight as u64));
        Semiflow { weights: own.collect() }
    };
    Semiflows { semiflows: solutions.into_iter().map(weigh).collect(), complete }
}

fn place_rows(net: &Net, rules: &FiringRules) -> Vec<Option<Vec<(u32, i64)>>> {
    let mut matrix = vec![Some(Vec::new()); net.places().len()];
    for (transition, rule) in rules.all_rules().iter().enumerate() {
        for &(place, change) in &rule.change {
            if let Some(row) = &mut matrix[place as usize] {
                row.push((transition as u32, change));
            }
        }
    }
    matrix
}

/// Upper bounds on the tokens of each place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlaceBounds {
    most: Vec<Option<u64>>,
}

impl PlaceBounds {
    /// Returns no bound for any place.
    pub fn unknown(net: &Net) -> Self {
        Self { most: vec![None; net.places().len()] }
    }

    /// Returns bounds that are known from elsewhere, one for each place.
    pub fn known(most: Vec<Option<u64>>) -> Self {
        Self { most }
    }

    /// Computes bounds from sums that no firing increases: `y·C ≤ 0`. First the sums that stay the
    /// same; then, if places are left without a bound, those that may decrease. A reset only lowers
    /// a sum.
    pub fn of_net(net: &Net, stop: &dyn Fn() -> bool) -> Self {
        let rules = FiringRules::new(net);
        let mut bounds = Self::unknown(net);
        // A place that no transition fills never holds more than initially.
        let mut filled = vec![false; net.places().len()];
        for rule in rules.all_rules() {
            let growing = rule.change.iter().filter(|(_, change)| *change > 0).map(|c| c.0);
            let refilled = rule.reset_to.iter().filter(|(_, tokens)| *tokens > 0).map(|r| r.0);
            growing.chain(refilled).for_each(|place| filled[place as usize] = true);
        }
        for (place, _) in filled.iter().enumerate().filter(|(_, filled)| !**filled) {
            bounds.most[place] = Some(u64::from(net.initial()[place]));
        }
        let (matrix, columns) = (sub_rows(net), net.transitions().len());
        let places = matrix.len() as u32;
        let effort = EliminationLimits { rows: ROWS, steps: STEPS_FOR_BOUNDS };
        let equal = solve_by_elimination(matrix.clone(), columns, places, effort, stop);
        bounds.tighten(net, &equal.solutions);
        if !bounds.is_bounded() && !stop() {
            let slack = (0..columns as u32).map(|column| vec![(column, 1)]);
            let matrix = matrix.into_iter().chain(slack).collect();
            let falling = solve_by_elimination(matrix, columns, places, effort, stop);
            bounds.tighten(net, &falling.solutions);
        }
        bounds
    }

    fn tighten(&mut self, net: &Net, sums: &[Vec<(u32, i64)>]) {
        for weights in sums {
            let tokens = |place: u32| i128::from(net.initial()[place as usize]);
            let sum: i128 = weights.iter().map(|&(p, weight)| i128::from(weight) * tokens(p)).sum();
            for &(place, weight) in weights {
                let most = u64::try_from(sum / i128::from(weight)).unwrap_or(u64::MAX);
                let known = &mut self.most[place as usize];
                *known = Some(known.map_or(most, |known| known.min(most)));
            }
        }
    }

    /// Returns the bound of a place, if one is known.
    pub fn of(&self, place: usize) -> Option<u64> {
        self.most[place]
    }

    /// Returns whether every place has a known bound.
    pub fn is_bounded(&self) -> bool {
        self.most.iter().all(Option::is_some)
    }
}

/// Returns the change of each place by each transition, ignoring what resets remove.
fn sub_rows(net: &Net) -> Vec<Vec<(u32, i64)>> {
    let mut matrix = vec![Vec::new(); net.places().len()];
    for (transition, t) in net.transitions().iter().enumerate() {
        let taken = t.inputs.iter().map(|&(place, weight)| (place, -i64::from(weight)));
        let put = t.outputs.iter().map(|&(place, weight)| (place, i64::from(weight)));
        for (place, change) in taken.chain(put) {
            let row: &mut Vec<(u32, i64)> = &mut matrix[place.index()];
            match row.last_mut() {
                Some(last) if last.0 == transition as u32 => last.1 += change,
                _ => row.push((transition as u32, change)),
            }
        }
    }
    for row in &mut matrix {
        row.retain(|(_, change)| *change != 0);
    }
    matrix
}

/// Returns a sum that proves that two places are never marked together, if there is one.
pub fn excluding_sum<'a>(
    semiflows: &'a Semiflows<PlaceId>,
    net: &Net,
    one: PlaceId,
    other: PlaceId,
) -> Option<&'a Semiflow<PlaceId>> {
    semiflows.semiflows.iter().find(|flow| {
        let weight = |place| flow.weights.iter().find(|w| w.0 == place).map_or(0, |w| w.1);
        let sum: u128 =
            flow.weights.iter().map(|w| u128::from(w.1) * initial_tokens(net, w.0)).sum();
        let both = u128::from(weight(one)) + u128::from(weight(other));
        weight(one) > 0 && weight(other) > 0 && both > sum
    })
}

fn initial_tokens(net: &Net, place: PlaceId) -> u128 {
    u128::from(net.initial()[place.index()])
}
