//! What the executive shows of itself: `executive.marking`, latched, at every change.

mod changing;
mod commanding;
mod dates;

use crate::controller::Controller;
use crate::guards::PlannedVariable;
use crate::ledger::{Firing, Phase, Stage};
use crate::plan::ComponentId;
use crate::record::Outcome;
use crate::roster::{Doing, Presence};
use crate::senses::in_words;
use crate::values::GivenValue;
use armor_petri::{PlaceId, TransitionId};
use armor_robotfile::guard::Scalar;
use armor_robotfile::mission::Autonomy;
use armor_sdk::Message;
use std::time::Duration;

pub use changing::MissionChange;
pub use commanding::{Confirmation, Holder, OrderGiven, Paused};
pub use dates::DateStand;

/// Where the mission stands. Times named `…_at_s` are mission time, in seconds since its start.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct Marking {
    /// System time, seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// The mission.
    pub mission: String,
    /// Mission time now.
    #[message(unit = "s")]
    pub now_at_s: f64,
    /// The data that mission time follows; empty if it is the host's.
    pub clock: String,
    /// `playing`, `paused`, `retreating`, `ending`, `stopping`, or how it ended.
    pub stage: String,
    /// Why it retreats or has given up; empty if it does not.
    pub why: String,
    /// The places that hold tokens.
    pub places: Vec<MarkedPlace>,
    /// Tokens on their way.
    pub in_flight: Vec<InFlight>,
    /// The transitions that are enabled, those that may fire first.
    pub enabled: Vec<EnabledTransition>,
    /// The variables of the mission.
    pub variables: Vec<VariableValue>,
    /// The guards of its transitions.
    pub guards: Vec<GuardTruth>,
    /// Its absolute dates.
    pub dates: Vec<DateStand>,
    /// The components of the mission.
    pub components: Vec<MissionComponent>,
    /// Transitions fired so far.
    pub fired: u64,
    /// The last of them, the oldest first.
    pub history: Vec<Fired>,
    /// Reports dropped because their activation was over.
    pub late_reports: u64,
    /// Reports that nothing in the mission waited for.
    pub unheard_reports: u64,
    /// Orders that were refused and, as there were too many, not written down.
    pub unwritten_orders: u64,
    /// Whether it stands still.
    pub pause: Option<Paused>,
    /// Who commands it; nobody: whoever orders something.
    pub holder: Option<Holder>,
    /// Since when the link to whoever commanded is lost, if it is.
    #[message(unit = "s")]
    pub link_lost_at_s: Option<f64>,
    /// What the operator is asked.
    pub confirmations: Vec<Confirmation>,
    /// The last orders, the oldest first.
    pub orders: Vec<OrderGiven>,
    /// The version of the file that is played, as configd counts them; 0 if it is not known.
    pub version: u64,
    /// Since when.
    #[message(unit = "s")]
    pub version_since_at_s: f64,
    /// A newer version that is not played.
    pub change: Option<MissionChange>,
}

/// A place that holds tokens.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct MarkedPlace {
    /// Its name.
    pub place: String,
    /// How many.
    pub tokens: u32,
    /// Whether all of its components run and have confirmed it.
    pub active: bool,
}

/// A firing on its way.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct InFlight {
    /// Counts firings.
    pub firing: u64,
    /// The transition, or in words what else moves the tokens.
    pub cause: String,
    /// Places the tokens were taken from.
    pub from: Vec<String>,
    /// Places they will be put into.
    pub to: Vec<String>,
    /// `stopping` or `starting`.
    pub phase: String,
    /// The components whose confirmation it waits for.
    pub waits_for: Vec<String>,
}

/// A transition whose clock runs.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct EnabledTransition {
    /// Its name.
    pub transition: String,
    /// When it became enabled.
    #[message(unit = "s")]
    pub enabled_at_s: f64,
    /// When it may fire.
    #[message(unit = "s")]
    pub earliest_at_s: f64,
    /// When it must have fired, if ever.
    #[message(unit = "s")]
    pub latest_at_s: Option<f64>,
    /// Who lets it fire: `mission`, `operator`, `confirmation` (the mission asks first), or
    /// `declined` (it has asked, and does again when it is newly enabled).
    pub by: String,
    /// Whether a pause stops its clock; its times count from the beginning of the pause then.
    pub held: bool,
}

