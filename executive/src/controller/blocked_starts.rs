//! Blocked starts. A component cannot start while one that it excludes may be running. Where
//! something may still stop that one, the start waits for as long as it takes; where nothing will,
//! it fails after a while.

use super::context::Context;
use super::wishes::{ComponentWish, components_now, is_up, wish};
use crate::ledger::Firing;
use armor_petri::PlaceId;
use armor_plan::ComponentId;
use std::collections::BTreeMap;
use std::time::Duration;

/// A start that only a failure or an operator can unblock.
#[derive(Clone, Debug, PartialEq, Eq)]
struct StuckStart {
    /// Since when, in mission time.
    since: Duration,
    /// In words.
    why: String,
}

/// A component that is to start, and a running one that excludes it.
type Block = (ComponentId, ComponentId);

/// The starts that nothing will unblock, by the number of the firing.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockedStarts {
    stuck: BTreeMap<u64, StuckStart>,
}

impl BlockedStarts {
    /// Notes which starts nothing will unblock, and since when; logs each of them once.
    pub(super) fn notice_stuck(&mut self, cx: &mut Context) {
        let host = cx.host();
        for component in cx.plan().component_ids() {
            // The time for its own start begins when no component blocks it.
            let observed = cx.roster.of_mut(component);
            if std::mem::take(&mut observed.is_blocked) {
                observed.unblocked = host;
            }
        }
        let found = stuck_starts(cx);
        self.stuck.retain(|number, _| found.contains_key(number));
        for (number, why) in found {
            if self.stuck.contains_key(&number) {
                continue;
            }
            let within = cx.plan().limits().wait_within;
            tracing::warn!("{why}; if that is still so in {within:?} it counts as a failed start");
            self.stuck.insert(number, StuckStart { since: cx.now(), why });
        }
    }

    /// Why a firing has to be given up, if it has waited for long enough.
    pub(super) fn failure_of(&self, cx: &Context, number: u64) -> Option<String> {
        let stuck = self.stuck.get(&number)?;
        let is_due = cx.now() >= stuck.since.saturating_add(cx.plan().limits().wait_within);
        // The firing that was given up just before this one may have unblocked it.
        (is_due && stuck_starts(cx).contains_key(&number)).then(|| stuck.why.clone())
    }

    /// When the next of them has waited for long enough, in mission time.
    pub(super) fn next_due(&self, cx: &Context) -> Option<Duration> {
        let due = |stuck: &StuckStart| stuck.since.saturating_add(cx.plan().limits().wait_within);
        self.stuck.values().map(due).min().filter(|_| cx.may_fire())
    }
}

/// Marks the components whose start is blocked, until the next event.
pub(super) fn remember_blocked(cx: &mut Context) {
    let blocked: Vec<_> = blocked_starts(cx).into_values().flatten().collect();
    for (component, _) in blocked {
        cx.roster.of_mut(component).is_blocked = true;
    }
}

/// Whether a component is to start while a component that excludes it should be running.
pub(super) fn is_kept_waiting(cx: &Context, component: ComponentId) -> bool {
    find_excluding_peer(cx, component).is_some()
}

fn find_excluding_peer(cx: &Context, component: ComponentId) -> Option<ComponentId> {
    let observed = cx.roster.of(component);
    if !cx.is_playing() || !observed.is_ready() || !observed.doing.is_at_rest() {
        return None;
    }
    let mut peers = cx.plan().component(component).peers.iter().copied();
    peers.find(|peer| {
        let running = cx.roster.of(*peer).may_be_active();
        running
            && matches!(
                wish(cx, *peer),
                ComponentWish::Active | ComponentWish::Keep | ComponentWish::Leave
            )
    })
}

/// Returns the firings whose starts are blocked, with which component blocks which.
pub(super) fn blocked_starts(cx: &Context) -> BTreeMap<u64, Vec<Block>> {
    let firings = cx.ledger().firings().iter();
    let starting = firings.filter(|(_, f)| f.is_starting() && !cx.ledger().is_held(f));
    let blocks = starting.map(|(number, firing)| (*number, blocks_of(cx, firing)));
    blocks.filter(|(_, blocks)| !blocks.is_empty()).collect()
}

