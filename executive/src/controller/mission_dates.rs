//! Absolute dates: which of them have come or passed, by the newest reading of the wall clock.

use super::context::Context;
use crate::ledger::DateState;
use crate::record::JournalEntry;
use armor_petri::{FiringClass, TransitionId};
use armor_plan::{DatePhase, Plan, PlannedDates};
use armor_robotfile::Date;
use armor_robotfile::mission::Missed;
use std::sync::Arc;
use std::time::Duration;

/// A change of UTC against mission time that is more than a clock being steered.
const JUMP: Duration = Duration::from_millis(500);

/// Judges dates. Without a reading of the wall clock no date comes or passes.
#[derive(Clone, Debug, Default)]
pub(super) struct MissionDates {
    /// UTC at mission time 0, as it was read last.
    at_start: Option<Date>,
}

impl MissionDates {
    /// Returns UTC at mission time 0.
    pub(super) fn utc_at_start(&self) -> Option<Date> {
        self.at_start
    }

    /// Takes a reading of the wall clock: the moment at which mission time was 0.
    pub(super) fn set_utc(&mut self, cx: &mut Context, at_start: Date) {
        let before = self.at_start.replace(at_start);
        let moved = |before: Date| before.after(at_start).or(at_start.after(before));
        if before.and_then(moved).is_none_or(|by| by > JUMP) {
            cx.publish_marking();
        }
    }

    /// Returns UTC now; none without a reading.
    fn utc_now(&self, cx: &Context) -> Option<Date> {
        Some(self.at_start?.later(cx.now()))
    }

    /// Whether it has a date and there is no reading of the wall clock yet: after a restart the
    /// date may have passed since the journal ended.
    pub(super) fn waits_for_utc(&self, plan: &Plan, id: TransitionId) -> bool {
        self.at_start.is_none() && plan.transition(id).dates.is_some()
    }

    /// Records which dates have come or passed. A date that has passed stays so, even if the clock
    /// is set back.
    pub(super) fn weigh_dates(&self, cx: &mut Context) {
        let Some(utc) = self.utc_now(cx).filter(|_| cx.may_fire()) else {
            return;
        };
        let plan = Arc::clone(cx.plan());
        for (id, dates) in plan.dated() {
            let (before, phase) = (cx.ledger().date(id), dates.phase(utc));
            if before.phase != phase && before.phase != DatePhase::Past {
                let transition = plan.net().transition(id).name.clone();
                let used = before.used;
                cx.record_entry(JournalEntry::Dated {
                    transition,
                    phase,
                    used,
                    utc: utc.to_string(),
                });
            }
        }
        let failed = plan.dated().find(|(id, dates)| Self::has_failed(cx, *id, dates));
        if let Some((id, PlannedDates { last: Some(last), .. })) = failed {
            let name = &plan.net().transition(id).name;
            cx.retreat(&format!("the date of `{name}` has passed unused: {last}"));
        }
    }

    /// Whether tokens wait for it although its last date has passed, and that fails the mission.
    /// In a pause nothing fails, but for safety.
    fn has_failed(cx: &Context, id: TransitionId, dates: &PlannedDates) -> bool {
        let DateState { phase, used } = cx.ledger().date(id);
        let is_held = cx.ledger().pause().is_some()
            && cx.plan().net().transition(id).class == FiringClass::Ordinary;
        let has_passed = phase == DatePhase::Past && !used && dates.missed == Missed::Fail;
        has_passed && !is_held && cx.ledger().is_wanted(id)
    }

    /// Returns when dates come or pass next, in mission time.
    pub(super) fn next_due(&self, cx: &Context) -> Option<Duration> {
        let (start, utc) = (self.at_start?, self.utc_now(cx)?);
        let dates = cx.plan().dated().filter(|_| cx.may_fire());
        let waiting = dates.filter(|(id, _)| cx.ledger().date(*id).phase != DatePhase::Past);
        let moments = waiting.flat_map(|(_, dates)| dates.first.into_iter().chain(dates.last));
        moments.filter(|date| *date > utc).filter_map(|date| date.after(start)).min()
    }

    /// Returns why its dates keep it from firing, in words.
    pub(super) fn date_hindrance(&self, cx: &Context, id: TransitionId) -> Option<String> {
        let dates = cx.plan().transition(id).dates?;
        if self.waits_for_utc(cx.plan(), id) {
            return Some("its date is not judged yet".to_owned());
        }
        match cx.ledger().date(id).phase {
            _ if cx.ledger().is_in_date(id) => None,
            DatePhase::Past => Some(format!("its date has passed: {}", dates.last?)),
            DatePhase::Early | DatePhase::Open => {
                Some(format!("its date has not come: {}", dates.first?))
            }
        }
    }
}
