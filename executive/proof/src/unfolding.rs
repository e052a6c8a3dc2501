//! The variables that transitions set, as places of the analysed net. One place of a pair holds as
//! many tokens as the variable is above its least value, the other as many as it is below its
//! greatest. A transition whose guard or values speak of variables is copied for each box of values
//! that they treat alike; the copy fires in its box, and moves tokens between the pairs.

use armor_petri::{NetBuilder, PlaceId, TransitionBuilder, TransitionId};
use armor_robotfile::guard::Scalar;

use armor_plan::Plan;
use armor_plan::{Operand, PlannedCounter, PlannedSet};

use crate::precedence::find_preceding;

/// Combinations of values that are looked at for one transition.
const MAX_COMBINATIONS: u64 = 65_536;
/// Copies in all.
const MAX_COPIES: usize = 16_384;

/// The copies of each transition.
#[derive(Clone, Debug)]
pub(super) struct Unfolding {
    /// Per transition of the plan.
    pub copies: Vec<Vec<Copy>>,
}

/// Variables that are too many to be followed.
#[derive(Clone, Debug)]
pub(super) struct TooMany {
    /// The variables, indices into the plan's counters.
    pub counters: Vec<usize>,
    /// Whose guard or values tell them apart.
    pub transition: TransitionId,
    /// How many combinations there are.
    pub combinations: u64,
}

/// A transition in a box of values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Copy {
    /// Counter, and least and greatest value, where that is less than its domain.
    pub bounds: Vec<(usize, i64, i64)>,
    /// Whether its guard holds there, whatever is known of data.
    pub is_decided: bool,
    /// What it does to counters; none if it would take one out of its domain.
    pub effects: Option<Vec<(usize, Effect)>>,
}

/// What a firing does to a counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    Add(i64),
    To(i64),
}

impl Unfolding {
    /// Of all transitions.
    pub fn of(plan: &Plan) -> Result<Self, TooMany> {
        let mut copies = Vec::new();
        let mut total = 0;
        for id in plan.net().transition_ids() {
            let found = Boxes::of(plan, id)?.all();
            total += found.len();
            if total > MAX_COPIES {
                let (counters, transition) = ((0..plan.counters().len()).collect(), id);
                return Err(TooMany { counters, transition, combinations: total as u64 });
            }
            copies.push(found);
        }
        Ok(Self { copies })
    }

    /// Of a net in which variables are not followed: guards are open at will.
    pub fn open(plan: &Plan) -> Self {
        let copy = || Copy { bounds: Vec::new(), is_decided: false, effects: Some(Vec::new()) };
        Self { copies: plan.net().transition_ids().map(|_| vec![copy()]).collect() }
    }
}

/// One pair of places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub above: PlaceId,
    pub below: PlaceId,
    pub minimum: i64,
    pub maximum: i64,
}

impl Pair {
    /// Its places, marked as at the start.
    pub fn build(counter: &PlannedCounter, builder: &mut NetBuilder) -> Self {
        let (counts, name) = (counter.counts, &counter.name);
        let tokens = |count: i64| u32::try_from(count).expect("variables count to 2^31 at most");
        let above = builder.place(name.as_str(), tokens(counts.initial - counts.minimum));
        let below = tokens(counts.maximum - counts.initial);
        let below = builder.place(format!("{name}/below"), below);
        Self { above, below, minimum: counts.minimum, maximum: counts.maximum }
    }

    /// The value in a marking.
    pub fn value(&self, marking: &[u32]) -> i64 {
        self.minimum + i64::from(marking[self.above.index()])
    }
}

impl Copy {
    /// The arcs that keep it in its box, and move its counters.
    pub fn arcs<'a>(&self, mut t: TransitionBuilder<'a>, pairs: &[Pair]) -> TransitionBuilder<'a> {
        let weight = |count: i64| u32::try_from(count).unwrap_or(0);
        for &(counter, low, high) in &self.bounds {
            let pair = pairs[counter];
            if low > pair.minimum {
                t = t.read(pair.above, weight(low - pair.minimum));
            }
            if high < pair.maximum {
                t = t.read(pair.below, weight(pair.maximum - high));
            }
        }
        for &(counter, effect) in self.effects.iter().flatten() {
            let pair = pairs[counter];
            // The two places of a pair always hold as many tokens as the domain has values but one:
            // what leaves one enters the other, and a value outside of the domain lacks tokens.
            let (from, to, by) = match effect {
                Effect::Add(by) if by < 0 => (pair.above, pair.below, -by),
                Effect::Add(by) => (pair.below, pair.above, by),
                Effect::To(value) => {
                    t = t.reset(pair.above).reset(pair.below);
                    for (place, tokens) in
                        [(pair.above, value - pair.minimum), (pair.below, pair.maximum - value)]
                    {
                        if tokens > 0 {
                            t = t.output(place, weight(tokens));
                        }
                    }
                    continue;
                }
            };
            if by > 0 {
                t = t.input(from, weight(by)).output(to, weight(by));
            }
        }
        t
    }

    /// Its box, for a name: `[n=1, m=0..2]`.
    pub fn label(&self, plan: &Plan) -> String {
        let one = |&(counter, low, high): &(usize, i64, i64)| {
            let name = &plan.counters()[counter].name;
            if low == high { format!("{name}={low}") } else { format!("{name}={low}..{high}") }
        };
        format!("[{}]", self.bounds.iter().map(one).collect::<Vec<_>>().join(", "))
    }
}

