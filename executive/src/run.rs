//! The executive as a process: takes events, passes them to the controller, and performs its
//! actions. The controller itself never waits.

use crate::clocks::Clocks;
use crate::controller::Controller;
use crate::event::{ControllerAction, ControllerEvent};
use crate::follow::{Newer, follow};
use crate::gathering;
use crate::given_up::{GivenUpComponents, GivenUpNews};
use crate::hub::{ExecutiveInput, Hub};
use crate::journal::{Journal, JournalError};
use crate::ledger::snapshot::snapshot_of;
use crate::ledger::{Ledger, LedgerError};
use crate::opening::{OpenedJournal, newest_plan, open_journal, read_again};
use crate::order::Judged;
use crate::record::JournalEntry;
use crate::terms::MissionOutcome;
use crate::wall_clock::{self, Calendar};
use crate::watch::GuardWatching;
use armor_marking::Marking;
use armor_plan::{DatePhase, GivenValue, Plan};
use armor_robotfile::Date;
use armor_sdk::Latched;
use armor_sdk::control::{Assigned, Command, GivenParameter};
use armor_sdk::node::{NodeOptions, SystemNode};
use armor_sdk::orders::{GivenOrder, OrderEvent};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

/// How long the registry may take to answer at the start.
const REGISTRY_LIMIT: Duration = Duration::from_secs(20);
/// Time between two checks of the stop flag and of processes in doubt.
const LOOK_AROUND: Duration = Duration::from_millis(50);
/// How long the last messages, such as the answer to the order that ended the mission, have to
/// leave this process.
const LAST_WORDS: Duration = Duration::from_millis(100);

/// The options of an executive.
#[derive(Clone, Debug)]
pub struct ExecutiveOptions {
    /// The registry, `host:port`.
    pub registry: String,
    /// The journal; an existing one is continued.
    pub journal: PathBuf,
    /// Whether the journal was created before ([`crate::journal::rest`]). A missing or empty one has been
    /// lost then: the mission does not begin again, but goes to its safe place.
    pub is_laid_out: bool,
    /// Where newer versions of the file come from; without it the mission stays as it is.
    pub newer: Option<Newer>,
    /// The components that the launcher has given up: the mission does not wait for them.
    pub given_up: GivenUpComponents,
    /// How long the journal grows before it is cut, in bytes; see [`crate::journal::CUT_AT`].
    pub cut_at: u64,
    /// The data that time follows, whatever the file specifies: `component.output`.
    pub clock: Option<String>,
    /// Whether this host's clock counts as right although no time service is known to keep it.
    pub trust_clock: bool,
}

/// Why a mission is not played.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The journal cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The journal is not one of this mission.
    #[error("journal {path}: {error}; move it away to begin the mission again")]
    Resume {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        error: LedgerError,
    },
    /// There is no mission to begin with.
    #[error("{0}")]
    Mission(String),
    /// The mission has absolute dates, and no time service is known to keep this host's clock.
    #[error("{}", wall_clock::describe_doubts(.0))]
    Clock(String),
    /// The registry is not reached, or another executive is there.
    #[error("the executive cannot register: {0}")]
    Register(String),
}

