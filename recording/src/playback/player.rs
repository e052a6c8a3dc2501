//! The process that plays: it publishes the time and the recorded messages under the names of their
//! components, and takes orders.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use armor_sdk::GivenPlaybackOrder;
use armor_sdk::control::{OutputStatus, PlaybackOrder};
use armor_sdk::node::{NodeOptions, SystemNode};
use armor_sdk::prelude::{Fault, Latched};
use armor_sdk::stand_in::{StandIn, StandInOutput};
use armor_wire::clock::Clock;

use super::followers::{Followers, PendingWork, find_followed};
use super::pace::{PlaybackPace, PlaybackSpeed};
use super::queue::{DataRename, PlaybackQueue, QueuedMessage, find_played};
use super::schedule::{PlaybackStep, PlayedPart, Schedule};
use super::state::PlaybackState;
use crate::message_stream::RecordedMessage;
use crate::reader::Recording;
use crate::reports::{REPORTS, RecordedReport};
use crate::summary::RecordingSummary;
use crate::taps::OutputSelection;

/// The name under which the player is registered.
pub const PLAYBACK: &str = "playback";
const CLOCK: &str = "clock";
const STATE: &str = "state";

/// Time within which the registry must answer at the start.
const REGISTER_WITHIN: Duration = Duration::from_secs(20);
/// Time within which the system must be linked to the recording.
const LINKED_WITHIN: Duration = Duration::from_secs(30);
/// Time between two looks at whether it is.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// An order is noticed within this time.
const ORDER_WITHIN: Duration = Duration::from_millis(100);
/// How often the state is published.
const STATE_EVERY: Duration = Duration::from_millis(200);
/// The first pause between two looks at whether the system has taken what was published, and the
/// longest one.
const TAKEN_PAUSES: (Duration, Duration) = (Duration::from_micros(100), Duration::from_millis(5));
/// How long time continues after the last message, for a mission that ends with it: a component may
/// need its next tick to report.
const AFTER_END_S: f64 = 2.0;
/// How long time waits for one process, until that has nothing left to do.
const PATIENCE: Duration = Duration::from_secs(5);

/// A component that is played.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlayedComponent {
    /// Its name in the system.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// Whether the mission activates and freezes it.
    pub controlled: bool,
}

/// A link that must exist before time begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AwaitedLink {
    /// `component.output`.
    pub data: String,
    /// The component that subscribes.
    pub to: String,
}

/// What is played, and how.
#[derive(Clone, Debug, Default)]
pub struct PlayerOptions {
    /// The recording.
    pub recording: PathBuf,
    /// The registry, `host:port`.
    pub registry: String,
    /// The components to play.
    pub components: Vec<PlayedComponent>,
    /// Outputs that are played under other names.
    pub renames: Vec<DataRename>,
    /// Where it begins, in seconds from the beginning of the recording.
    pub from_s: f64,
    /// Where it ends; at its end, if it is not given.
    pub to_s: Option<f64>,
    /// The speed at the beginning.
    pub speed: PlaybackSpeed,
    /// Whether it begins with a pause.
    pub is_paused: bool,
    /// Whether it begins again at the end.
    pub loops: bool,
    /// Whether the process stays at the end, with its last values.
    pub stays: bool,
    /// Whether time waits until the system has taken what was published.
    pub is_lossless: bool,
    /// The links that must exist before time begins.
    pub awaited: Vec<AwaitedLink>,
    /// Whether the executive must play its mission before time continues.
    pub awaits_mission: bool,
}

/// What was played.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlayerReport {
    /// Messages that were published.
    pub published: u64,
    /// Reports of components.
    pub reported: u64,
    /// Messages and reports of components that were frozen.
    pub withheld: u64,
    /// Messages that cannot be read.
    pub unreadable: u64,
    /// Damaged parts of the file, of which nothing can be read.
    pub damaged_chunks: u64,
    /// Messages of another type than their output, and reports with other fields than they have here.
    pub of_other_type: u64,
    /// How long time has waited for the system, in seconds.
    pub waited_s: f64,
}

