//! The controller: one pure state machine from events to actions.
//!
//! It is composed of machines with state of their own: commands to components, progress of firings,
//! turns of transitions, operators, senses, dates, changes of the file, reports. They share a
//! [`Context`]: the ledger (what is decided) and the roster (what is observed). After every event
//! the controller settles the difference: firings move on, transitions begin, components are
//! commanded. Everything decided is first a [`ControllerAction::Journal`]; nothing here knows
//! sockets or clocks.

mod blocked_starts;
mod commands;
mod confirmations;
mod context;
mod file_changes;
mod hindrances;
mod mission_dates;
mod operators;
mod progress;
mod publishing;
mod reports;
mod senses;
mod token_moves;
mod turns;
mod wishes;

use crate::event::{ControllerAction, ControllerEvent};
use crate::judging::{MoveQuestion, VersionQuestion};
use crate::ledger::applying::replay_records;
use crate::ledger::{Ledger, LedgerError, MissionStage};
use crate::record::{JournalEntry, JournalRecord};
use crate::roster::ProcessPresence;
use crate::terms::{Cause, MissionOutcome};
use crate::time::{ClockReadings, Deadlines};
use armor_petri::NetStep;
use armor_plan::{ComponentId, OnResume, Plan};
use commands::Commands;
use context::Context;
use file_changes::FileChanges;
use mission_dates::MissionDates;
use operators::Operators;
use progress::FiringProgress;
use reports::Reports;
use senses::GuardSenses;
use std::sync::Arc;
use std::time::Duration;
use turns::Turns;

/// Reports and orders that changed nothing, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Reports of an activation that is over.
    pub late: u64,
    /// Reports received again that have been counted already.
    pub repeated: u64,
    /// Reports that no transition waits for.
    pub unheard: u64,
    /// Orders that were refused or changed nothing and, as there were too many, not written down.
    pub orders: u64,
}

/// Plays one mission.
#[derive(Clone, Debug)]
pub struct Controller {
    context: Context,
    commands: Commands,
    progress: FiringProgress,
    turns: Turns,
    operators: Operators,
    senses: GuardSenses,
    dates: MissionDates,
    changes: FileChanges,
    reports: Reports,
    is_finished: bool,
}

impl Controller {
    /// Begins a mission. The initial places are entered once every component is known to be off.
    pub fn new(plan: Arc<Plan>, now: impl Into<ClockReadings>) -> (Self, Vec<ControllerAction>) {
        let mut controller = Self::begin_mission(&plan, now.into(), false);
        let initial = plan.place_ids().zip(plan.net().initial().iter().copied());
        let initial: Vec<_> = initial.filter(|(_, tokens)| *tokens > 0).collect();
        controller.context.begin_firing(Cause::Start, &[], &initial);
        controller.settle_decisions();
        let actions = controller.context.take_actions();
        (controller, actions)
    }

    /// Begins a mission whose journal is lost or damaged: it is unknown where it stood, and what it
    /// would do twice. It goes to its safe place, past everything that may be running.
    pub(crate) fn after_loss(
        plan: Arc<Plan>,
        why: &str,
        now: impl Into<ClockReadings>,
    ) -> (Self, Vec<ControllerAction>) {
        let mut controller = Self::begin_mission(&plan, now.into(), true);
        controller.context.retreat(why);
        controller.settle_decisions();
        let actions = controller.context.take_actions();
        (controller, actions)
    }

    /// Continues where a journal ends. Every component counts as running until it reports
    /// otherwise.
    ///
    /// # Errors
    /// If the journal is not one of this plan.
    pub fn resume(
        plan: Arc<Plan>,
        records: &[JournalRecord],
        now: impl Into<ClockReadings>,
    ) -> Result<(Self, Vec<ControllerAction>), LedgerError> {
        if records.is_empty() {
            return Ok(Self::new(plan, now));
        }
        Ok(Self::resume_from(replay_records(plan, records)?, now))
    }