/// Plays a mission to its end, or until `stop` is set. An existing journal holds the version of the
/// file that is continued, independent of the disk; without one it is `first`.
///
///
/// # Errors
/// If it cannot begin, or the journal cannot be written: nothing is done then that is not on disk.
pub fn run(
    first: impl FnOnce() -> Result<Plan, String>,
    options: &ExecutiveOptions,
    stop: &AtomicBool,
) -> Result<MissionOutcome, RunError> {
    let OpenedJournal { mut journal, story, loss, readable } =
        open_journal(&options.journal, options.is_laid_out)?;
    let ledger = match &loss {
        Some(_) => Ledger::new(newest_plan(&readable, first, options)?),
        None => read_again(&story, first, options)?,
    };
    let plan = Arc::clone(ledger.plan());
    let begins = story.records.is_empty() && loss.is_none();
    judge_clock(&plan, options, begins)?;
    let (sender, inputs) = mpsc::channel();
    let watching = GuardWatching::start(&plan, &options.registry, &sender);
    if begins {
        gathering::gather(&plan, &options.registry, &watching, &options.given_up, stop);
    }
    let (clocks, now) = Clocks::begin(&plan, &story);
    journal.begin(clocks.life().clone())?;
    if loss.is_none() {
        // Otherwise it is in one batch with the retreat: a journal with this record alone looks like
        // a mission that has not begun, and a restarted executive would begin it.
        journal.sync()?;
    }
    let node = register_node(options)?;
    clocks.follow(&plan, &node, sender.clone());
    hand_on("watch", node.directory().watch_changes(), sender.clone(), ExecutiveInput::Registry);
    hand_on("orders", node.orders(), sender.clone(), ExecutiveInput::Operator);
    if let Some(newer) = &options.newer {
        follow(newer.clone(), plan.version().number, sender.clone());
    }
    let (controller, actions) = if let Some(why) = &loss {
        Controller::after_loss(Arc::clone(&plan), why, now)
    } else if begins {
        Controller::new(Arc::clone(&plan), now)
    } else {
        Controller::resume_from(ledger, now)
    };
    if !story.records.is_empty() {
        log_where(&controller);
    }
    let hub = Hub::new(plan, sender.clone());
    let mut executive = ExecutiveLoop {
        controller,
        hub,
        watching,
        given_up: GivenUpNews::new(options.given_up.clone()),
        journal,
        is_short: false,
        cut_at: options.cut_at,
        trust_clock: options.trust_clock,
        node,
        clocks,
        calendar: Calendar::default(),
        shown: None,
        inputs: sender,
    };
    let mut outcome = executive.perform_actions(actions)?;
    while outcome.is_none() {
        outcome = executive.take_turn(&inputs, stop)?;
    }
    executive.journal.release_reserve();
    std::thread::sleep(LAST_WORDS);
    Ok(outcome.unwrap_or(MissionOutcome::Failed))
}

fn log_where(controller: &Controller) {
    let marking = controller.marking(0.0);
    let places = marking.places.iter().map(|marked| marked.place.clone());
    let firings = marking.in_flight.iter().map(|firing| format!("{} under way", firing.cause));
    let all: Vec<_> = places.chain(firings).collect();
    tracing::info!("continues where it stopped: {}", all.join(", "));
}

/// A mission with dates begins only with a clock that is known to be right. One that has begun
/// continues with any clock.
fn judge_clock(plan: &Plan, options: &ExecutiveOptions, begins: bool) -> Result<(), RunError> {
    if !plan.has_dates() || options.trust_clock {
        return Ok(());
    }
    match wall_clock::doubts() {
        Some(doubts) if begins => Err(RunError::Clock(doubts)),
        Some(doubts) => {
            tracing::warn!("this host's clock is not known to be right any more: {doubts}");
            Ok(())
        }
        None => Ok(()),
    }
}

struct ExecutiveLoop {
    controller: Controller,
    hub: Hub,
    watching: GuardWatching,
    given_up: GivenUpNews,
    journal: Journal,
    /// Whether the disk was found to be full.
    is_short: bool,
    cut_at: u64,
    trust_clock: bool,
    node: SystemNode,
    clocks: Clocks,
    calendar: Calendar,
    shown: Option<Marking>,
    /// Given to threads that send inputs.
    inputs: mpsc::Sender<ExecutiveInput>,
}

