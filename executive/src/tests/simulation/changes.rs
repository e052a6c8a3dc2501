//! A user who edits the mission while it runs: random versions, each judged at random after a
//! delay, and what must be true when one is taken.

use super::Play;
use super::dice::Dice;
use super::draft::{Edits, random_plan};
use crate::answer::{VersionAnswer, VersionFinding};
use crate::event::ControllerEvent;
use crate::judging::VersionQuestion;
use armor_plan::{FileText, Plan, Version, fits};
use std::sync::Arc;
use std::time::Duration;

/// The versions of the file in one simulated mission.
pub(super) struct Changes {
    dice: Dice,
    seed: u64,
    /// Versions still to be saved.
    left: usize,
    next_at: Duration,
    saved: u64,
    /// The newest saved version, if there is one.
    file: Option<Arc<Version>>,
    /// Answers and offered versions that have not arrived yet.
    coming: Vec<(Duration, ControllerEvent)>,
}

/// Makes `plan`, which was drawn from `seed`, the first version.
pub(super) fn first(plan: Plan, seed: u64) -> Plan {
    let version = Arc::new(version(1, seed, 0));
    plan.with_origin(Arc::clone(&version), version, read)
}

fn version(number: u64, seed: u64, edits: u64) -> Version {
    Version {
        number,
        files: vec![FileText { path: "seeds".into(), text: format!("{seed} {edits}") }],
    }
}

fn read(version: &Version, running: &Plan) -> Result<Plan, String> {
    let seeds: Vec<u64> =
        version.files[0].text.split(' ').map(|seed| seed.parse().unwrap()).collect();
    let dice = (seeds[1] > 0).then(|| Dice::new(seeds[1]));
    let edits = Edits { dice, watches: running.watches().to_vec() };
    let plan = random_plan(&mut Dice::new(seeds[0]), Some(edits));
    let plan = plan.with_origin(Arc::new(version.clone()), Arc::clone(running.began()), read);
    fits(&plan, running).map(|()| plan)
}

impl Changes {
    pub(super) fn new(seed: u64) -> Self {
        let mut dice = Dice::new(seed ^ 0x0065_6469_7473);
        let left = [0, 1, 4, 12][dice.roll(4)];
        let (next_at, saved) = (dice.up_to_ms(20_000), 1);
        Self { dice, seed, left, next_at, saved, file: None, coming: Vec::new() }
    }

    pub(super) fn next_at(&self) -> Option<Duration> {
        let next = (self.left > 0).then_some(self.next_at);
        self.coming.iter().map(|it| it.0).chain(next).min()
    }

    /// A restart: open questions are dropped, and the newest version is offered again.
    pub(super) fn executive_starts(&mut self, now: Duration) {
        self.coming.clear();
        if let Some(file) = &self.file {
            let at = now + self.dice.up_to_ms(500);
            self.coming.push((at, ControllerEvent::Offered(Arc::clone(file))));
        }
    }

    pub(super) fn happen(&mut self, now: Duration) -> ControllerEvent {
        if let Some(due) = self.coming.iter().position(|it| it.0 <= now) {
            return self.coming.remove(due).1;
        }
        self.left -= 1;
        self.next_at = now + self.dice.up_to_ms(20_000);
        self.saved += 1;
        // Sometimes the user restores the first version.
        let edits = if self.dice.one_in(8) { 0 } else { self.saved };
        let version = Arc::new(version(self.saved, self.seed, edits));
        self.file = Some(Arc::clone(&version));
        ControllerEvent::Offered(version)
    }
}

impl Play {
    /// Answers the controller's question about a version; a random verdict stands in for the proof.
    pub(super) fn judge(&mut self) {
        let question = self.controller.as_ref().and_then(|controller| controller.question());
        let Some(question) = question else { return };
        let event = match &question {
            VersionQuestion::Read { .. } => question.answer(&|| None),
            VersionQuestion::Prove { serial, stand, .. } => {
                let verdict = if self.changes.dice.one_in(6) { Err("bad".into()) } else { Ok(()) };
                let found = VersionFinding::Proven { stand: stand.clone(), verdict };
                ControllerEvent::Answered(VersionAnswer { serial: *serial, found })
            }
        };
        let at = self.world.now + self.changes.dice.up_to_ms(1500);
        self.changes.coming.push((at, event));
    }

    /// Answers the controller's question about tokens to be moved, at random.
    pub(super) fn judge_move(&mut self) {
        let question = self.controller.as_ref().and_then(|controller| controller.move_question());
        let Some(question) = question else { return };
        let verdict = if self.changes.dice.one_in(6) { Err("bad".into()) } else { Ok(()) };
        let at = self.world.now + self.changes.dice.up_to_ms(300);
        self.changes
            .coming
            .push((at, ControllerEvent::MoveJudged { serial: question.serial, verdict }));
    }

    /// Checks a change of the file: every token keeps its place, and every place its components;
    /// only components are started again to which the marked places give other values.
    pub(super) fn note_change(&mut self, version: &Version, restarts: &[String]) {
        assert!(self.in_flight.is_empty(), "changed while {:?} are under way", self.in_flight);
        let next = Arc::new(read(version, &self.plan).expect("it was read before"));
        let mut oracle = vec![0; next.places().len()];
        for (id, tokens) in self.plan.place_ids().zip(&self.oracle).filter(|it| *it.1 > 0) {
            let name = self.plan.net().place(id);
            let place = next.place_named(name).expect("what is marked stays");
            oracle[place.index()] = *tokens;
            assert_eq!(self.plan.place(id).components, next.place(place).components, "{name}");
        }
        let values_of = |plan: &Plan, marking: &[i64], component| {
            let values = plan.values_in(component, |place| marking[place.index()] > 0);
            values.iter().map(|value| format!("{:?}", value.terms())).collect::<Vec<_>>()
        };
        for component in self.plan.component_ids() {
            let before = values_of(&self.plan, &self.oracle, component);
            let after = values_of(&next, &oracle, component);
            let is_restarted = restarts.contains(&self.plan.component(component).name);
            assert!(!is_restarted || before != after, "started again with the same values");
        }
        let same = |name: &String| {
            let id = next.transition_named(name);
            id.is_some_and(|id| self.plan.continues_as(&next, id).is_some())
        };
        let counters = next.counters().iter().map(|counter| {
            let value = self.counters.get(&counter.name).copied();
            let value = value.unwrap_or(counter.counts.initial);
            assert!((counter.counts.minimum..=counter.counts.maximum).contains(&value));
            (counter.name.clone(), value)
        });
        self.counters = counters.collect();
        self.holding.retain(same);
        self.wall.follow(same);
        self.outlook.follow(&next, self.world.now);
        (self.oracle, self.plan) = (oracle, next);
        // A marked safe place ends the mission, and with it a pause.
        self.paused &= self.plan.safe().is_none_or(|safe| self.oracle[safe.index()] == 0);
    }
}