/// Plays a recording to its end, or until `stop` is set or the process is to end.
///
/// # Errors
/// If the recording cannot be read, or the system does not link to it.
pub fn play_recording(options: &PlayerOptions, stop: &AtomicBool) -> Result<PlayerReport, Fault> {
    let name = options.recording.display().to_string();
    let selection = OutputSelection {
        include: options.components.iter().map(|it| format!("{}.*", it.name)).collect(),
        exclude: Vec::new(),
    };
    let (queue, summary) =
        PlaybackQueue::<Recording>::open(&options.recording, selection, options.renames.clone())
            .map_err(|error| format!("{name}: {error}"))?;
    let part = find_part(options, &summary).ok_or_else(|| format!("{name}: it is empty"))?;
    let mut player = Player::start(options, &summary, part)?;
    player.publish_time(part.from_s)?;
    player.await_links(options, stop)?;
    let begun = Instant::now();
    let pace = PlaybackPace::new(part.from_s, options.speed, options.is_paused, Duration::ZERO);
    let mut schedule = Schedule::new(queue, part, pace, options.is_lossless)?;
    schedule.set_followed(find_followed(&player.outputs()));
    let run = PlaybackRun {
        player,
        schedule,
        begun,
        part,
        last_s: summary.span_s.map_or(part.to_s, |(_, end_s)| end_s.clamp(part.from_s, part.to_s)),
        waits: None,
        stated: None,
        loops: options.loops,
        recording: name,
        components: options.components.iter().map(|it| it.name.clone()).collect(),
    };
    run.play(options, stop)
}

/// The part that is played; `None` if the recording is empty.
fn find_part(options: &PlayerOptions, summary: &RecordingSummary) -> Option<PlayedPart> {
    let begin_s = summary.begin_s()?;
    let (_, end_s) = summary.span_s?;
    let from_s = (begin_s + options.from_s).min(end_s);
    let rest_s = if options.awaits_mission { AFTER_END_S } else { 0.0 };
    let to_s = options.to_s.map_or(end_s + rest_s, |to_s| (begin_s + to_s).min(end_s)).max(from_s);
    Some(PlayedPart { from_s, to_s })
}

/// The processes that publish.
struct Player {
    node: SystemNode,
    orders: Receiver<GivenPlaybackOrder>,
    stand_ins: BTreeMap<String, StandIn>,
    /// The schema of each output.
    schemas: BTreeMap<String, String>,
    followers: Followers,
    report: PlayerReport,
    /// Whether a mission is played over what is played here.
    awaits_mission: bool,
}

impl Player {
    fn start(
        options: &PlayerOptions,
        summary: &RecordingSummary,
        part: PlayedPart,
    ) -> Result<Self, Fault> {
        let registered = |name: &str, kind: &str| NodeOptions {
            name: name.into(),
            kind: kind.into(),
            registry: options.registry.clone(),
        };
        let node = SystemNode::start(&registered(PLAYBACK, PLAYBACK), REGISTER_WITHIN, |armor| {
            armor.provide::<Latched<Clock>>(CLOCK)?;
            Ok(armor.provide::<Latched<PlaybackState>>(STATE)?)
        })?;
        let orders = node.playback_orders();
        let mut outputs: BTreeMap<&str, Vec<StandInOutput>> = BTreeMap::new();
        let mut schemas = BTreeMap::new();
        for output in &summary.outputs {
            let data = find_played(&options.renames, &output.data);
            let Some((component, id)) = data.split_once('.') else { continue };
            let Some(played) = options.components.iter().find(|it| it.name == component) else {
                continue;
            };
            schemas.insert(data.clone(), output.schema.clone());
            outputs.entry(&played.name).or_default().push(StandInOutput {
                id: id.into(),
                type_name: output.type_name.clone(),
                schema: output.schema.clone(),
                latched: output.latched,
            });
        }
        let mut stand_ins = BTreeMap::new();
        for PlayedComponent { name, kind, controlled } in &options.components {
            let outputs = outputs.remove(name.as_str()).unwrap_or_default();
            let options = registered(name, kind);
            let stand_in = StandIn::start(&options, &outputs, *controlled, REGISTER_WITHIN)
                .map_err(|fault| format!("{name} cannot be played: {fault}"))?;
            stand_ins.insert(name.clone(), stand_in);
        }
        let own: BTreeSet<_> = stand_ins.keys().cloned().chain([PLAYBACK.to_owned()]).collect();
        let followers = Followers::new(node.directory().clone(), PLAYBACK, own);
        tracing::info!(
            "{} of {:.1} s, {} components",
            options.recording.display(),
            part.to_s - part.from_s,
            stand_ins.len()
        );
        let report = PlayerReport::default();
        let awaits_mission = options.awaits_mission;
        Ok(Self { node, orders, stand_ins, schemas, followers, report, awaits_mission })
    }

    fn publish_time(&self, clock: f64) -> Result<(), Fault> {
        self.node.publish_at(CLOCK, &Clock { clock }, clock)?;
        Ok(())
    }

    fn publish(&mut self, queued: QueuedMessage) -> Result<(), Fault> {
        let message = queued.message;
        if message.data == REPORTS {
            self.report(&message);
            return Ok(());
        }
        if self.schemas.get(&message.data) != Some(&message.output_type.schema) {
            self.report.of_other_type += 1;
            return Ok(());
        }
        let found = message.data.split_once('.').and_then(|(component, id)| {
            self.stand_ins.get(component).map(|stand_in| (stand_in, id))
        });
        let (Some((stand_in, id)), Ok(bytes)) = (found, message.payload) else { return Ok(()) };
        if stand_in.publish(id, message.head.stamp_s, bytes)? {
            self.report.published += 1;
        } else {
            self.report.withheld += 1;
        }
        Ok(())
    }

