//! The parts of a plan: components, places and transitions with their names resolved.

use std::time::Duration;

use crate::counters::PlannedSet;
use crate::dates::PlannedDates;
use crate::guards::PlannedGuard;
use crate::values::GivenValue;
use armor_petri::PlaceId;
use armor_robotfile::mission::{Autonomy, LostLink};

/// A component of one plan, numbered in the order of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ComponentId(pub u32);

impl ComponentId {
    /// The position in `Plan::components`.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A component as the plan sees it.
#[derive(Clone, Debug)]
pub struct PlannedComponent {
    /// Its name in the system.
    pub name: String,
    /// Whether the file lets a mission command it. One that is in no place is left alone all the
    /// same, and is always active.
    pub controllable: bool,
    /// The places that activate it.
    pub places: Vec<PlaceId>,
    /// The components it may never be active together with.
    pub peers: Vec<ComponentId>,
    /// Whether its process is started again when it has ended: not where `restart="never"`.
    pub returns: bool,
    /// How long it may take to be ready again after it has died or its connection was lost.
    pub return_within: Duration,
}

impl PlannedComponent {
    /// Whether the executive activates and freezes it.
    pub fn is_controlled(&self) -> bool {
        self.controllable && !self.places.is_empty()
    }
}

/// A place as the plan sees it.
#[derive(Clone, Debug, Default)]
pub struct PlannedPlace {
    /// The components that are active while it is marked.
    pub components: Vec<ComponentId>,
    /// Where its token goes when one of them fails for good; without it, the mission retreats.
    pub on_failure: Option<PlaceId>,
    /// Whether its components run during a pause.
    pub safety: bool,
    /// Values that it gives parameters of its components.
    pub values: Vec<(ComponentId, GivenValue)>,
}

/// A transition as the plan sees it, in addition to what the net has.
#[derive(Clone, Debug, Default)]
pub struct PlannedTransition {
    /// The report it consumes.
    pub on: Option<(ComponentId, String)>,
    /// What must hold.
    pub guard: Option<PlannedGuard>,
    /// What it sets variables to.
    pub sets: Vec<PlannedSet>,
    /// When it may be enabled at all.
    pub dates: Option<PlannedDates>,
    /// Where the tokens go when a component does not stop; without it, the mission retreats.
    pub on_stop_fail: Option<PlaceId>,
    /// Where the tokens go when a component does not start; without it, the mission retreats.
    pub on_start_fail: Option<PlaceId>,
    /// The place that gets a token more when it fires late.
    pub overrun: Option<PlaceId>,
    /// Who decides that it fires.
    pub autonomy: Autonomy,
    /// What it does when the link to the operator is lost.
    pub lost_link: Option<LostLink>,
}

impl PlannedTransition {
    /// Whether more than tokens and time decide that it is enabled.
    pub fn is_gated(&self) -> bool {
        self.on.is_some() || self.guard.is_some() || self.dates.is_some()
    }

    /// Whether the operator is asked before it fires.
    pub fn asks(&self) -> bool {
        matches!(self.autonomy, Autonomy::Confirm { .. })
    }
}
