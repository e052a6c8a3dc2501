//! The data that guards read in a random world: values jump, are missing, and lose their link. A
//! restarted executive has to receive them again. Computes the expected truth of each guard.

use super::dice::Dice;
use crate::event::ControllerEvent;
use armor_plan::{Operand, Plan, PlannedGuard, WatchId};
use armor_robotfile::guard::Scalar;
use std::collections::BTreeMap;
use std::time::Duration;

/// No value changes after this, so that the mission can come to rest.
const CALM: Duration = Duration::from_secs(100);

/// The last report of a watch since the executive started.
#[derive(Clone, Debug)]
struct WatchReport {
    value: Option<Scalar>,
    lost: Option<Duration>,
}

pub(super) struct Outlook {
    dice: Dice,
    next: Vec<Duration>,
    reports: Vec<Option<WatchReport>>,
    /// When the executive was last restarted, if it was.
    restarted: Option<Duration>,
}

impl Outlook {
    pub(super) fn new(plan: &Plan, mut dice: Dice) -> Self {
        let next = plan.watches().iter().map(|_| dice.up_to_ms(3000)).collect();
        Self { dice, next, reports: vec![None; plan.watches().len()], restarted: None }
    }

    pub(super) fn executive_starts(&mut self, watches: usize, now: Duration, again: bool) {
        self.reports = vec![None; watches];
        self.next.resize(watches, now);
        self.restarted = again.then_some(now);
        for next in &mut self.next {
            *next = now + self.dice.up_to_ms(3000);
        }
    }

    /// Adds the watches of a new version of the mission.
    pub(super) fn follow(&mut self, plan: &Plan, now: Duration) {
        self.next.resize(plan.watches().len(), now);
        self.reports.resize(plan.watches().len(), None);
    }

    pub(super) fn next_at(&self) -> Option<Duration> {
        self.next.iter().min().copied().filter(|at| *at < CALM)
    }

    pub(super) fn happen(&mut self, now: Duration) -> ControllerEvent {
        let index = (0..self.next.len()).min_by_key(|i| self.next[*i]).expect("there is one");
        self.next[index] = now + self.dice.up_to_ms(4000);
        let watch = WatchId(index as u32);
        let report = &mut self.reports[index];
        if self.dice.one_in(5)
            && let Some(report) = report
        {
            report.lost.get_or_insert(now);
            return ControllerEvent::Unlinked { watch };
        }
        let number = self.dice.roll(12) as f64 - 1.0;
        let value = (!self.dice.one_in(8)).then_some(Scalar::Number(number));
        *report = Some(WatchReport { value: value.clone(), lost: None });
        ControllerEvent::Sensed { watch, value }
    }

    /// Returns the guard's truth, `Some(None)` if it is unknown. `None`: no report since the
    /// restart, so the guard may still have its truth from before.
    pub(super) fn truth(
        &self,
        plan: &Plan,
        planned: &PlannedGuard,
        counters: &BTreeMap<String, i64>,
        now: Duration,
    ) -> Option<Option<bool>> {
        let holds = plan.limits().value_holds;
        let mut values = Vec::new();
        for operand in &planned.operands {
            let (watch, variable) = match operand {
                Operand::Counter(index) => {
                    let value = counters[&plan.counters()[*index].name];
                    values.push(Some(Scalar::Number(value as f64)));
                    continue;
                }
                Operand::Field(watch) => (*watch, None),
                Operand::Variable(index) => {
                    (plan.variables()[*index].source, Some(&plan.variables()[*index]))
                }
            };
            let value = match &self.reports[watch.index()] {
                None if self.restarted.is_some_and(|at| now < at + holds) => return None,
                None => None,
                Some(WatchReport { lost: Some(at), .. }) if *at + holds <= now => None,
                Some(WatchReport { value, .. }) => value.clone(),
            };
            values.push(match (value, variable) {
                (Some(Scalar::Number(number)), Some(variable)) if number < variable.minimum => {
                    Some(Scalar::Number(variable.minimum))
                }
                (Some(Scalar::Number(number)), Some(variable)) if number > variable.maximum => {
                    Some(Scalar::Number(variable.maximum))
                }
                (value, _) => value,
            });
        }
        Some(planned.guard.holds(&values))
    }
}
