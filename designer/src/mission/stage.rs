//! A mission as something that can be played by hand: its net with its sub-missions put in, and
//! what may go wrong with components as transitions of their own.
//!
//! Unlike a plan of the executive it is made of any mission that can be read, also one with
//! mistakes: arcs that lead nowhere are left out. The names of its transitions are those that
//! findings use, so that their firing sequences can be played here.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use armor_petri::{FiringInterval, Net, NetBuilder, PlaceId, TransitionId};
use armor_robotfile::guard::Guard;
use armor_robotfile::mission::{ArcKind, Autonomy, Class, Mission, Transition};
use armor_robotfile::{Configuration, Spanned};

/// What a transition of the stage's net stands for; the numbers are those of the flattened mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// The mission's transition fires as it should.
    Fires(usize),
    /// It fires, but a component does not stop.
    DoesNotStop(usize),
    /// It fires, but a component does not start.
    DoesNotStart(usize),
    /// A component of the place fails for good.
    Fails(usize),
}

/// A mission that can be played.
#[derive(Debug)]
pub struct Stage {
    /// With its sub-missions put in.
    pub mission: Mission,
    /// The net: places are the mission's, in order.
    pub net: Arc<Net>,
    /// What each transition of the net stands for.
    pub acts: Vec<Act>,
    /// Per transition of the mission, its guard, if it has one that can be read.
    pub guards: Vec<Option<Guard>>,
    /// The goal, if there is such a place.
    pub goal: Option<PlaceId>,
    /// The safe place, if there is such a place.
    pub safe: Option<PlaceId>,
    by_name: HashMap<String, TransitionId>,
}

/// Why a mission cannot be played at all.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StageError {
    /// There is no mission.
    #[error("This file has no mission yet: add a place to begin one")]
    NoMission,
    /// It is too large with its sub-missions put in, or its net is none.
    #[error("this mission cannot be played: {0}")]
    NoNet(String),
}

impl Stage {
    /// The stage of a configuration's mission.
    ///
    /// # Errors
    /// If there is no mission, or its pieces make no net (two places of one name).
    pub fn of(configuration: &Configuration) -> Result<Self, StageError> {
        let first = |findings: armor_robotfile::Findings| {
            findings.iter().next().map(|finding| finding.message.clone()).unwrap_or_default()
        };
        let mission = configuration.flattened().map_err(|found| StageError::NoNet(first(found)))?;
        Self::of_mission(mission.ok_or(StageError::NoMission)?)
    }

    /// The stage of a mission whose sub-missions are put in.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn of_mission(mission: Mission) -> Result<Self, StageError> {
        let mut set = Set::of(&mission);
        for (number, transition) in mission.transitions.iter().enumerate() {
            set.transition(&mission, number, transition);
        }
        set.failures(&mission);
        let Set { builder, acts, places, .. } = set;
        let net = builder.build().map_err(|error| StageError::NoNet(error.to_string()))?;
        let id = |name: &Option<Spanned<String>>| {
            name.as_ref().and_then(|name| places.get(&name.value).copied())
        };
        let names = net.transition_ids().map(|id| (net.transition(id).name.clone(), id));
        let guard = |transition: &Transition| {
            transition.when.as_ref().and_then(|when| Guard::parse(&when.value).ok())
        };
        Ok(Self {
            by_name: names.collect(),
            goal: id(&mission.goal),
            safe: id(&mission.safe),
            guards: mission.transitions.iter().map(guard).collect(),
            net: Arc::new(net),
            acts,
            mission,
        })
    }

    /// The transition of the net with this name, which may be one such as `late/on-stop-fail`.
    pub fn transition(&self, name: &str) -> Option<TransitionId> {
        self.by_name.get(name).copied()
    }

    /// The name of a transition of the net.
    pub fn name(&self, id: TransitionId) -> &str {
        &self.net.transition(id).name
    }

    /// The mission's own transition, of one that stands for its firing.
    pub fn written(&self, id: TransitionId) -> Option<&Transition> {
        match self.acts[id.index()] {
            Act::Fires(number) => self.mission.transitions.get(number),
            _ => None,
        }
    }

    /// Whether it fires without anyone doing anything once its time has come.
    pub fn is_automatic(&self, id: TransitionId) -> bool {
        self.written(id).is_some_and(|written| written.autonomy == Autonomy::Auto)
    }

    /// Whether the mission is over in a marking.
    pub fn is_over(&self, marking: &[u32]) -> bool {
        [self.goal, self.safe].into_iter().flatten().any(|place| marking[place.index()] > 0)
    }

    /// The components that are active in a marking, each once, in the order of the places.
    pub fn active<'a>(&'a self, marking: &[u32]) -> Vec<&'a str> {
        let mut active = Vec::new();
        for (place, tokens) in self.mission.places.iter().zip(marking) {
            for component in place.components.iter().filter(|_| *tokens > 0) {
                if !active.contains(&component.value.as_str()) {
                    active.push(component.value.as_str());
                }
            }
        }
        active
    }

    /// Exclusive components that are wanted active together in a marking.
    pub fn breaches<'a>(&'a self, marking: &[u32]) -> Vec<(&'a str, &'a str)> {
        let active = self.active(marking);
        let mut found = Vec::new();
        for set in &self.mission.exclusives {
            let names = set.components.iter().map(|name| name.value.as_str());
            let together: Vec<_> = names.filter(|name| active.contains(name)).collect();
            for (n, one) in together.iter().enumerate() {
                found.extend(together[n + 1..].iter().map(|other| (*one, *other)));
            }
        }
        found
    }
}

