//! A measured figure and its goal.

use std::fmt;

/// The side that is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Contender {
    Std,
    Armor,
}

impl fmt::Display for Contender {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Std => "std",
            Self::Armor => "armor",
        })
    }
}

/// The goal of a figure.
#[derive(Clone, Copy, Debug)]
pub enum FigureGoal {
    None,
    /// At most this many times what std takes.
    TimesStdAtMost(f64),
    /// At least this many times what std does.
    TimesStdAtLeast(f64),
    AtMost(f64),
    AtLeast(f64),
}

/// One figure of one measurement.
#[derive(Clone, Debug)]
pub struct Figure {
    pub name: String,
    pub unit: &'static str,
    pub value: f64,
    pub goal: FigureGoal,
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {:.2} {}", self.name, self.value, self.unit)
    }
}

impl Figure {
    pub fn new(name: impl Into<String>, unit: &'static str, value: f64, goal: FigureGoal) -> Self {
        Self { name: name.into(), unit, value, goal }
    }
}