    /// Continues with the ledger that the journal gives.
    pub(crate) fn resume_from(
        ledger: Ledger,
        now: impl Into<ClockReadings>,
    ) -> (Self, Vec<ControllerAction>) {
        let mut controller = Self::with_ledger(ledger, now.into(), true);
        let (stage, on_resume) = (controller.ledger().stage(), controller.plan().on_resume());
        if let MissionStage::Ended(outcome) = stage {
            controller.finish_with(outcome);
        } else {
            match on_resume {
                OnResume::Continue => {}
                OnResume::Safe => controller
                    .context
                    .retreat("the executive was restarted, and the mission resumes in safety"),
                OnResume::Hold => controller.hold_after_restart(),
            }
        }
        controller.settle_decisions();
        let actions = controller.context.take_actions();
        (controller, actions)
    }

    /// Takes in one event at `now` (neither clock ever goes back); returns what is to be done.
    pub fn handle(
        &mut self,
        event: ControllerEvent,
        now: impl Into<ClockReadings>,
    ) -> Vec<ControllerAction> {
        self.context.advance_clocks(now.into());
        if !self.is_finished {
            self.take_in(event);
            self.settle_decisions();
        }
        self.context.take_actions()
    }

    /// Notes that a command has gone to a component, at `now` of the host's clock: its limits begin then, and
    /// not before the journal was on disk.
    pub fn note_sent(&mut self, component: ComponentId, now: Duration) {
        let stop_within = self.plan().limits().stop_within;
        self.context.roster.of_mut(component).note_sent(now, stop_within);
    }

    /// Returns when [`ControllerEvent::Timer`] is due next, if nothing else happens.
    pub fn deadlines(&self) -> Deadlines {
        if self.is_finished {
            return Deadlines::default();
        }
        let cx = &self.context;
        let answers = confirmations::answers_due(cx).map(|due| due.1);
        let mission = self.turns.next_due(cx, &self.dates).into_iter().chain(answers);
        let mission = mission.chain(self.dates.next_due(cx)).chain(self.progress.blocked_until(cx));
        let host = commands::pushes_due(cx).chain(progress::patience_due(cx));
        let host = host.chain(self.senses.next_due(cx)).chain(self.operators.lease_due(cx));
        Deadlines { mission: mission.min(), host: host.min() }
    }

    /// Returns the earlier of both deadlines, where both clocks are one.
    pub fn next_deadline(&self) -> Option<Duration> {
        let Deadlines { mission, host } = self.deadlines();
        mission.into_iter().chain(host).min()
    }

    /// Returns what has been decided.
    pub fn ledger(&self) -> &Ledger {
        self.context.ledger()
    }

    /// Returns the plan in force.
    pub fn plan(&self) -> &Arc<Plan> {
        self.context.plan()
    }

    /// Whether it has been ordered to stop.
    pub fn is_stopping(&self) -> bool {
        self.context.is_stopping()
    }

    /// Returns the reports and orders that changed nothing.
    pub fn dropped(&self) -> Dropped {
        Dropped {
            late: self.reports.late(),
            repeated: self.reports.repeated(),
            unheard: self.reports.unheard(),
            orders: self.operators.unwritten(),
        }
    }

    /// Returns the question that [`ControllerAction::Judge`] asks; none if it has been overtaken.
    pub fn question(&self) -> Option<VersionQuestion> {
        self.changes.question(self.plan())
    }

    /// Returns the question that [`ControllerAction::JudgeMove`] asks; none if it has been
    /// answered.
    pub fn move_question(&self) -> Option<MoveQuestion> {
        self.operators.move_question(self.plan())
    }

    fn begin_mission(plan: &Arc<Plan>, now: ClockReadings, is_restart: bool) -> Self {
        let mut controller = Self::with_ledger(Ledger::new(Arc::clone(plan)), now, is_restart);
        controller.context.record_entry(JournalEntry::Began {
            mission: plan.mission().to_owned(),
            fingerprint: plan.fingerprint(),
            version: (**plan.version()).clone(),
        });
        controller
    }

