//! Transitions that ask before they fire, as they are analysed: silence fires or declines them when
//! the time for an answer is over. A person who declines what silence fires is not thought of.

use armor_petri::{NetBuilder, NetTransition, PlaceId, TransitionId};
use armor_robotfile::mission::{Autonomy, LostLink};
use std::collections::BTreeMap;
use std::time::Duration;

use armor_plan::Plan;

/// How long an answer is waited for, and whether silence fires it.
fn default_of(plan: &Plan, id: TransitionId) -> Option<(Duration, bool)> {
    match plan.transition(id).autonomy {
        Autonomy::Confirm { within: Some(within), fire_unanswered } => {
            Some((within, fire_unanswered))
        }
        Autonomy::Confirm { within: None, .. } | Autonomy::Auto | Autonomy::Operator => None,
    }
}

/// When a transition fires at the latest after it was enabled, if silence sees to that.
pub(super) fn fires_by(plan: &Plan, id: TransitionId) -> Option<Duration> {
    let waits = plan.transition(id).lost_link == Some(LostLink::Wait);
    let (within, _) = default_of(plan, id).filter(|(_, fires)| *fires && !waits)?;
    Some(plan.net().transition(id).interval.earliest.saturating_add(within))
}

/// How long it is asked about before silence declines it, if it does.
pub(super) fn declines_after(plan: &Plan, id: TransitionId) -> Option<Duration> {
    default_of(plan, id).filter(|(_, fires)| !fires).map(|(within, _)| within)
}

/// A place for each transition that silence declines.
pub(super) fn declined_places(
    plan: &Plan,
    builder: &mut NetBuilder,
) -> BTreeMap<TransitionId, PlaceId> {
    let ids = plan.net().transition_ids().filter(|id| declines_after(plan, *id).is_some());
    let name = |id: TransitionId| format!("{}/declined", plan.net().transition(id).name);
    ids.map(|id| (id, builder.place(name(id), 0))).collect()
}

/// The tokens it has to find, taken or not.
pub(super) fn needs(transition: &NetTransition) -> BTreeMap<PlaceId, u32> {
    let mut needs = BTreeMap::new();
    for &(place, weight) in transition.inputs.iter().chain(&transition.reads) {
        let most = needs.entry(place).or_insert(0);
        *most = weight.max(*most);
    }
    needs
}

/// Whether it has to find tokens in a place.
pub(super) fn needs_token(plan: &Plan, id: TransitionId, place: PlaceId) -> bool {
    needs(plan.net().transition(id)).contains_key(&place)
}

/// Whether the firing of one may disable another, which asks again when it is newly enabled.
/// Where a place holds more tokens than are wanted it need not: then it asks once more than it does
/// in a run, and can be declined once more.
pub(super) fn disturbs(plan: &Plan, one: TransitionId, other: TransitionId) -> bool {
    let (fires, asks) = (plan.net().transition(one), plan.net().transition(other));
    let needs = needs(asks);
    let takes = fires.inputs.iter().map(|arc| arc.0).chain(fires.resets.iter().copied());
    let inhibits = |arc: &(PlaceId, u32)| asks.inhibitors.iter().any(|it| it.0 == arc.0);
    let guard = plan.transition(other).guard.iter().flat_map(|guard| &guard.operands);
    let mut read = guard.filter_map(|operand| operand.counter());
    let sets = &plan.transition(one).sets;
    takes.into_iter().any(|place| needs.contains_key(&place))
        || fires.outputs.iter().any(inhibits)
        || read.any(|counter| sets.iter().any(|set| set.counter == counter))
}
