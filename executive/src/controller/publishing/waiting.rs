//! What the marking shows of the transitions that are not enabled although tokens wait for them.

use crate::controller::Controller;
use crate::controller::hindrances::token_hindrance;
use armor_marking::WaitingTransition;
use armor_petri::TransitionId;

impl Controller {
    /// Returns the transitions out of marked places that are not enabled; none once the mission
    /// has left its net.
    pub(super) fn waiting_transitions(&self) -> Vec<WaitingTransition> {
        if !self.context.may_fire() {
            return Vec::new();
        }
        let ids = self.plan().net().transition_ids();
        ids.filter_map(|id| self.waiting_transition(id)).collect()
    }

    fn waiting_transition(&self, id: TransitionId) -> Option<WaitingTransition> {
        let (ledger, net) = (self.ledger(), self.plan().net());
        let transition = net.transition(id);
        // One that takes no tokens waits where it reads them.
        let arcs = match transition.inputs.is_empty() {
            true => &transition.reads,
            false => &transition.inputs,
        };
        let marked = arcs.iter().filter(|arc| ledger.state().tokens(arc.0) > 0);
        let from: Vec<_> = marked.map(|arc| net.place(arc.0).to_owned()).collect();
        if from.is_empty() || ledger.state().enabled_since(id).is_some() {
            return None;
        }
        let planned = self.plan().transition(id);
        let tokens = token_hindrance(&self.context, id);
        let can_be_gated = tokens.is_none();
        let report = planned.on.as_ref();
        let report = report.filter(|report| can_be_gated && !ledger.has_report(report));
        Some(WaitingTransition {
            transition: transition.name.clone(),
            from,
            report: report.map_or(String::new(), |(component, report)| {
                format!("{}.{report}", self.plan().component(*component).name)
            }),
            guard: can_be_gated && planned.guard.is_some() && !ledger.guard_holds(id),
            hindrance: tokens
                .or_else(|| self.dates.date_hindrance(&self.context, id))
                .unwrap_or_default(),
        })
    }
}