/// The net while it is put together.
struct Set {
    builder: NetBuilder,
    acts: Vec<Act>,
    places: HashMap<String, PlaceId>,
    /// Marked, nothing fires any longer.
    ends: Vec<PlaceId>,
    period: Duration,
}

impl Set {
    fn of(mission: &Mission) -> Self {
        let mut builder = NetBuilder::default();
        let mut places = HashMap::new();
        for place in &mission.places {
            let id = builder.place(place.name.value.as_str(), place.initial);
            places.entry(place.name.value.clone()).or_insert(id);
        }
        let ends = [&mission.goal, &mission.safe].into_iter().flatten();
        let ends = ends.filter_map(|name| places.get(&name.value).copied()).collect();
        let period = mission.period.as_ref().map_or(Duration::ZERO, |period| period.value);
        Self { builder, acts: Vec::new(), places, ends, period }
    }

    fn transition(&mut self, mission: &Mission, number: usize, written: &Transition) {
        let name = &written.name.value;
        let puts: Vec<_> = self.arcs(written, ArcKind::Put);
        self.put(mission, written, name.clone(), &puts);
        self.acts.push(Act::Fires(number));
        let refuges = [
            (&written.on_stop_fail, "on-stop-fail", Act::DoesNotStop(number)),
            (&written.on_start_fail, "on-start-fail", Act::DoesNotStart(number)),
        ];
        for (refuge, why, act) in refuges {
            let refuge = refuge.as_ref().and_then(|name| self.places.get(&name.value).copied());
            if let Some(refuge) = refuge {
                self.put(mission, written, format!("{name}/{why}"), &[(refuge, 1)]);
                self.acts.push(act);
            }
        }
    }

    fn arcs(&self, written: &Transition, kind: ArcKind) -> Vec<(PlaceId, u32)> {
        let of_kind = written.arcs.iter().filter(|arc| arc.kind == kind && arc.weight > 0);
        of_kind.filter_map(|arc| Some((*self.places.get(&arc.place.value)?, arc.weight))).collect()
    }

    fn put(
        &mut self,
        mission: &Mission,
        written: &Transition,
        name: String,
        puts: &[(PlaceId, u32)],
    ) {
        let takes = self.arcs(written, ArcKind::Take);
        let reads = self.arcs(written, ArcKind::Read);
        let inhibitors = self.arcs(written, ArcKind::Inhibitor);
        let resets = self.arcs(written, ArcKind::Reset);
        let mut t = self.builder.transition(name);
        t = takes.iter().fold(t, |t, (place, weight)| t.input(*place, *weight));
        t = puts.iter().fold(t, |t, (place, weight)| t.output(*place, *weight));
        t = reads.iter().fold(t, |t, (place, weight)| t.read(*place, *weight));
        t = inhibitors.iter().fold(t, |t, (place, weight)| t.inhibitor(*place, *weight));
        t = resets.iter().fold(t, |t, (place, _)| t.reset(*place));
        t = self.ends.iter().fold(t, |t, end| t.inhibitor(*end, 1));
        t = t.interval(interval(written, self.period)).priority(written.priority);
        if is_safety(mission, written) {
            t = t.class(armor_petri::FiringClass::Safety);
        }
        if is_gated(written) {
            t.gated();
        }
    }

    fn failures(&mut self, mission: &Mission) {
        for (number, place) in mission.places.iter().enumerate() {
            let id = |name: &str| self.places.get(name).copied();
            let refuge = place.on_failure.as_ref().and_then(|refuge| id(&refuge.value));
            let (Some(from), Some(refuge)) = (id(&place.name.value), refuge) else { continue };
            let name = format!("{}/on-failure", place.name.value);
            let mut t = self.builder.transition(name).input(from, 1).output(refuge, 1);
            t = self.ends.iter().fold(t, |t, end| t.inhibitor(*end, 1));
            t.interval(FiringInterval::UNTIMED);
            self.acts.push(Act::Fails(number));
        }
    }
}

/// Whether more than tokens and time decide that it is enabled.
pub fn is_gated(written: &Transition) -> bool {
    let is_dated = written.not_before.is_some() || written.not_after.is_some();
    written.on.is_some() || written.when.is_some() || is_dated
}

/// What leads to a place of the safety class is of the safety class.
fn is_safety(mission: &Mission, written: &Transition) -> bool {
    let is_safe = |name: &str| mission.place(name).is_some_and(|p| p.class == Class::Safety);
    written.class == Class::Safety || written.outputs().any(|arc| is_safe(&arc.place))
}

fn interval(written: &Transition, period: Duration) -> FiringInterval {
    // A transition that waits for a person is never too late.
    let is_manual = written.autonomy != Autonomy::Auto;
    let latest = |latest: Option<Duration>| {
        latest.filter(|_| !is_manual).map(|latest| latest.saturating_add(period))
    };
    match &written.interval {
        Some(given) => FiringInterval { earliest: given.earliest, latest: latest(given.latest) },
        None if is_manual => FiringInterval::UNTIMED,
        None => FiringInterval { earliest: Duration::ZERO, latest: latest(Some(Duration::ZERO)) },
    }
}
