//! What is decided about who commands: the lease, the pause, and what operators have answered.
//! Part of the ledger, so it changes by records alone.

use crate::ledger::{Firing, Ledger, LedgerError, Stage};
use crate::order::{Giver, Judged, Order, TokenMove};
use crate::record::{Cause, Outcome};
use armor_petri::{Class, PlaceId, TransitionId};
use armor_plan::ComponentId;
use armor_robotfile::mission::LostLink;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// How many of the last orders are remembered, so that a repeated one is known as such.
const ORDERS: usize = 64;

/// Who commands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lease {
    /// Who holds it.
    pub by: Giver,
    /// Since when.
    pub since: Duration,
}

/// While the mission stands still.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pause {
    /// Who ordered it.
    pub by: String,
    /// Since when.
    pub since: Duration,
}

/// What is said about an enabled transition that does not fire by itself. It is forgotten when the
/// transition fires or is no longer enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Consent {
    /// The operator is asked, since then.
    Asked(Duration),
    /// It may fire.
    Granted,
    /// It may not, and does not ask again.
    Declined,
}

/// See the module.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Authority {
    pub(crate) lease: Option<Lease>,
    /// The link to whoever commanded has been lost then, and nobody has come since.
    pub(crate) link_lost: Option<Duration>,
    pub(crate) pause: Option<Pause>,
    /// When the last pause ended.
    pub(crate) resumed_at: Duration,
    pub(crate) consents: BTreeMap<TransitionId, Consent>,
    /// The last orders and when they were given; the oldest first.
    pub(crate) orders: VecDeque<(Judged, Duration)>,
}

impl Ledger {
    /// Who commands, if anyone does.
    pub fn lease(&self) -> Option<&Lease> {
        self.authority.lease.as_ref()
    }

    /// Whether the mission stands still, and by whose order.
    pub fn pause(&self) -> Option<&Pause> {
        self.authority.pause.as_ref()
    }

    /// The last orders and when they were given; the oldest first.
    pub fn orders(&self) -> impl Iterator<Item = &(Judged, Duration)> {
        self.authority.orders.iter()
    }

    pub(crate) fn ordered(&mut self, judged: &Judged) -> Result<(), LedgerError> {
        self.authority.orders.push_back((judged.clone(), self.at));
        if self.authority.orders.len() > ORDERS {
            self.authority.orders.pop_front();
        }
        if !judged.accepted {
            return Ok(());
        }
        let holds = |lease: &Lease| lease.by.instance == judged.by.instance;
        if judged.take && !self.authority.lease.as_ref().is_some_and(holds) {
            self.authority.lease = None;
        }
        if !judged.order.is_open_to_all() {
            self.link_is_back();
        }
        match &judged.order {
            Order::Lease => {
                if self.authority.lease.is_none() {
                    self.authority.lease = Some(Lease { by: judged.by.clone(), since: self.at });
                }
            }
            Order::Release => self.authority.lease = None,
            Order::Fire(name) | Order::Confirm(name) => self.consent(name, Consent::Granted)?,
            Order::Decline(name) => self.consent(name, Consent::Declined)?,
            Order::Pause => self.hold(&judged.by.author),
            Order::Resume => self.go_on(),
            Order::Safe if self.stage == Stage::Playing => {
                self.retreated(&format!("{} ordered it", judged.by.author));
            }
            Order::Safe | Order::Rejoin => {}
            Order::Move(moves) => self.move_tokens(moves)?,
        }
        Ok(())
    }

    /// What the operator says of a transition, or what follows from saying nothing.
    pub(crate) fn consent(&mut self, name: &str, consent: Consent) -> Result<(), LedgerError> {
        let id = self.transition(name)?;
        self.authority.consents.insert(id, consent);
        Ok(())
    }

    pub(crate) fn link_is_lost(&mut self) {
        (self.authority.lease, self.authority.link_lost) = (None, Some(self.at));
    }

