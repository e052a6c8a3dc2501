//! Telling components what to do: who should run, who may, and what follows if one does not obey.

use crate::controller::Controller;
use crate::event::Action;
use crate::ledger::Stage;
use crate::record::Entry;
use crate::roster::{Doing, Order, Presence};
use armor_plan::ComponentId;
use std::time::Duration;

/// What a component should be doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wish {
    /// It is none of the executive's business.
    Leave,
    /// Off.
    Frozen,
    /// As it is: running goes on, a stopped one is not started yet.
    Keep,
    /// Running.
    Active,
}

/// How often a component is asked to stop before it is killed.
const STOP_TRIES: u32 = 2;

impl Controller {
    /// What is wanted of a component at this moment.
    pub(crate) fn wish(&self, component: ComponentId) -> Wish {
        if !self.roster.of(component).controllable {
            return Wish::Leave;
        }
        if self.stopping {
            return Wish::Frozen;
        }
        if let Stage::Ending(_) | Stage::Ended(_) = self.ledger.stage {
            return self.wish_at_the_end(component);
        }
        let firings = || self.ledger.firings.values().filter(|f| !self.ledger.is_held(f));
        let wanted = |to| self.ledger.activates_now(to, component);
        let target =
            |starting: bool| firings().any(|f| f.is_starting() == starting && wanted(&f.to));
        if firings().any(|f| f.renewing.contains(&component)) {
            // Finished, and wanted once more: it comes to rest first.
            let rested = !self.roster.of(component).may_be_active();
            return if rested && target(true) { Wish::Active } else { Wish::Frozen };
        }
        if self.ledger.runs(component) || target(true) {
            return Wish::Active;
        }
        if firings().any(|f| wanted(&f.from) && wanted(&f.to)) { Wish::Keep } else { Wish::Frozen }
    }

    fn wish_at_the_end(&self, component: ComponentId) -> Wish {
        let places = [self.plan.goal(), self.plan.safe()];
        let stays = places.into_iter().flatten().any(|place| {
            let given_up = self.ledger.marking().iter().all(|tokens| *tokens == 0);
            let is_safe = self.plan.safe() == Some(place);
            (self.ledger.state.tokens(place) > 0 || (given_up && is_safe))
                && self.plan.place(place).components.contains(&component)
        });
        if stays { Wish::Active } else { Wish::Frozen }
    }

    pub(crate) fn wants_off(&self, component: ComponentId) -> bool {
        self.wish(component) == Wish::Frozen
    }

    /// Off, or nothing that can be done will tell whether it is.
    pub(crate) fn is_settled_off(&self, component: ComponentId) -> bool {
        let observed = self.roster.of(component);
        !observed.controllable || !observed.may_be_active() || observed.unstoppable
    }

    /// Whether a component runs as decided, and has confirmed it.
    pub(crate) fn is_up(&self, component: ComponentId) -> bool {
        let observed = self.roster.of(component);
        if !observed.controllable {
            return observed.presence == Presence::Here;
        }
        if self.has_finished_and_rests(component) {
            return true;
        }
        observed.presence == Presence::Here
            && observed.doing == Doing::Active
            && observed.activation == self.ledger.activations[component.index()].number
            && observed.order.is_none_or(|order| !order.stop)
    }

    /// It reported that it has finished, and a pause brought it to rest afterwards: nothing is left
    /// for it to do in this activation, and its report stands.
    fn has_finished_and_rests(&self, component: ComponentId) -> bool {
        let (observed, last) =
            (self.roster.of(component), &self.ledger.activations[component.index()]);
        let finished = last.open && (last.done || last.failed.is_some());
        let wanted_anew = || self.ledger.firings.values().any(|f| f.renewing.contains(&component));
        finished
            && last.interrupted
            && observed.presence == Presence::Here
            && observed.doing.is_at_rest()
            && observed.activation == last.number
            && !wanted_anew()
    }

