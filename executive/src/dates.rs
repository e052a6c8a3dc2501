//! Absolute dates: which transitions have them, what is decided about them (as part of the
//! ledger), and the controller's judgement by the newest that it has been told of UTC.

use crate::controller::Controller;
use crate::ledger::{Ledger, LedgerError};
use crate::record::Entry;
use armor_petri::{Class, TransitionId};
use armor_plan::{DatePhase, PlannedDates};
use armor_robotfile::Date;
use armor_robotfile::mission::Missed;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A change of UTC against mission time that is more than a clock being steered.
const JUMP: Duration = Duration::from_millis(500);

/// Where the dates of a transition stand, as decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Dated {
    pub(crate) phase: DatePhase,
    /// It has fired since the mission began.
    pub(crate) used: bool,
}

impl Ledger {
    /// Whether its dates let a transition fire; true of those without.
    pub(crate) fn is_in_date(&self, id: TransitionId) -> bool {
        let Some(planned) = &self.plan.transition(id).dates else { return true };
        let Dated { phase, used } = self.dates[id.index()];
        match phase {
            DatePhase::Early => false,
            DatePhase::Open => true,
            DatePhase::Past => planned.missed == Missed::Fire && !used,
        }
    }

    pub(crate) fn dated(&mut self, name: &str, phase: DatePhase) -> Result<(), LedgerError> {
        let id = self.transition(name)?;
        self.dates[id.index()].phase = phase;
        self.set_gate(id);
        Ok(())
    }

    /// It has fired: one whose date had passed does so once.
    pub(crate) fn date_used(&mut self, id: TransitionId) {
        if self.plan.transition(id).dates.is_some() {
            self.dates[id.index()].used = true;
            self.set_gate(id);
        }
    }

    /// Whether the tokens are as a transition wants them, whatever its gate and its clock say.
    fn is_wanted(&self, id: TransitionId) -> bool {
        let transition = self.plan.net().transition(id);
        let mut needed = transition.inputs.iter().chain(&transition.reads);
        needed.all(|arc| self.state.tokens(arc.0) >= arc.1)
            && transition.inhibitors.iter().all(|arc| self.state.tokens(arc.0) < arc.1)
    }
}

impl Controller {
    /// What the clock on the wall says, as the moment at which mission time was 0.
    pub(crate) fn told_utc(&mut self, at_start: Date) {
        let before = self.utc_at_start.replace(at_start);
        let moved = |before: Date| before.after(at_start).or(at_start.after(before));
        if before.and_then(moved).is_none_or(|by| by > JUMP) {
            self.publish();
        }
    }

    /// UTC now, as far as it has been told.
    pub(crate) fn utc(&self) -> Option<Date> {
        Some(self.utc_at_start?.later(self.now))
    }

    /// Whether it has a date and nobody has said what time it is: it may be another one than the
    /// journal ends with.
    pub(crate) fn waits_for_utc(&self, id: TransitionId) -> bool {
        self.utc_at_start.is_none() && self.plan.transition(id).dates.is_some()
    }

    /// Records which dates have come or passed. What has passed stays so, whatever the clock says
    /// later.
    pub(crate) fn weigh_dates(&mut self) {
        let Some(utc) = self.utc().filter(|_| self.may_fire()) else { return };
        let plan = std::sync::Arc::clone(&self.plan);
        for (id, dates) in plan.dated() {
            let (before, phase) = (self.ledger.dates[id.index()], dates.phase(utc));
            if before.phase != phase && before.phase != DatePhase::Past {
                let transition = plan.net().transition(id).name.clone();
                let used = before.used;
                self.record(Entry::Dated { transition, phase, used, utc: utc.to_string() });
            }
        }
        let failed = plan.dated().find(|(id, dates)| self.has_failed(*id, dates));
        if let Some((id, PlannedDates { last: Some(last), .. })) = failed {
            let name = &plan.net().transition(id).name;
            self.retreat(&format!("the date of `{name}` has passed unused: {last}"));
        }
    }

    /// Whether tokens wait for it although its last date has passed, and that fails the mission.
    /// In a pause nothing fails, but for safety.
    fn has_failed(&self, id: TransitionId, dates: &PlannedDates) -> bool {
        let Dated { phase, used } = self.ledger.dates[id.index()];
        let is_held = self.ledger.pause().is_some()
            && self.plan.net().transition(id).class == Class::Ordinary;
        let has_passed = phase == DatePhase::Past && !used && dates.missed == Missed::Fail;
        has_passed && !is_held && self.ledger.is_wanted(id)
    }

    /// When dates come or pass next, in mission time.
    pub(crate) fn dates_due(&self) -> Option<Duration> {
        let (start, utc) = (self.utc_at_start?, self.utc()?);
        let dates = self.plan.dated().filter(|_| self.may_fire());
        let waiting =
            dates.filter(|(id, _)| self.ledger.dates[id.index()].phase != DatePhase::Past);
        let moments = waiting.flat_map(|(_, dates)| dates.first.into_iter().chain(dates.last));
        moments.filter(|date| *date > utc).filter_map(|date| date.after(start)).min()
    }

    /// What its dates say against its firing, in words.
    pub(crate) fn date_against(&self, id: TransitionId) -> Option<String> {
        let dates = self.plan.transition(id).dates?;
        if self.waits_for_utc(id) {
            return Some("its date is not judged yet".to_owned());
        }
        match self.ledger.dates[id.index()].phase {
            _ if self.ledger.is_in_date(id) => None,
            DatePhase::Past => Some(format!("its date has passed: {}", dates.last?)),
            _ => Some(format!("its date has not come: {}", dates.first?)),
        }
    }
}
