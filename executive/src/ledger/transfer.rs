//! The ledger carried over to the plan of a new version: tokens by the names of places; clocks,
//! answers and guards by those of transitions whose terms are the same; activations end whose values
//! differ. It follows from the record alone, so that replay gives the same.

use super::Ledger;
use super::activation::have_same_terms;
use super::error::LedgerError;
use super::reports::forget_reports_of;
use super::stage::MissionStage;
use armor_plan::{ComponentId, Plan, Version};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Returns what prevents the plan that follows from being taken now, in words.
pub(crate) fn find_obstacle(ledger: &Ledger, next: &Plan) -> Option<String> {
    if ledger.stage != MissionStage::Playing {
        return Some("the mission is ending".to_owned());
    }
    if let Some(firing) = ledger.firings.values().next() {
        return Some(format!("{} is under way", firing.cause));
    }
    if let Err(why) = ledger.plan.counters_in(next, &ledger.counters) {
        return Some(why);
    }
    let marked = ledger.plan.place_ids().filter(|place| ledger.state.tokens(*place) > 0);
    marked.into_iter().find_map(|place| {
        let name = ledger.plan.net().place(place);
        let Some(after) = next.place_named(name) else {
            return Some(format!("`{name}` holds a token, and the new file has no such place"));
        };
        let (was, is) = (ledger.plan.place(place), next.place(after));
        let components = |of: &[ComponentId]| {
            let mut sorted = of.to_vec();
            sorted.sort_unstable();
            sorted
        };
        if components(&was.components) != components(&is.components) {
            return Some(format!("`{name}` is marked, and the new file gives it other components"));
        }
        (was.safety != is.safety)
            .then(|| format!("`{name}` is marked, and the new file gives it another class"))
    })
}

/// Returns the components that have to be started again when the plan that follows is taken: marked
/// places give them other values there, and they run with other values than these. No firing is in
/// flight.
pub(crate) fn components_with_other_values(ledger: &Ledger, next: &Plan) -> Vec<ComponentId> {
    let marking = ledger.plan.marking_in(next, ledger.state.marking());
    let marking = marking.expect("`find_obstacle` has found a place for each token");
    let differs = |component: &ComponentId| {
        let last = &ledger.activations[component.index()];
        let runs = last.open && last.number > 0;
        if !runs || !next.component(*component).is_controlled() || !ledger.is_marked(*component) {
            return false;
        }
        let before = ledger.plan.values_in(*component, |place| ledger.state.tokens(place) > 0);
        let after = next.values_in(*component, |place| marking[place.index()] > 0);
        !have_same_terms(&before, &after) && !have_same_terms(&last.values, &after)
    };
    ledger.plan.component_ids().filter(differs).collect()
}

/// Ends the activations of these components, with their reports: they are needed, so that each is
/// stopped and started again.
pub(super) fn end_activations(ledger: &mut Ledger, names: &[String]) -> Result<(), LedgerError> {
    for name in names {
        let component = ledger.find_component(name)?;
        let activation = &mut ledger.activations[component.index()];
        (activation.open, activation.interrupted) = (false, false);
        (activation.done, activation.failed) = (false, None);
        forget_reports_of(ledger, component);
    }
    Ok(())
}

/// Takes a new version.
pub(super) fn take_version(
    ledger: &mut Ledger,
    version: &Version,
    fingerprint: &str,
) -> Result<(), LedgerError> {
    let refused = |why| LedgerError::NotTaken { version: version.number, why };
    let plan = ledger.plan.read_next(version).map_err(refused)?;
    if plan.fingerprint() != fingerprint {
        let (mission, fingerprint) = (plan.mission().to_owned(), fingerprint.to_owned());
        return Err(LedgerError::OtherMission { mission, fingerprint });
    }
    if let Some(why) = find_obstacle(ledger, &plan) {
        return Err(refused(why));
    }
    adopt_plan(ledger, Arc::new(plan));
    Ok(())
}

fn adopt_plan(ledger: &mut Ledger, plan: Arc<Plan>) {
    let marking = ledger.plan.marking_in(&plan, ledger.state.marking());
    let marking = marking.expect("`find_obstacle` has found a place for each token");
    let counters = ledger.plan.counters_in(&plan, &ledger.counters);
    ledger.counters = counters.expect("`find_obstacle` has compared the domains");
    let before = std::mem::replace(&mut ledger.plan, plan);
    let plan = Arc::clone(&ledger.plan);
    let next = ledger.state.in_another(Arc::clone(plan.net()), marking);
    let state = std::mem::replace(&mut ledger.state, next);
    let known: Vec<_> =
        plan.net().transition_ids().map(|id| before.continues_as(&plan, id)).collect();
    ledger.gates = ledger.gates.carried_to(&plan, &known);
    let mut consents = BTreeMap::new();
    for (id, known) in plan.net().transition_ids().zip(&known) {
        // Before the clock: a transition behind a closed gate has none.
        ledger.set_gate(id);
        let Some(known) = *known else { continue };
        if let Some(since) = state.enabled_since(known) {
            ledger.state.resume_clock(id, since);
        }
        let autonomy = plan.transition(id).autonomy;
        let asks_as_before = before.transition(known).autonomy == autonomy;
        let consent = ledger.authority.consent(known).filter(|_| asks_as_before);
        consents.extend(consent.map(|consent| (id, consent)));
    }
    (ledger.authority.consents, ledger.version_since) = (consents, ledger.at);
    ledger.conclude_if_ended();
}
