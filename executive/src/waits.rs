//! Starts that wait for a component which excludes the one to be started. Where something may still
//! stop that one they wait for as long as it takes; where nothing will, they fail after a while.

use crate::commands::Wish;
use crate::controller::Controller;
use crate::ledger::{Firing, Stage};
use armor_petri::PlaceId;
use armor_plan::ComponentId;
use std::collections::BTreeMap;
use std::time::Duration;

/// A start that nothing will let begin, but for a failure or an operator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Stuck {
    /// Since when, in mission time.
    since: Duration,
    /// In words.
    why: String,
}

/// One that is to start, and one that runs and excludes it.
type Block = (ComponentId, ComponentId);

impl Controller {
    /// Notes which starts nothing will let begin, and since when; says so once of each.
    pub(crate) fn notice_waits(&mut self) {
        for component in self.plan.component_ids() {
            // Its patience with its own start begins when nobody is in its way.
            let observed = self.roster.of_mut(component);
            if std::mem::take(&mut observed.is_blocked) {
                observed.unblocked = self.host;
            }
        }
        let found = self.stuck_starts();
        self.stuck.retain(|number, _| found.contains_key(number));
        for (number, why) in found {
            if self.stuck.contains_key(&number) {
                continue;
            }
            let within = self.plan.limits().wait_within;
            tracing::warn!("{why}; if that is still so in {within:?} it counts as a failed start");
            self.stuck.insert(number, Stuck { since: self.now, why });
        }
    }

    /// Remembers who waits for another to stop, until something happens.
    pub(crate) fn remember_waits(&mut self) {
        let blocked: Vec<_> = self.blocked_starts().into_values().flatten().collect();
        for (component, _) in blocked {
            self.roster.of_mut(component).is_blocked = true;
        }
    }

    /// Why a firing has to be given up, if it has waited for long enough.
    pub(crate) fn waited_in_vain(&self, number: u64) -> Option<String> {
        let stuck = self.stuck.get(&number)?;
        let is_due = self.now >= stuck.since.saturating_add(self.plan.limits().wait_within);
        // Another that was given up just now may have ended it.
        (is_due && self.stuck_starts().contains_key(&number)).then(|| stuck.why.clone())
    }

    /// When the next of them has waited for long enough, in mission time.
    pub(crate) fn waits_due(&self) -> Option<Duration> {
        let playing = self.ledger.stage == Stage::Playing && !self.stopping;
        let due = |stuck: &Stuck| stuck.since.saturating_add(self.plan.limits().wait_within);
        self.stuck.values().map(due).min().filter(|_| playing)
    }

    /// Whether a component is to start and one that excludes it is wanted on.
    pub(crate) fn is_kept_waiting(&self, component: ComponentId) -> bool {
        self.in_the_way_of(component).is_some()
    }

    fn in_the_way_of(&self, component: ComponentId) -> Option<ComponentId> {
        let observed = self.roster.of(component);
        let playing = self.ledger.stage == Stage::Playing;
        if !playing || !observed.is_ready() || !observed.doing.is_at_rest() {
            return None;
        }
        let mut peers = self.plan.component(component).peers.iter().copied();
        peers.find(|peer| {
            let running = self.roster.of(*peer).may_be_active();
            running && matches!(self.wish(*peer), Wish::Active | Wish::Keep | Wish::Leave)
        })
    }

    /// The firings whose starts wait, with who waits for whom.
    pub(crate) fn blocked_starts(&self) -> BTreeMap<u64, Vec<Block>> {
        let firings = self.ledger.firings.iter();
        let starting = firings.filter(|(_, f)| f.is_starting() && !self.ledger.is_held(f));
        let blocks = starting.map(|(number, firing)| (*number, self.blocks_of(firing)));
        blocks.filter(|(_, blocks)| !blocks.is_empty()).collect()
    }

    fn blocks_of(&self, firing: &Firing) -> Vec<Block> {
        let components = self.components_now(&firing.to);
        let down = components.into_iter().filter(|component| !self.is_up(*component));
        down.filter_map(|component| Some((component, self.in_the_way_of(component)?))).collect()
    }

    /// The firings whose starts nothing will let begin, and why. A transition counts as possible if
    /// tokens may come to each of its places, whatever its report, guard, date and time.
    fn stuck_starts(&self) -> BTreeMap<u64, String> {
        let mut blocked = self.blocked_starts();
        if blocked.is_empty() {
            return BTreeMap::new();
        }
        let mut markable: Vec<bool> =
            self.ledger.marking().iter().map(|tokens| *tokens > 0).collect();
        let free = self.ledger.firings.iter().filter(|it| !blocked.contains_key(it.0));
        free.flat_map(|it| &it.1.to).for_each(|arc| markable[arc.0.index()] = true);
        loop {
            self.spread(&mut markable);
            let ends = |(_, blocks): &(&u64, &Vec<Block>)| {
                blocks.iter().all(|block| self.may_stop(block.1, &markable))
            };
            let Some(number) = blocked.iter().find(ends).map(|it| *it.0) else { break };
            blocked.remove(&number);
            let firing = &self.ledger.firings[&number];
            firing.to.iter().for_each(|arc| markable[arc.0.index()] = true);
        }
        let ends = [self.plan.goal(), self.plan.safe()].into_iter().flatten();
        if ends.into_iter().any(|end| markable[end.index()]) {
            return BTreeMap::new();
        }
        blocked.into_iter().map(|(number, blocks)| (number, self.vain(&blocks))).collect()
    }

    /// The places that tokens may come to.
    fn spread(&self, markable: &mut [bool]) {
        loop {
            let before = markable.iter().filter(|it| **it).count();
            for transition in self.plan.net().transitions() {
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

    /// Whether a component may come to be off: its places can be left for others.
    fn may_stop(&self, component: ComponentId, markable: &[bool]) -> bool {
        if self.wish(component) == Wish::Leave {
            return false;
        }
        let places = &self.plan.component(component).places;
        let mut left: Vec<PlaceId> = Vec::new();
        let leads_out = |place: PlaceId, left: &[PlaceId]| {
            markable[place.index()]
                && self.plan.net().transitions().iter().any(|t| {
                    let needs = t.inputs.iter().chain(&t.reads);
                    let takes =
                        t.inputs.iter().any(|arc| arc.0 == place) || t.resets.contains(&place);
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
            let mut to = self.ledger.firings.values().flat_map(|firing| &firing.to);
            self.ledger.state.tokens(**place) > 0 || to.any(|arc| arc.0 == **place)
        };
        places.iter().filter(wants).all(|place| left.contains(place))
    }

    fn vain(&self, blocks: &[Block]) -> String {
        let name = |component: ComponentId| &self.plan.component(component).name;
        let one = |block: &Block| {
            let (one, other) = (name(block.0), name(block.1));
            format!(
                "`{one}` cannot start: `{other}` runs, which excludes it, and nothing will stop it"
            )
        };
        blocks.first().map_or_else(String::new, one)
    }
}
