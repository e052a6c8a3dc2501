//! Which reports count: those of activations that are not over, each until a transition consumes
//! it. A report that stands keeps the gates open of the transitions that wait for it.

use super::Ledger;
use super::activation::Activation;
use crate::terms::ComponentReport;
use armor_petri::{PlaceId, TransitionId};
use armor_plan::{ComponentId, GivenValue};
use std::collections::BTreeSet;

pub(super) fn begin_activation(
    ledger: &mut Ledger,
    component: ComponentId,
    number: u64,
    values: &[GivenValue],
) {
    ledger.last_activation = ledger.last_activation.max(number);
    let activation = &mut ledger.activations[component.index()];
    let heard = activation.heard;
    let finished = activation.has_finished();
    let continues = activation.interrupted && activation.open && !finished;
    let values = values.to_vec();
    *activation = Activation { number, open: true, heard, values, ..Activation::default() };
    if !continues {
        forget_reports_of(ledger, component);
    }
    for firing in ledger.firings.values_mut() {
        firing.renewing.remove(&component);
    }
}

pub(super) fn take_report(
    ledger: &mut Ledger,
    component: ComponentId,
    heard: (u64, u64),
    report: &ComponentReport,
) {
    let activation = &mut ledger.activations[component.index()];
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
    ledger.standing.insert(key.clone(), worth);
    set_listening_gates(ledger, &key);
    // A new report is a reason to ask again.
    for id in ledger.plan.listeners(key.0, &key.1) {
        ledger.authority.forget_refusal(*id);
    }
}

/// Closes activations that nothing needs any more, and forgets events that no transition which
/// could fire waits for. `done` and `failed` stand as long as their activation.
pub(super) fn forget_obsolete_reports(ledger: &mut Ledger) {
    for component in ledger.plan.component_ids() {
        if ledger.plan.component(component).is_controlled()
            && ledger.activations[component.index()].open
            && !ledger.is_needed(component)
        {
            ledger.activations[component.index()].open = false;
            forget_reports_of(ledger, component);
        }
    }
    let idle = |key: &&(ComponentId, String)| {
        !matches!(key.1.as_str(), "done" | "failed") && !has_use_for(ledger, key)
    };
    let idle: Vec<_> = ledger.standing.keys().filter(idle).cloned().collect();
    for key in idle {
        ledger.standing.remove(&key);
        set_listening_gates(ledger, &key);
    }
}

/// Whether a transition waits for this report whose places are all marked, or about to be.
fn has_use_for(ledger: &Ledger, key: &(ComponentId, String)) -> bool {
    let arriving =
        |place| ledger.firings.values().any(|firing| firing.to.iter().any(|arc| arc.0 == place));
    let waits = |id: &TransitionId| {
        let inputs = &ledger.plan.net().transition(*id).inputs;
        inputs.iter().all(|arc| ledger.state.tokens(arc.0) > 0 || arriving(arc.0))
    };
    ledger.plan.listeners(key.0, &key.1).iter().any(waits)
}

pub(super) fn forget_reports_of(ledger: &mut Ledger, component: ComponentId) {
    let range = (component, String::new())..(ComponentId(component.0 + 1), String::new());
    let keys: Vec<_> = ledger.standing.range(range).map(|entry| entry.0.clone()).collect();
    for key in keys {
        ledger.standing.remove(&key);
        set_listening_gates(ledger, &key);
    }
}

/// Opens or shuts the gates of those that wait for a report.
pub(super) fn set_listening_gates(ledger: &mut Ledger, key: &(ComponentId, String)) {
    for id in ledger.plan.listeners(key.0, &key.1).to_vec() {
        ledger.set_gate(id);
    }
}

/// Those of the components to be active that have finished what they were activated for.
pub(super) fn finished_in(ledger: &Ledger, to: &[(PlaceId, u32)]) -> BTreeSet<ComponentId> {
    let components = to.iter().flat_map(|arc| &ledger.plan.place(arc.0).components);
    let finished = |component: &&ComponentId| ledger.activations[component.index()].has_finished();
    components.filter(finished).copied().collect()
}