impl ExecutiveLoop {
    /// Waits for the next input and performs the actions that follow from it.
    fn take_turn(
        &mut self,
        inputs: &Receiver<ExecutiveInput>,
        stop: &AtomicBool,
    ) -> Result<Option<MissionOutcome>, RunError> {
        let now = self.clocks.now();
        if let Some(utc) = self.utc()
            && let Some(event) = self.calendar.news(utc, now.mission)
        {
            let actions = self.controller.handle(event, now);
            if let Some(outcome) = self.perform_actions(actions)? {
                return Ok(Some(outcome));
            }
        }
        if let Some(event) = self.notice_shortage() {
            let actions = self.controller.handle(event, now);
            if let Some(outcome) = self.perform_actions(actions)? {
                return Ok(Some(outcome));
            }
        }
        let mut wait = LOOK_AROUND;
        if let Some(left) = self.clocks.left(self.controller.deadlines()) {
            wait = wait.min(left);
        }
        let ledger = self.controller.ledger();
        // What a pause holds is not on its way.
        let is_firing = ledger.firings().values().any(|firing| !ledger.is_held(firing));
        self.node.set_busy(is_firing || self.clocks.has_unread_time());
        let input = inputs.recv_timeout(wait);
        self.node.set_busy(true);
        let mut events = match input {
            Ok(ExecutiveInput::Operator(OrderEvent::Given(given)))
                if self.refuse_malformed(&given) =>
            {
                Vec::new()
            }
            Ok(ExecutiveInput::News(watch)) => self.watching.news(watch),
            Ok(ExecutiveInput::Time) => self.look_at_the_time()?,
            Ok(input) => self.hub.take_in(input),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => Vec::new(),
        };
        if self.hub.is_uneasy() {
            events.extend(self.hub.look_around());
        }
        events.extend(self.given_up.take_changes(self.controller.plan()));
        if (stop.load(Ordering::Relaxed) || self.node.is_ending()) && !self.controller.is_stopping()
        {
            events.push(ControllerEvent::Stop);
        }
        if events.is_empty() && self.controller.deadlines().are_due(self.clocks.now()) {
            events.push(ControllerEvent::Timer);
        }
        for event in events {
            let now = self.clocks.now();
            let actions = self.controller.handle(event, now);
            if let Some(outcome) = self.perform_actions(actions)? {
                return Ok(Some(outcome));
            }
        }
        Ok(None)
    }

    /// Notices a full disk, once. A mission without a safe place continues until the reserve is
    /// used up.
    fn notice_shortage(&mut self) -> Option<ControllerEvent> {
        let is_new = self.journal.shortage().is_some() && !self.is_short;
        self.is_short |= is_new;
        let why = self.journal.shortage().filter(|_| is_new)?;
        let why = format!("no space is left for the journal of the mission: {why}");
        tracing::error!("{why}; free space on its disk");
        self.controller.plan().safe().map(|_| ControllerEvent::Endangered { why })
    }

    /// Returns UTC from the data that mission time follows, or else from this host's clock.
    fn utc(&self) -> Option<Date> {
        if !self.clocks.follow_data() {
            return Some(wall_clock::utc());
        }
        let stamp_s = self.node.armor().timestamp();
        let since_1970 = Duration::try_from_secs_f64(stamp_s).ok();
        since_1970.filter(|since| !since.is_zero()).map(Date::since_1970)
    }

    /// Handles a reading of the data that mission time follows.
    fn look_at_the_time(&mut self) -> Result<Vec<ControllerEvent>, RunError> {
        let Some(life) = self.clocks.look() else {
            return Ok(Vec::new());
        };
        self.journal.begin(life.clone())?;
        // Tools compute the time from the stamp of the last marking. After a jump that is wrong, so
        // publish a new one.
        self.shown = None;
        Ok(vec![ControllerEvent::Timer])
    }

    /// Answers a malformed order and returns true. It never reaches the journal.
    fn refuse_malformed(&self, given: &GivenOrder) -> bool {
        let wrong = given.order.check(given.request, &given.author).err();
        if let Some(wrong) = wrong {
            self.node.answer(given.connection, given.request, false, wrong.to_string());
        }
        wrong.is_some()
    }

