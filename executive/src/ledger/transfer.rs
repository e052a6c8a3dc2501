//! The ledger carried over to the plan of a new version: tokens by the names of places; clocks, answers
//! and guards by those of transitions whose terms are the same. It follows from the record alone, so
//! that replay gives the same.

use super::Ledger;
use super::error::LedgerError;
use super::stage::MissionStage;
use armor_plan::{ComponentId, Plan, Version};
use std::collections::BTreeMap;
use std::sync::Arc;

impl Ledger {
    /// Returns what keeps the plan that follows from being taken now, in words.
    pub(crate) fn keeps_from(&self, next: &Plan) -> Option<String> {
        if self.stage != MissionStage::Playing {
            return Some("the mission is ending".to_owned());
        }
        if let Some(firing) = self.firings.values().next() {
            return Some(format!("{} is under way", firing.cause));
        }
        if let Err(why) = self.plan.counters_in(next, &self.counters) {
            return Some(why);
        }
        let marked = self.plan.place_ids().filter(|place| self.state.tokens(*place) > 0);
        marked.into_iter().find_map(|place| {
            let name = self.plan.net().place(place);
            let Some(after) = next.place_named(name) else {
                return Some(format!("`{name}` holds a token, and the new file has no such place"));
            };
            let (was, is) = (self.plan.place(place), next.place(after));
            let components = |of: &[ComponentId]| {
                let mut sorted = of.to_vec();
                sorted.sort_unstable();
                sorted
            };
            if components(&was.components) != components(&is.components) {
                return Some(format!(
                    "`{name}` is marked, and the new file gives it other components"
                ));
            }
            (was.safety != is.safety)
                .then(|| format!("`{name}` is marked, and the new file gives it another class"))
        })
    }

    /// Takes a new version.
    pub(super) fn take_version(
        &mut self,
        version: &Version,
        fingerprint: &str,
    ) -> Result<(), LedgerError> {
        let refused = |why| LedgerError::NotTaken { version: version.number, why };
        let plan = self.plan.read_next(version).map_err(refused)?;
        if plan.fingerprint() != fingerprint {
            let (mission, fingerprint) = (plan.mission().to_owned(), fingerprint.to_owned());
            return Err(LedgerError::OtherMission { mission, fingerprint });
        }
        if let Some(why) = self.keeps_from(&plan) {
            return Err(refused(why));
        }
        self.go_over_to(Arc::new(plan));
        Ok(())
    }

    fn go_over_to(&mut self, plan: Arc<Plan>) {
        let marking = self.plan.marking_in(&plan, self.state.marking());
        let marking = marking.expect("nothing keeps it from being taken");
        let counters = self.plan.counters_in(&plan, &self.counters);
        self.counters = counters.expect("nothing keeps it from being taken");
        let before = std::mem::replace(&mut self.plan, plan);
        let plan = Arc::clone(&self.plan);
        let next = self.state.in_another(Arc::clone(plan.net()), marking);
        let state = std::mem::replace(&mut self.state, next);
        let known: Vec<_> =
            plan.net().transition_ids().map(|id| before.goes_on_as(&plan, id)).collect();
        self.gates = self.gates.carried_to(&plan, &known);
        let mut consents = BTreeMap::new();
        for (id, known) in plan.net().transition_ids().zip(&known) {
            self.set_gate(id);
            let Some(known) = *known else { continue };
            if let Some(since) = state.enabled_since(known) {
                self.state.resume_clock(id, since);
            }
            let autonomy = plan.transition(id).autonomy;
            let asks_as_before = before.transition(known).autonomy == autonomy;
            let consent = self.authority.consent(known).filter(|_| asks_as_before);
            consents.extend(consent.map(|consent| (id, consent)));
        }
        (self.authority.consents, self.version_since) = (consents, self.at);
        self.conclude_if_ended();
    }
}
