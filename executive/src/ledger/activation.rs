//! The last activation of a component.

use armor_plan::GivenValue;
use serde::{Deserialize, Serialize};

/// The last activation of a component, and its result.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Activation {
    pub(crate) number: u64,
    /// Whether its reports count.
    pub(crate) open: bool,
    pub(crate) done: bool,
    pub(crate) failed: Option<String>,
    /// The values that places gave its parameters when it began.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) values: Vec<GivenValue>,
    /// A pause stopped it. If it has not finished it continues, under another number.
    pub(crate) interrupted: bool,
    /// The last report that counted: process start and number.
    pub(crate) heard: (u64, u64),
}

/// Whether two activations are given the same values, wherever these are written.
pub(super) fn have_same_terms(one: &[GivenValue], other: &[GivenValue]) -> bool {
    one.iter().map(GivenValue::terms).eq(other.iter().map(GivenValue::terms))
}

impl Activation {
    /// Whether it has reported that its task is over, or cannot be done.
    pub(crate) fn has_finished(&self) -> bool {
        self.done || self.failed.is_some()
    }
}