    fn with_ledger(ledger: Ledger, now: ClockReadings, is_restart: bool) -> Self {
        let context = Context::new(ledger, now);
        let (plan, host) = (context.plan(), context.host());
        Self {
            commands: Commands::default(),
            progress: FiringProgress::default(),
            turns: Turns::default(),
            operators: Operators::new(host),
            senses: GuardSenses::new(plan, is_restart.then_some(host)),
            dates: MissionDates::default(),
            changes: FileChanges::new(plan.version().number),
            reports: Reports::default(),
            is_finished: false,
            context,
        }
    }

    fn hold_after_restart(&mut self) {
        if self.context.is_playing() && self.ledger().pause().is_none() {
            let why = "the executive was restarted; an operator has to resume the mission";
            self.context.record_entry(JournalEntry::Held { why: why.to_owned() });
        }
    }

    /// Routes an event to the machine that it concerns. Only observations change; decisions follow
    /// when the controller settles, but for orders, reports and versions, which are decided here.
    fn take_in(&mut self, event: ControllerEvent) {
        let cx = &mut self.context;
        // Values alone may arrive fast; the senses publish them once per second.
        if !matches!(
            event,
            ControllerEvent::Timer
                | ControllerEvent::Utc { .. }
                | ControllerEvent::Sensed { .. }
                | ControllerEvent::Unlinked { .. }
                | ControllerEvent::UnitKnown { .. }
        ) {
            cx.publish_marking();
        }
        let host = cx.host();
        match event {
            ControllerEvent::Appeared { component, instance } => {
                self.take_appearance(component, instance);
            }
            ControllerEvent::StateReported {
                component,
                instance,
                doing,
                activation,
                controllable,
            } => {
                if cx.roster.of(component).instance == instance {
                    let planned = cx.plan().component(component).is_controlled();
                    cx.roster.of_mut(component).controllable = planned && controllable;
                    cx.roster.note_doing(component, doing, activation);
                    if planned && !controllable {
                        self.commands.take_refusal(cx, component);
                    }
                }
            }
            ControllerEvent::Reported { component, instance, serial, activation, report } => {
                self.reports.take_report(cx, component, (instance, serial), activation, report);
            }
            ControllerEvent::Lost { component, instance } => {
                let observed = cx.roster.of(component);
                if observed.instance == instance && observed.presence == ProcessPresence::Here {
                    cx.roster.left(component, ProcessPresence::Lost, host);
                }
            }
            ControllerEvent::Gone { component, instance } => {
                if instance.is_none_or(|instance| cx.roster.of(component).instance == instance) {
                    self.commands.note_gone(cx, component);
                }
            }
            ControllerEvent::GivenUp { component, why } => {
                let observed = cx.roster.of_mut(component);
                let has_ended = why.is_some() && observed.presence != ProcessPresence::Here;
                observed.given_up = why;
                if has_ended && observed.presence != ProcessPresence::Gone {
                    self.commands.note_gone(cx, component);
                }
            }
            ControllerEvent::Ordered(given) => self.operators.take_order(cx, &self.dates, given),
            ControllerEvent::OperatorLeft { connection } => {
                self.operators.operator_left(cx, connection);
            }
            ControllerEvent::Sensed { watch, value } => self.senses.take_value(cx, watch, value),
            ControllerEvent::UnitKnown { watch, unit } => self.senses.set_unit(watch, unit),
            ControllerEvent::Unlinked { watch } => self.senses.note_unlinked(cx, watch),
            ControllerEvent::Offered(version) => self.changes.take_offer(cx, version),
            ControllerEvent::Answered(answer) => self.changes.take_answer(cx, answer),
            ControllerEvent::MoveJudged { serial, verdict } => {
                self.operators.move_judged(cx, &self.dates, serial, verdict);
            }
            ControllerEvent::Utc { at_start } => self.dates.set_utc(cx, at_start),
            ControllerEvent::Endangered { why } => cx.retreat(&why),
            ControllerEvent::Timer => {}
            ControllerEvent::Stop => cx.begin_stopping(),
        }
    }

