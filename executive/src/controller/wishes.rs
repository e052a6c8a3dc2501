//! What every component should be doing, and whether it does: what is decided against what is
//! observed.

use super::context::Context;
use crate::ledger::MissionStage;
use crate::roster::{Doing, ProcessPresence};
use armor_petri::PlaceId;
use armor_plan::ComponentId;
use std::collections::BTreeSet;

/// What a component should be doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ComponentWish {
    /// The mission does not command it.
    Leave,
    /// Off.
    Frozen,
    /// As it is: a running one keeps running, a stopped one is not started yet.
    Keep,
    /// Running.
    Active,
}

/// Returns what is wanted of a component at this moment.
pub(super) fn wish(cx: &Context, component: ComponentId) -> ComponentWish {
    let ledger = cx.ledger();
    if !cx.roster.of(component).controllable {
        return ComponentWish::Leave;
    }
    if cx.is_stopping() {
        return ComponentWish::Frozen;
    }
    if let MissionStage::Ending(_) | MissionStage::Ended(_) = ledger.stage() {
        return wish_at_the_end(cx, component);
    }
    let firings = || ledger.firings().values().filter(|f| !ledger.is_held(f));
    let wanted = |to| ledger.activates_now(to, component);
    let target = |starting: bool| firings().any(|f| f.is_starting() == starting && wanted(&f.to));
    if firings().any(|f| f.renews(component)) {
        // It has finished and is wanted once more: it comes to rest first.
        let rested = !cx.roster.of(component).may_be_active();
        return if rested && target(true) { ComponentWish::Active } else { ComponentWish::Frozen };
    }
    if ledger.runs(component) || target(true) {
        return ComponentWish::Active;
    }
    // Active before and after a firing that is still stopping others: it is not disturbed.
    if firings().any(|f| wanted(&f.from) && wanted(&f.to)) {
        ComponentWish::Keep
    } else {
        ComponentWish::Frozen
    }
}

fn wish_at_the_end(cx: &Context, component: ComponentId) -> ComponentWish {
    let (ledger, plan) = (cx.ledger(), cx.plan());
    let places = [plan.goal(), plan.safe()];
    let stays = places.into_iter().flatten().any(|place| {
        let given_up = ledger.marking().iter().all(|tokens| *tokens == 0);
        let is_safe = plan.safe() == Some(place);
        (ledger.state().tokens(place) > 0 || (given_up && is_safe))
            && plan.place(place).components.contains(&component)
    });
    if stays { ComponentWish::Active } else { ComponentWish::Frozen }
}

pub(super) fn wants_off(cx: &Context, component: ComponentId) -> bool {
    wish(cx, component) == ComponentWish::Frozen
}

/// Whether a component is off, or no action can make certain that it is.
pub(super) fn is_settled_off(cx: &Context, component: ComponentId) -> bool {
    let observed = cx.roster.of(component);
    !observed.controllable || !observed.may_be_active() || observed.unstoppable
}

/// Whether a component runs as decided, and has confirmed it.
pub(super) fn is_up(cx: &Context, component: ComponentId) -> bool {
    let observed = cx.roster.of(component);
    if !observed.controllable {
        return observed.presence == ProcessPresence::Here;
    }
    if has_finished_and_rests(cx, component) {
        return true;
    }
    observed.presence == ProcessPresence::Here
        && observed.doing == Doing::Active
        && observed.activation == cx.ledger().activation(component).number
        && !cx.ledger().is_activation_over(component)
        && observed.order.is_none_or(|order| !order.stop)
}

/// Whether it reported that it has finished, and a pause brought it to rest afterwards: nothing is
/// left for it to do in this activation, and its report stands.
pub(super) fn has_finished_and_rests(cx: &Context, component: ComponentId) -> bool {
    let (observed, last) = (cx.roster.of(component), cx.ledger().activation(component));
    let wanted_again = || cx.ledger().firings().values().any(|f| f.renews(component));
    last.open
        && last.has_finished()
        && last.interrupted
        && observed.presence == ProcessPresence::Here
        && observed.doing.is_at_rest()
        && observed.activation == last.number
        && !wanted_again()
}

/// Returns the components of places that run now: during a pause only those of safety.
pub(super) fn components_now(cx: &Context, places: &[(PlaceId, u32)]) -> BTreeSet<ComponentId> {
    let playing = places.iter().filter(|arc| cx.ledger().plays(arc.0)).copied();
    components_of(cx, &playing.collect::<Vec<_>>())
}

pub(super) fn components_of(cx: &Context, places: &[(PlaceId, u32)]) -> BTreeSet<ComponentId> {
    places.iter().flat_map(|arc| cx.plan().place(arc.0).components.iter().copied()).collect()
}
