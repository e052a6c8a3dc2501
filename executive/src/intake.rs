//! What the controller makes of an event before it decides anything: what is known of the
//! components, and which reports are worth writing down.

use crate::controller::Controller;
use crate::event::{Action, Event};
use crate::record::{Entry, Report};
use crate::roster::Presence;
use armor_plan::ComponentId;

impl Controller {
    pub(crate) fn take_in(&mut self, event: Event) {
        let now = self.host;
        // Of values alone there may be many; they are shown now and then.
        if !matches!(
            event,
            Event::Timer | Event::Utc { .. } | Event::Sensed { .. } | Event::Unlinked { .. }
        ) {
            self.publish();
        }
        match event {
            Event::Appeared { component, instance } => {
                if self.roster.of(component).presence != Presence::Unseen
                    && self.roster.of(component).instance != instance
                {
                    // Whoever waited for the old one to end has to hear of it first.
                    self.gone(component);
                    self.settle();
                }
                self.roster.appeared(component, instance, now);
            }
            Event::Said { component, instance, doing, activation, controllable } => {
                if self.roster.of(component).instance == instance {
                    let planned = self.plan.component(component).is_controlled();
                    self.roster.of_mut(component).controllable = planned && controllable;
                    self.roster.said(component, doing, activation);
                }
            }
            Event::Reported { component, instance, serial, activation, report } => {
                self.reported(component, (instance, serial), activation, report);
            }
            Event::Lost { component, instance } => {
                let observed = self.roster.of(component);
                if observed.instance == instance && observed.presence == Presence::Here {
                    self.roster.left(component, Presence::Lost, now);
                }
            }
            Event::Gone { component, instance } => {
                if instance.is_none_or(|instance| self.roster.of(component).instance == instance) {
                    self.gone(component);
                }
            }
            Event::Ordered(given) => self.order(given),
            Event::OperatorLeft { connection } => self.operator_left(connection),
            Event::Sensed { watch, value } => self.sensed(watch, value),
            Event::Unlinked { watch } => self.unlinked(watch),
            Event::Offered(version) => self.offered(version),
            Event::Answered(answer) => self.answered(answer),
            Event::MoveJudged { serial, verdict } => self.move_judged(serial, verdict),
            Event::Utc { at_start } => self.told_utc(at_start),
            Event::Timer => {}
            Event::Stop => self.stopping = true,
        }
    }

    fn gone(&mut self, component: ComponentId) {
        let order = self.roster.of(component).order;
        if order.is_some_and(|order| order.killed.is_some()) {
            self.unstopped.push(component);
        }
        self.roster.left(component, Presence::Gone, self.host);
    }

    fn reported(
        &mut self,
        component: ComponentId,
        heard: (u64, u64),
        activation: u64,
        report: Report,
    ) {
        let last = &self.ledger.activations[component.index()];
        let controlled = self.plan.component(component).is_controlled();
        let current = last.open && (activation == last.number || !controlled);
        let repeated = heard.0 == last.heard.0 && heard.1 <= last.heard.1;
        let ends = matches!(report, Report::Done | Report::Failed { .. });
        let listened = !self.plan.listeners(component, report.name()).is_empty();
        if repeated {
            self.dropped.repeated += 1;
        } else if !current {
            self.dropped.late += 1;
        } else if !ends && !listened {
            self.dropped.unheard += 1;
        } else {
            let name = self.plan.component(component).name.clone();
            let (instance, serial) = heard;
            self.record(Entry::Heard { component: name, instance, serial, report });
        }
        self.actions.push(Action::Acknowledge { component, serial: heard.1 });
    }
}
