//! What the marking shows of who commands: the pause, the lease, what is asked, the last orders.

use crate::authority::Consent;
use crate::controller::Controller;
use crate::operator::Link;
use armor_petri::TransitionId;
use armor_robotfile::mission::Autonomy;
use armor_sdk::Message;
use std::time::Duration;

/// How many of the last orders are shown.
const ORDERS: usize = 10;

/// The mission stands still.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct Paused {
    /// Who ordered it; `the executive` itself after a restart.
    pub by: String,
    /// Since when.
    #[message(unit = "s")]
    pub since_at_s: f64,
    /// Whether everything that was to come to rest has confirmed it.
    pub at_rest: bool,
}

/// Who commands the mission.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct Holder {
    /// Who.
    pub author: String,
    /// The process, and where it is if not on this host.
    pub from: String,
    /// Since when.
    #[message(unit = "s")]
    pub since_at_s: f64,
    /// Whether that process is connected.
    pub connected: bool,
    /// When the lease runs out if it does not come back.
    #[message(unit = "s")]
    pub runs_out_at_s: Option<f64>,
}

/// A transition that asks before it fires.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct Confirmation {
    /// The transition.
    pub transition: String,
    /// Since when it asks.
    #[message(unit = "s")]
    pub asked_at_s: f64,
    /// Until when an answer is waited for, if not for ever.
    #[message(unit = "s")]
    pub answer_by_at_s: Option<f64>,
    /// What it does without an answer: `fire` or `decline`.
    pub unanswered: String,
    /// Whether that time stands still, in a pause or until the operator is back.
    pub put_off: bool,
}

/// An order that was given.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct OrderGiven {
    /// When.
    #[message(unit = "s")]
    pub given_at_s: f64,
    /// By whom.
    pub author: String,
    /// What was to be done, in words.
    pub order: String,
    /// Whether it was.
    pub accepted: bool,
    /// What followed from it, or why it was refused.
    pub text: String,
}

impl Controller {
    pub(super) fn paused(&self) -> Option<Paused> {
        let pause = self.ledger.pause()?;
        let mut held = self.plan.component_ids().filter(|c| self.wants_off(*c));
        Some(Paused {
            by: pause.by.clone(),
            since_at_s: pause.since.as_secs_f64(),
            at_rest: held.all(|component| self.is_settled_off(component)),
        })
    }

    pub(super) fn holder(&self) -> Option<Holder> {
        let lease = self.ledger.lease()?;
        Some(Holder {
            author: lease.by.author.clone(),
            from: lease.by.from.clone(),
            since_at_s: lease.since.as_secs_f64(),
            connected: matches!(self.link, Link::Up(_)),
            runs_out_at_s: self
                .lease_due()
                .map(|due| (self.now + due.saturating_sub(self.host)).as_secs_f64()),
        })
    }

    pub(super) fn confirmations(&self) -> Vec<Confirmation> {
        let consents = self.ledger.authority.consents.iter();
        let asked = consents.filter_map(|(id, consent)| match consent {
            Consent::Asked(since) => Some(self.confirmation(*id, *since)),
            Consent::Granted | Consent::Declined => None,
        });
        asked.collect()
    }

    fn confirmation(&self, id: TransitionId, since: Duration) -> Confirmation {
        let by = self.answer_within(id).map(|within| since.saturating_add(within).as_secs_f64());
        let fires = matches!(
            self.plan.transition(id).autonomy,
            Autonomy::Confirm { fire_unanswered: true, .. }
        );
        Confirmation {
            transition: self.plan.net.transition(id).name.clone(),
            asked_at_s: since.as_secs_f64(),
            answer_by_at_s: by,
            unanswered: if fires { "fire" } else { "decline" }.to_owned(),
            put_off: self.is_put_off(id),
        }
    }

    pub(super) fn last_orders(&self) -> Vec<OrderGiven> {
        let all = self.ledger.orders();
        let old = self.ledger.authority.orders.len().saturating_sub(ORDERS);
        let shown = |(judged, at): &(crate::order::Judged, Duration)| OrderGiven {
            given_at_s: at.as_secs_f64(),
            author: judged.by.author.clone(),
            order: judged.order.to_string(),
            accepted: judged.accepted,
            text: judged.text.clone(),
        };
        all.skip(old).map(shown).collect()
    }
}