    /// Those that wait for the operator to come back have all their time from now on.
    fn link_is_back(&mut self) {
        if self.authority.link_lost.take().is_none() {
            return;
        }
        for (id, consent) in &mut self.authority.consents {
            let waits = self.plan.transition(*id).lost_link == Some(LostLink::Wait);
            if let (true, Consent::Asked(since)) = (waits, consent) {
                *since = self.at;
            }
        }
    }

    /// Clocks stop, and what runs is interrupted: its reports so far stand when it goes on.
    pub(crate) fn hold(&mut self, by: &str) {
        if self.authority.pause.is_some() || self.stage != Stage::Playing {
            return;
        }
        self.authority.pause = Some(Pause { by: by.to_owned(), since: self.at });
        self.state.hold();
        for component in self.plan.component_ids() {
            let runs_on = self.runs(component) || !self.plan.component(component).is_controlled();
            let activation = &mut self.activations[component.index()];
            activation.interrupted = activation.open && !runs_on;
        }
    }

    fn go_on(&mut self) {
        let Some(pause) = self.end_pause() else { return };
        let stood = self.at.saturating_sub(pause.since);
        for (id, consent) in &mut self.authority.consents {
            let held = self.plan.net().transition(*id).class == Class::Ordinary;
            if let (true, Consent::Asked(since)) = (held, consent) {
                *since += stood;
            }
        }
        for firing in self.firings.values_mut() {
            firing.since = self.at;
        }
        self.conclude();
    }

    pub(crate) fn end_pause(&mut self) -> Option<Pause> {
        let pause = self.authority.pause.take()?;
        self.state.release();
        self.authority.resumed_at = self.at;
        Some(pause)
    }

    fn move_tokens(&mut self, moves: &[TokenMove]) -> Result<(), LedgerError> {
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

    /// Over, if the goal or the safe place is marked. A pause puts that off, but for safety.
    pub(crate) fn conclude(&mut self) {
        let marked = |place: Option<PlaceId>| place.is_some_and(|p| self.state.tokens(p) > 0);
        if marked(self.plan.safe()) {
            self.stage = Stage::Ending(Outcome::Safe);
        } else if marked(self.plan.goal())
            && self.stage == Stage::Playing
            && self.authority.pause.is_none()
        {
            self.stage = Stage::Ending(Outcome::Goal);
        }
        if self.stage != Stage::Playing {
            self.firings.clear();
            self.end_pause();
        }
    }

    pub(crate) fn forget_consents(&mut self) {
        let state = &self.state;
        self.authority.consents.retain(|id, _| state.enabled_since(*id).is_some());
    }

    /// Whether the components of a place run while it is marked: a pause stops all but safety's.
    pub(crate) fn plays(&self, place: PlaceId) -> bool {
        self.authority.pause.is_none() || self.plan.place(place).safety
    }

    /// Whether a marked place wants the component to run, now.
    pub(crate) fn runs(&self, component: ComponentId) -> bool {
        let places = &self.plan.component(component).places;
        places.iter().any(|place| self.state.tokens(*place) > 0 && self.plays(*place))
    }

    /// Whether these places, once marked, want the component to run, now.
    pub(crate) fn activates_now(&self, to: &[(PlaceId, u32)], component: ComponentId) -> bool {
        let places = &self.plan.component(component).places;
        to.iter().any(|(place, _)| places.contains(place) && self.plays(*place))
    }

    /// Whether a firing in flight stays where it is until the pause is over.
    pub(crate) fn is_held(&self, firing: &Firing) -> bool {
        let of_safety = match &firing.cause {
            Cause::Transition(name) => self
                .plan
                .transition_named(name)
                .is_some_and(|id| self.plan.net().transition(id).class == Class::Safety),
            Cause::Retreat => true,
            Cause::Start | Cause::Failure { .. } => false,
        };
        let to_safety = || firing.to.iter().any(|arc| self.plan.place(arc.0).safety);
        self.authority.pause.is_some() && !of_safety && !to_safety()
    }
}
