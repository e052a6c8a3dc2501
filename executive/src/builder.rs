//! Puts a plan together from parts whose names are resolved.

use crate::counters::PlannedCounter;
use crate::guards::{PlannedVariable, Watch};
use crate::plan::{
    ComponentId, Limits, Names, OnResume, Plan, PlannedComponent, PlannedPlace, PlannedTransition,
};
use armor_petri::{NetBuilder, PlaceId};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Puts a plan together; whoever calls it has resolved the names.
#[derive(Debug, Default)]
pub(crate) struct PlanBuilder {
    pub(crate) net: NetBuilder,
    pub(crate) mission: String,
    pub(crate) components: Vec<PlannedComponent>,
    pub(crate) places: Vec<PlannedPlace>,
    pub(crate) transitions: Vec<PlannedTransition>,
    pub(crate) watches: Vec<Watch>,
    pub(crate) variables: Vec<PlannedVariable>,
    pub(crate) counters: Vec<PlannedCounter>,
    pub(crate) exclusives: Vec<Vec<ComponentId>>,
    pub(crate) goal: Option<PlaceId>,
    pub(crate) safe: Option<PlaceId>,
    pub(crate) period: Option<Duration>,
    pub(crate) on_resume: OnResume,
    pub(crate) limits: Limits,
}

impl PlanBuilder {
    pub(crate) fn component(&mut self, name: &str, controllable: bool) -> ComponentId {
        let (places, peers) = (Vec::new(), Vec::new());
        self.components.push(PlannedComponent {
            name: name.to_owned(),
            controllable,
            places,
            peers,
            returns: true,
        });
        ComponentId(self.components.len() as u32 - 1)
    }

    pub(crate) fn place(&mut self, name: &str, tokens: u32, active: &[ComponentId]) -> PlaceId {
        let id = self.net.place(name, tokens);
        self.places.push(PlannedPlace { components: active.to_vec(), ..PlannedPlace::default() });
        for component in active {
            self.components[component.index()].places.push(id);
        }
        id
    }

    pub(crate) fn build(mut self) -> Result<Plan, armor_petri::NetError> {
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
        let names = Names {
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
            reader: crate::change::read,
        })
    }
}
