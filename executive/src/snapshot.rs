//! The whole ledger as one record, which replaces all earlier ones when a journal is cut. As every
//! record, it holds names instead of ids.

use crate::ledger::activation::Activation;
use crate::ledger::authority::{Consent, Lease, Pause};
use crate::ledger::firing::Phase;
use crate::ledger::gates::DateState;
use crate::ledger::stage::MissionStage;
use crate::order::Judged;
use crate::terms::{Cause, Tokens, any_number};
use armor_plan::Version;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// The state of a ledger after the records of a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LedgerSnapshot {
    /// The mission's name.
    pub mission: String,
    /// The fingerprint of the plan.
    pub fingerprint: String,
    /// The version that the mission began with, which the running components were started from.
    pub began: Version,
    /// The version in force.
    pub version: Version,
    pub(crate) version_since: Duration,
    /// How many records it replaces.
    pub records: u64,
    /// The places that hold tokens.
    pub marking: Vec<Tokens>,
    /// When each enabled transition became enabled.
    pub(crate) clocks: BTreeMap<String, Duration>,
    pub(crate) held_since: Option<Duration>,
    pub(crate) firings: Vec<(u64, FiringSnapshot)>,
    pub(crate) activations: BTreeMap<String, Activation>,
    pub(crate) standing: Vec<StandingReport>,
    /// The values of the variables that transitions set.
    #[serde(default)]
    pub(crate) counters: BTreeMap<String, i64>,
    /// The transitions whose guards are true.
    pub(crate) holds: BTreeSet<String>,
    pub(crate) dates: BTreeMap<String, DateState>,
    pub(crate) stage: MissionStage,
    pub(crate) lease: Option<Lease>,
    pub(crate) link_lost: Option<Duration>,
    pub(crate) pause: Option<Pause>,
    pub(crate) resumed_at: Duration,
    pub(crate) consents: BTreeMap<String, Consent>,
    pub(crate) orders: Vec<(Judged, Duration)>,
    pub(crate) last_firing: u64,
    pub(crate) last_activation: u64,
    pub(crate) fired: u64,
    pub(crate) history: Vec<(String, Duration)>,
    pub(crate) why: String,
}

/// A firing in flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FiringSnapshot {
    pub(crate) cause: Cause,
    pub(crate) from: Vec<Tokens>,
    pub(crate) to: Vec<Tokens>,
    pub(crate) phase: Phase,
    pub(crate) since: Duration,
    pub(crate) redirected: bool,
    pub(crate) leaving: Vec<String>,
    pub(crate) renewing: Vec<String>,
}

/// A report that no transition has consumed yet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct StandingReport {
    pub(crate) component: String,
    pub(crate) report: String,
    #[serde(with = "any_number")]
    pub(crate) value: f64,
}
