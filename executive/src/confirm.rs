//! Transitions that do not fire by themselves: the operator's, and those that ask. Asking, the
//! deadline of an answer, and what happens without one.

use crate::authority::Consent;
use crate::controller::Controller;
use crate::ledger::Stage;
use crate::record::Entry;
use armor_petri::{Class, TransitionId};
use armor_robotfile::mission::{Autonomy, LostLink};
use std::time::Duration;

impl Controller {
    /// The transition whose turn it is: what operators let fire, else what fires by itself.
    pub(crate) fn next_ready(&self) -> Option<TransitionId> {
        let state = &self.ledger.state;
        let mut ready = state.ready().filter(|id| !self.waits_for_utc(*id));
        let by_itself = ready.find(|id| self.fires_by_itself(*id))?;
        let safety = self.plan.net().transition(by_itself).class == Class::Safety;
        let granted = || state.ready().find(|id| self.is_granted(*id) && !self.waits_for_utc(*id));
        if safety || self.ledger.authority.consents.is_empty() {
            return Some(by_itself);
        }
        granted().or(Some(by_itself))
    }

    /// When a transition fires next without anything happening.
    pub(crate) fn next_firing(&self) -> Option<Duration> {
        let state = &self.ledger.state;
        let held = state.held_since().is_some();
        let runs =
            |id: &TransitionId| !held || self.plan.net().transition(*id).class == Class::Safety;
        // One that has still to ask has to be looked at when its time comes.
        let acts = |id: &TransitionId| {
            self.fires_by_itself(*id) || self.plan.transition(*id).asks() && self.is_unasked(*id)
        };
        let knows = |id: &TransitionId| !self.waits_for_utc(*id);
        let next = state.enabled().find(|id| runs(id) && knows(id) && acts(id))?;
        state.earliest(next).map(|at| at.max(state.now()))
    }

    /// Asks about those whose time has come, and takes silence for an answer where it has lasted.
    pub(crate) fn ask(&mut self) {
        if self.ledger.stage != Stage::Playing {
            return;
        }
        let silent: Vec<_> = self.answers_due().filter(|due| due.1 <= self.now).collect();
        for (id, _) in silent {
            let Autonomy::Confirm { fire_unanswered: fires, .. } =
                self.plan.transition(id).autonomy
            else {
                continue;
            };
            let transition = self.plan.net().transition(id).name.clone();
            self.record(Entry::Unanswered { transition, fires });
        }
        if self.next_ready().is_some() {
            return;
        }
        let unasked = self.ledger.state.ready().filter(|id| {
            let asks = self.plan.transition(*id).asks() && !self.fires_by_itself(*id);
            asks && self.is_unasked(*id) && !self.waits_for_utc(*id)
        });
        for id in unasked.collect::<Vec<_>>() {
            let transition = self.plan.net().transition(id).name.clone();
            self.record(Entry::Asked { transition });
        }
    }

    /// Until when answers are waited for.
    pub(crate) fn answers_due(&self) -> impl Iterator<Item = (TransitionId, Duration)> {
        let playing = self.ledger.stage == Stage::Playing && !self.stopping;
        let consents = self.ledger.authority.consents.iter();
        consents.filter_map(move |(id, consent)| {
            let Consent::Asked(since) = consent else { return None };
            let due = since.saturating_add(self.answer_within(*id)?);
            (playing && !self.is_put_off(*id)).then_some((*id, due))
        })
    }

    /// How long an answer is waited for.
    pub(crate) fn answer_within(&self, id: TransitionId) -> Option<Duration> {
        match self.plan.transition(id).autonomy {
            Autonomy::Confirm { within, .. } => within,
            Autonomy::Auto | Autonomy::Operator => None,
        }
    }

    /// Whether the time for an answer stands still.
    pub(crate) fn is_put_off(&self, id: TransitionId) -> bool {
        let authority = &self.ledger.authority;
        let held =
            authority.pause.is_some() && self.plan.net().transition(id).class == Class::Ordinary;
        let waits = authority.link_lost.is_some()
            && self.plan.transition(id).lost_link == Some(LostLink::Wait);
        held || waits
    }

    /// Whether nobody needs to be asked, any more.
    pub(crate) fn fires_by_itself(&self, id: TransitionId) -> bool {
        let planned = self.plan.transition(id);
        let on_its_own = || {
            self.ledger.authority.link_lost.is_some() && planned.lost_link == Some(LostLink::Fire)
        };
        planned.autonomy == Autonomy::Auto || on_its_own() || self.is_granted(id)
    }

    pub(crate) fn is_granted(&self, id: TransitionId) -> bool {
        self.ledger.authority.consents.get(&id) == Some(&Consent::Granted)
    }

    /// Whether it does not fire until it is newly enabled.
    pub(crate) fn is_declined(&self, id: TransitionId) -> bool {
        self.ledger.authority.consents.get(&id) == Some(&Consent::Declined)
    }

    fn is_unasked(&self, id: TransitionId) -> bool {
        !self.ledger.authority.consents.contains_key(&id)
    }
}
