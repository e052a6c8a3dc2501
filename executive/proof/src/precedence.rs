//! Transitions that fire in the place of another one, because the same report lets both fire and they
//! have the higher class or priority.

use armor_petri::{FiringClass, NetTransition, TransitionId};
use armor_plan::{Plan, PlannedTransition};
use armor_robotfile::mission::Autonomy;

/// Returns the transitions that take what `id` waits for before it can, wherever their guards are true:
/// they are enabled whenever it is, without delay, and the run prefers them.
pub(super) fn find_preceding(plan: &Plan, id: TransitionId) -> Vec<TransitionId> {
    let (own, planned) = (plan.net().transition(id), plan.transition(id));
    if planned.on.is_none() || !is_prompt(own, planned) {
        return Vec::new();
    }
    let precedes = |other: &TransitionId| {
        let (arcs, with) = (plan.net().transition(*other), plan.transition(*other));
        // Guards over data may be true for a moment only, and are left open.
        let is_followed = |guard: &armor_plan::PlannedGuard| {
            guard.operands.iter().all(|operand| operand.counter().is_some())
        };
        with.on == planned.on
            && is_preferred(arcs, own)
            && is_prompt(arcs, with)
            && with.dates.is_none()
            && with.guard.as_ref().is_none_or(is_followed)
            && needs_no_more(arcs, own)
    };
    plan.net().transition_ids().filter(precedes).collect()
}

/// Returns whether it fires by itself as soon as it is enabled.
fn is_prompt(arcs: &NetTransition, planned: &PlannedTransition) -> bool {
    planned.autonomy == Autonomy::Auto && arcs.interval.earliest.is_zero()
}

/// Returns whether the run fires `one` first where both can fire.
fn is_preferred(one: &NetTransition, other: &NetTransition) -> bool {
    let rank = |it: &NetTransition| (it.class == FiringClass::Safety, it.priority);
    rank(one) > rank(other)
}

/// Returns whether `one` has its tokens wherever `other` has its own.
fn needs_no_more(one: &NetTransition, other: &NetTransition) -> bool {
    let has = |(place, count): &(armor_petri::PlaceId, u32)| {
        other.inputs.iter().any(|(taken, least)| taken == place && least >= count)
    };
    one.inputs.iter().all(has) && one.reads.is_empty() && one.inhibitors.is_empty()
}
