//! The ledger carried over to the plan of a new version: tokens by the names of places; clocks,
//! answers and guards by those of transitions whose terms are the same. Part of the ledger, so it
//! is the same when the journal is played again.

use crate::dates::{Dated, PlannedDates};
use crate::ledger::{Ledger, LedgerError, Stage};
use crate::plan::{ComponentId, Plan};
use crate::version::Version;
use armor_petri::{Class, PlaceId, TransitionId};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What a transition needs to be enabled: while that stays, its clock goes on.
#[derive(PartialEq, Eq)]
struct Terms<'a> {
    inputs: Vec<(&'a str, u32)>,
    reads: Vec<(&'a str, u32)>,
    inhibitors: Vec<(&'a str, u32)>,
    /// Components have the same numbers in both.
    on: Option<&'a (ComponentId, String)>,
    guard: Option<String>,
    dates: Option<PlannedDates>,
    class: Class,
}

impl Plan {
    fn terms(&self, id: TransitionId) -> Terms<'_> {
        let (transition, planned) = (self.net.transition(id), self.transition(id));
        let named = |arcs: &[(PlaceId, u32)]| {
            let mut named: Vec<_> = arcs.iter().map(|arc| (self.net.place(arc.0), arc.1)).collect();
            named.sort_unstable();
            named
        };
        Terms {
            inputs: named(&transition.inputs),
            reads: named(&transition.reads),
            inhibitors: named(&transition.inhibitors),
            on: planned.on.as_ref(),
            dates: planned.dates,
            guard: planned.guard.as_ref().map(|guard| guard.guard.to_string()),
            class: transition.class,
        }
    }

    /// The transition of `self` that goes on as `id` of the plan that follows.
    pub(crate) fn goes_on_as(&self, next: &Self, id: TransitionId) -> Option<TransitionId> {
        let known = self.transition_named(&next.net.transition(id).name)?;
        (self.terms(known) == next.terms(id)).then_some(known)
    }

    /// The tokens per place of the plan that follows, if each of them has a place there.
    pub(crate) fn marking_in(&self, next: &Self, marking: &[u32]) -> Option<Vec<u32>> {
        let mut carried = vec![0; next.places.len()];
        for (name, tokens) in self.net.places().iter().zip(marking).filter(|it| *it.1 > 0) {
            carried[next.place_named(name)?.index()] = *tokens;
        }
        Some(carried)
    }
}

impl Ledger {
    /// The plan that is played.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.plan
    }

    /// What has to be otherwise before the plan that follows can be played, in words.
    pub(crate) fn keeps_from(&self, next: &Plan) -> Option<String> {
        if self.stage != Stage::Playing {
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
            let name = self.plan.net.place(place);
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
    pub(crate) fn changed(
        &mut self,
        version: &Version,
        fingerprint: &str,
    ) -> Result<(), LedgerError> {
        let refused = |why| LedgerError::NotTaken { version: version.number, why };
        let plan = (self.plan.reader)(version, &self.plan).map_err(refused)?;
        if plan.fingerprint() != fingerprint {
            let (mission, fingerprint) = (plan.mission, fingerprint.to_owned());
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
        let next = self.state.in_another(Arc::clone(&plan.net), marking);
        let state = std::mem::replace(&mut self.state, next);
        let holds = std::mem::take(&mut self.holds);
        let dates = std::mem::take(&mut self.dates);
        let known: Vec<_> =
            plan.net.transition_ids().map(|id| before.goes_on_as(&plan, id)).collect();
        // A guard that is another one is weighed at once, and so is a date; until then a guard does
        // not hold, and a date is to come.
        self.dates = known
            .iter()
            .map(|known| known.map_or(Dated::default(), |known| dates[known.index()]))
            .collect();
        self.holds = (plan.transitions.iter().zip(&known))
            .map(|(planned, known)| {
                planned.guard.is_none() || known.is_some_and(|known| holds[known.index()])
            })
            .collect();
        let mut consents = BTreeMap::new();
        for (id, known) in plan.net.transition_ids().zip(&known) {
            self.set_gate(id);
            let Some(known) = *known else { continue };
            if let Some(since) = state.enabled_since(known) {
                self.state.resume_clock(id, since);
            }
            let autonomy = plan.transition(id).autonomy;
            let asks_as_before = before.transition(known).autonomy == autonomy;
            let consent = self.authority.consents.get(&known).filter(|_| asks_as_before);
            consents.extend(consent.map(|consent| (id, *consent)));
        }
        (self.authority.consents, self.version_since) = (consents, self.at);
        self.conclude();
    }
}