    /// Performs the actions of the controller. Records are on disk before any later action is
    /// performed.
    fn perform_actions(
        &mut self,
        actions: Vec<ControllerAction>,
    ) -> Result<Option<MissionOutcome>, RunError> {
        let mut publish = false;
        for action in actions {
            if let ControllerAction::Journal(record) = action {
                log_entry(&record.entry);
                self.journal.write(record)?;
                continue;
            }
            if action == ControllerAction::Publish {
                publish = true;
                continue;
            }
            self.journal.sync()?;
            match action {
                ControllerAction::Activate { component, activation, values } => {
                    let parameters = values.into_iter().map(parameter_given).collect();
                    self.hub.send_command(component, &Command::Activate { activation, parameters });
                    self.controller.note_sent(component, self.clocks.now().host);
                }
                ControllerAction::Freeze { component, activation } => {
                    self.hub.send_command(component, &Command::Freeze { activation });
                    self.controller.note_sent(component, self.clocks.now().host);
                }
                ControllerAction::Acknowledge { component, serial } => {
                    self.hub.send_command(component, &Command::Acknowledge { report: serial });
                }
                ControllerAction::Kill { component } => self.hub.kill_process(component),
                ControllerAction::Answer { connection, request, accepted, text } => {
                    self.node.answer(connection, request, accepted, text);
                }
                ControllerAction::Judge => self.spawn_judge(),
                ControllerAction::JudgeMove => self.judge_move(),
                ControllerAction::Changed => {
                    self.watching.follow(self.controller.plan(), &self.inputs);
                }
                ControllerAction::Finished(outcome) => {
                    self.publish_marking();
                    return Ok(Some(outcome));
                }
                ControllerAction::Journal(_) | ControllerAction::Publish => {}
            }
        }
        self.journal.sync()?;
        if !self.is_short && self.journal.is_longer_than(self.cut_at) {
            self.journal.cut(self.clocks.life().clone(), snapshot_of(self.controller.ledger()))?;
        }
        if publish || self.shown.is_none() {
            self.publish_marking();
        }
        Ok(None)
    }

    /// Answers the question about a new version on a thread of its own: a proof may take seconds.
    fn spawn_judge(&self) {
        let Some(question) = self.controller.question() else {
            return;
        };
        let inputs = self.inputs.clone();
        let trusted = self.trust_clock;
        let doubts = move || if trusted { None } else { wall_clock::doubts() };
        let answer = move || drop(inputs.send(ExecutiveInput::Event(question.answer(&doubts))));
        if let Err(error) = std::thread::Builder::new().name("judge".into()).spawn(answer) {
            tracing::error!("no thread to judge a new version of the file: {error}");
        }
    }

    /// Proves a move of tokens on a thread of its own.
    fn judge_move(&self) {
        let Some(question) = self.controller.move_question() else {
            return;
        };
        let inputs = self.inputs.clone();
        let answer = move || drop(inputs.send(ExecutiveInput::Event(question.answer())));
        if let Err(error) = std::thread::Builder::new().name("judge-move".into()).spawn(answer) {
            tracing::error!("no thread to prove a move of tokens: {error}");
        }
    }

    /// Publishes the marking, unless only the time has changed.
    fn publish_marking(&mut self) {
        let marking = self.controller.marking(self.node.armor().timestamp());
        let news = self.shown.as_ref().is_none_or(|shown| {
            let (stamp, now_at_s) = (marking.stamp, marking.now_at_s);
            Marking { stamp, now_at_s, ..shown.clone() } != marking
        });
        if news {
            if let Err(error) = self.node.armor().send_data("marking", &marking) {
                tracing::error!("the marking cannot be published: {error}");
            }
            self.shown = Some(marking);
        }
    }
}

fn register_node(options: &ExecutiveOptions) -> Result<SystemNode, RunError> {
    let node = NodeOptions {
        name: "executive".into(),
        kind: "executive".into(),
        registry: options.registry.clone(),
    };
    let declare = |armor: &armor_sdk::Armor| Ok(armor.provide::<Latched<Marking>>("marking")?);
    SystemNode::start(&node, REGISTRY_LIMIT, declare)
        .map_err(|error| RunError::Register(error.to_string()))
}

