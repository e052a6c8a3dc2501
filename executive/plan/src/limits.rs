//! How long the controller waits, and what a restarted executive does first.

use std::time::Duration;

/// The waiting times and bounds of the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanLimits {
    /// How long every component may take to appear after the executive has started.
    pub muster: Duration,
    /// How long a component that died or lost its connection may take to be ready again.
    pub return_within: Duration,
    /// How long the confirmation of an activation may take: the first call may open hardware.
    pub start_within: Duration,
    /// How long the confirmation of a freeze may take; the executive asks twice, then it kills the
    /// component.
    pub stop_within: Duration,
    /// How long a start stays blocked by an excluded component that nothing will stop any more, in
    /// mission time, before it fails: long enough for an operator to intervene.
    pub wait_within: Duration,
    /// How long the end of a killed component may take.
    pub kill_within: Duration,
    /// How long the holder of the lease may take to reconnect.
    pub lease: Duration,
    /// How long a value that guards read stays in force after its provider was lost.
    pub value_holds: Duration,
    /// How late a transition may fire before it counts as an overrun.
    pub overrun: Duration,
    /// Most firings in flight at the same time; a net that needs more grows without bound.
    pub firings: usize,
    /// Most firings at one moment; more count as an endless loop.
    pub step_bound: usize,
}

impl Default for PlanLimits {
    fn default() -> Self {
        Self {
            muster: Duration::from_secs(30),
            return_within: Duration::from_secs(15),
            start_within: Duration::from_secs(10),
            stop_within: Duration::from_secs(1),
            wait_within: Duration::from_secs(10),
            kill_within: Duration::from_secs(2),
            lease: Duration::from_secs(5),
            value_holds: Duration::from_secs(2),
            overrun: Duration::from_millis(100),
            firings: 256,
            step_bound: 1000,
        }
    }
}

/// What a restarted executive does first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnResume {
    /// It continues with the same marking.
    #[default]
    Continue,
    /// It waits for an operator.
    Hold,
    /// It goes to the safe place.
    Safe,
}
