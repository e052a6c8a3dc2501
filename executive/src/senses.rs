//! What the controller knows of the world, and what the guards make of it. A value that cannot be
//! had any more holds for a while, then it is not known. Every change of a guard is a record.

use crate::controller::Controller;
use crate::record::{Entry, GuardTurned};
use armor_petri::TransitionId;
use armor_plan::{Operand, Plan, PlannedGuard, WatchId};
use armor_robotfile::guard::Scalar;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Least time between two publications for the sake of values alone.
const SHOW_EVERY: Duration = Duration::from_secs(1);

/// What is known of one watch.
#[derive(Clone, Debug)]
struct Sense {
    value: Option<Scalar>,
    /// Since when its provider cannot be reached, if its value still holds.
    lost: Option<Duration>,
    /// Not heard of since a restart: the guards stay as the journal has them.
    inherited: bool,
}

/// Everything that is known of the world.
#[derive(Clone, Debug)]
pub(crate) struct Senses {
    senses: Vec<Sense>,
    /// Per variable, the values that came from outside its domain.
    pub(crate) outside: Vec<u64>,
    /// Per transition, what its guard was when it was weighed last.
    truths: Vec<Option<bool>>,
    /// Guards whose values have changed.
    unweighed: BTreeSet<TransitionId>,
    /// Until when what the journal says holds for what has not been heard of.
    inherited_until: Option<Duration>,
    /// When values alone are shown next.
    show_at: Option<Duration>,
    shown_at: Duration,
}

impl Senses {
    /// Nothing is known yet. After a restart the guards stay as they were until there is news, or
    /// until the time is over that a value holds without its provider.
    pub(crate) fn new(plan: &Plan, restarted_at: Option<Duration>) -> Self {
        let sense = Sense { value: None, lost: None, inherited: restarted_at.is_some() };
        let guarded = plan.net().transition_ids().filter(|id| plan.transition(*id).guard.is_some());
        Self {
            senses: vec![sense; plan.watches().len()],
            outside: vec![0; plan.variables().len()],
            truths: vec![None; plan.transitions().len()],
            unweighed: guarded.collect(),
            inherited_until: restarted_at
                .filter(|_| !plan.watches().is_empty())
                .map(|at| at + plan.limits().value_holds),
            show_at: None,
            shown_at: Duration::ZERO,
        }
    }
}

impl Senses {
    /// Goes on with another plan, whose watches begin with those there were.
    pub(crate) fn follow(&mut self, before: &Plan, after: &Plan) {
        let new = Sense { value: None, lost: None, inherited: false };
        self.senses.resize(after.watches().len(), new);
        let counted = std::mem::take(&mut self.outside);
        let known: BTreeMap<_, _> =
            before.variables().iter().map(|variable| &variable.name).zip(counted).collect();
        let variables = after.variables().iter();
        self.outside =
            variables.map(|variable| known.get(&variable.name).copied().unwrap_or(0)).collect();
        self.truths = vec![None; after.transitions().len()];
        let guarded =
            after.net().transition_ids().filter(|id| after.transition(*id).guard.is_some());
        self.unweighed = guarded.collect();
    }
}

impl Controller {
    pub(crate) fn sensed(&mut self, watch: WatchId, value: Option<Scalar>) {
        let Some(sense) = self.senses.senses.get_mut(watch.index()) else { return };
        *sense = Sense { value: value.clone(), lost: None, inherited: false };
        self.senses.unweighed.extend(self.plan.watchers(watch));
        if let Some(Scalar::Number(number)) = value {
            self.count_outside(watch, number);
        }
        let next = (self.senses.shown_at + SHOW_EVERY).max(self.host);
        self.senses.show_at.get_or_insert(next);
    }

    pub(crate) fn unlinked(&mut self, watch: WatchId) {
        let now = self.host;
        if let Some(sense) = self.senses.senses.get_mut(watch.index())
            && sense.value.is_some()
        {
            sense.lost.get_or_insert(now);
        }
    }

    fn count_outside(&mut self, watch: WatchId, number: f64) {
        for (variable, outside) in self.plan.variables().iter().zip(&mut self.senses.outside) {
            let is_inside = (variable.minimum..=variable.maximum).contains(&number);
            if variable.source != watch || is_inside || number.is_nan() {
                continue;
            }
            *outside += 1;
            if *outside == 1 {
                tracing::warn!(
                    variable = variable.name.as_str(),
                    "{number} is outside of {} to {}; it counts as the nearer end, and from now on \
                     this is only counted",
                    variable.minimum,
                    variable.maximum
                );
            }
        }
    }

