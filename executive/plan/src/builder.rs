//! Puts a plan together from parts whose names are resolved.

use crate::counters::{PlannedCounter, PlannedSet};
use crate::guards::{Operand, PlannedGuard, PlannedVariable, Watch, WatchId};
use crate::limits::{OnResume, PlanLimits};
use crate::plan::{Plan, PlanNames};
use crate::planned::{ComponentId, PlannedComponent, PlannedPlace, PlannedTransition};
use armor_petri::{NetBuilder, PlaceId, TransitionId};
use armor_robotfile::guard::{Count, Guard, Name};
use armor_robotfile::list_scopes;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Puts a plan together; the caller has resolved the names.
#[derive(Debug, Default)]
pub struct PlanBuilder {
    /// The net.
    pub net: NetBuilder,
    /// The mission's name.
    pub mission: String,
    /// The components.
    pub components: Vec<PlannedComponent>,
    /// The places.
    pub places: Vec<PlannedPlace>,
    /// The transitions, in the order in which the net has them.
    pub transitions: Vec<PlannedTransition>,
    /// The fields of data that guards read.
    pub watches: Vec<Watch>,
    /// The variables that follow data.
    pub variables: Vec<PlannedVariable>,
    /// The variables that transitions set.
    pub counters: Vec<PlannedCounter>,
    /// Sets of components of which one at most may be active.
    pub exclusives: Vec<Vec<ComponentId>>,
    /// The place that ends the mission well.
    pub goal: Option<PlaceId>,
    /// The place for which a failed mission gives up everything else.
    pub safe: Option<PlaceId>,
    /// The period in which the net is looked at.
    pub period: Option<Duration>,
    /// What a restarted executive does first.
    pub on_resume: OnResume,
    /// The waiting times.
    pub limits: PlanLimits,
}

impl PlanBuilder {
    /// Adds a component.
    pub fn component(&mut self, name: &str, controllable: bool) -> ComponentId {
        let (places, peers) = (Vec::new(), Vec::new());
        self.components.push(PlannedComponent {
            name: name.to_owned(),
            controllable,
            places,
            peers,
            returns: true,
            return_within: self.limits.return_within,
        });
        ComponentId(self.components.len() as u32 - 1)
    }

    /// Adds a place with its first tokens and the components that it activates.
    pub fn place(&mut self, name: &str, tokens: u32, active: &[ComponentId]) -> PlaceId {
        let id = self.net.place(name, tokens);
        self.places.push(PlannedPlace { components: active.to_vec(), ..PlannedPlace::default() });
        for component in active {
            self.components[component.index()].places.push(id);
        }
        id
    }

    /// Builds the plan.
    ///
    /// # Errors
    /// If the net has two places or two transitions of one name.
    pub fn build(mut self) -> Result<Plan, armor_petri::NetError> {
        for set in &self.exclusives {
            for (one, other) in set.iter().flat_map(|one| set.iter().map(move |o| (*one, *o))) {
                let peers = &mut self.components[one.index()].peers;
                if one != other && !peers.contains(&other) {
                    peers.push(other);
                }
            }
        }
        if let Some(safe) = self.safe {
            self.places[safe.index()].safety = true;
        }
        let watchers = self.watchers();
        let counter_readers = self.counter_readers();
        let net = self.net.build()?;
        let mut listeners: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for (id, transition) in net.transition_ids().zip(&self.transitions) {
            if let Some(on) = &transition.on {
                listeners.entry(on.clone()).or_default().push(id);
            }
        }
        let dated = net.transition_ids().zip(&self.transitions);
        let dated = dated.filter(|it| it.1.dates.is_some()).map(|it| it.0).collect();
        let names = PlanNames {
            components: (0..)
                .map(ComponentId)
                .zip(&self.components)
                .map(|(id, c)| (c.name.clone(), id))
                .collect(),
            places: (0..).map(PlaceId).zip(net.places()).map(|(id, p)| (p.clone(), id)).collect(),
            transitions: net
                .transition_ids()
                .map(|id| (net.transition(id).name.clone(), id))
                .collect(),
        };
        Ok(Plan {
            mission: self.mission,
            net: Arc::new(net),
            components: self.components,
            places: self.places,
            transitions: self.transitions,
            listeners,
            watches: self.watches,
            variables: self.variables,
            counters: self.counters,
            watchers,
            counter_readers,
            dated,
            goal: self.goal,
            safe: self.safe,
            period: self.period,
            clock: None,
            on_resume: self.on_resume,
            limits: self.limits,
            names,
            version: Arc::default(),
            began: Arc::default(),
            reader: crate::succession::read,
        })
    }
}

