//! Commands to components: who is activated, who is frozen, and what follows if one does not obey.

use super::context::Context;
use super::wishes::{ComponentWish, has_finished_and_rests, wish};
use crate::event::ControllerAction;
use crate::ledger::firing_steps::values_for;
use crate::record::JournalEntry;
use crate::roster::{Doing, PendingCommand, ProcessPresence};
use armor_plan::ComponentId;
use std::time::Duration;

/// How many times a component is asked to stop before it is killed.
const STOP_TRIES: u32 = 2;

/// Gives the commands, and remembers which components did not obey.
#[derive(Clone, Debug, Default)]
pub(super) struct Commands {
    /// Components that were killed, whether or not the end of their process is confirmed.
    unstopped: Vec<ComponentId>,
}

impl Commands {
    /// Returns the components that did not stop, each once.
    pub(super) fn take_unstopped(&mut self) -> Vec<ComponentId> {
        std::mem::take(&mut self.unstopped)
    }

    /// Notes that the process of a component has ended.
    pub(super) fn note_gone(&mut self, cx: &mut Context, component: ComponentId) {
        if cx.roster.of(component).order.is_some_and(|order| order.killed.is_some()) {
            self.unstopped.push(component);
        }
        let host = cx.host();
        cx.roster.left(component, ProcessPresence::Gone, host);
    }

    /// Notes that a component refuses every command. A mission that needs to command it cannot be
    /// played; without its own end, nothing that excludes the component will be started.
    pub(super) fn take_refusal(&mut self, cx: &mut Context, component: ComponentId) {
        cx.roster.of_mut(component).order = None;
        let name = cx.plan().component(component).name.clone();
        cx.retreat(&format!(
            "`{name}` lets no mission control it (its code calls `set_non_controllable`), but this \
             one activates it; name it in no place"
        ));
    }

    /// Gives each component the command it needs, if it can take one.
    pub(super) fn command_components(&mut self, cx: &mut Context) {
        for component in cx.plan().component_ids() {
            match wish(cx, component) {
                ComponentWish::Frozen => self.want_off(cx, component),
                ComponentWish::Active => self.want_on(cx, component),
                ComponentWish::Leave | ComponentWish::Keep => {}
            }
        }
    }

    fn want_off(&mut self, cx: &mut Context, component: ComponentId) {
        let since = cx.host();
        let observed = cx.roster.of_mut(component);
        if !observed.may_be_active() {
            return;
        }
        if !observed.order.is_some_and(|order| order.stop) {
            observed.order = Some(PendingCommand { stop: true, since, tries: 0, killed: None });
        }
        // One that has just appeared is about to report whether there is anything to stop.
        let reported = observed.doing != Doing::Unknown || observed.commanded > 0;
        if reported && observed.is_ready() && observed.order.is_some_and(|order| order.tries == 0) {
            self.push_order(cx, component);
        }
    }

    fn want_on(&mut self, cx: &mut Context, component: ComponentId) {
        let observed = cx.roster.of(component);
        let stopping = observed.order.is_some_and(|order| order.stop);
        if stopping || !observed.is_ready() || has_finished_and_rests(cx, component) {
            return;
        }
        let decided = cx.ledger().activation(component).number;
        let is_another =
            observed.activation != decided || cx.ledger().is_activation_over(component);
        if observed.doing == Doing::Active && is_another {
            // It runs for another executive, for a decision that never reached the journal, or for an
            // activation that was over before it could be stopped.
            self.want_off(cx, component);
        } else if observed.doing.is_at_rest() && observed.order.is_none() {
            activate_component(cx, component);
        }
    }

    /// Asks again, kills, or gives up, wherever an order to stop has waited long enough.
    pub(super) fn push_orders(&mut self, cx: &mut Context) {
        for component in cx.plan().component_ids() {
            if next_push(cx, component).is_some_and(|due| due <= cx.host()) {
                self.push_order(cx, component);
            }
        }
    }

    fn push_order(&mut self, cx: &mut Context, component: ComponentId) {
        let now = cx.host();
        let name = cx.plan().component(component).name.clone();
        let observed = cx.roster.of_mut(component);
        let Some(order) = observed.order.as_mut() else {
            return;
        };
        // Killed, and its end was not confirmed in time: the process may run on.
        if order.killed.is_some() {
            observed.unstoppable = true;
            self.unstopped.push(component);
            tracing::error!(component = name, "killed, but not known to be gone");
            return cx.publish_marking();
        }
        let here = observed.presence == ProcessPresence::Here;
        if here && order.tries < STOP_TRIES {
            order.tries += 1;
            // The newest activation that either side knows: an `Activate` on its way to the
            // component must not make it run after this.
            let activation = observed.activation.max(observed.commanded);
            observed.commanded = activation;
            return cx.add_action(ControllerAction::Freeze { component, activation });
        }
        order.killed = Some(now);
        tracing::warn!(component = name, "it did not stop when it was asked to; killing it");
        cx.add_action(ControllerAction::Kill { component });
    }
}

/// Returns when orders to stop are given their next push.
pub(super) fn pushes_due(cx: &Context) -> impl Iterator<Item = Duration> {
    cx.plan().component_ids().filter_map(|component| next_push(cx, component))
}

fn next_push(cx: &Context, component: ComponentId) -> Option<Duration> {
    let return_within = cx.plan().component(component).return_within;
    cx.roster.of(component).next_push(cx.plan().limits(), return_within, cx.roster.began())
}

/// Starts a component, unless one that it excludes may still be running.
fn activate_component(cx: &mut Context, component: ComponentId) {
    let planned = cx.plan().component(component);
    if planned.peers.iter().any(|peer| cx.roster.of(*peer).may_be_active()) {
        return;
    }
    // Larger than the number that the component knows: another executive may have counted further,
    // and an old report must never match the new activation.
    let activation = cx.ledger().last_activation().max(cx.roster.of(component).activation) + 1;
    let (name, values) = (planned.name.clone(), values_for(cx.ledger(), component));
    cx.record_entry(JournalEntry::Activating {
        component: name,
        activation,
        values: values.clone(),
    });
    let since = cx.host();
    let observed = cx.roster.of_mut(component);
    observed.order = Some(PendingCommand { stop: false, since, tries: 1, killed: None });
    (observed.doing, observed.commanded) = (Doing::Unknown, activation);
    cx.add_action(ControllerAction::Activate { component, activation, values });
}
