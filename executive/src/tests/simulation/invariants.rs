//! What must be true after every step of the simulation.

use crate::controller::Controller;
use crate::ledger::applying::replay_records;
use crate::ledger::{Ledger, MissionStage, check_same};
use crate::terms::{Cause, MissionOutcome, Tokens};
use std::sync::Arc;
use std::time::Duration;

use super::Play;
use armor_plan::ComponentId;

impl Play {
    pub(super) fn check_enabled(&self, cause: &Cause) {
        let Cause::Transition(name) = cause else {
            return;
        };
        let net = self.plan.net();
        let id = self.plan.transition_named(name).unwrap();
        let t = net.transition(id);
        let tokens = |place: armor_petri::PlaceId| self.oracle[place.index()];
        assert!(t.inputs.iter().chain(&t.reads).all(|arc| tokens(arc.0) >= i64::from(arc.1)));
        let is_free = self.plan.transition(id).guard.is_none();
        assert!(is_free || self.holding.contains(name), "{name} fires against its guard");
        assert!(t.inhibitors.iter().all(|arc| tokens(arc.0) < i64::from(arc.1)));
    }

    /// Checks that no component that a firing had to stop still runs when the journal records the
    /// stop.
    pub(super) fn check_stopped(&self, firing: u64) {
        let (from, to) = &self.in_flight[&firing];
        for component in self.plan.component_ids() {
            let planned = self.plan.component(component);
            let named = |tokens: &[Tokens]| {
                let place = |t: &Tokens| self.plan.place_named(&t.place).unwrap();
                tokens.iter().any(|t| planned.places.contains(&place(t)))
            };
            let kept = named(to)
                || planned.places.iter().any(|place| self.oracle[place.index()] > 0)
                || self.in_flight.values().any(|other| named(&other.1));
            let running = self.world.processes[component.index()].active;
            // If it is unknown whether a kill succeeded, `on-stop-fail` moves on and the process
            // may run.
            let excused = self.world.trouble.blind;
            assert!(!named(from) || kept || !running || excused, "{} runs", planned.name);
        }
    }

    pub(super) fn check_exclusion(&self) {
        for component in self.plan.component_ids() {
            let active = |c: ComponentId| self.world.processes[c.index()].active;
            let planned = self.plan.component(component);
            let both =
                planned.peers.iter().find(|peer| active(**peer)).filter(|_| active(component));
            assert!(both.is_none(), "{} and {both:?} are active together", planned.name);
        }
    }

    /// Checks that the marking is the oracle's, and that replaying the journal gives the live
    /// ledger.
    pub(super) fn check_ledger(&mut self) {
        let Some(controller) = &self.controller else {
            return;
        };
        let live = controller.ledger();
        let marking: Vec<_> = live.marking().iter().map(|tokens| i64::from(*tokens)).collect();
        assert_eq!(marking, self.oracle);
        let counters = live.plan().counters().iter().map(|counter| self.counters[&counter.name]);
        assert!(counters.eq(live.counters().iter().copied()), "{:?}", live.counters());
        self.check_guards(live);
        self.check_dates(live);
        if self.journal.len() < self.checked + self.checked / 4 {
            return;
        }
        self.checked = self.journal.len();
        let again = replay_records(Arc::clone(&self.began), &self.records()).unwrap();
        check_same(live, &again);
    }

    /// Checks each guard against the simulated data, and each gate against guard, report and dates.
    pub(super) fn check_guards(&self, live: &Ledger) {
        for id in self.plan.net().transition_ids() {
            let planned = self.plan.transition(id);
            let Some(guard) = &planned.guard else {
                continue;
            };
            let holds = live.guard_holds(id);
            let reported = planned.on.as_ref().is_none_or(|on| live.has_report(on));
            let in_date = self.is_in_date(id, live);
            assert_eq!(live.state().gate(id), holds && reported && in_date);
            let truth = self.outlook.truth(&self.plan, guard, &self.counters, self.world.now);
            if let (Some(truth), MissionStage::Playing) = (truth, live.stage()) {
                assert_eq!(holds, truth == Some(true), "{guard:?}");
            }
        }
    }

    pub(super) fn check_end(&self, outcome: MissionOutcome) {
        let marked = |place: Option<armor_petri::PlaceId>| self.oracle[place.unwrap().index()] > 0;
        match outcome {
            MissionOutcome::Goal => assert!(marked(self.plan.goal())),
            MissionOutcome::Safe => assert!(marked(self.plan.safe())),
            MissionOutcome::Failed | MissionOutcome::Interrupted => return,
        }
        for component in self.plan.component_ids() {
            let planned = self.plan.component(component);
            let last =
                if outcome == MissionOutcome::Goal { self.plan.goal() } else { self.plan.safe() };
            let belongs = [self.plan.goal(), self.plan.safe(), last]
                .iter()
                .flatten()
                .any(|p| planned.places.contains(p) && self.oracle[p.index()] > 0);
            let running = self.world.processes[component.index()].active;
            let left = planned.places.is_empty() || !planned.controllable;
            assert!(belongs || !running || left, "{} runs on", planned.name);
        }
    }

    /// Checks a mission that came to rest without ending: nothing may be stuck.
    pub(super) fn check_calm(&self, controller: &Controller) {
        let ledger = controller.ledger();
        let patience = Duration::from_secs(90);
        let stuck = |since: Duration| since + patience < self.world.now;
        assert!(
            ledger.stage() == MissionStage::Playing || !stuck(ledger.last_at()),
            "stuck at the end"
        );
        // A blocked start may wait for ever, as long as something may still stop what blocks it.
        let moving = ledger.firings().iter().filter(|it| !ledger.is_held(it.1));
        let moving = moving.filter(|it| !controller.is_blocked(*it.0));
        let stuck: Vec<_> = moving.filter(|it| stuck(it.1.since)).collect();
        assert!(stuck.is_empty(), "stuck: {stuck:?}");
        let stopped = self.world.next_at().is_none() && controller.next_deadline().is_none();
        if !stopped {
            return;
        }
        for component in self.plan.component_ids() {
            let planned = self.plan.component(component);
            let process = &self.world.processes[component.index()];
            if !planned.controllable || ledger.activation(component).failed.is_some() {
                continue;
            }
            let wanted = planned.places.is_empty() || ledger.runs(component);
            // A component that had finished before a pause stopped it is not started again; of a start
            // that is blocked, some run and others wait.
            let finished = ledger.activation(component).done;
            let mut starting = ledger.firings().values().filter(|it| it.is_starting());
            let is_starting = starting.any(|it| ledger.activates_now(&it.to, component));
            let is_right = process.active == wanted || finished && wanted || is_starting;
            assert!(is_right, "{}", planned.name);
            let place = |place: &&armor_petri::PlaceId| ledger.state().tokens(**place) > 0;
            if process.done && planned.places.iter().any(|p| place(&p)) {
                for id in self.plan.listeners(component, "done") {
                    let enabled = ledger.state().enabled_since(*id).is_some();
                    let fires = controller.fires_by_itself(*id) && !ledger.state().is_held(*id);
                    assert!(!(enabled && fires), "done was not answered");
                }
            }
        }
    }
}
