//! What the guards of a plan look at: fields of data, variables that follow them, and counters,
//! which are the variables that transitions set.

use crate::builder::PlanBuilder;
use armor_petri::TransitionId;
use armor_robotfile::guard::{Guard, Name, Scalar};

/// A field of data that guards look at, numbered within a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WatchId(pub u32);

impl WatchId {
    /// The position in [`crate::Plan::watches`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A field of data that guards look at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Watch {
    /// The data, `component.output`.
    pub data: String,
    /// The fields that lead to the value; none where the message has only one.
    pub field: Vec<String>,
}

/// A variable: a field of data under a name of its own, kept within its domain.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedVariable {
    /// Its name.
    pub name: String,
    /// What it follows.
    pub source: WatchId,
    /// Least value, in SI; -∞ without one.
    pub minimum: f64,
    /// Greatest value, in SI; +∞ without one.
    pub maximum: f64,
}

impl PlannedVariable {
    /// The value within the domain, given that of the source.
    pub(crate) fn within(&self, value: Scalar) -> Scalar {
        match value {
            // Not `clamp`, which panics at limits that a file cannot have.
            Scalar::Number(number) => Scalar::Number(number.min(self.maximum).max(self.minimum)),
            other => other,
        }
    }
}

/// What a name in a guard stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operand {
    Field(WatchId),
    /// An index into the plan's variables.
    Variable(usize),
    /// An index into the plan's counters.
    Counter(usize),
}

impl Operand {
    /// The counter that it is, if it is one.
    pub(crate) fn counter(&self) -> Option<usize> {
        match self {
            Self::Counter(index) => Some(*index),
            Self::Field(_) | Self::Variable(_) => None,
        }
    }
}

/// A guard whose names are resolved.
#[derive(Clone, Debug)]
pub struct PlannedGuard {
    /// As written.
    pub guard: Guard,
    /// What its names stand for, in their order.
    pub(crate) operands: Vec<Operand>,
}

impl PlanBuilder {
    /// The watch for a field of data; one that is there already serves all.
    pub(crate) fn watch(&mut self, data: &str, field: &[&str]) -> WatchId {
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
    pub(crate) fn guard(&mut self, transition: &str, guard: Guard) -> Result<PlannedGuard, Name> {
        let mission = mission_of(transition);
        let mut operands = Vec::new();
        for name in guard.names() {
            operands.push(match name.data() {
                Some(data) => Operand::Field(self.watch(data, &name.fields())),
                None => {
                    let named = |variable: &PlannedVariable| {
                        variable.name.strip_prefix(mission) == Some(name.as_str())
                    };
                    match self.variables.iter().position(named) {
                        Some(variable) => Operand::Variable(variable),
                        None => Operand::Counter(self.counter_named(mission, name)?),
                    }
                }
            });
        }
        Ok(PlannedGuard { guard, operands })
    }

    /// For each watch, the transitions whose guards look at it.
    pub(crate) fn watchers(&self) -> Vec<Vec<TransitionId>> {
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

/// What the names of a transition's mission begin with.
pub(crate) fn mission_of(transition: &str) -> &str {
    transition.rfind('.').map_or("", |dot| &transition[..=dot])
}
