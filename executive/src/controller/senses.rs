//! The values that guards read, and what the guards make of them. A value whose provider is lost
//! stays in force for a while, then it is unknown. Every change of a guard is a record.

use super::context::Context;
use crate::record::JournalEntry;
use crate::terms::GuardTurned;
use armor_petri::TransitionId;
use armor_plan::{Operand, Plan, PlannedGuard, WatchId};
use armor_robotfile::guard::Scalar;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Least time between two publications for the sake of values alone.
const SHOW_EVERY: Duration = Duration::from_secs(1);

/// The state of one watch.
#[derive(Clone, Debug)]
struct WatchedValue {
    value: Option<Scalar>,
    /// Since when its provider cannot be reached, while its value is still in force.
    lost: Option<Duration>,
    /// No news since a restart: the guards that read it stay as the journal has them.
    inherited: bool,
}

/// The values of all watches, and the truth of all guards.
#[derive(Clone, Debug)]
pub(super) struct GuardSenses {
    senses: Vec<WatchedValue>,
    /// Per watch, the SI unit of its values, if it is known and has one.
    units: Vec<Option<&'static str>>,
    /// Per variable, the values that came from outside its domain.
    outside: Vec<u64>,
    /// Per transition, what its guard was when it was weighed last.
    truths: Vec<Option<bool>>,
    /// Guards whose values have changed.
    unweighed: BTreeSet<TransitionId>,
    /// Until when inherited guards stay as the journal has them.
    inherited_until: Option<Duration>,
    /// When values alone are shown next.
    show_at: Option<Duration>,
    shown_at: Duration,
}

