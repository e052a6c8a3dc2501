//! What is decided about who commands: the lease, the pause, and the answers of operators.

use crate::order::{Giver, Judged};
use armor_petri::{FiringClass, TransitionId};
use armor_plan::Plan;
use armor_robotfile::mission::LostLink;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// How many of the last orders are remembered, so that a repeated one is known as such.
const ORDERS: usize = 64;

/// The lease: who commands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lease {
    /// Who holds it.
    pub by: Giver,
    /// Since when.
    pub since: Duration,
}

/// A pause of the mission.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pause {
    /// Who ordered it.
    pub by: String,
    /// Since when.
    pub since: Duration,
}

/// The state of the question whether an enabled transition may fire. It is forgotten when the
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

/// Who commands, and what operators have answered.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Authority {
    pub(super) lease: Option<Lease>,
    /// When the link to the holder was lost, if no operator has taken the command since.
    pub(super) link_lost: Option<Duration>,
    pub(super) pause: Option<Pause>,
    /// When the last pause ended.
    pub(super) resumed_at: Duration,
    pub(super) consents: BTreeMap<TransitionId, Consent>,
    /// The last orders and when they were given; the oldest first.
    pub(super) orders: VecDeque<(Judged, Duration)>,
}

impl Authority {
    /// Returns when the link to the holder was lost, if no operator has taken the command since.
    pub(crate) fn link_lost(&self) -> Option<Duration> {
        self.link_lost
    }

    /// Returns when the last pause ended.
    pub(crate) fn resumed_at(&self) -> Duration {
        self.resumed_at
    }

    /// Returns the last orders and when they were given; the oldest first.
    pub(crate) fn orders(&self) -> impl DoubleEndedIterator<Item = &(Judged, Duration)> {
        self.orders.iter()
    }

    /// Returns the state of the question about a transition.
    pub(crate) fn consent(&self, id: TransitionId) -> Option<Consent> {
        self.consents.get(&id).copied()
    }

    /// Returns the open questions and the answers.
    pub(crate) fn consents(&self) -> impl Iterator<Item = (&TransitionId, &Consent)> {
        self.consents.iter()
    }

    /// Whether a question is open or answered.
    pub(crate) fn has_consents(&self) -> bool {
        !self.consents.is_empty()
    }

    /// Notes an order. Who gives one that needs the command takes it from another holder, and ends
    /// the time without an operator.
    pub(super) fn note_order(&mut self, plan: &Plan, judged: &Judged, at: Duration) {
        self.orders.push_back((judged.clone(), at));
        if self.orders.len() > ORDERS {
            self.orders.pop_front();
        }
        if !judged.accepted {
            return;
        }
        let holds = |lease: &Lease| lease.by.instance == judged.by.instance;
        if judged.take && !self.lease.as_ref().is_some_and(holds) {
            self.lease = None;
        }
        if !judged.order.is_open_to_all() {
            self.link_is_back(plan, at);
        }
    }

    /// Gives the lease, unless it is held.
    pub(super) fn give_lease(&mut self, by: &Giver, since: Duration) {
        self.lease.get_or_insert_with(|| Lease { by: by.clone(), since });
    }

    pub(super) fn release_lease(&mut self) {
        self.lease = None;
    }

    pub(super) fn lose_link(&mut self, at: Duration) {
        (self.lease, self.link_lost) = (None, Some(at));
    }

    /// Questions that waited for the operator to come back have all their time again.
    fn link_is_back(&mut self, plan: &Plan, at: Duration) {
        if self.link_lost.take().is_none() {
            return;
        }
        for (id, consent) in &mut self.consents {
            let waits = plan.transition(*id).lost_link == Some(LostLink::Wait);
            if let (true, Consent::Asked(since)) = (waits, consent) {
                *since = at;
            }
        }
    }

    /// Questions whose clocks stood during a pause have the time that they had before it.
    pub(super) fn put_off_questions(&mut self, plan: &Plan, stood: Duration) {
        for (id, consent) in &mut self.consents {
            let held = plan.net().transition(*id).class == FiringClass::Ordinary;
            if let (true, Consent::Asked(since)) = (held, consent) {
                *since += stood;
            }
        }
    }

    pub(super) fn set_consent(&mut self, id: TransitionId, consent: Consent) {
        self.consents.insert(id, consent);
    }

    pub(super) fn forget_consent(&mut self, id: TransitionId) {
        self.consents.remove(&id);
    }

    /// Forgets an answer "no": there is a reason to ask again.
    pub(super) fn forget_refusal(&mut self, id: TransitionId) {
        if self.consent(id) == Some(Consent::Declined) {
            self.forget_consent(id);
        }
    }

    /// Forgets the questions about transitions that are not enabled any more.
    pub(super) fn retain_consents(&mut self, is_enabled: impl Fn(TransitionId) -> bool) {
        self.consents.retain(|id, _| is_enabled(*id));
    }

    pub(super) fn begin_pause(&mut self, by: &str, since: Duration) {
        self.pause = Some(Pause { by: by.to_owned(), since });
    }

    pub(super) fn end_pause(&mut self, at: Duration) -> Option<Pause> {
        let pause = self.pause.take()?;
        self.resumed_at = at;
        Some(pause)
    }
}