    /// Repeats a report of a component that is played.
    fn report(&mut self, message: &RecordedMessage) {
        let Ok(recorded) = message.decode_as::<RecordedReport>() else {
            self.report.of_other_type += 1;
            return;
        };
        // What it was renamed to, if it was, is another component.
        let Some(stand_in) = self.stand_ins.get(&recorded.component) else { return };
        if stand_in.report(recorded.kind()) {
            self.report.reported += 1;
        } else {
            self.report.withheld += 1;
        }
    }

    /// Waits until the system is linked to what is played, so that it misses nothing.
    fn await_links(&mut self, options: &PlayerOptions, stop: &AtomicBool) -> Result<(), Fault> {
        let begun = Instant::now();
        let mut missing = String::new();
        while begun.elapsed() < LINKED_WITHIN {
            if stop.load(Ordering::Relaxed) || self.node.is_ending() {
                return Ok(());
            }
            missing = match self.find_unlinked(&options.awaited) {
                Some(link) => format!("{} has no link to {}", link.to, link.data),
                None if options.awaits_mission && !self.followers.plays_mission() => {
                    "the executive does not play its mission".into()
                }
                None => return Ok(()),
            };
            std::thread::sleep(LOOK_EVERY);
        }
        Err(format!("the system is not ready after {} s: {missing}", LINKED_WITHIN.as_secs())
            .into())
    }

    fn find_unlinked<'a>(&self, awaited: &'a [AwaitedLink]) -> Option<&'a AwaitedLink> {
        let outputs = self.outputs();
        awaited.iter().find(|link| {
            let output = outputs.iter().find(|output| output.data == link.data);
            !output.is_some_and(|output| output.links.iter().any(|it| it.to == link.to))
        })
    }

    /// The outputs of the player's processes, and their links.
    fn outputs(&self) -> Vec<OutputStatus> {
        let stand_ins = self.stand_ins.values().flat_map(StandIn::outputs);
        stand_ins.chain(self.node.outputs()).collect()
    }

    /// Returns what the system has not taken yet, in words, if something is.
    fn find_pending(&mut self, outputs: &[OutputStatus], clock_s: f64) -> Option<PendingWork> {
        let unsettled = self.stand_ins.iter().find(|(_, stand_in)| !stand_in.is_settled());
        if let Some((name, _)) = unsettled
            && self.followers.has_known_executive()
        {
            return Some(PendingWork::new(
                "",
                format!("the executive has not taken a report of {name}"),
            ));
        }
        let pending = self.followers.find_pending(outputs, clock_s);
        if self.awaits_mission && !self.followers.has_known_executive() {
            // The mission has ended, and the run ends; or the executive is being restarted.
            return Some(PendingWork::new("", "the executive is not there"));
        }
        pending
    }
}

/// Since when time waits for the system, and what was found last.
struct TakenWait {
    since: Instant,
    /// Since when for the present process.
    begun: Instant,
    pause: Duration,
    pending: String,
}

struct PlaybackRun {
    player: Player,
    schedule: Schedule<Recording>,
    begun: Instant,
    part: PlayedPart,
    /// When the last message of the part was published.
    last_s: f64,
    waits: Option<TakenWait>,
    /// When the state was published last.
    stated: Option<Instant>,
    /// Whether it begins again at the end.
    loops: bool,
    /// The path of the recording, and the components that are played.
    recording: String,
    components: Vec<String>,
}