/// Starts a thread that sends the items of `from` as inputs, until the receiver is gone.
fn hand_on<T: Send + 'static>(
    name: &str,
    from: impl IntoIterator<Item = T> + Send + 'static,
    inputs: mpsc::Sender<ExecutiveInput>,
    input: impl Fn(T) -> ExecutiveInput + Send + 'static,
) {
    let hand_on = move || {
        for one in from {
            if inputs.send(input(one)).is_err() {
                return;
            }
        }
    };
    if let Err(error) = std::thread::Builder::new().name(name.into()).spawn(hand_on) {
        tracing::error!("no thread for the {name}: {error}");
    }
}

/// Logs a record for people who follow the mission.
fn log_entry(entry: &JournalEntry) {
    match entry {
        JournalEntry::Took { cause, from, to, late_s, sets, .. } => {
            let names = |tokens: &[crate::terms::Tokens]| {
                in_words(&tokens.iter().map(|t| t.place.as_str()).collect::<Vec<_>>())
            };
            tracing::info!("{cause}: {} -> {}", names(from), names(to));
            for set in sets {
                tracing::info!("{} is {}", set.variable, set.value);
            }
            if *late_s > 0.1 {
                tracing::warn!("{cause} fires {late_s:.3} s late");
            }
        }
        JournalEntry::Guard { .. } => tracing::info!("{entry}"),
        JournalEntry::Heard { component, report, .. } => tracing::info!("{component}: {report}"),
        JournalEntry::Redirected { why, .. } => tracing::warn!("goes elsewhere: {why}"),
        JournalEntry::Ordered(Judged { by, order, accepted: true, text, .. }) => {
            tracing::info!("{} orders: {order}; {text}", by.author);
        }
        JournalEntry::Ordered(Judged { by, order, text, .. }) => {
            tracing::warn!("{} orders: {order}; refused: {text}", by.author);
        }
        JournalEntry::Asked { transition } => tracing::info!("asks whether {transition} may fire"),
        JournalEntry::Unanswered { transition, fires } => {
            let what = if *fires { "fires" } else { "does not fire" };
            tracing::warn!("no answer about {transition}: it {what}");
        }
        JournalEntry::LinkLost { author } => tracing::warn!("the link to {author} is lost"),
        JournalEntry::Held { why } => tracing::warn!("holds: {why}"),
        JournalEntry::Dated { phase: DatePhase::Past, used: false, .. } => {
            tracing::warn!("{entry}");
        }
        JournalEntry::Dated { .. } => tracing::info!("{entry}"),
        JournalEntry::Retreated { why } => tracing::warn!("retreats: {why}"),
        JournalEntry::GaveUp { why } => tracing::error!("gives up: {why}"),
        JournalEntry::Ended { outcome } => tracing::info!("the mission has ended: {outcome:?}"),
        JournalEntry::Changed { .. } => tracing::info!("{entry}"),
        JournalEntry::Refused { .. } => tracing::warn!("{entry}; the one before stays in force"),
        JournalEntry::Snapshot(_)
        | JournalEntry::Began { .. }
        | JournalEntry::Stopped { .. }
        | JournalEntry::Activating { .. }
        | JournalEntry::Put { .. } => {
            tracing::debug!("{entry:?}");
        }
    }
}

/// Makes a parameter value as configd would: relative folders start from the working directory,
/// which is the same for this process and configd.
fn parameter_given(value: GivenValue) -> GivenParameter {
    let base = std::env::current_dir().unwrap_or_default().join(&value.folder);
    let base = base.to_string_lossy().into_owned();
    let assigned = Assigned { text: value.text, base, origin: value.origin };
    GivenParameter { name: value.parameter, assigned }
}

fn in_words(places: &[&str]) -> String {
    if places.is_empty() { "nowhere".to_owned() } else { places.join(" ") }
}