impl GuardSenses {
    /// Begins without values. After a restart the guards stay as they were until there is news, or
    /// until the time is over for which a value stays in force without its provider.
    pub(super) fn new(plan: &Plan, restarted_at: Option<Duration>) -> Self {
        let sense = WatchedValue { value: None, lost: None, inherited: restarted_at.is_some() };
        let guarded = plan.net().transition_ids().filter(|id| plan.transition(*id).guard.is_some());
        Self {
            senses: vec![sense; plan.watches().len()],
            units: vec![None; plan.watches().len()],
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

    /// Continues with another plan, whose watches begin with those there were.
    pub(super) fn follow_plan(&mut self, before: &Plan, after: &Plan) {
        let new = WatchedValue { value: None, lost: None, inherited: false };
        self.senses.resize(after.watches().len(), new);
        self.units.resize(after.watches().len(), None);
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

    pub(super) fn take_value(&mut self, cx: &mut Context, watch: WatchId, value: Option<Scalar>) {
        let Some(sense) = self.senses.get_mut(watch.index()) else {
            return;
        };
        *sense = WatchedValue { value: value.clone(), lost: None, inherited: false };
        self.unweighed.extend(cx.plan().watchers(watch));
        if let Some(Scalar::Number(number)) = value {
            self.count_outside(cx.plan(), watch, number);
        }
        let next = (self.shown_at + SHOW_EVERY).max(cx.host());
        self.show_at.get_or_insert(next);
    }

    /// Sets the unit in which values of a watch are named.
    pub(super) fn set_unit(&mut self, watch: WatchId, unit: &'static str) {
        if let Some(known) = self.units.get_mut(watch.index()) {
            *known = Some(unit);
        }
    }

    pub(super) fn note_unlinked(&mut self, cx: &mut Context, watch: WatchId) {
        let now = cx.host();
        if let Some(sense) = self.senses.get_mut(watch.index())
            && sense.value.is_some()
        {
            sense.lost.get_or_insert(now);
        }
    }

    fn count_outside(&mut self, plan: &Plan, watch: WatchId, number: f64) {
        for (variable, outside) in plan.variables().iter().zip(&mut self.outside) {
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

    /// Forgets values that are too old, and records which guards have changed.
    pub(super) fn weigh_guards(&mut self, cx: &mut Context) {
        let (now, holds) = (cx.host(), cx.plan().limits().value_holds);
        let is_over = self.inherited_until.is_some_and(|until| until <= now);
        for (sense, watch) in self.senses.iter_mut().zip((0..).map(WatchId)) {
            let is_lost = sense.lost.is_some_and(|since| since + holds <= now);
            if is_lost || (sense.inherited && is_over) {
                *sense = WatchedValue { value: None, lost: None, inherited: false };
                self.unweighed.extend(cx.plan().watchers(watch));
            }
        }
        if is_over {
            self.inherited_until = None;
        }
        if self.show_at.is_some_and(|at| at <= now) {
            (self.show_at, self.shown_at) = (None, now);
            cx.publish_marking();
        }
        if cx.may_fire() {
            for id in std::mem::take(&mut self.unweighed) {
                self.weigh_guard(cx, id);
            }
        }
    }

    fn weigh_guard(&mut self, cx: &mut Context, id: TransitionId) {
        let Some(planned) = &cx.plan().transition(id).guard else {
            return;
        };
        let is_inherited =
            |operand: &Operand| self.sense(cx, *operand).is_some_and(|sense| sense.inherited);
        if planned.operands.iter().any(is_inherited) {
            return;
        }
        let truth = self.truth_with(cx, planned, cx.ledger().counters());
        if std::mem::replace(&mut self.truths[id.index()], truth) != truth {
            cx.publish_marking();
        }
        let holds = truth == Some(true);
        if cx.ledger().guard_holds(id) != holds {
            let transition = cx.plan().net().transition(id).name.clone();
            cx.record_entry(JournalEntry::Guard {
                transition,
                holds,
                because: self.values_in_words(cx, id),
            });
        }
    }

    /// Returns the guards that turn when counters are set to these values. An inherited value
    /// counts as unknown here: the journal's guard was about other counters.
    pub(super) fn guards_after(&mut self, cx: &Context, sets: &[(usize, i64)]) -> Vec<GuardTurned> {
        let mut counters = cx.ledger().counters().to_vec();
        let mut readers = BTreeSet::new();
        for (index, value) in sets {
            if std::mem::replace(&mut counters[*index], *value) != *value {
                readers.extend(cx.plan().counter_readers(*index));
            }
        }
        let mut turned = Vec::new();
        for id in readers {
            let Some(planned) = &cx.plan().transition(id).guard else {
                continue;
            };
            let truth = self.truth_with(cx, planned, &counters);
            self.truths[id.index()] = truth;
            let holds = truth == Some(true);
            if cx.ledger().guard_holds(id) != holds {
                let transition = cx.plan().net().transition(id).name.clone();
                turned.push(GuardTurned { transition, holds });
            }
        }
        turned
    }

    fn truth_with(&self, cx: &Context, planned: &PlannedGuard, counters: &[i64]) -> Option<bool> {
        let value = |operand: &Operand| match operand {
            Operand::Counter(index) => Some(Scalar::Number(counters[*index] as f64)),
            other => self.value(cx, *other),
        };
        planned.guard.holds(&planned.operands.iter().map(value).collect::<Vec<_>>())
    }

    /// Returns when values expire, or are published, without an event.
    pub(super) fn next_due<'a>(&'a self, cx: &'a Context) -> impl Iterator<Item = Duration> + 'a {
        let holds = cx.plan().limits().value_holds;
        let lost = self.senses.iter().filter_map(move |sense| Some(sense.lost? + holds));
        lost.chain(self.inherited_until).chain(self.show_at).filter(move |_| !cx.is_stopping())
    }

    /// Returns the truth of its guard; none if it is unknown, was never weighed, or there is no
    /// guard.
    pub(super) fn truth(&self, id: TransitionId) -> Option<bool> {
        self.truths[id.index()]
    }

    /// Returns the values that a guard reads, in words.
    pub(super) fn values_in_words(&self, cx: &Context, id: TransitionId) -> String {
        let Some(planned) = &cx.plan().transition(id).guard else {
            return String::new();
        };
        let names = planned.guard.names().iter().zip(&planned.operands);
        let words = names
            .map(|(name, operand)| format!("{name} is {}", self.operand_in_words(cx, *operand)));
        words.collect::<Vec<_>>().join(", ")
    }

    /// Returns, per variable, how many values came from outside its domain.
    pub(super) fn outside_counts(&self) -> &[u64] {
        &self.outside
    }

    /// Returns the value of a variable.
    pub(super) fn variable(&self, cx: &Context, index: usize) -> Option<Scalar> {
        self.value(cx, Operand::Variable(index))
    }

    /// Returns the value of a variable in words, with its unit.
    pub(super) fn variable_in_words(&self, cx: &Context, index: usize) -> String {
        self.operand_in_words(cx, Operand::Variable(index))
    }

    fn operand_in_words(&self, cx: &Context, operand: Operand) -> String {
        let value = self.value(cx, operand);
        let unit = watch_of(cx, operand).and_then(|watch| self.units[watch.index()]);
        match unit.filter(|_| matches!(value, Some(Scalar::Number(_)))) {
            Some(unit) => format!("{} {unit}", in_words(value.as_ref())),
            None => in_words(value.as_ref()),
        }
    }

    fn sense(&self, cx: &Context, operand: Operand) -> Option<&WatchedValue> {
        Some(&self.senses[watch_of(cx, operand)?.index()])
    }

    fn value(&self, cx: &Context, operand: Operand) -> Option<Scalar> {
        if let Operand::Counter(index) = operand {
            return Some(Scalar::Number(cx.ledger().counters()[index] as f64));
        }
        let value = self.sense(cx, operand)?.value.clone()?;
        Some(match operand {
            Operand::Field(_) | Operand::Counter(_) => value,
            Operand::Variable(index) => cx.plan().variables()[index].within(value),
        })
    }
}

/// Returns the watch of an operand; a counter has none.
fn watch_of(cx: &Context, operand: Operand) -> Option<WatchId> {
    match operand {
        Operand::Field(watch) => Some(watch),
        Operand::Variable(index) => Some(cx.plan().variables()[index].source),
        Operand::Counter(_) => None,
    }
}

/// A value as people read it.
fn in_words(value: Option<&Scalar>) -> String {
    match value {
        None => "not known".to_owned(),
        Some(Scalar::Number(number)) => format_number(*number),
        Some(Scalar::Flag(flag)) => format!("{flag}"),
        Some(Scalar::Text(text)) => format!("'{text}'"),
    }
}

/// A whole number as it is; another one with six significant digits at most.
fn format_number(number: f64) -> String {
    if number.fract() == 0.0 || !number.is_finite() {
        return number.to_string();
    }
    // The rounded number in its shortest form: without zeros at the end.
    let rounded = format!("{number:.5e}").parse().unwrap_or(number);
    f64::to_string(&rounded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_significant_digits_and_counts_all_of_theirs() {
        let shown = [0.1 + 0.2, 2.0 / 3.0, -1_234.567_89, 1.5e-9, 12_345_678.0, -0.0];
        let expected = ["0.3", "0.666667", "-1234.57", "0.0000000015", "12345678", "-0"];
        assert_eq!(shown.map(format_number), expected);
        assert_eq!(format_number(f64::INFINITY), "inf");
    }
}