impl PlaybackRun {
    fn play(mut self, options: &PlayerOptions, stop: &AtomicBool) -> Result<PlayerReport, Fault> {
        let mut is_over = false;
        while !stop.load(Ordering::Relaxed) && !self.player.node.is_ending() {
            let now = self.begun.elapsed();
            let wait = match self.schedule.next_step(now)? {
                PlaybackStep::Clock(clock_s) => {
                    self.player.publish_time(clock_s)?;
                    Duration::ZERO
                }
                PlaybackStep::Message(queued) => {
                    self.player.publish(*queued)?;
                    Duration::ZERO
                }
                PlaybackStep::AwaitTaken => self.look_whether_taken(),
                PlaybackStep::Wait(left) => left.min(ORDER_WITHIN),
                PlaybackStep::Over if self.loops => {
                    self.schedule.seek(self.part.from_s, now)?;
                    self.player.followers.forget();
                    Duration::ZERO
                }
                PlaybackStep::Over if !is_over => {
                    is_over = true;
                    self.publish_state(true)?;
                    if !options.stays {
                        // The launcher ends the others first.
                        self.player.node.set_done();
                    }
                    ORDER_WITHIN
                }
                PlaybackStep::Over => ORDER_WITHIN,
            };
            match self.player.orders.recv_timeout(wait) {
                Ok(given) => {
                    self.obey_order(&given)?;
                    is_over = false;
                    self.publish_state(false)?;
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if !is_over && self.stated.is_none_or(|stated| stated.elapsed() >= STATE_EVERY) {
                self.publish_state(false)?;
            }
        }
        let mut report = self.player.report.clone();
        report.unreadable = self.schedule.unreadable();
        report.damaged_chunks = self.schedule.damaged_chunks();
        Ok(report)
    }

    /// Looks whether the system has taken what was published. Returns how long to wait before the next
    /// step.
    fn look_whether_taken(&mut self) -> Duration {
        let begun = Instant::now();
        let outputs = self.player.outputs();
        let Some(pending) = self.player.find_pending(&outputs, self.schedule.pace().reached_s())
        else {
            self.schedule.set_followed(find_followed(&outputs));
            self.schedule.mark_taken();
            let wait = self.waits.take();
            let begun = wait.map_or(begun, |wait| wait.since);
            self.player.report.waited_s += begun.elapsed().as_secs_f64();
            return Duration::ZERO;
        };
        let (shortest, longest) = TAKEN_PAUSES;
        let wait = self.waits.get_or_insert_with(|| TakenWait {
            since: begun,
            begun,
            pause: shortest,
            pending: String::new(),
        });
        wait.pause = (2 * wait.pause).min(longest);
        if wait.begun.elapsed() > PATIENCE {
            tracing::warn!(
                "time has waited for {} s: {pending}; until that is over, time does not wait for it",
                PATIENCE.as_secs()
            );
            self.player.followers.excuse(&pending.process);
            wait.begun = Instant::now();
        }
        wait.pending = pending.to_string();
        wait.pause
    }

    fn obey_order(&mut self, given: &GivenPlaybackOrder) -> Result<(), Fault> {
        let now = self.begun.elapsed();
        self.waits = None;
        let schedule = &mut self.schedule;
        let answer = match given.order {
            PlaybackOrder::Pause => {
                schedule.pause();
                Ok("it is paused".into())
            }
            PlaybackOrder::Resume => {
                schedule.resume(now);
                Ok("it continues".into())
            }
            PlaybackOrder::Step { time_s } if time_s.is_finite() && time_s >= 0.0 => {
                schedule.step(time_s, now)?;
                Ok("it continues by one step".into())
            }
            PlaybackOrder::Step { .. } => Err("the time of a step is not negative".into()),
            PlaybackOrder::Speed { factor } => PlaybackSpeed::of_factor(factor).map(|speed| {
                schedule.set_speed(speed, now);
                format!("the speed is {speed}")
            }),
            PlaybackOrder::Seek { at_s } if at_s.is_finite() => {
                let to_s = self.part.from_s + at_s;
                schedule.seek(to_s.min(self.last_s), now)?;
                // A jump is for looking: it does not end what is played, nor begin it again.
                if to_s >= self.last_s {
                    schedule.pause();
                }
                self.player.followers.forget();
                let reached_s = schedule.pace().reached_s() - self.part.from_s;
                Ok(format!("it is at {reached_s:.3} s"))
            }
            PlaybackOrder::Seek { .. } => Err("the moment is not a number".into()),
            PlaybackOrder::Loop { on } => {
                self.loops = on;
                Ok(if on { "it begins again at the end" } else { "it ends at the end" }.into())
            }
        };
        let (accepted, text) = match answer {
            Ok(text) => (true, text),
            Err(text) => (false, text),
        };
        self.player.node.answer(given.connection, given.request, accepted, text);
        Ok(())
    }

    fn publish_state(&mut self, is_over: bool) -> Result<(), Fault> {
        self.stated = Some(Instant::now());
        let pace = self.schedule.pace();
        let waits = self.waits.as_ref().filter(|wait| wait.begun.elapsed() > STATE_EVERY);
        let state = PlaybackState {
            stamp: pace.reached_s(),
            from: self.part.from_s,
            to: self.part.to_s,
            at: pace.reached_s() - self.part.from_s,
            speed: pace.speed().factor(),
            paused: pace.is_paused(),
            over: is_over,
            loops: self.loops,
            waits_for: waits.map(|wait| wait.pending.clone()).unwrap_or_default(),
            recording: self.recording.clone(),
            components: self.components.clone(),
        };
        self.player.node.publish_at(STATE, &state, state.stamp)?;
        Ok(())
    }
}
