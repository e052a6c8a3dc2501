//! What every machine of the controller works with: the ledger and the one way to change it, the
//! roster, both clocks, and the actions that follow from the event at hand.

use crate::event::ControllerAction;
use crate::ledger::applying::apply_record;
use crate::ledger::{Ledger, MissionStage};
use crate::record::{JournalEntry, JournalRecord};
use crate::roster::Roster;
use crate::terms::Cause;
use crate::time::{ClockReadings, HostTimes};
use armor_petri::PlaceId;
use armor_plan::Plan;
use std::sync::Arc;
use std::time::Duration;

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Context {
    ledger: Ledger,
    /// Mission time.
    now: Duration,
    /// Host time.
    host: Duration,
    host_times: HostTimes,
    actions: Vec<ControllerAction>,
    /// The executive is being stopped: every component comes to rest, nothing fires.
    is_stopping: bool,
    /// The components as observed.
    pub(super) roster: Roster,
}

impl Context {
    pub(super) fn new(ledger: Ledger, now: ClockReadings) -> Self {
        let ClockReadings { mission, host } = now;
        // Without a `<clock>` both clocks are one, so neither may be behind the last record.
        let host = if ledger.plan().clock().is_none() { host.max(ledger.last_at()) } else { host };
        let mut host_times = HostTimes::default();
        host_times.follow(&ledger, host);
        Self {
            now: mission.max(ledger.last_at()),
            host,
            host_times,
            actions: Vec::new(),
            is_stopping: false,
            roster: Roster::new(ledger.plan(), host),
            ledger,
        }
    }

    /// Moves both clocks on; neither ever goes back.
    pub(super) fn advance_clocks(&mut self, now: ClockReadings) {
        (self.now, self.host) = (self.now.max(now.mission), self.host.max(now.host));
    }

    /// Moves the clocks of the net on to now.
    pub(super) fn advance_net(&mut self) {
        self.ledger.advance(self.now);
    }

    pub(super) fn begin_stopping(&mut self) {
        self.is_stopping = true;
    }

    pub(super) fn is_stopping(&self) -> bool {
        self.is_stopping
    }

    pub(super) fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    pub(super) fn plan(&self) -> &Arc<Plan> {
        self.ledger.plan()
    }

    /// Returns mission time.
    pub(super) fn now(&self) -> Duration {
        self.now
    }

    /// Returns host time.
    pub(super) fn host(&self) -> Duration {
        self.host
    }

    pub(super) fn host_times(&self) -> &HostTimes {
        &self.host_times
    }

    /// Whether the mission is neither retreating nor ending.
    pub(super) fn is_playing(&self) -> bool {
        self.ledger.stage() == MissionStage::Playing
    }

    pub(super) fn may_fire(&self) -> bool {
        self.is_playing() && !self.is_stopping
    }

    /// Decides: the entry goes into the ledger, and into the journal before any later action.
    pub(super) fn record_entry(&mut self, entry: JournalEntry) {
        let record = JournalRecord { at: self.now, entry };
        apply_record(&mut self.ledger, &record)
            .expect("a decision follows from the ledger, so it fits it");
        self.host_times.follow(&self.ledger, self.host);
        self.add_action(ControllerAction::Journal(record));
        self.publish_marking();
    }

    pub(super) fn add_action(&mut self, action: ControllerAction) {
        self.actions.push(action);
    }

    /// Publishes the marking, once per event.
    pub(super) fn publish_marking(&mut self) {
        if !self.actions.contains(&ControllerAction::Publish) {
            self.add_action(ControllerAction::Publish);
        }
    }

    /// Returns how many actions there are so far.
    pub(super) fn action_count(&self) -> usize {
        self.actions.len()
    }

    pub(super) fn take_actions(&mut self) -> Vec<ControllerAction> {
        std::mem::take(&mut self.actions)
    }

    /// Begins a firing that is not one of a transition.
    pub(super) fn begin_firing(
        &mut self,
        cause: Cause,
        from: &[(PlaceId, u32)],
        to: &[(PlaceId, u32)],
    ) {
        self.record_entry(JournalEntry::Took {
            firing: self.ledger.next_firing(),
            cause,
            from: self.ledger.tokens_named(from),
            to: self.ledger.tokens_named(to),
            late_s: 0.0,
            sets: Vec::new(),
            guards: Vec::new(),
        });
    }

    /// Gives up every token and firing for the safe place.
    pub(super) fn retreat(&mut self, why: &str) {
        if self.is_playing() {
            self.record_entry(JournalEntry::Retreated { why: why.to_owned() });
        }
    }
}
