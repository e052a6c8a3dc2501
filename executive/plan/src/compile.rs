//! Mission file → plan. What the file may say and this executive does not play is refused with a
//! finding, never passed over.

mod conditions;
mod names;

use crate::builder::PlanBuilder;
use crate::dates::PlannedDates;
use crate::limits::OnResume;
use crate::plan::Plan;
use crate::planned::{ComponentId, PlannedTransition};
use crate::values::GivenValue;
use crate::version::{Version, in_words};
use armor_petri::{FiringInterval, PlaceId};
use armor_robotfile::mission::{
    ArcKind, Autonomy, Class, Mission, Place, PlaceParameter, Resume, Transition,
};
use armor_robotfile::model::{Host, Restart};
use armor_robotfile::{Code, Configuration, Date, Finding, Findings, Spanned, System};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

impl Plan {
    /// The plan of a configuration's mission with its sub-missions put in; none if it has none.
    ///
    /// # Errors
    /// Findings: names that lead nowhere, or that the whole is larger than a
    /// mission may be.
    pub fn of(configuration: &Configuration) -> Result<Option<Self>, Findings> {
        Self::compiled(configuration, None)
    }

    /// The same for a mission that is to follow the one that is played: over the components that
    /// run, under the same numbers, and looking at what is looked at already.
    ///
    /// # Errors
    /// As [`Self::of`]; also a component that the mission speaks of and that does not run.
    pub fn over(configuration: &Configuration, running: &Self) -> Result<Option<Self>, Findings> {
        Self::compiled(configuration, Some(running))
    }

    fn compiled(
        configuration: &Configuration,
        running: Option<&Self>,
    ) -> Result<Option<Self>, Findings> {
        let Some(mission) = configuration.flattened()? else { return Ok(None) };
        let compiler = match running {
            None => Compiler::of(&configuration.system),
            Some(running) => Compiler::over(&configuration.system, running),
        };
        let mut plan = Self::compile(compiler, &mission)?;
        plan.version = Version::of(configuration, 0).into();
        // A running executive keeps the time that it was started with.
        plan.clock = match running {
            Some(running) => running.clock.clone(),
            None => configuration.system.clock.as_ref().map(|clock| clock.source.data()),
        };
        let began = running.map(|running| &running.began);
        plan.began = Arc::clone(began.unwrap_or(&plan.version));
        Ok(Some(plan))
    }

    /// The plan of a whole mission over a system, both checked before.
    fn compile(mut compiler: Compiler, mission: &Mission) -> Result<Self, Findings> {
        compiler.plan.mission =
            mission.name.as_ref().map_or_else(|| "mission".to_owned(), |name| name.value.clone());
        mission.places.iter().for_each(|place| compiler.place(place));
        for place in &mission.places {
            let id = compiler.find_place(&place.name);
            let refuge = place.on_failure.as_ref().and_then(|refuge| compiler.find_place(refuge));
            if let Some(id) = id {
                compiler.plan.places[id.index()].on_failure = refuge;
            }
        }
        compiler.plan.goal = mission.goal.as_ref().and_then(|goal| compiler.find_place(goal));
        compiler.plan.safe = mission.safe.as_ref().and_then(|safe| compiler.find_place(safe));
        compiler.plan.period = mission.period.as_ref().map(|period| period.value);
        compiler.plan.on_resume = match mission.resume.as_deref() {
            Some(Resume::Safe) => OnResume::Safe,
            Some(Resume::Hold) => OnResume::Hold,
            Some(Resume::Continue) | None => OnResume::Continue,
        };
        for exclusive in &mission.exclusives {
            let names = exclusive.components.iter();
            let set = names.filter_map(|name| compiler.exclusive(name)).collect();
            compiler.plan.exclusives.push(set);
        }
        mission.variables.iter().for_each(|variable| compiler.variable(variable));
        mission.transitions.iter().for_each(|t| compiler.transition(mission, t));
        compiler.finish(mission)
    }
}

impl Version {
    /// The plan of its mission.
    ///
    /// # Errors
    /// In words, what is wrong with it.
    pub fn plan(&self) -> Result<Plan, String> {
        let configuration = self.configuration().map_err(in_words)?;
        let plan = Plan::of(&configuration).map_err(in_words)?;
        let plan = plan.ok_or_else(|| "it has no mission".to_owned())?;
        Ok(plan.numbered(self.number))
    }
}

#[derive(Default)]
struct Compiler {
    plan: PlanBuilder,
    components: HashMap<String, ComponentId>,
    places: HashMap<String, PlaceId>,
    findings: std::cell::RefCell<Findings>,
    /// Components of the file that do not run.
    idle: HashSet<String>,
}

impl Compiler {
    fn of(system: &System) -> Self {
        let mut compiler = Self::default();
        for component in &system.components {
            let id = compiler.component(&component.name, component.controllable);
            let planned = &mut compiler.plan.components[id.index()];
            planned.returns = component.restart != Restart::Never;
            let is_its = |host: &&Host| {
                component.host.as_ref().is_some_and(|name| name.value == host.name.value)
            };
            if let Some(patience) = system.hosts.iter().find(is_its).and_then(|it| it.patience) {
                planned.return_within = patience;
            }
        }
        compiler
    }