    /// Forgets what has not been heard of for too long, and records which guards have changed.
    pub(crate) fn weigh_guards(&mut self) {
        let (now, holds) = (self.host, self.plan.limits().value_holds);
        let is_over = self.senses.inherited_until.is_some_and(|until| until <= now);
        for (sense, watch) in self.senses.senses.iter_mut().zip((0..).map(WatchId)) {
            let is_lost = sense.lost.is_some_and(|since| since + holds <= now);
            if is_lost || (sense.inherited && is_over) {
                *sense = Sense { value: None, lost: None, inherited: false };
                self.senses.unweighed.extend(self.plan.watchers(watch));
            }
        }
        if is_over {
            self.senses.inherited_until = None;
        }
        if self.senses.show_at.is_some_and(|at| at <= now) {
            (self.senses.show_at, self.senses.shown_at) = (None, now);
            self.publish();
        }
        if self.may_fire() {
            for id in std::mem::take(&mut self.senses.unweighed) {
                self.weigh(id);
            }
        }
    }

    fn weigh(&mut self, id: TransitionId) {
        let Some(planned) = &self.plan.transition(id).guard else { return };
        let is_inherited =
            |operand: &Operand| self.sense(*operand).is_some_and(|sense| sense.inherited);
        if planned.operands.iter().any(is_inherited) {
            return;
        }
        let truth = self.truth_with(planned, &self.ledger.counters);
        if std::mem::replace(&mut self.senses.truths[id.index()], truth) != truth {
            self.publish();
        }
        let holds = truth == Some(true);
        if self.ledger.holds[id.index()] != holds {
            let transition = self.plan.net().transition(id).name.clone();
            self.record(Entry::Guard { transition, holds, because: self.because(id) });
        }
    }

    /// The guards that turn when counters are set so. What has not been heard of since a restart is
    /// not known then: what the journal says of it was about other values.
    pub(crate) fn guards_after(&mut self, sets: &[(usize, i64)]) -> Vec<GuardTurned> {
        let mut counters = self.ledger.counters.clone();
        let mut readers = BTreeSet::new();
        for (index, value) in sets {
            if std::mem::replace(&mut counters[*index], *value) != *value {
                readers.extend(self.plan.counter_readers(*index));
            }
        }
        let mut turned = Vec::new();
        for id in readers {
            let Some(planned) = &self.plan.transition(id).guard else { continue };
            let truth = self.truth_with(planned, &counters);
            self.senses.truths[id.index()] = truth;
            let holds = truth == Some(true);
            if self.ledger.holds[id.index()] != holds {
                let transition = self.plan.net().transition(id).name.clone();
                turned.push(GuardTurned { transition, holds });
            }
        }
        turned
    }

    fn truth_with(&self, planned: &PlannedGuard, counters: &[i64]) -> Option<bool> {
        let value = |operand: &Operand| match operand {
            Operand::Counter(index) => Some(Scalar::Number(counters[*index] as f64)),
            other => self.value(*other),
        };
        planned.guard.holds(&planned.operands.iter().map(value).collect::<Vec<_>>())
    }

    /// When what is known changes without anybody saying so.
    pub(crate) fn senses_due(&self) -> impl Iterator<Item = Duration> {
        let holds = self.plan.limits().value_holds;
        let lost = self.senses.senses.iter().filter_map(move |sense| Some(sense.lost? + holds));
        lost.chain(self.senses.inherited_until)
            .chain(self.senses.show_at)
            .filter(|_| !self.stopping)
    }

    /// What its guard is now: not known if it was never weighed, or has no guard.
    pub(crate) fn truth(&self, id: TransitionId) -> Option<bool> {
        self.senses.truths[id.index()]
    }

    /// The values that a guard looks at, in words.
    pub(crate) fn because(&self, id: TransitionId) -> String {
        let Some(planned) = &self.plan.transition(id).guard else { return String::new() };
        let names = planned.guard.names().iter().zip(&planned.operands);
        let words = names.map(|(name, operand)| {
            let value = self.value(*operand);
            format!("{name} is {}", in_words(value.as_ref()))
        });
        words.collect::<Vec<_>>().join(", ")
    }

    /// The value of a variable.
    pub(crate) fn variable(&self, index: usize) -> Option<Scalar> {
        self.value(Operand::Variable(index))
    }

    /// What is known of it from outside; nothing of a counter.
    fn sense(&self, operand: Operand) -> Option<&Sense> {
        let watch = match operand {
            Operand::Field(watch) => watch,
            Operand::Variable(index) => self.plan.variables()[index].source,
            Operand::Counter(_) => return None,
        };
        Some(&self.senses.senses[watch.index()])
    }

    fn value(&self, operand: Operand) -> Option<Scalar> {
        if let Operand::Counter(index) = operand {
            return Some(Scalar::Number(self.ledger.counters[index] as f64));
        }
        let value = self.sense(operand)?.value.clone()?;
        Some(match operand {
            Operand::Field(_) | Operand::Counter(_) => value,
            Operand::Variable(index) => self.plan.variables()[index].within(value),
        })
    }
}

/// A value as people read it.
pub(crate) fn in_words(value: Option<&Scalar>) -> String {
    match value {
        None => "not known".to_owned(),
        Some(Scalar::Number(number)) => format!("{number}"),
        Some(Scalar::Flag(flag)) => format!("{flag}"),
        Some(Scalar::Text(text)) => format!("'{text}'"),
    }
}
