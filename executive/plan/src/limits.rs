//! How long the controller waits, and what a restarted executive does first.

use std::time::Duration;

/// The waiting times and bounds of the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanLimits {
    /// For every component to appear after the start of the executive.
    pub muster: Duration,
    /// For a component that died or was cut off to be back and ready.
    pub return_within: Duration,
    /// For the confirmation of an activation; the first call may open hardware.
    pub start_within: Duration,
    /// For the confirmation of a freeze; asked twice, then the component is killed.
    pub stop_within: Duration,
    /// For a component that excludes one to be started and that nothing will stop any more, in
    /// mission time: long enough for an operator to see to it.
    pub wait_within: Duration,
    /// For a killed component to be gone.
    pub kill_within: Duration,
    /// For the holder of the lease to come back after its connection broke.
    pub lease: Duration,
    /// For a value that guards look at, after its provider could be reached last.
    pub value_holds: Duration,
    /// How late a transition may fire before that is an overrun.
    pub overrun: Duration,
    /// Firings in flight at once; a net that needs more grows without end.
    pub firings: usize,
    /// Firings at one moment before they count as an endless loop.
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
