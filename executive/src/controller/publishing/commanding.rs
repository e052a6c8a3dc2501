//! What the marking shows of who commands: the pause, the lease, what is asked, the last orders.

use crate::controller::Controller;
use crate::controller::confirmations::{answer_within, is_put_off};
use crate::controller::wishes::{is_settled_off, wants_off};
use crate::ledger::Consent;
use crate::order::Judged;
use armor_marking::{Confirmation, Holder, OrderGiven, Paused, UnansweredAction};
use armor_petri::TransitionId;
use armor_robotfile::mission::Autonomy;
use std::time::Duration;

/// How many of the last orders are shown.
const ORDERS: usize = 10;

impl Controller {
    pub(super) fn pause_shown(&self) -> Option<Paused> {
        let pause = self.ledger().pause()?;
        let mut held = self.plan().component_ids().filter(|c| wants_off(&self.context, *c));
        Some(Paused {
            by: pause.by.clone(),
            since_at_s: pause.since.as_secs_f64(),
            at_rest: held.all(|component| is_settled_off(&self.context, component)),
        })
    }

    pub(super) fn holder_shown(&self) -> Option<Holder> {
        let lease = self.ledger().lease()?;
        Some(Holder {
            author: lease.by.author.clone(),
            from: lease.by.from.clone(),
            since_at_s: lease.since.as_secs_f64(),
            connected: self.operators.is_holder_connected(),
            runs_out_at_s: self.operators.lease_due(&self.context).map(|due| {
                (self.context.now() + due.saturating_sub(self.context.host())).as_secs_f64()
            }),
        })
    }

    pub(super) fn open_confirmations(&self) -> Vec<Confirmation> {
        let consents = self.ledger().authority().consents();
        let asked = consents.filter_map(|(id, consent)| match consent {
            Consent::Asked(since) => Some(self.confirmation_of(*id, *since)),
            Consent::Granted | Consent::Declined => None,
        });
        asked.collect()
    }

    fn confirmation_of(&self, id: TransitionId, since: Duration) -> Confirmation {
        let by = answer_within(self.ledger(), id)
            .map(|within| since.saturating_add(within).as_secs_f64());
        let unanswered = match self.plan().transition(id).autonomy {
            Autonomy::Confirm { fire_unanswered: true, .. } => UnansweredAction::Fire,
            Autonomy::Confirm { fire_unanswered: false, .. }
            | Autonomy::Auto
            | Autonomy::Operator => UnansweredAction::Decline,
        };
        Confirmation {
            transition: self.plan().net().transition(id).name.clone(),
            asked_at_s: since.as_secs_f64(),
            answer_by_at_s: by,
            unanswered,
            put_off: is_put_off(self.ledger(), id),
        }
    }

    pub(super) fn last_orders(&self) -> Vec<OrderGiven> {
        let all = self.ledger().orders();
        let old = self.ledger().orders().count().saturating_sub(ORDERS);
        let shown = |(judged, at): &(Judged, Duration)| OrderGiven {
            given_at_s: at.as_secs_f64(),
            author: judged.by.author.clone(),
            order: judged.order.to_string(),
            accepted: judged.accepted,
            text: judged.text.clone(),
        };
        all.skip(old).map(shown).collect()
    }
}
