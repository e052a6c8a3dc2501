//! Absolute dates of transitions, and where they stand at a moment.

use armor_robotfile::Date;
use armor_robotfile::mission::Missed;
use serde::{Deserialize, Serialize};

/// The dates of a transition: it is enabled from the first one on, until the last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannedDates {
    /// Not before this.
    pub first: Option<Date>,
    /// From then on no more, except as `missed` specifies.
    pub last: Option<Date>,
    /// What follows when it has not fired until then.
    pub missed: Missed,
}

impl PlannedDates {
    /// Where they stand at a moment.
    pub fn phase(&self, utc: Date) -> DatePhase {
        if self.last.is_some_and(|last| last <= utc) {
            DatePhase::Past
        } else if self.first.is_none_or(|first| first <= utc) {
            DatePhase::Open
        } else {
            DatePhase::Early
        }
    }
}

/// Where the dates of a transition stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DatePhase {
    /// Its first date is still to come, or there is no reading of the clock yet.
    #[default]
    Early,
    /// Its first date has come, its last one has not.
    Open,
    /// Its last date has passed; that is for good.
    Past,
}
