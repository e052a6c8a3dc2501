//! What orders of operators change: the lease, answers, the pause, and tokens that are moved.

use super::Ledger;
use super::authority::{Consent, Pause};
use super::error::LedgerError;
use super::stage::MissionStage;
use crate::order::{Judged, MissionOrder, MovedTokens};

impl Ledger {
    /// Carries out an order that was accepted, and remembers it.
    pub(super) fn carry_out(&mut self, judged: &Judged) -> Result<(), LedgerError> {
        self.authority.note_order(&self.plan, judged, self.at);
        if !judged.accepted {
            return Ok(());
        }
        match &judged.order {
            MissionOrder::Lease => self.authority.give_lease(&judged.by, self.at),
            MissionOrder::Release => self.authority.release_lease(),
            MissionOrder::Fire(name) | MissionOrder::Confirm(name) => {
                self.set_consent(name, Consent::Granted)?;
            }
            MissionOrder::Decline(name) => self.set_consent(name, Consent::Declined)?,
            MissionOrder::Pause => self.begin_pause(&judged.by.author),
            MissionOrder::Resume => self.end_pause_by_order(),
            MissionOrder::Safe if self.stage == MissionStage::Playing => {
                self.begin_retreat(&format!("{} ordered it", judged.by.author));
            }
            MissionOrder::Safe | MissionOrder::Rejoin => {}
            MissionOrder::Move(moves) => self.move_tokens(moves)?,
        }
        Ok(())
    }

    /// Notes a question about a transition, its answer, or what follows without one.
    pub(super) fn set_consent(&mut self, name: &str, consent: Consent) -> Result<(), LedgerError> {
        let id = self.find_transition(name)?;
        self.authority.set_consent(id, consent);
        Ok(())
    }

    /// Begins a pause: clocks stop, and what runs is interrupted. Its reports so far stand afterwards.
    pub(super) fn begin_pause(&mut self, by: &str) {
        if self.authority.pause.is_some() || self.stage != MissionStage::Playing {
            return;
        }
        self.authority.begin_pause(by, self.at);
        self.state.hold();
        for component in self.plan.component_ids() {
            let runs_on = self.runs(component) || !self.plan.component(component).is_controlled();
            let activation = &mut self.activations[component.index()];
            activation.interrupted = activation.open && !runs_on;
        }
    }

    fn end_pause_by_order(&mut self) {
        let Some(pause) = self.end_pause() else {
            return;
        };
        let stood = self.at.saturating_sub(pause.since);
        self.authority.put_off_questions(&self.plan, stood);
        for firing in self.firings.values_mut() {
            firing.since = self.at;
        }
        self.conclude_if_ended();
    }

    pub(super) fn end_pause(&mut self) -> Option<Pause> {
        let pause = self.authority.end_pause(self.at)?;
        self.state.release();
        Some(pause)
    }

    fn move_tokens(&mut self, moves: &[MovedTokens]) -> Result<(), LedgerError> {
        let place = |name: &str| {
            let found = self.plan.place_named(name);
            found.ok_or_else(|| LedgerError::UnknownName(name.to_owned()))
        };
        let moves: Vec<_> = moves
            .iter()
            .map(|it| Ok((place(&it.from)?, place(&it.to)?, it.tokens)))
            .collect::<Result<_, LedgerError>>()?;
        let refused = |why| LedgerError::NotAllowed { what: "the move of tokens".to_owned(), why };
        for &(from, to, tokens) in &moves {
            self.state.remove(from, tokens).map_err(refused)?;
            self.state.add(to, tokens).map_err(refused)?;
        }
        Ok(())
    }
}
