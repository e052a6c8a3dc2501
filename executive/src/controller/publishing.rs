//! The state of the mission as it is published: `executive.marking`, latched, at every change.

mod changing;
mod commanding;
mod dating;
mod waiting;

use super::Controller;
use super::confirmations::{fires_by_itself, is_declined};
use super::wishes::{is_settled_off, is_up, wants_off};
use crate::ledger::{Firing, MissionStage, Phase};
use crate::roster::{Doing, ProcessPresence};
use crate::terms::MissionOutcome;
use armor_marking::{
    EnabledTransition, Fired, FiringDecider, FlightPhase, GuardTruth, InFlight, MarkedPlace,
    Marking, MarkingStage, MissionComponent, MissionComponentState, ParameterGiven, VariableValue,
};
use armor_petri::{PlaceId, TransitionId};
use armor_plan::{ComponentId, GivenValue, PlannedVariable};
use armor_robotfile::guard::Scalar;
use armor_robotfile::mission::Autonomy;
use std::time::Duration;

impl Controller {
    /// Returns what is to be published now; `stamp` is system time, in seconds.
    pub fn marking(&self, stamp: f64) -> Marking {
        let ledger = self.ledger();
        let places = self.plan().place_ids().filter(|place| ledger.state().tokens(*place) > 0);
        let fired = |(transition, at): &(String, Duration)| Fired {
            transition: transition.clone(),
            fired_at_s: at.as_secs_f64(),
        };
        Marking {
            stamp,
            mission: self.plan().mission().to_owned(),
            now_at_s: self.context.now().as_secs_f64(),
            clock: self.plan().clock().map(str::to_owned).unwrap_or_default(),
            stage: self.stage_shown(),
            why: ledger.why().to_owned(),
            places: places.map(|place| self.marked_place(place)).collect(),
            in_flight: ledger
                .firings()
                .iter()
                .map(|(id, firing)| self.firing_in_flight(*id, firing))
                .collect(),
            enabled: ledger.state().enabled().map(|id| self.enabled_transition(id)).collect(),
            waiting: self.waiting_transitions(),
            variables: self.variable_values(),
            guards: self
                .plan()
                .net()
                .transition_ids()
                .filter_map(|id| self.guard_truth(id))
                .collect(),
            dates: self.date_stands(),
            components: self.plan().component_ids().map(|id| self.component_state(id)).collect(),
            fired: ledger.fired(),
            history: ledger.history().map(fired).collect(),
            late_reports: self.reports.late(),
            unheard_reports: self.reports.unheard(),
            unwritten_orders: self.operators.unwritten(),
            pause: self.pause_shown(),
            holder: self.holder_shown(),
            link_lost_at_s: ledger.authority().link_lost().map(|at| at.as_secs_f64()),
            confirmations: self.open_confirmations(),
            orders: self.last_orders(),
            version: self.changes.known_as(),
            version_since_at_s: ledger.version_since().as_secs_f64(),
            change: self.change_shown(),
        }
    }

    fn variable_values(&self) -> Vec<VariableValue> {
        let variables =
            self.plan().variables().iter().zip(self.senses.outside_counts()).enumerate();
        let shown = |(index, (variable, outside)): (usize, (&PlannedVariable, &u64))| {
            let value = self.senses.variable(&self.context, index);
            VariableValue {
                variable: variable.name.clone(),
                value: self.senses.variable_in_words(&self.context, index),
                number: match value {
                    Some(Scalar::Number(number)) => Some(number),
                    Some(Scalar::Flag(flag)) => Some(f64::from(u8::from(flag))),
                    Some(Scalar::Text(_)) | None => None,
                },
                outside: *outside,
            }
        };
        let counters = self.plan().counters().iter().zip(self.ledger().counters());
        let counted = counters.map(|(counter, value)| VariableValue {
            variable: counter.name.clone(),
            value: value.to_string(),
            number: Some(*value as f64),
            outside: 0,
        });
        variables.map(shown).chain(counted).collect()
    }

    fn guard_truth(&self, id: TransitionId) -> Option<GuardTruth> {
        let planned = self.plan().transition(id).guard.as_ref()?;
        Some(GuardTruth {
            transition: self.plan().net().transition(id).name.clone(),
            guard: planned.guard.to_string(),
            truth: self.senses.truth(id).into(),
            because: self.senses.values_in_words(&self.context, id),
        })
    }

