//! The mission played over its drawing: what continues from frame to frame, and what the user has
//! chosen. What is played is [`Play`]'s.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use armor_petri::{PlaceId, TransitionId};
use armor_robotfile::FiringTrace;

use crate::mission::play::chance::{Chance, Step};
use crate::mission::play::refusal::NotNow;
use crate::mission::play::world::scalar;
use crate::mission::play::{Happened, Outcome, Play};
use crate::mission::stage::Stage;
use crate::workspace::Workspace;

/// How long a token moves, in seconds, at the usual speed.
const MOVE_S: f64 = 0.7;

/// A simulation.
pub(super) struct MissionSimulator {
    play: Play,
    chance: Chance,
    /// The seed of the chances, to see the same run again.
    pub(super) seed: u64,
    /// Firings in a second, as far as time is shown.
    pub(super) speed: f32,
    /// Whether it continues by itself.
    pub(super) is_running: bool,
    /// The revision of the files it was made of.
    revision: u64,
    /// Changes with every event, so that the drawing is updated.
    moment: u64,
    motion: Option<Motion>,
    in_flight: Vec<(PlaceId, u32)>,
    /// When the last step was made by itself, in seconds of the window.
    stepped_at: f64,
    /// The result of the last command; empty if the drawing shows it.
    pub(super) status: String,
    /// Values as they are typed.
    pub(super) typed: BTreeMap<String, String>,
}

/// Tokens that are moving.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub(super) transition: TransitionId,
    /// When it began, in seconds of the window.
    pub(super) since: f64,
    /// How long it takes.
    pub(super) lasts: f64,
}

impl Motion {
    /// From 0 to 1.
    pub(super) fn share(&self, now: f64) -> f32 {
        ((now - self.since) / self.lasts).clamp(0.0, 1.0) as f32
    }
}

impl MissionSimulator {
    /// A simulation of the mission as it is.
    ///
    /// # Errors
    /// Why it cannot be played, for people.
    pub(super) fn of(workspace: &Workspace) -> Result<Self, String> {
        let configuration = workspace.project.configuration();
        let configuration = configuration.ok_or("The file is not a valid robot yet")?;
        let stage = Stage::of(configuration).map_err(|error| error.to_string())?;
        Ok(Self {
            play: Play::new(Arc::new(stage)),
            chance: Chance::from_seed(1),
            seed: 1,
            speed: 1.0,
            is_running: false,
            revision: workspace.project.revision(),
            moment: 0,
            motion: None,
            in_flight: Vec::new(),
            stepped_at: 0.0,
            status: String::new(),
            typed: BTreeMap::new(),
        })
    }

    /// Begins again if the files have changed.
    pub(super) fn keep_up(&mut self, workspace: &Workspace) {
        if self.revision == workspace.project.revision() {
            return;
        }
        self.revision = workspace.project.revision();
        if let Ok(fresh) = Self::of(workspace) {
            let is_same = fresh.play.stage().net.places() == self.play.stage().net.places()
                && fresh.play.stage().net.transitions() == self.play.stage().net.transitions();
            // Words and positions do not matter to what is played.
            if !is_same {
                self.play = fresh.play;
                self.is_running = false;
                self.changed();
                self.status = "The mission was changed: the simulation restarts".into();
            }
        }
    }

    pub(super) fn play(&self) -> &Play {
        &self.play
    }

    pub(super) fn moment(&self) -> u64 {
        self.moment
    }

    pub(super) fn in_flight(&self) -> &[(PlaceId, u32)] {
        &self.in_flight
    }

    pub(super) fn motion(&self) -> Option<Motion> {
        self.motion
    }

    pub(super) fn chance(&mut self) -> &mut Chance {
        &mut self.chance
    }

    /// Begins again with the same chances.
    pub(super) fn restart(&mut self) {
        let (people, faults) = (self.chance.people, self.chance.faults);
        self.chance = Chance::from_seed(self.seed);
        (self.chance.people, self.chance.faults) = (people, faults);
        self.play.restart();
        self.is_running = false;
        self.status.clear();
        self.changed();
    }

    /// Fires a transition by hand.
    pub(super) fn fire(&mut self, id: TransitionId, now: f64) -> Result<(), NotNow> {
        let outcome = self.play.fire_by_hand(id)?;
        self.status = match outcome {
            Outcome::Fired => String::new(),
            Outcome::Clock(at) => format!(
                "{}: condition met; due at {}",
                self.play.stage().name(id),
                armor_proof::time_in_words(at)
            ),
        };
        self.moved(now);
        Ok(())
    }

    /// One step: of what it follows, or by itself.
    pub(super) fn step(&mut self, now: f64) {
        self.status.clear();
        if let Some(course) = self.play.course() {
            if course.is_done() {
                self.is_running = false;
                self.status = "End of the run".into();
            } else if self.play.next_leg() {
                self.moved(now);
            } else {
                self.is_running = false;
                self.status = "The next firing is no longer possible".into();
            }
            return;
        }
        match self.play.step(&mut self.chance) {
            Step::Happened => self.moved(now),
            Step::Over => {
                self.is_running = false;
                self.status = "The mission is over".into();
            }
            Step::StandsStill => {
                self.is_running = false;
                self.status = "Nothing more can happen".into();
            }
        }
    }

    pub(super) fn back(&mut self) {
        self.status.clear();
        if self.play.back() {
            self.is_running = false;
            self.changed();
        }
    }

    pub(super) fn wait(&mut self, time: Duration, now: f64) {
        self.play.wait(time);
        self.moved(now);
    }

    pub(super) fn set_value(&mut self, name: &str, text: &str) {
        self.play.set_value(name, scalar(text));
        self.changed();
    }

    /// Follows a firing sequence from the start.
    pub(super) fn follow(&mut self, trace: &FiringTrace) -> Result<(), String> {
        self.play
            .follow(trace)
            .map_err(|name| format!("The mission has changed: {name} no longer exists"))?;
        self.is_running = false;
        self.status.clear();
        self.changed();
        Ok(())
    }

    pub(super) fn leave_course(&mut self) {
        self.play.leave_course();
        self.changed();
    }

    /// Lets time of the window pass; returns after how many seconds something is to be drawn.
    pub(super) fn advance(&mut self, now: f64) -> Option<f64> {
        if self.motion.is_some_and(|motion| motion.share(now) >= 1.0) {
            self.motion = None;
            self.in_flight.clear();
            self.moment += 1;
        }
        if self.motion.is_some() {
            return Some(0.0);
        }
        if !self.is_running {
            return None;
        }
        let pause = 1.0 / f64::from(self.speed.max(0.05));
        if now - self.stepped_at >= pause {
            self.step(now);
            self.stepped_at = now;
            return Some(0.0);
        }
        Some((self.stepped_at + pause - now).max(0.0))
    }

    /// Something happened; if tokens moved, they are seen moving.
    fn moved(&mut self, now: f64) {
        self.changed();
        if let Some(Happened::Fired { transition, .. }) = self.play.last() {
            let outputs = &self.play.stage().net.transition(*transition).outputs;
            let lasts = (MOVE_S / f64::from(self.speed.max(0.05))).min(MOVE_S);
            self.in_flight = outputs.clone();
            self.motion = Some(Motion { transition: *transition, since: now, lasts });
        }
    }

    fn changed(&mut self) {
        self.motion = None;
        self.in_flight.clear();
        self.moment += 1;
    }
}
