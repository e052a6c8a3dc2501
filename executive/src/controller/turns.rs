//! The transition whose turn it is, and the taking of its tokens. A mission with a period looks at
//! its net once per period; any other looks at every event.

use super::confirmations::{is_granted, next_firing, next_ready};
use super::context::Context;
use super::mission_dates::MissionDates;
use super::senses::GuardSenses;
use crate::record::JournalEntry;
use crate::terms::{Cause, ValueSet};
use armor_petri::{NetStep, TransitionId};
use std::time::Duration;

/// Begins firings of transitions, one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Turns {
    /// With a period: when it looks at the net next, if there is something to see.
    next_look: Option<Duration>,
}

impl Turns {
    /// Returns when a transition fires next if nothing else happens.
    pub(super) fn next_due(&self, cx: &Context, dates: &MissionDates) -> Option<Duration> {
        let firing = cx.may_fire().then(|| next_firing(cx, dates)).flatten();
        match self.next_look {
            Some(look) => firing.map(|at| at.max(look)),
            None => firing,
        }
    }

    /// Begins the transition whose turn it is, if there is one.
    pub(super) fn fire_next(
        &mut self,
        cx: &mut Context,
        (dates, senses): (&MissionDates, &mut GuardSenses),
        step: &mut NetStep,
    ) {
        let Some(id) = next_ready(cx, dates).filter(|_| cx.may_fire()) else {
            self.next_look = None;
            return;
        };
        if let Some(period) = cx.plan().period().filter(|period| !period.is_zero())
            // Only the first transition waits for the next look; the others fire in the same look.
            && step.fired().is_empty()
            && !is_granted(cx.ledger(), id)
        {
            let look = *self.next_look.get_or_insert_with(|| next_multiple(cx.now(), period));
            if cx.now() < look {
                return;
            }
            self.next_look = None;
        }
        begin_transition(cx, senses, id);
        let flights = cx.ledger().firings().len();
        if flights > cx.plan().limits().firings {
            cx.retreat(&format!("{flights} firings in flight at once: the net has no bound"));
        }
        if let Err(endless) = step.count(id) {
            let names = |id: &TransitionId| cx.plan().net().transition(*id).name.clone();
            let cycle: Vec<_> = endless.cycle.iter().map(names).collect();
            cx.retreat(&format!(
                "{} transitions fired at one moment; these repeat without end: {}",
                endless.bound,
                cycle.join(" ")
            ));
        }
    }
}

fn begin_transition(cx: &mut Context, senses: &mut GuardSenses, id: TransitionId) {
    let sets = match cx.plan().sets_of(id, cx.ledger().counters()) {
        Ok(sets) => sets,
        Err(why) => return cx.retreat(&why),
    };
    let guards = senses.guards_after(cx, &sets);
    let (plan, state) = (cx.plan(), cx.ledger().state());
    let named = |(index, value): (usize, i64)| {
        let variable = plan.counters()[index].name.clone();
        ValueSet { variable, value }
    };
    let sets = sets.into_iter().map(named).collect();
    let transition = plan.net().transition(id);
    // A reset takes what the inputs leave.
    let emptied = transition.resets.iter().filter_map(|&place| {
        let taken = transition.inputs.iter().find(|arc| arc.0 == place);
        let rest = state.tokens(place).saturating_sub(taken.map_or(0, |arc| arc.1));
        (rest > 0).then_some((place, rest))
    });
    let from: Vec<_> = transition.inputs.iter().copied().chain(emptied).collect();
    let mut to = transition.outputs.clone();
    // A mission with a period looks at its net once per period, so a firing at the first look after
    // its deadline is in time.
    let period = plan.period().unwrap_or_default();
    let latest = state.deadline(id).map(|at| at.saturating_add(period));
    let late = latest.map_or(Duration::ZERO, |at| cx.now().saturating_sub(at));
    if late > plan.limits().overrun
        && let Some(overrun) = plan.transition(id).overrun
    {
        to.push((overrun, 1));
    }
    // One record for tokens, variables and guards: a crash cannot leave a guard that contradicts
    // the variables that it reads.
    cx.record_entry(JournalEntry::Took {
        firing: cx.ledger().next_firing(),
        cause: Cause::Transition(transition.name.clone()),
        from: cx.ledger().tokens_named(&from),
        to: cx.ledger().tokens_named(&to),
        late_s: late.as_secs_f64(),
        sets,
        guards,
    });
}

/// Returns the first multiple of `period` that is not before `now`.
fn next_multiple(now: Duration, period: Duration) -> Duration {
    let (now, period) = (now.as_nanos(), period.as_nanos());
    let at = now.div_ceil(period) * period;
    Duration::from_nanos(u64::try_from(at).unwrap_or(u64::MAX))
}
