//! Unbounded places, shown by a pumping sequence: firings that can repeat for ever and add tokens
//! each time (Karp and Miller, 1969).

use super::rules::FiringRules;
use super::space::Space;
use crate::net::{Net, PlaceId, TransitionId};

/// After `prefix`, `cycle` can repeat for ever, and adds tokens to `growing` each time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PumpingSequence {
    /// Firings from the initial marking.
    pub prefix: Vec<TransitionId>,
    /// Firings that can repeat.
    pub cycle: Vec<TransitionId>,
    /// The places that gain tokens each time.
    pub growing: Vec<PlaceId>,
}

impl PumpingSequence {
    /// Returns these firings as a pumping sequence, if they are one.
    ///
    /// More tokens keep every transition enabled except through inhibitor arcs, and the same
    /// firings add as much again except through reset arcs. So no place that has grown may inhibit
    /// a transition of the cycle, and at least one of them must not be reset in it.
    pub fn new(
        rules: &FiringRules,
        initial: &[u32],
        prefix: Vec<TransitionId>,
        cycle: Vec<TransitionId>,
    ) -> Option<Self> {
        let before = rules.play(initial, &prefix)?;
        let after = rules.play(&before, &cycle)?;
        let growing = grown_places(rules, &before, &after, &cycle)?;
        Some(Self { prefix, cycle, growing })
    }

    /// Leaves out firings as long as the rest is still a pumping sequence.
    fn shorten(mut self, rules: &FiringRules, initial: &[u32]) -> Self {
        for cyclic in [true, false] {
            let mut piece = if cyclic { self.cycle.len() } else { self.prefix.len() };
            while piece > 0 {
                let mut start = 0;
                while start < if cyclic { self.cycle.len() } else { self.prefix.len() } {
                    let mut shorter = (self.prefix.clone(), self.cycle.clone());
                    let part = if cyclic { &mut shorter.1 } else { &mut shorter.0 };
                    part.drain(start..(start + piece).min(part.len()));
                    let pumping = Some(shorter).filter(|(_, cycle)| !cycle.is_empty());
                    match pumping.and_then(|(p, c)| Self::new(rules, initial, p, c)) {
                        Some(shorter) => self = shorter,
                        None => start += piece,
                    }
                }
                piece /= 2;
            }
        }
        self
    }
}

/// Returns the places that grow without bound when `cycle`, which leads from `before` to `after`,
/// is repeated; `None` if there are none.
fn grown_places(
    rules: &FiringRules,
    before: &[u32],
    after: &[u32],
    cycle: &[TransitionId],
) -> Option<Vec<PlaceId>> {
    if before.iter().zip(after).any(|(before, after)| before > after) {
        return None;
    }
    let more = |place: u32| after[place as usize] > before[place as usize];
    let fired = || cycle.iter().map(|id| rules.rule(id.0));
    if fired().flat_map(|rule| &rule.below).any(|(place, _)| more(*place)) {
        return None;
    }
    let reset: Vec<u32> = fired().flat_map(|rule| &rule.reset_to).map(|reset| reset.0).collect();
    let growing: Vec<_> = (0..before.len() as u32)
        .filter(|place| more(*place) && !reset.contains(place))
        .map(PlaceId)
        .collect();
    if growing.is_empty() { None } else { Some(growing) }
}

/// Walks made before the enumeration, which find most unbounded nets in a fraction of its time.
const WALKS: u64 = 12;
/// Firings per walk.
const WALK_STEPS: usize = 400;
/// Most comparisons of two numbers in all walks: a fraction of a second.
const COMPARISONS: u64 = 40_000_000;