    fn stage_shown(&self) -> MarkingStage {
        match self.ledger().stage() {
            MissionStage::Ended(MissionOutcome::Goal) => MarkingStage::Goal,
            MissionStage::Ended(MissionOutcome::Safe) => MarkingStage::Safe,
            MissionStage::Ended(MissionOutcome::Failed | MissionOutcome::Interrupted) => {
                MarkingStage::Failed
            }
            _ if self.is_stopping() => MarkingStage::Stopping,
            MissionStage::Playing if self.ledger().pause().is_some() => MarkingStage::Paused,
            MissionStage::Playing => MarkingStage::Playing,
            MissionStage::Retreating => MarkingStage::Retreating,
            MissionStage::Ending(_) => MarkingStage::Ending,
        }
    }

    fn marked_place(&self, place: PlaceId) -> MarkedPlace {
        let components = self.plan().place(place).components.iter();
        let down = components.filter(|component| !is_up(&self.context, **component));
        let waits_for: Vec<_> = down.map(|id| self.plan().component(*id).name.clone()).collect();
        MarkedPlace {
            place: self.plan().net().place(place).to_owned(),
            tokens: self.ledger().state().tokens(place),
            active: waits_for.is_empty(),
            waits_for,
        }
    }

    fn firing_in_flight(&self, number: u64, firing: &Firing) -> InFlight {
        let names = |arcs: &[(PlaceId, u32)]| {
            arcs.iter().map(|arc| self.plan().net().place(arc.0).to_owned()).collect()
        };
        let waits = |component: &ComponentId| match firing.phase {
            Phase::Stopping => {
                let places = &self.plan().component(*component).places;
                places.iter().any(|place| firing.leaving().contains(place))
                    && wants_off(&self.context, *component)
                    && !is_settled_off(&self.context, *component)
            }
            Phase::Starting => {
                self.plan().activates(&firing.to, *component) && !is_up(&self.context, *component)
            }
        };
        let waits_for = self.plan().component_ids().filter(waits);
        InFlight {
            firing: number,
            cause: firing.cause.to_string(),
            from: names(&firing.from),
            to: names(&firing.to),
            phase: match firing.phase {
                Phase::Stopping => FlightPhase::Stopping,
                Phase::Starting => FlightPhase::Starting,
            },
            waits_for: waits_for.map(|id| self.plan().component(id).name.clone()).collect(),
        }
    }

    fn component_state(&self, id: ComponentId) -> MissionComponent {
        let (planned, observed) = (self.plan().component(id), self.context.roster.of(id));
        let last = self.ledger().activation(id);
        let given = |value: &GivenValue| ParameterGiven {
            parameter: value.parameter.clone(),
            value: value.text.clone(),
        };
        let state = match (observed.presence, observed.doing) {
            (ProcessPresence::Unseen, _) => MissionComponentState::Unseen,
            (ProcessPresence::Lost, _) => MissionComponentState::Lost,
            (ProcessPresence::Gone, _) => MissionComponentState::Gone,
            (ProcessPresence::Here, Doing::Unknown) => MissionComponentState::Commanded,
            (ProcessPresence::Here, Doing::Starting) => MissionComponentState::Starting,
            (ProcessPresence::Here, Doing::Frozen) => MissionComponentState::Frozen,
            (ProcessPresence::Here, Doing::Active) => MissionComponentState::Active,
        };
        MissionComponent {
            component: planned.name.clone(),
            controlled: planned.is_controlled() && observed.controllable,
            state,
            activation: last.number,
            unheard_reports: self.reports.unheard_of(&planned.name),
            values: last.values.iter().map(given).collect(),
        }
    }

    fn enabled_transition(&self, id: TransitionId) -> EnabledTransition {
        let (state, transition) = (self.ledger().state(), self.plan().net().transition(id));
        let since = state.enabled_since(id).unwrap_or_default();
        EnabledTransition {
            transition: transition.name.clone(),
            enabled_at_s: since.as_secs_f64(),
            earliest_at_s: (since + transition.interval.earliest).as_secs_f64(),
            latest_at_s: state.deadline(id).map(|at| at.as_secs_f64()),
            by: match self.plan().transition(id).autonomy {
                _ if fires_by_itself(self.ledger(), id) => FiringDecider::Mission,
                _ if is_declined(self.ledger(), id) => FiringDecider::Declined,
                Autonomy::Confirm { .. } => FiringDecider::Confirmation,
                Autonomy::Auto | Autonomy::Operator => FiringDecider::Operator,
            },
            held: state.is_held(id),
        }
    }
}