    fn take_appearance(&mut self, component: ComponentId, instance: u64) {
        let observed = self.context.roster.of(component);
        if observed.presence != ProcessPresence::Unseen && observed.instance != instance {
            // A firing that waited for the old process to end has to move on before the new one
            // counts: otherwise its stop would never be confirmed.
            self.commands.note_gone(&mut self.context, component);
            self.settle_decisions();
        }
        let host = self.context.host();
        self.context.roster.appeared(component, instance, host);
    }

    /// Decides until nothing more follows without another event.
    ///
    /// The order matters. Orders to stop that are overdue come first, so that a killed component is
    /// blamed in this round. A change of the file is taken before anything begins that would put it
    /// off. Firings move on before failures are noticed, since a firing may answer for a failure.
    /// Guards and dates are weighed before transitions fire. Commands come last, when it is decided
    /// what every component should be doing.
    fn settle_decisions(&mut self) {
        let cx = &mut self.context;
        cx.advance_net();
        let mut step = NetStep::new(cx.plan().limits().step_bound);
        loop {
            let before = cx.action_count();
            self.commands.push_orders(cx);
            if !cx.is_stopping() {
                self.operators.notice_lost_link(cx);
                if let Some(old) = self.changes.consider_change(cx) {
                    self.senses.follow_plan(&old, cx.plan());
                }
                self.progress.notice_blocked_starts(cx);
                self.progress.advance_firings(cx, self.commands.take_unstopped());
                progress::notice_failures(cx);
                self.senses.weigh_guards(cx);
                self.dates.weigh_dates(cx);
                confirmations::ask_operator(cx, &self.dates);
                self.turns.fire_next(cx, (&self.dates, &mut self.senses), &mut step);
            }
            self.commands.command_components(cx);
            if cx.action_count() == before || self.is_finished {
                break;
            }
        }
        blocked_starts::remember_blocked(cx);
        self.notice_the_end();
    }

    /// Ends the mission once everything that does not belong to the last place is off.
    fn notice_the_end(&mut self) {
        if self.is_finished {
            return;
        }
        let cx = &self.context;
        if cx.is_stopping() {
            if cx.plan().component_ids().all(|c| wishes::is_settled_off(cx, c)) {
                self.finish_with(MissionOutcome::Interrupted);
            }
            return;
        }
        let MissionStage::Ending(outcome) = cx.ledger().stage() else {
            return;
        };
        let rest =
            || cx.plan().component_ids().filter(|c| !cx.plan().component(*c).places.is_empty());
        if rest().any(|c| wishes::wants_off(cx, c) && !wishes::is_settled_off(cx, c)) {
            return;
        }
        let still_running = rest().any(|c| wishes::wants_off(cx, c) && cx.roster.of(c).unstoppable);
        let outcome = if still_running { MissionOutcome::Failed } else { outcome };
        self.context.record_entry(JournalEntry::Ended { outcome });
        self.finish_with(outcome);
    }

    fn finish_with(&mut self, outcome: MissionOutcome) {
        self.is_finished = true;
        self.changes.end();
        self.context.publish_marking();
        self.context.add_action(ControllerAction::Finished(outcome));
    }
}

/// What tests look at.
#[cfg(test)]
impl Controller {
    pub(crate) fn roster(&self) -> &crate::roster::Roster {
        &self.context.roster
    }

    pub(crate) fn is_blocked(&self, firing: u64) -> bool {
        blocked_starts::blocked_starts(&self.context).contains_key(&firing)
    }

    pub(crate) fn fires_by_itself(&self, id: armor_petri::TransitionId) -> bool {
        confirmations::fires_by_itself(self.ledger(), id)
            && !self.dates.waits_for_utc(self.plan(), id)
    }
}