    fn over(system: &System, running: &Plan) -> Self {
        let mut compiler = Self::default();
        for component in &running.components {
            let id = compiler.component(&component.name, component.controllable);
            let planned = &mut compiler.plan.components[id.index()];
            (planned.returns, planned.return_within) = (component.returns, component.return_within);
        }
        compiler.plan.watches.clone_from(&running.watches);
        compiler.plan.limits = running.limits.clone();
        let names = system.components.iter().map(|component| component.name.value.clone());
        compiler.idle = names.filter(|name| !compiler.components.contains_key(name)).collect();
        compiler
    }

    fn component(&mut self, name: &str, controllable: bool) -> ComponentId {
        let id = self.plan.component(name, controllable);
        self.components.insert(name.to_owned(), id);
        id
    }

    fn place(&mut self, place: &Place) {
        let found = place.components.iter().filter_map(|name| self.find_component(name));
        let components: Vec<_> = found.collect();
        let id = self.plan.place(&place.name, place.initial, &components);
        let given = place.parameters.iter().filter_map(|given| {
            let PlaceParameter { component, parameter } = given;
            let value = GivenValue {
                parameter: parameter.name.value.clone(),
                text: parameter.value.value.clone(),
                folder: parameter.folder.clone(),
                origin: parameter.origin(),
            };
            Some((self.find_component(component)?, value))
        });
        let values = given.collect();
        self.plan.places[id.index()].safety = place.class == Class::Safety;
        self.plan.places[id.index()].values = values;
        self.places.insert(place.name.value.clone(), id);
    }

    fn transition(&mut self, mission: &Mission, transition: &Transition) {
        let manual = transition.autonomy != Autonomy::Auto;
        let guard = transition.when.as_ref().and_then(|when| self.guard(&transition.name, when));
        let found =
            |name: &Option<Spanned<String>>| name.as_ref().and_then(|name| self.find_place(name));
        let on = transition
            .on
            .as_ref()
            .and_then(|on| Some((self.find_component(&on.component)?, on.event.value.clone())));
        let planned = PlannedTransition {
            on,
            guard,
            sets: self.sets(transition),
            dates: dates(transition),
            on_stop_fail: found(&transition.on_stop_fail),
            on_start_fail: found(&transition.on_start_fail),
            overrun: found(&transition.overrun),
            autonomy: transition.autonomy,
            lost_link: transition.lost_link.as_deref().copied(),
        };
        let arcs: Vec<_> = transition
            .arcs
            .iter()
            .filter_map(|arc| Some((arc.kind, self.find_place(&arc.place)?, arc.weight)))
            .collect();
        let mut t = self.plan.net.transition(transition.name.value.as_str());
        for (kind, place, weight) in arcs {
            t = match kind {
                ArcKind::Take => t.input(place, weight),
                ArcKind::Put => t.output(place, weight),
                ArcKind::Read => t.read(place, weight),
                ArcKind::Inhibitor => t.inhibitor(place, weight),
                ArcKind::Reset => t.reset(place),
            };
        }
        if let Some(interval) = &transition.interval {
            // A transition that waits for a person is never too late.
            let latest = interval.latest.filter(|_| !manual);
            t = t.interval(FiringInterval { earliest: interval.earliest, latest });
        } else if manual {
            t = t.interval(FiringInterval::UNTIMED);
        }
        if is_safety(mission, transition) {
            t = t.class(armor_petri::FiringClass::Safety);
        }
        t = t.priority(transition.priority);
        if planned.is_gated() {
            t.gated();
        }
        self.plan.transitions.push(planned);
    }

    fn finish(self, mission: &Mission) -> Result<Plan, Findings> {
        let mut findings = self.findings.into_inner();
        if findings.has_errors() {
            return Err(findings);
        }
        self.plan.build().map_err(|error| {
            let finding = Finding::new(Code::DuplicateTransition, &mission.at, error.to_string());
            findings.push(finding.remedy("give places and transitions names of their own"));
            findings
        })
    }
}

fn dates(transition: &Transition) -> Option<PlannedDates> {
    let date = |date: &Option<Spanned<Date>>| date.as_ref().map(|date| date.value);
    let (first, last) = (date(&transition.not_before), date(&transition.not_after));
    let missed = transition.missed.as_deref().copied().unwrap_or_default();
    (first.is_some() || last.is_some()).then_some(PlannedDates { first, last, missed })
}

/// What leads to a place of the safety class is of the safety class.
fn is_safety(mission: &Mission, transition: &Transition) -> bool {
    let safe = |name: &str| mission.place(name).is_some_and(|p| p.class == Class::Safety);
    transition.class == Class::Safety || transition.outputs().any(|arc| safe(&arc.place))
}

#[cfg(test)]
mod tests;