/// A variable and what it is known to be.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct VariableValue {
    /// Its name.
    pub variable: String,
    /// In words: a number in SI, `true`, `false`, a text between single quotes, or `not known`.
    pub value: String,
    /// As a number in SI; 1 or 0 for true or false; none for a text and what is not known.
    pub number: Option<f64>,
    /// How many values came from outside its domain and counted as the nearer end.
    pub outside: u64,
}

/// A transition's guard and what it is known to be.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct GuardTruth {
    /// The transition.
    pub transition: String,
    /// The guard.
    pub guard: String,
    /// `true`, `false` or `not known`.
    pub truth: String,
    /// The values it looks at, in words.
    pub because: String,
}

/// A component and what it is known to do.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct MissionComponent {
    /// Its name.
    pub component: String,
    /// Whether the mission activates and freezes it.
    pub controlled: bool,
    /// `active`, `frozen`, `starting`, `commanded`, `lost`, `gone`, or `unseen`.
    pub state: String,
    /// Its last activation by this mission; 0 if there was none.
    pub activation: u64,
    /// The values that places gave its parameters when that began.
    pub values: Vec<ParameterGiven>,
}

/// A value that a place gives a parameter.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct ParameterGiven {
    /// The parameter.
    pub parameter: String,
    /// Its value, as written.
    pub value: String,
}

/// A transition that has fired.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct Fired {
    /// Its name.
    pub transition: String,
    /// When.
    #[message(unit = "s")]
    pub fired_at_s: f64,
}

impl Controller {
    /// What is to be shown now; `stamp` is system time, in seconds.
    pub fn marking(&self, stamp: f64) -> Marking {
        let ledger = &self.ledger;
        let places = self.plan.place_ids().filter(|place| ledger.state.tokens(*place) > 0);
        let fired = |(transition, at): &(String, Duration)| Fired {
            transition: transition.clone(),
            fired_at_s: at.as_secs_f64(),
        };
        Marking {
            stamp,
            mission: self.plan.mission.clone(),
            now_at_s: self.now.as_secs_f64(),
            clock: self.plan.clock.clone().unwrap_or_default(),
            stage: self.stage_in_words().to_owned(),
            why: ledger.why.clone(),
            places: places.map(|place| self.marked(place)).collect(),
            in_flight: ledger.firings.iter().map(|(id, firing)| self.flight(*id, firing)).collect(),
            enabled: ledger.state.enabled().map(|id| self.enabled(id)).collect(),
            variables: self.variables(),
            guards: self.plan.net.transition_ids().filter_map(|id| self.guard(id)).collect(),
            dates: self.dates(),
            components: self.plan.component_ids().map(|id| self.observed(id)).collect(),
            fired: ledger.fired,
            history: ledger.history.iter().map(fired).collect(),
            late_reports: self.dropped.late,
            unheard_reports: self.dropped.unheard,
            unwritten_orders: self.dropped.orders,
            pause: self.paused(),
            holder: self.holder(),
            link_lost_at_s: ledger.authority.link_lost.map(|at| at.as_secs_f64()),
            confirmations: self.confirmations(),
            orders: self.last_orders(),
            version: self.known_as,
            version_since_at_s: ledger.version_since.as_secs_f64(),
            change: self.change_shown(),
        }
    }

    fn variables(&self) -> Vec<VariableValue> {
        let variables = self.plan.variables.iter().zip(&self.senses.outside).enumerate();
        let shown = |(index, (variable, outside)): (usize, (&PlannedVariable, &u64))| {
            let value = self.variable(index);
            VariableValue {
                variable: variable.name.clone(),
                value: in_words(value.as_ref()),
                number: match value {
                    Some(Scalar::Number(number)) => Some(number),
                    Some(Scalar::Flag(flag)) => Some(f64::from(u8::from(flag))),
                    Some(Scalar::Text(_)) | None => None,
                },
                outside: *outside,
            }
        };
        let counters = self.plan.counters.iter().zip(&self.ledger.counters);
        let counted = counters.map(|(counter, value)| VariableValue {
            variable: counter.name.clone(),
            value: value.to_string(),
            number: Some(*value as f64),
            outside: 0,
        });
        variables.map(shown).chain(counted).collect()
    }