/// What a transition does by one combination of values.
#[derive(Clone, Debug, PartialEq)]
struct ValueClass {
    is_decided: bool,
    /// What its sets come to; none if one of them is outside of its domain.
    values: Option<Vec<i64>>,
}

/// How many combinations of values some counters have.
fn count_combinations(plan: &Plan, counters: &[usize]) -> u64 {
    let sizes = counters.iter().map(|index| {
        let counts = plan.counters()[*index].counts;
        (counts.maximum - counts.minimum) as u64 + 1
    });
    sizes.fold(1_u64, u64::saturating_mul)
}

struct Boxes<'a> {
    plan: &'a Plan,
    id: TransitionId,
    /// The counters that its guard and values speak of.
    reads: Vec<usize>,
    /// Whether its guard speaks of data too.
    is_mixed: bool,
    /// Those that fire in its place on the same report, where their guards are true.
    preceding: Vec<TransitionId>,
    /// Per set, how it is written as an effect.
    shapes: Vec<SetShape>,
}

/// How the values of a set stand to those before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SetShape {
    /// Always so much more.
    Add(i64),
    /// Always the same.
    To(i64),
    /// One by one; of a counter that it speaks of.
    EachAdd,
    /// One by one.
    EachTo,
}

impl<'a> Boxes<'a> {
    fn of(plan: &'a Plan, id: TransitionId) -> Result<Self, TooMany> {
        let planned = plan.transition(id);
        let operands = planned.guard.iter().flat_map(|guard| &guard.operands);
        let in_guard = operands.clone().filter_map(Operand::counter);
        let in_values = planned.sets.iter().flat_map(|set| set.operands.iter().copied());
        let mut reads: Vec<_> = in_guard.chain(in_values).collect();
        reads.sort_unstable();
        reads.dedup();
        let is_mixed = operands.clone().any(|operand| operand.counter().is_none());
        let combinations = count_combinations(plan, &reads);
        if combinations > MAX_COMBINATIONS {
            return Err(TooMany { counters: reads, transition: id, combinations });
        }
        let mut preceding = Vec::new();
        for other in find_preceding(plan, id) {
            let operands = plan.transition(other).guard.iter().flat_map(|guard| &guard.operands);
            let mut wider = reads.clone();
            wider.extend(operands.filter_map(Operand::counter));
            wider.sort_unstable();
            wider.dedup();
            // Without this one the transition can do more than in a run, which is safe to assume.
            if count_combinations(plan, &wider) <= MAX_COMBINATIONS {
                reads = wider;
                preceding.push(other);
            }
        }
        let mut boxes = Self { plan, id, reads, is_mixed, preceding, shapes: Vec::new() };
        boxes.shapes = (0..planned.sets.len()).map(|set| boxes.shape(set)).collect();
        Ok(boxes)
    }

    /// Every combination of values at which it may fire.
    fn each(&self, mut see: impl FnMut(&[i64], &ValueClass)) {
        let counts = |index: &usize| self.plan.counters()[*index].counts;
        let mut values: Vec<_> = self.reads.iter().map(|index| counts(index).minimum).collect();
        loop {
            if let Some(class) = self.class(&values) {
                see(&values, &class);
            }
            let Some(next) =
                (0..values.len()).rev().find(|at| values[*at] < counts(&self.reads[*at]).maximum)
            else {
                return;
            };
            values[next] += 1;
            for (value, index) in values[next + 1..].iter_mut().zip(&self.reads[next + 1..]) {
                *value = counts(index).minimum;
            }
        }
    }