impl PlanBuilder {
    /// Returns the watch for a field of data; all guards that read the field share one.
    pub fn watch(&mut self, data: &str, field: &[&str]) -> WatchId {
        let watch = Watch {
            data: data.to_owned(),
            field: field.iter().map(|name| (*name).to_owned()).collect(),
        };
        let known = self.watches.iter().position(|other| *other == watch);
        let index = known.unwrap_or_else(|| {
            self.watches.push(watch);
            self.watches.len() - 1
        });
        WatchId(index as u32)
    }

    /// The guard of a transition with its names resolved. Variables are those of the mission that
    /// the transition was written in: of a sub-mission both begin with its name.
    ///
    /// # Errors
    /// The name of a variable that there is not.
    pub fn guard(&mut self, transition: &str, guard: Guard) -> Result<PlannedGuard, Name> {
        let mut operands = Vec::new();
        for name in guard.names() {
            operands.push(match name.data() {
                Some(data) => Operand::Field(self.watch(data, &name.fields())),
                None => self.variable_named(transition, name)?,
            });
        }
        Ok(PlannedGuard { guard, operands })
    }

    fn variable_named(&self, transition: &str, name: &Name) -> Result<Operand, Name> {
        let operand = |mission: &str| {
            let is_it = |full: &str| full.strip_prefix(mission) == Some(name.as_str());
            let variable = self.variables.iter().position(|it| is_it(&it.name));
            let counter = || self.counters.iter().position(|it| is_it(&it.name));
            variable.map(Operand::Variable).or_else(|| counter().map(Operand::Counter))
        };
        list_scopes(transition).find_map(operand).ok_or_else(|| name.clone())
    }

    /// For each watch, the transitions whose guards look at it.
    fn watchers(&self) -> Vec<Vec<TransitionId>> {
        let mut watchers = vec![Vec::new(); self.watches.len()];
        for (id, transition) in (0..).map(TransitionId).zip(&self.transitions) {
            for operand in transition.guard.iter().flat_map(|guard| &guard.operands) {
                let watch = match operand {
                    Operand::Field(watch) => *watch,
                    Operand::Variable(index) => self.variables[*index].source,
                    Operand::Counter(_) => continue,
                };
                let watchers: &mut Vec<_> = &mut watchers[watch.index()];
                if watchers.last() != Some(&id) {
                    watchers.push(id);
                }
            }
        }
        watchers
    }
}

impl PlanBuilder {
    /// What a transition sets a counter to, with its names resolved; they are those of its mission.
    ///
    /// # Errors
    /// The name of a counter that there is not.
    pub fn set(&self, transition: &str, counter: usize, value: Count) -> Result<PlannedSet, Name> {
        let operands: Result<_, _> =
            value.names().iter().map(|name| self.counter_named(transition, name)).collect();
        Ok(PlannedSet { counter, operands: operands?, value })
    }

    fn counter_named(&self, transition: &str, name: &Name) -> Result<usize, Name> {
        let counter = |mission: &str| {
            let is_it = |full: &str| full.strip_prefix(mission) == Some(name.as_str());
            self.counters.iter().position(|it| is_it(&it.name))
        };
        list_scopes(transition).find_map(counter).ok_or_else(|| name.clone())
    }

    /// For each counter, the transitions whose guards look at it.
    fn counter_readers(&self) -> Vec<Vec<TransitionId>> {
        let mut readers = vec![Vec::new(); self.counters.len()];
        for (id, transition) in (0..).map(TransitionId).zip(&self.transitions) {
            for operand in transition.guard.iter().flat_map(|guard| &guard.operands) {
                if let Operand::Counter(index) = operand {
                    let readers: &mut Vec<_> = &mut readers[*index];
                    if readers.last() != Some(&id) {
                        readers.push(id);
                    }
                }
            }
        }
        readers
    }
}