fn blocks_of(cx: &Context, firing: &Firing) -> Vec<Block> {
    let components = components_now(cx, &firing.to);
    let down = components.into_iter().filter(|component| !is_up(cx, *component));
    down.filter_map(|component| Some((component, find_excluding_peer(cx, component)?))).collect()
}

/// Returns the firings whose starts nothing will unblock, and why. A transition counts as possible
/// if tokens may come to each of its places, whatever its report, guard, date and time: so a start
/// is only given up where no run of the net could unblock it.
fn stuck_starts(cx: &Context) -> BTreeMap<u64, String> {
    let mut blocked = blocked_starts(cx);
    if blocked.is_empty() {
        return BTreeMap::new();
    }
    let mut markable: Vec<bool> = cx.ledger().marking().iter().map(|tokens| *tokens > 0).collect();
    let free = cx.ledger().firings().iter().filter(|it| !blocked.contains_key(it.0));
    free.flat_map(|it| &it.1.to).for_each(|arc| markable[arc.0.index()] = true);
    // A fixed point: a start that is unblocked puts its tokens, which may unblock the next one.
    // What is left at the end is blocked by components that only wait for each other.
    loop {
        spread_tokens(cx, &mut markable);
        let ends = |(_, blocks): &(&u64, &Vec<Block>)| {
            blocks.iter().all(|block| may_stop(cx, block.1, &markable))
        };
        let Some(number) = blocked.iter().find(ends).map(|it| *it.0) else {
            break;
        };
        blocked.remove(&number);
        let firing = &cx.ledger().firings()[&number];
        firing.to.iter().for_each(|arc| markable[arc.0.index()] = true);
    }
    // At its goal or in its safe place the mission ends, and stops every component.
    let ends = [cx.plan().goal(), cx.plan().safe()].into_iter().flatten();
    if ends.into_iter().any(|end| markable[end.index()]) {
        return BTreeMap::new();
    }
    blocked.into_iter().map(|(number, blocks)| (number, describe_block(cx, &blocks))).collect()
}

/// Marks every place that tokens may come to, from those marked so far.
fn spread_tokens(cx: &Context, markable: &mut [bool]) {
    loop {
        let before = markable.iter().filter(|it| **it).count();
        for transition in cx.plan().net().transitions() {
            let needs = transition.inputs.iter().chain(&transition.reads);
            if needs.into_iter().all(|arc| markable[arc.0.index()]) {
                transition.outputs.iter().for_each(|arc| markable[arc.0.index()] = true);
            }
        }
        if markable.iter().filter(|it| **it).count() == before {
            break;
        }
    }
}

/// Whether a component may come to rest: its marked places can be left for places without it.
fn may_stop(cx: &Context, component: ComponentId, markable: &[bool]) -> bool {
    if wish(cx, component) == ComponentWish::Leave {
        return false;
    }
    let places = &cx.plan().component(component).places;
    let mut left: Vec<PlaceId> = Vec::new();
    let leads_out = |place: PlaceId, left: &[PlaceId]| {
        markable[place.index()]
            && cx.plan().net().transitions().iter().any(|t| {
                let needs = t.inputs.iter().chain(&t.reads);
                let takes = t.inputs.iter().any(|arc| arc.0 == place) || t.resets.contains(&place);
                let stays =
                    |arc: &(PlaceId, u32)| places.contains(&arc.0) && !left.contains(&arc.0);
                takes
                    && needs.into_iter().all(|arc| markable[arc.0.index()])
                    && !t.outputs.iter().any(stays)
            })
    };
    loop {
        let more: Vec<_> = places
            .iter()
            .copied()
            .filter(|place| !left.contains(place) && leads_out(*place, &left))
            .collect();
        if more.is_empty() {
            break;
        }
        left.extend(more);
    }
    let wants = |place: &&PlaceId| {
        let mut to = cx.ledger().firings().values().flat_map(|firing| &firing.to);
        cx.ledger().state().tokens(**place) > 0 || to.any(|arc| arc.0 == **place)
    };
    places.iter().filter(wants).all(|place| left.contains(place))
}

fn describe_block(cx: &Context, blocks: &[Block]) -> String {
    let name = |component: ComponentId| &cx.plan().component(component).name;
    let one = |block: &Block| {
        let (one, other) = (name(block.0), name(block.1));
        format!("`{one}` cannot start: `{other}` runs, which excludes it, and nothing will stop it")
    };
    blocks.first().map_or_else(String::new, one)
}