/// Looks for a pumping sequence on a few pseudo-random walks, the same in every run. `None` does
/// not mean that the net is bounded.
pub fn pumping_on_walks(net: &Net) -> Option<PumpingSequence> {
    let rules = FiringRules::new(net);
    let mut comparisons = COMPARISONS;
    (0..WALKS).find_map(|walk| {
        let (prefix, cycle) = walk_until_covering(net, &rules, walk, &mut comparisons)?;
        let pumping = PumpingSequence::new(&rules, net.initial(), prefix, cycle)?;
        Some(pumping.shorten(&rules, net.initial()))
    })
}

/// Returns prefix and cycle of the first growth on a walk.
fn walk_until_covering(
    net: &Net,
    rules: &FiringRules,
    walk: u64,
    comparisons: &mut u64,
) -> Option<(Vec<TransitionId>, Vec<TransitionId>)> {
    // A linear congruential generator (Knuth's MMIX constants) rather than a crate's: reports quote
    // the sequence found, which must not change with a crate's version.
    let mut chance = 0x9e37_79b9_7f4a_7c15u64.wrapping_mul(walk + 1);
    let mut markings = vec![net.initial().to_vec()];
    let mut fired: Vec<TransitionId> = Vec::new();
    for _ in 0..WALK_STEPS {
        let marking = markings.last().expect("the walk begins with the initial marking");
        let mut enabled = Vec::new();
        rules.for_each_enabled(marking, |transition| enabled.push(transition));
        enabled.sort_unstable();
        // Every other walk prefers transitions that add tokens.
        if walk % 2 == 1 {
            let gain = |t: &u32| rules.rule(*t).change.iter().map(|c| c.1).sum::<i64>();
            let best = enabled.iter().map(gain).max().unwrap_or(0);
            if best > 0 {
                enabled.retain(|transition| gain(transition) == best);
            }
        }
        chance = chance.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
        let choice = (chance >> 33) as usize % enabled.len().max(1);
        let transition = TransitionId(*enabled.get(choice)?);
        let mut after = marking.clone();
        rules.fire(&mut after, transition)?;
        fired.push(transition);
        for (start, before) in markings.iter().enumerate().rev() {
            *comparisons = comparisons.checked_sub(before.len() as u64)?;
            if grown_places(rules, before, &after, &fired[start..]).is_some() {
                return Some((fired[..start].to_vec(), fired[start..].to_vec()));
            }
        }
        markings.push(after);
    }
    None
}

/// Most states of a path that are compared pairwise: the last ones.
const PATH_STATES: usize = 3000;
/// Most numbers that are compared for that: a fraction of a second.
const PATH_COMPARISONS: usize = 200_000_000;

/// Looks for growth between any two states on the path to `state`. Called whenever a place has
/// doubled, it eventually finds the growth of an unbounded net without inhibitor and reset arcs:
/// every infinite path has two markings of which the later covers the earlier.
pub(super) fn pumping_on_path(space: &Space, state: u32) -> Option<PumpingSequence> {
    let mut states = space.states_on_path(state)?;
    let places = space.most_in_place.len().max(1);
    let compared = (PATH_COMPARISONS / places).isqrt().clamp(10, PATH_STATES);
    let skipped = states.len().saturating_sub(compared);
    let head = states[..=skipped].to_vec();
    states.drain(..skipped);
    let markings: Vec<_> = states.iter().map(|state| space.marking(*state)).collect();
    let fired = |states: &[u32]| -> Vec<TransitionId> {
        states.windows(2).map(|step| space.between(step[0], step[1])).collect()
    };
    for (end, after) in markings.iter().enumerate() {
        for (start, before) in markings[..end].iter().enumerate() {
            if before.iter().zip(after).all(|(before, after)| before <= after) {
                let mut prefix = fired(&head);
                prefix.extend(fired(&states[..=start]));
                let cycle = fired(&states[start..=end]);
                let initial = space.marking(0);
                if let Some(pumping) = PumpingSequence::new(&space.rules, &initial, prefix, cycle) {
                    return Some(pumping.shorten(&space.rules, &initial));
                }
            }
        }
    }
    None
}