    fn guard(&self, id: TransitionId) -> Option<GuardTruth> {
        let planned = self.plan.transition(id).guard.as_ref()?;
        Some(GuardTruth {
            transition: self.plan.net.transition(id).name.clone(),
            guard: planned.guard.to_string(),
            truth: match self.truth(id) {
                Some(truth) => truth.to_string(),
                None => "not known".to_owned(),
            },
            because: self.because(id),
        })
    }

    fn stage_in_words(&self) -> &'static str {
        match self.ledger.stage {
            Stage::Ended(Outcome::Goal) => "goal",
            Stage::Ended(Outcome::Safe) => "safe",
            Stage::Ended(_) => "failed",
            _ if self.stopping => "stopping",
            Stage::Playing if self.ledger.pause().is_some() => "paused",
            Stage::Playing => "playing",
            Stage::Retreating => "retreating",
            Stage::Ending(_) => "ending",
        }
    }

    fn marked(&self, place: PlaceId) -> MarkedPlace {
        MarkedPlace {
            place: self.plan.net.place(place).to_owned(),
            tokens: self.ledger.state.tokens(place),
            active: self.plan.place(place).components.iter().all(|c| self.is_up(*c)),
        }
    }

    fn flight(&self, number: u64, firing: &Firing) -> InFlight {
        let names = |arcs: &[(PlaceId, u32)]| {
            arcs.iter().map(|arc| self.plan.net.place(arc.0).to_owned()).collect()
        };
        let waits = |component: &ComponentId| match firing.phase {
            Phase::Stopping => {
                let places = &self.plan.component(*component).places;
                places.iter().any(|place| firing.leaving.contains(place))
                    && self.wants_off(*component)
                    && !self.is_settled_off(*component)
            }
            Phase::Starting => {
                self.plan.activates(&firing.to, *component) && !self.is_up(*component)
            }
        };
        let waits_for = self.plan.component_ids().filter(waits);
        InFlight {
            firing: number,
            cause: firing.cause.to_string(),
            from: names(&firing.from),
            to: names(&firing.to),
            phase: match firing.phase {
                Phase::Stopping => "stopping".to_owned(),
                Phase::Starting => "starting".to_owned(),
            },
            waits_for: waits_for.map(|id| self.plan.component(id).name.clone()).collect(),
        }
    }

    fn observed(&self, id: ComponentId) -> MissionComponent {
        let (planned, observed) = (self.plan.component(id), self.roster.of(id));
        let last = &self.ledger.activations[id.index()];
        let given = |value: &GivenValue| ParameterGiven {
            parameter: value.parameter.clone(),
            value: value.text.clone(),
        };
        let state = match (observed.presence, observed.doing) {
            (Presence::Unseen, _) => "unseen",
            (Presence::Lost, _) => "lost",
            (Presence::Gone, _) => "gone",
            (Presence::Here, Doing::Unknown) => "commanded",
            (Presence::Here, Doing::Starting) => "starting",
            (Presence::Here, Doing::Frozen) => "frozen",
            (Presence::Here, Doing::Active) => "active",
        };
        MissionComponent {
            component: planned.name.clone(),
            controlled: planned.is_controlled() && observed.controllable,
            state: state.to_owned(),
            activation: last.number,
            values: last.values.iter().map(given).collect(),
        }
    }

    fn enabled(&self, id: TransitionId) -> EnabledTransition {
        let (state, transition) = (&self.ledger.state, self.plan.net.transition(id));
        let since = state.enabled_since(id).unwrap_or_default();
        EnabledTransition {
            transition: transition.name.clone(),
            enabled_at_s: since.as_secs_f64(),
            earliest_at_s: (since + transition.interval.earliest).as_secs_f64(),
            latest_at_s: state.deadline(id).map(|at| at.as_secs_f64()),
            by: match self.plan.transition(id).autonomy {
                _ if self.fires_by_itself(id) => "mission".to_owned(),
                _ if self.is_declined(id) => "declined".to_owned(),
                Autonomy::Confirm { .. } => "confirmation".to_owned(),
                Autonomy::Auto | Autonomy::Operator => "operator".to_owned(),
            },
            held: state.is_held(id),
        }
    }
}
