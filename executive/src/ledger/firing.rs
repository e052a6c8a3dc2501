//! A firing in flight.

use crate::terms::Cause;
use armor_petri::PlaceId;
use armor_plan::ComponentId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::time::Duration;

/// The phase of a firing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// Until everything that must stop has confirmed it.
    Stopping,
    /// Until everything that must start has confirmed it.
    Starting,
}

/// Tokens on their way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Firing {
    /// Why.
    pub cause: Cause,
    /// What was taken.
    pub from: Vec<(PlaceId, u32)>,
    /// What will be put.
    pub to: Vec<(PlaceId, u32)>,
    /// Where it is.
    pub phase: Phase,
    /// Since when it is there.
    pub since: Duration,
    /// Whether it has been redirected: it is not redirected twice.
    pub redirected: bool,
    /// Places whose components must be off unless something else wants them.
    pub(super) leaving: BTreeSet<PlaceId>,
    /// Components that are in both, but have finished and need a fresh start.
    pub(super) renewing: BTreeSet<ComponentId>,
}

impl Firing {
    /// Whether everything that must stop has confirmed it.
    pub(crate) fn is_starting(&self) -> bool {
        self.phase == Phase::Starting
    }

    /// Returns the places whose components must be off unless something else wants them.
    pub(crate) fn leaving(&self) -> &BTreeSet<PlaceId> {
        &self.leaving
    }

    /// Returns the components that it needs from a fresh start.
    pub(crate) fn renewing(&self) -> &BTreeSet<ComponentId> {
        &self.renewing
    }

    /// Whether it needs a component from a fresh start.
    pub(crate) fn renews(&self, component: ComponentId) -> bool {
        self.renewing.contains(&component)
    }
}