    /// Gives each component the command it needs, if it can take one.
    pub(crate) fn command_components(&mut self) {
        for component in self.plan.component_ids() {
            match self.wish(component) {
                Wish::Frozen => self.want_off(component),
                Wish::Active => self.want_on(component),
                Wish::Leave | Wish::Keep => {}
            }
        }
    }

    fn want_off(&mut self, component: ComponentId) {
        let now = self.host;
        let observed = self.roster.of_mut(component);
        if !observed.may_be_active() {
            return;
        }
        if !observed.order.is_some_and(|order| order.stop) {
            observed.order = Some(Order { stop: true, since: now, tries: 0, killed: None });
        }
        // One that has just appeared is about to say whether there is anything to stop.
        let said = observed.doing != Doing::Unknown || observed.commanded > 0;
        if said && observed.is_ready() && observed.order.is_some_and(|order| order.tries == 0) {
            self.push_order(component);
        }
    }

    fn want_on(&mut self, component: ComponentId) {
        let observed = self.roster.of(component);
        let stopping = observed.order.is_some_and(|order| order.stop);
        if stopping || !observed.is_ready() {
            return;
        }
        let decided = self.ledger.activations[component.index()].number;
        if self.has_finished_and_rests(component) {
            return;
        }
        if observed.doing == Doing::Active && observed.activation != decided {
            // It runs for someone else, or for a decision that was never written down.
            self.want_off(component);
        } else if observed.doing.is_at_rest() && observed.order.is_none() {
            self.activate(component);
        }
    }

    /// Starts it, unless one that it excludes may still be running.
    fn activate(&mut self, component: ComponentId) {
        let planned = self.plan.component(component);
        if planned.peers.iter().any(|peer| self.roster.of(*peer).may_be_active()) {
            return;
        }
        let activation = self.ledger.last_activation.max(self.roster.of(component).activation) + 1;
        let (name, values) = (planned.name.clone(), self.ledger.values_for(component));
        self.record(Entry::Activating { component: name, activation, values: values.clone() });
        let now = self.host;
        let observed = self.roster.of_mut(component);
        observed.order = Some(Order { stop: false, since: now, tries: 1, killed: None });
        (observed.doing, observed.commanded) = (Doing::Unknown, activation);
        self.actions.push(Action::Activate { component, activation, values });
    }

    /// Asks again, kills, or gives up, wherever an order to stop has waited long enough.
    pub(crate) fn push_orders(&mut self) {
        for component in self.plan.component_ids() {
            let observed = self.roster.of(component);
            let due = observed.next_push(self.plan.limits(), self.roster.began);
            if due.is_some_and(|due| due <= self.host) {
                self.push_order(component);
            }
        }
    }

    fn push_order(&mut self, component: ComponentId) {
        let now = self.host;
        let observed = self.roster.of_mut(component);
        let Some(order) = observed.order.as_mut() else { return };
        if order.killed.is_some() {
            observed.unstoppable = true;
            self.unstopped.push(component);
            let name = self.plan.component(component).name.as_str();
            tracing::error!(component = name, "killed, but not known to be gone");
            return self.publish();
        }
        let here = observed.presence == Presence::Here;
        if here && order.tries < STOP_TRIES {
            order.tries += 1;
            let activation = observed.activation.max(observed.commanded);
            observed.commanded = activation;
            return self.actions.push(Action::Freeze { component, activation });
        }
        order.killed = Some(now);
        let name = self.plan.component(component).name.as_str();
        tracing::warn!(component = name, "did not stop when told to; killing it");
        self.actions.push(Action::Kill { component });
    }

    /// When an order to stop is given its next push.
    pub(crate) fn pushes(&self) -> impl Iterator<Item = Duration> {
        let push =
            |component| self.roster.of(component).next_push(self.plan.limits(), self.roster.began);
        self.plan.component_ids().filter_map(push)
    }
}
