//! The wall clock of a random world: it is steered, and set back and forth by up to an hour. A
//! restarted executive has to read it again. Computes the expected phases of dates.

use super::Play;
use super::dice::Dice;
use super::draft::noon;
use crate::event::ControllerEvent;
use crate::ledger::{Ledger, MissionStage};
use crate::record::{JournalEntry, JournalRecord};
use armor_petri::{FiringClass, TransitionId};
use armor_plan::DatePhase;
use armor_robotfile::Date;
use armor_robotfile::mission::Missed;
use std::collections::BTreeSet;
use std::time::Duration;

/// The clock is not set after this, so that the mission can come to rest.
const CALM: Duration = Duration::from_secs(100);

pub(super) struct Wall {
    dice: Dice,
    /// UTC at mission time 0.
    at_start: Date,
    /// The last reading reported since the executive started.
    reported: Option<Date>,
    next: Option<Duration>,
    /// The transitions whose last date was recorded as passed.
    past: BTreeSet<String>,
    /// The transitions that have fired.
    used: BTreeSet<String>,
    is_set: bool,
}

impl Wall {
    pub(super) fn new(mut dice: Dice) -> Self {
        let is_set = dice.one_in(2);
        let (past, used) = (BTreeSet::new(), BTreeSet::new());
        Self { dice, at_start: noon(), reported: None, next: None, past, used, is_set }
    }

    /// A restart: the first reading follows immediately or within 2 s.
    pub(super) fn executive_starts(&mut self, now: Duration) {
        self.reported = None;
        let late = if self.dice.one_in(4) { self.dice.up_to_ms(2000) } else { Duration::ZERO };
        self.next = Some(now + late);
    }

    /// A new version of the mission: keeps the state of the transitions that continue.
    pub(super) fn follow(&mut self, same: impl Fn(&String) -> bool) {
        self.past.retain(&same);
        self.used.retain(&same);
    }

    pub(super) fn next_at(&self) -> Option<Duration> {
        self.next
    }

    pub(super) fn happen(&mut self, now: Duration) -> ControllerEvent {
        if self.reported.is_some() {
            let by = match self.dice.roll(4) {
                0 => Duration::from_secs(3600),
                1 => self.dice.up_to_ms(30_000),
                _ => self.dice.up_to_ms(5),
            };
            let forth = self.dice.one_in(2);
            self.at_start = if forth { self.at_start.later(by) } else { self.at_start.earlier(by) };
        }
        self.reported = Some(self.at_start);
        let next = now + Duration::from_secs(1) + self.dice.up_to_ms(20_000);
        self.next = Some(next).filter(|next| self.is_set && *next < CALM);
        ControllerEvent::Utc { at_start: self.at_start }
    }

    fn utc(&self, now: Duration) -> Option<Date> {
        Some(self.reported?.later(now))
    }
}

impl Play {
    /// Checks the recorded phases of dates against the clock, and that no transition fires outside
    /// its dates.
    pub(super) fn note_dates(&mut self, record: &JournalRecord) {
        let plan = std::sync::Arc::clone(&self.plan);
        match &record.entry {
            JournalEntry::Dated { transition, phase, .. } => {
                let id = plan.transition_named(transition).unwrap();
                let utc = self.wall.utc(record.at).expect("a reading of the clock");
                assert_eq!(*phase, self.phase(id, utc), "{transition} at {utc}");
                assert!(!self.wall.past.contains(transition), "what has passed stays so");
                if *phase == DatePhase::Past {
                    self.wall.past.insert(transition.clone());
                }
            }
            JournalEntry::Took { cause: crate::terms::Cause::Transition(name), .. } => {
                let id = plan.transition_named(name).unwrap();
                let Some(dates) = plan.transition(id).dates else {
                    return;
                };
                let used = !self.wall.used.insert(name.clone());
                let utc = self.wall.utc(record.at).expect("a reading of the clock");
                let past = self.wall.past.contains(name) || dates.last.is_some_and(|d| d <= utc);
                if past {
                    assert!(dates.missed == Missed::Fire && !used, "{name} fires after its date");
                } else {
                    assert!(dates.first.is_none_or(|d| d <= utc), "{name} fires before its date");
                }
            }
            _ => {}
        }
    }

    fn name(&self, id: TransitionId) -> &String {
        &self.plan.net().transition(id).name
    }

    fn is_used(&self, id: TransitionId) -> bool {
        self.wall.used.contains(self.name(id))
    }

    fn phase(&self, id: TransitionId, utc: Date) -> DatePhase {
        let dates = self.plan.transition(id).dates.unwrap();
        match (dates.first, dates.last) {
            _ if self.wall.past.contains(self.name(id)) => DatePhase::Past,
            (_, Some(last)) if utc >= last => DatePhase::Past,
            (Some(first), _) if utc < first => DatePhase::Early,
            _ => DatePhase::Open,
        }
    }

    /// Whether the dates of a transition let it fire.
    pub(super) fn is_in_date(&self, id: TransitionId, live: &Ledger) -> bool {
        let Some(dates) = self.plan.transition(id).dates else {
            return true;
        };
        match live.date(id).phase {
            DatePhase::Past => dates.missed == Missed::Fire && !self.is_used(id),
            phase => phase == DatePhase::Open,
        }
    }

    /// Checks the phases of all dates against the clock, once the controller has settled. While
    /// tokens wait for a transition whose missed date fails the mission, that date must not have
    /// passed.
    pub(super) fn check_dates(&self, live: &Ledger) {
        let utc = self.wall.utc(self.world.now).filter(|_| live.stage() == MissionStage::Playing);
        for id in self.plan.net().transition_ids() {
            let Some(dates) = self.plan.transition(id).dates else {
                continue;
            };
            assert_eq!(live.date(id).used, self.is_used(id));
            let Some(utc) = utc else { continue };
            assert_eq!(live.date(id).phase, self.phase(id, utc), "{dates:?} at {utc}");
            let t = self.plan.net().transition(id);
            let tokens = |arc: &(armor_petri::PlaceId, u32)| self.oracle[arc.0.index()];
            let wanted = t.inputs.iter().chain(&t.reads).all(|arc| tokens(arc) >= i64::from(arc.1))
                && t.inhibitors.iter().all(|arc| tokens(arc) < i64::from(arc.1));
            let held = self.paused && t.class == FiringClass::Ordinary;
            let fails = self.wall.past.contains(&t.name) && dates.missed == Missed::Fail;
            let failed = fails && wanted && !held && !self.is_used(id);
            assert!(!failed, "{} has passed, and nothing follows", t.name);
        }
    }
}
