//! The clock on the wall of a random world: it is steered, set back and forth by up to an hour, and
//! heard of anew by whoever is restarted; and what dates should make of that.

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

/// Nobody touches the clock any more after this, so that the mission can come to rest.
const CALM: Duration = Duration::from_secs(100);

pub(super) struct Wall {
    dice: Dice,
    /// UTC at mission time 0.
    at_start: Date,
    /// What this life of the executive has been told of it.
    told: Option<Date>,
    next: Option<Duration>,
    /// The transitions whose last date has passed while anybody looked.
    past: BTreeSet<String>,
    /// Those that have fired.
    used: BTreeSet<String>,
    is_set: bool,
}

impl Wall {
    pub(super) fn new(mut dice: Dice) -> Self {
        let is_set = dice.one_in(2);
        let (past, used) = (BTreeSet::new(), BTreeSet::new());
        Self { dice, at_start: noon(), told: None, next: None, past, used, is_set }
    }

    /// The first thing it hears, now or a moment later, is what time it is.
    pub(super) fn executive_starts(&mut self, now: Duration) {
        self.told = None;
        let late = if self.dice.one_in(4) { self.dice.up_to_ms(2000) } else { Duration::ZERO };
        self.next = Some(now + late);
    }

    /// A new version of the mission: what goes on as before is remembered.
    pub(super) fn follow(&mut self, same: impl Fn(&String) -> bool) {
        self.past.retain(&same);
        self.used.retain(&same);
    }

    pub(super) fn next_at(&self) -> Option<Duration> {
        self.next
    }

    pub(super) fn happen(&mut self, now: Duration) -> ControllerEvent {
        if self.told.is_some() {
            let by = match self.dice.roll(4) {
                0 => Duration::from_secs(3600),
                1 => self.dice.up_to_ms(30_000),
                _ => self.dice.up_to_ms(5),
            };
            let forth = self.dice.one_in(2);
            self.at_start = if forth { self.at_start.later(by) } else { self.at_start.earlier(by) };
        }
        self.told = Some(self.at_start);
        let next = now + Duration::from_secs(1) + self.dice.up_to_ms(20_000);
        self.next = Some(next).filter(|next| self.is_set && *next < CALM);
        ControllerEvent::Utc { at_start: self.at_start }
    }

    fn utc(&self, now: Duration) -> Option<Date> {
        Some(self.told?.later(now))
    }
}

impl Play {
    /// What the journal says of dates is so by the clock, and nothing fires against them.
    pub(super) fn note_dates(&mut self, record: &JournalRecord) {
        let plan = std::sync::Arc::clone(&self.plan);
        match &record.entry {
            JournalEntry::Dated { transition, phase, .. } => {
                let id = plan.transition_named(transition).unwrap();
                let utc = self.wall.utc(record.at).expect("it was told what time it is");
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
                let utc = self.wall.utc(record.at).expect("it was told what time it is");
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

    /// Whether its dates let it fire.
    pub(super) fn is_in_date(&self, id: TransitionId, live: &Ledger) -> bool {
        let Some(dates) = self.plan.transition(id).dates else {
            return true;
        };
        match live.date(id).phase {
            DatePhase::Past => dates.missed == Missed::Fire && !self.is_used(id),
            phase => phase == DatePhase::Open,
        }
    }

    /// Once settled, dates stand as the clock says, and none that fails the mission has passed
    /// while tokens waited for it.
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
