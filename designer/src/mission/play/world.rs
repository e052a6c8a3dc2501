//! The environment of a played mission: reports that have arrived, values, guards that the user has
//! made true, dates that have passed.

use std::collections::{BTreeMap, BTreeSet};

use armor_petri::{NetState, TransitionId};
use armor_robotfile::guard::{Count, Name, Scalar};
use armor_wire::quantity;

use crate::mission::stage::{Act, Stage};

/// The state of the environment at a moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
    /// `component.event` that has come and was not consumed.
    reports: BTreeSet<String>,
    /// Values by the names that guards use; a variable's begins with its sub-mission's name.
    values: BTreeMap<String, Scalar>,
    /// Transitions of the mission whose guard the user has made true, whatever the values.
    holding: BTreeSet<usize>,
    /// Transitions of the mission whose dates the user has made current.
    dated: BTreeSet<usize>,
}

/// A value that guards read.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Sense {
    /// The name by which its value is set.
    pub name: String,
    /// The transitions whose guards read it.
    pub transitions: Vec<String>,
}

impl World {
    /// What is known at the start: what transitions set variables to has a first value.
    pub(super) fn at_start(stage: &Stage) -> Self {
        let counts = stage.mission.variables.iter().filter_map(|variable| {
            let counts = variable.counts()?;
            Some((variable.name.value.clone(), Scalar::Number(counts.initial as f64)))
        });
        Self { values: counts.collect(), ..Self::default() }
    }

    /// Returns everything that guards read.
    pub fn senses(stage: &Stage) -> Vec<Sense> {
        let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (number, guard) in stage.guards.iter().enumerate() {
            for name in guard.iter().flat_map(|guard| guard.names()) {
                let transition = &stage.mission.transitions[number].name.value;
                found.entry(key(stage, transition, name)).or_default().push(transition.clone());
            }
        }
        found.into_iter().map(|(name, transitions)| Sense { name, transitions }).collect()
    }

    /// Returns a value, if it is known.
    pub fn value(&self, name: &str) -> Option<&Scalar> {
        self.values.get(name)
    }

    /// Whether `component.event` has come and was not consumed.
    pub fn is_reported(&self, report: &str) -> bool {
        self.reports.contains(report)
    }

    /// Whether the guard of a transition of the mission holds; none without one, or if it is not
    /// known.
    pub fn holds(&self, stage: &Stage, number: usize) -> Option<bool> {
        let guard = stage.guards[number].as_ref()?;
        let transition = &stage.mission.transitions[number].name.value;
        let value = |name: &Name| self.values.get(&key(stage, transition, name)).cloned();
        let values: Vec<_> = guard.names().iter().map(value).collect();
        guard.holds(&values)
    }

    pub(super) fn set_value(&mut self, name: &str, value: Option<Scalar>) {
        // A guard made true by hand stays so only until a value is set.
        self.holding.clear();
        match value {
            Some(value) => self.values.insert(name.to_owned(), value),
            None => self.values.remove(name),
        };
    }

    /// The same values, without reports and other events.
    pub(super) fn values_only(&self, stage: &Stage) -> Self {
        let mut values = self.values.clone();
        values.extend(Self::at_start(stage).values);
        Self { values, ..Self::default() }
    }

    /// All that a transition waits for has arrived.
    pub(super) fn satisfy(&mut self, stage: &Stage, id: TransitionId) {
        let Some(number) = number_of(stage, id) else { return };
        if let Some(report) = report(stage, number) {
            self.reports.insert(report);
        }
        self.dated.insert(number);
        if self.holds(stage, number) != Some(true) {
            self.holding.insert(number);
        }
    }

    /// A transition has fired: its report is consumed, and so are those that no transition waits
    /// for any more because their component has been frozen.
    pub(super) fn fired(&mut self, stage: &Stage, id: TransitionId, marking: &[u32]) {
        if let Some(number) = number_of(stage, id) {
            if let Some(report) = report(stage, number) {
                self.reports.remove(&report);
            }
            self.holding.remove(&number);
            if stage.acts[id.index()] == Act::Fires(number) {
                self.set_variables(stage, number);
            }
        }
        let active = stage.active(marking);
        let controlled = |component: &str| stage.mission.controls(component);
        self.reports.retain(|report| {
            let component = report.split('.').next().unwrap_or_default();
            active.contains(&component) || !controlled(component)
        });
    }

    /// What a firing sets variables to, by the values before it and kept within what they count.
    fn set_variables(&mut self, stage: &Stage, number: usize) {
        let transition = &stage.mission.transitions[number];
        let name = &transition.name.value;
        let before = self.values.clone();
        for set in &transition.sets {
            let Ok(count) = Count::parse(&set.value.value) else { continue };
            let value = |named: &Name| match before.get(&key(stage, name, named)) {
                Some(Scalar::Number(number)) => *number as i64,
                _ => 0,
            };
            let values: Vec<_> = count.names().iter().map(value).collect();
            let Some(own) = stage.mission.variable_of(name, &set.variable.value) else { continue };
            if let (Some(value), Some(counts)) = (count.of(&values), own.counts()) {
                let value = value.clamp(counts.minimum, counts.maximum);
                self.values.insert(own.name.value.clone(), Scalar::Number(value as f64));
            }
        }
    }

    /// Opens the gates of the transitions whose conditions are met, and shuts the others.
    pub(super) fn open_gates(&self, stage: &Stage, state: &mut NetState) {
        for id in stage.net.transition_ids() {
            if let Some(number) = number_of(stage, id) {
                state.set_gate(id, self.is_met(stage, number));
            }
        }
    }

    fn is_met(&self, stage: &Stage, number: usize) -> bool {
        let written = &stage.mission.transitions[number];
        let is_dated = written.not_before.is_some() || written.not_after.is_some();
        report(stage, number).is_none_or(|report| self.reports.contains(&report))
            && (written.when.is_none()
                || self.holding.contains(&number)
                || self.holds(stage, number) == Some(true))
            && (!is_dated || self.dated.contains(&number))
    }
}

/// The mission's transition whose conditions are those of a transition of the net.
pub(super) fn number_of(stage: &Stage, id: TransitionId) -> Option<usize> {
    match stage.acts[id.index()] {
        Act::Fires(number) | Act::DoesNotStop(number) | Act::DoesNotStart(number) => Some(number),
        Act::Fails(_) => None,
    }
}

fn report(stage: &Stage, number: usize) -> Option<String> {
    let on = stage.mission.transitions[number].on.as_ref()?;
    Some(format!("{}.{}", on.component.value, on.event.value))
}

/// A field of data is everybody's; a variable is that of the mission its transition is written in.
fn key(stage: &Stage, transition: &str, name: &Name) -> String {
    let variable = match name.data() {
        Some(_) => None,
        None => stage.mission.variable_of(transition, name.as_str()),
    };
    variable.map_or_else(|| name.as_str().to_owned(), |it| it.name.value.clone())
}

/// A value as a user types it: `30%`, `true`, `Full`. Empty is not known.
pub fn scalar(text: &str) -> Option<Scalar> {
    match text.trim() {
        "" => None,
        "true" => Some(Scalar::Flag(true)),
        "false" => Some(Scalar::Flag(false)),
        text => Some(match quantity::parse(text) {
            Ok(quantity) => Scalar::Number(quantity.si),
            Err(_) => Scalar::Text(text.trim_matches('\'').to_owned()),
        }),
    }
}

pub(super) fn shown(value: &Scalar) -> String {
    match value {
        Scalar::Number(number) => number.to_string(),
        Scalar::Flag(flag) => flag.to_string(),
        Scalar::Text(text) => text.clone(),
    }
}
