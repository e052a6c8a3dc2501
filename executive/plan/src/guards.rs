//! What the guards of a plan look at: fields of data, variables that follow them, and counters,
//! which are the variables that transitions set.

use armor_robotfile::guard::{Guard, Scalar};

/// A field of data that guards look at, numbered within a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WatchId(pub u32);

impl WatchId {
    /// The position in `Plan::watches`.
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
    pub fn within(&self, value: Scalar) -> Scalar {
        match value {
            // Not `clamp`, which panics at limits that a file cannot have.
            Scalar::Number(number) => Scalar::Number(number.min(self.maximum).max(self.minimum)),
            other => other,
        }
    }
}

/// What a name in a guard stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    /// A field of data.
    Field(WatchId),
    /// An index into the plan's variables.
    Variable(usize),
    /// An index into the plan's counters.
    Counter(usize),
}

impl Operand {
    /// The counter that it is, if it is one.
    pub fn counter(&self) -> Option<usize> {
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
    pub operands: Vec<Operand>,
}