    fn shape(&self, set: usize) -> SetShape {
        let target = self.plan.transition(self.id).sets[set].counter;
        let at = self.reads.iter().position(|index| *index == target);
        let (mut adds, mut values) = (Vec::new(), Vec::new());
        self.each(|before, class| {
            let Some(after) = class.values.as_ref().map(|values| values[set]) else { return };
            if let Some(at) = at {
                adds.push(after - before[at]);
            }
            values.push(after);
        });
        adds.sort_unstable();
        adds.dedup();
        values.sort_unstable();
        values.dedup();
        match (&adds[..], &values[..]) {
            ([add], _) => SetShape::Add(*add),
            (_, [value]) => SetShape::To(*value),
            _ if at.is_some() => SetShape::EachAdd,
            _ => SetShape::EachTo,
        }
    }

    /// None where its guard does not hold, whatever is known of data, and where another transition
    /// fires first.
    fn class(&self, values: &[i64]) -> Option<ValueClass> {
        let planned = self.plan.transition(self.id);
        let value = |index: &usize| {
            let at = self.reads.iter().position(|read| read == index);
            values[at.expect("what it speaks of is read")]
        };
        let fires_first = |other: &TransitionId| {
            self.plan.transition(*other).guard.as_ref().is_none_or(|guard| {
                let of = |operand: &Operand| {
                    operand.counter().map(|index| Scalar::Number(value(&index) as f64))
                };
                let known: Vec<_> = guard.operands.iter().map(of).collect();
                guard.guard.holds(&known) == Some(true)
            })
        };
        if self.preceding.iter().any(fires_first) {
            return None;
        }
        let is_decided = match &planned.guard {
            None => true,
            Some(guard) => {
                let of = |operand: &Operand| match operand {
                    Operand::Counter(index) => Some(Scalar::Number(value(index) as f64)),
                    _ => None,
                };
                let known: Vec<_> = guard.operands.iter().map(of).collect();
                let open: Vec<_> =
                    guard.operands.iter().map(|operand| operand.counter().is_none()).collect();
                match guard.guard.holds_whatever(&known, &open) {
                    Some(false) => return None,
                    // Without data there is nothing else that could make it hold.
                    None if !self.is_mixed => return None,
                    truth => truth == Some(true),
                }
            }
        };
        let set = |set: &PlannedSet| {
            let operands: Vec<_> = set.operands.iter().map(value).collect();
            let counts = self.plan.counters()[set.counter].counts;
            set.value
                .of(&operands)
                .filter(|value| (counts.minimum..=counts.maximum).contains(value))
        };
        Some(ValueClass { is_decided, values: planned.sets.iter().map(set).collect() })
    }

    fn all(&self) -> Vec<Copy> {
        self.from(0, &mut Vec::new())
    }

    /// The boxes of the values from the counter number `at` on, given those before it.
    fn from(&self, at: usize, before: &mut Vec<i64>) -> Vec<Copy> {
        let Some(index) = self.reads.get(at) else {
            return self.class(before).map(|class| self.copy(before, class)).into_iter().collect();
        };
        let counts = self.plan.counters()[*index].counts;
        let mut runs: Vec<(i64, i64, Vec<Copy>)> = Vec::new();
        for value in counts.minimum..=counts.maximum {
            before.push(value);
            let found = self.from(at + 1, before);
            before.pop();
            match runs.last_mut() {
                Some(run) if run.2 == found => run.1 = value,
                _ => runs.push((value, value, found)),
            }
        }
        let mut copies = Vec::new();
        for (low, high, found) in runs {
            let is_whole = (low, high) == (counts.minimum, counts.maximum);
            for mut copy in found {
                if !is_whole {
                    copy.bounds.insert(0, (*index, low, high));
                }
                copies.push(copy);
            }
        }
        copies
    }

    fn copy(&self, before: &[i64], class: ValueClass) -> Copy {
        let sets = &self.plan.transition(self.id).sets;
        let effects = class.values.map(|values| {
            let parts = sets.iter().zip(&self.shapes).zip(values);
            let effect = |((set, shape), value): ((&PlannedSet, &SetShape), i64)| {
                let at = self.reads.iter().position(|index| *index == set.counter);
                let effect = match (shape, at) {
                    (SetShape::Add(by), _) => Effect::Add(*by),
                    (SetShape::To(value), _) => Effect::To(*value),
                    (SetShape::EachAdd, Some(at)) => Effect::Add(value - before[at]),
                    _ => Effect::To(value),
                };
                (set.counter, effect)
            };
            parts.map(effect).collect()
        });
        Copy { bounds: Vec::new(), is_decided: class.is_decided, effects }
    }
}
