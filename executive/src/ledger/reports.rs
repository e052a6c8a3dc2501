//! Which reports count: those of activations that are not over, each until a transition consumes it. A
//! report that stands keeps the gates open of the transitions that wait for it.

use super::Ledger;
use super::activation::Activation;
use crate::terms::ComponentReport;
use armor_petri::{PlaceId, TransitionId};
use armor_plan::{ComponentId, GivenValue};
use std::collections::BTreeSet;

impl Ledger {
    pub(super) fn begin_activation(
        &mut self,
        component: ComponentId,
        number: u64,
        values: &[GivenValue],
    ) {
        self.last_activation = self.last_activation.max(number);
        let activation = &mut self.activations[component.index()];
        let heard = activation.heard;
        let finished = activation.has_finished();
        let goes_on = activation.interrupted && activation.open && !finished;
        let values = values.to_vec();
        *activation = Activation { number, open: true, heard, values, ..Activation::default() };
        if !goes_on {
            self.forget_reports_of(component);
        }
        for firing in self.firings.values_mut() {
            firing.renewing.remove(&component);
        }
    }

    pub(super) fn take_report(
        &mut self,
        component: ComponentId,
        heard: (u64, u64),
        report: &ComponentReport,
    ) {
        let activation = &mut self.activations[component.index()];
        if heard.0 != 0 {
            activation.heard = heard;
        }
        let mut worth = 1.0;
        match report {
            ComponentReport::Done => activation.done = true,
            ComponentReport::Failed { reason } => activation.failed = Some(reason.clone()),
            ComponentReport::Event { value, .. } => worth = *value,
        }
        let key = (component, report.name().to_owned());
        self.standing.insert(key.clone(), worth);
        self.set_gates(&key);
        // A new report is a reason to ask again.
        for id in self.plan.listeners(key.0, &key.1) {
            self.authority.forget_refusal(*id);
        }
    }

    /// Closes activations that nothing needs any more, and forgets events that no transition which could
    /// fire waits for. `done` and `failed` stand as long as their activation.
    pub(super) fn forget_what_no_longer_counts(&mut self) {
        for component in self.plan.component_ids() {
            if self.plan.component(component).is_controlled()
                && self.activations[component.index()].open
                && !self.is_needed(component)
            {
                self.activations[component.index()].open = false;
                self.forget_reports_of(component);
            }
        }
        let idle = |key: &&(ComponentId, String)| {
            !matches!(key.1.as_str(), "done" | "failed") && !self.has_use_for(key)
        };
        let idle: Vec<_> = self.standing.keys().filter(idle).cloned().collect();
        for key in idle {
            self.standing.remove(&key);
            self.set_gates(&key);
        }
    }

    /// Whether a transition waits for this report whose places are all marked, or about to be.
    fn has_use_for(&self, key: &(ComponentId, String)) -> bool {
        let arriving =
            |place| self.firings.values().any(|firing| firing.to.iter().any(|arc| arc.0 == place));
        let waits = |id: &TransitionId| {
            let inputs = &self.plan.net().transition(*id).inputs;
            inputs.iter().all(|arc| self.state.tokens(arc.0) > 0 || arriving(arc.0))
        };
        self.plan.listeners(key.0, &key.1).iter().any(waits)
    }

    pub(super) fn forget_reports_of(&mut self, component: ComponentId) {
        let range = (component, String::new())..(ComponentId(component.0 + 1), String::new());
        let keys: Vec<_> = self.standing.range(range).map(|entry| entry.0.clone()).collect();
        for key in keys {
            self.standing.remove(&key);
            self.set_gates(&key);
        }
    }

    /// Opens or shuts the gates of those that wait for a report.
    pub(super) fn set_gates(&mut self, key: &(ComponentId, String)) {
        for id in self.plan.listeners(key.0, &key.1).to_vec() {
            self.set_gate(id);
        }
    }

    /// Those of the components to be active that have finished what they were activated for.
    pub(super) fn finished_in(&self, to: &[(PlaceId, u32)]) -> BTreeSet<ComponentId> {
        let components = to.iter().flat_map(|arc| &self.plan.place(arc.0).components);
        let finished =
            |component: &&ComponentId| self.activations[component.index()].has_finished();
        components.filter(finished).copied().collect()
    }
}
