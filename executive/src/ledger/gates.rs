//! What is decided about the gates of transitions: whether their guards are true, and where their
//! dates stand. A gate is open while guard, report and dates all are as they should be.

use armor_petri::TransitionId;
use armor_plan::{DatePhase, Plan};
use armor_robotfile::mission::Missed;
use serde::{Deserialize, Serialize};

/// Where the dates of a transition stand, as decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct DateState {
    pub(crate) phase: DatePhase,
    /// It has fired since the mission began.
    pub(crate) used: bool,
}

/// Guards and dates, per transition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Gates {
    /// Whether its guard is true; true of a transition without one.
    guards: Vec<bool>,
    dates: Vec<DateState>,
}

impl Gates {
    pub(super) fn new(plan: &Plan) -> Self {
        let transitions = plan.transitions();
        Self {
            guards: transitions.iter().map(|t| t.guard.is_none()).collect(),
            dates: vec![DateState::default(); transitions.len()],
        }
    }

    /// Carries the gates over to a plan that follows; `known` names, per transition of it, the one
    /// that it continues. Another guard is weighed at the next settling, and so is a date; until
    /// then the guard counts as false, and the date as still to come.
    pub(super) fn carried_to(&self, plan: &Plan, known: &[Option<TransitionId>]) -> Self {
        let guard = |known: &Option<TransitionId>| known.is_some_and(|id| self.guard(id));
        let transitions = plan.transitions().iter();
        Self {
            guards: transitions.zip(known).map(|(t, it)| t.guard.is_none() || guard(it)).collect(),
            dates: known
                .iter()
                .map(|it| it.map_or(DateState::default(), |id| self.date(id)))
                .collect(),
        }
    }

    pub(super) fn guard(&self, id: TransitionId) -> bool {
        self.guards[id.index()]
    }

    pub(super) fn set_guard(&mut self, id: TransitionId, is_true: bool) {
        self.guards[id.index()] = is_true;
    }

    pub(super) fn date(&self, id: TransitionId) -> DateState {
        self.dates[id.index()]
    }

    pub(super) fn set_date(&mut self, id: TransitionId, date: DateState) {
        self.dates[id.index()] = date;
    }

    pub(super) fn set_date_phase(&mut self, id: TransitionId, phase: DatePhase) {
        self.dates[id.index()].phase = phase;
    }

    /// Notes that a transition with dates has fired: one whose date had passed fires once.
    pub(super) fn use_date(&mut self, id: TransitionId) {
        self.dates[id.index()].used = true;
    }

    /// Whether its dates let a transition fire; true of one without dates.
    pub(super) fn is_in_date(&self, plan: &Plan, id: TransitionId) -> bool {
        let Some(planned) = &plan.transition(id).dates else {
            return true;
        };
        let DateState { phase, used } = self.date(id);
        match phase {
            DatePhase::Early => false,
            DatePhase::Open => true,
            DatePhase::Past => planned.missed == Missed::Fire && !used,
        }
    }
}
