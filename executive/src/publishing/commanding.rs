//! What the marking shows of who commands: the pause, the lease, what is asked, the last orders.

use crate::authority::Consent;
use crate::controller::Controller;
use crate::operator::Link;
use armor_marking::{Confirmation, Holder, OrderGiven, Paused};
use armor_petri::TransitionId;
use armor_robotfile::mission::Autonomy;
use std::time::Duration;

/// How many of the last orders are shown.
const ORDERS: usize = 10;

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
            transition: self.plan.net().transition(id).name.clone(),
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
