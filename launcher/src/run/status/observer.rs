//! Collects the status of a run on a thread of its own. It reads what any tool may read: the
//! marking, outputs of type `Progress`, and on a terminal the statuses that the rates come from.
//! Its links keep the newest value only, so no publisher waits for it.

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_inspect::words::format_duration;
use armor_inspect::{MissionWatch, ObservedLink, SystemWatch, WakeCallback, WatchedValues};
use armor_marking::{MarkedPlace, Marking, MarkingStage, MissionComponent, MissionComponentState};
use armor_sdk::directory::Directory;
use armor_sdk::messages::Progress;
use armor_wire::codec;

use super::display::StatusLine;
use super::line::{RunStatus, TaskStatus};
use super::rates::{FallenRate, RateHistory};
use crate::run::hanging_calls::HangingCalls;

/// The line is redrawn this often, and whenever the marking changes.
const DRAW_EVERY: Duration = Duration::from_millis(500);
/// Rates are measured over a second, so that asking more often shows nothing new.
const RATES_EVERY: Duration = Duration::from_secs(1);
/// How long the time of the system may stand still before the status shows it: a simulator that starts
/// or is busy needs less.
const STANDS_STILL_AFTER: Duration = Duration::from_secs(5);
/// How long the end of a run waits for a terminal that does not take the line.
const FINISH_WITHIN: Duration = Duration::from_millis(500);

/// Where the status of a run comes from.
pub struct StatusSources {
    /// The registry of the run.
    pub registry: SocketAddr,
    /// Whether there is a mission.
    pub has_mission: bool,
    /// The data that time follows, if it is not the host's clock.
    pub clock: Option<String>,
    /// The outputs of type `Progress`, `component.progress`.
    pub progress_outputs: Vec<String>,
    /// The outputs that publish a value only when it changes.
    pub latched_outputs: BTreeSet<String>,
    /// Processes that were started again.
    pub restarts: Arc<AtomicU32>,
    /// The calls of components' code that hang.
    pub hanging_calls: HangingCalls,
    /// The beginning of the run.
    pub start: Instant,
}

/// A running observer.
pub struct StatusObserver {
    wake: Sender<Wakeup>,
    thread: JoinHandle<()>,
}

enum Wakeup {
    Changed,
    End,
}

impl StatusObserver {
    /// Begins to show the status on `line`.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn start(sources: StatusSources, line: StatusLine) -> Result<Self> {
        let (wake, wakeups) = mpsc::channel();
        let changed = wake.clone();
        let thread = thread::Builder::new()
            .name("status".into())
            .spawn(move || {
                let Ok(mut collector) = Collector::connect(sources, line.is_live(), changed) else {
                    // Without threads there is no status; the run itself does not need it.
                    return;
                };
                while let Ok(Wakeup::Changed) | Err(RecvTimeoutError::Timeout) =
                    wakeups.recv_timeout(DRAW_EVERY)
                {
                    line.show(&collector.collect());
                }
                line.finish();
            })
            .context("starting a thread for the status")?;
        Ok(Self { wake, thread })
    }

    /// Erases the line and ends.
    pub fn finish(self) {
        let _ = self.wake.send(Wakeup::End);
        let deadline = Instant::now() + FINISH_WITHIN;
        while !self.thread.is_finished() && Instant::now() < deadline {
            thread::sleep(Duration::from_millis(2));
        }
    }
}

struct Collector {
    sources: StatusSources,
    mission: Option<MissionWatch>,
    progress: WatchedValues,
    watch: Option<SystemWatch>,
    history: RateHistory,
    fallen_rates: Vec<FallenRate>,
    measured: Instant,
    time: TimeWatch,
}

/// Notices that the time of the system stands still.
struct TimeWatch {
    newest: Option<Vec<u8>>,
    changed: Instant,
}

impl TimeWatch {
    /// Takes the newest reading of the clock, and returns whether it has not changed for a time after which
    /// a person should know.
    fn stands_still(&mut self, reading: Option<&[u8]>, now: Instant) -> bool {
        if reading.is_some() && self.newest.as_deref() != reading {
            self.newest = reading.map(<[u8]>::to_vec);
            self.changed = now;
        }
        now.saturating_duration_since(self.changed) >= STANDS_STILL_AFTER
    }
}

impl Collector {
    fn connect(sources: StatusSources, is_live: bool, changed: Sender<Wakeup>) -> Result<Self> {
        let registry = sources.registry.to_string();
        let name = format!("status-{}", std::process::id());
        let directory = Directory::observer(&registry, &name);
        let idle: WakeCallback = Arc::new(|| {});
        let wake: WakeCallback = Arc::new(move || {
            let _ = changed.send(Wakeup::Changed);
        });
        let mission =
            sources.has_mission.then(|| MissionWatch::begin(&directory, wake)).transpose()?;
        // Rates need the status of every process once per second. A log file has no use for them.
        let watch =
            is_live.then(|| SystemWatch::begin(&registry, "status", idle.clone())).transpose()?;
        Ok(Self {
            sources,
            mission,
            progress: WatchedValues::new(directory, idle),
            watch,
            history: RateHistory::default(),
            fallen_rates: Vec::new(),
            measured: Instant::now(),
            time: TimeWatch { newest: None, changed: Instant::now() },
        })
    }

    fn collect(&mut self) -> RunStatus {
        let marking = self.mission.as_ref().and_then(|mission| mission.look().marking);
        if self.measured.elapsed() >= RATES_EVERY {
            self.measured = Instant::now();
            self.fallen_rates = self.measure_rates(marking.as_deref());
        }
        RunStatus {
            standing_clock: self.find_standing_clock(),
            elapsed_s: self.sources.start.elapsed().as_secs_f64(),
            places: marking.as_deref().map(list_places).unwrap_or_default(),
            orders: marking.as_deref().map(list_orders).unwrap_or_default(),
            tasks: self.list_tasks(marking.as_deref()),
            hanging_calls: self.sources.hanging_calls.describe_calls(),
            fallen_rates: self.fallen_rates.clone(),
            restarts: self.sources.restarts.load(Ordering::Relaxed),
        }
    }

    /// The clock of the system, if time stands still.
    fn find_standing_clock(&mut self) -> Option<String> {
        let clock = self.sources.clock.as_ref()?;
        let newest = self.progress.look(clock).data;
        let reading = newest.as_ref().map(|data| data.payload.as_slice());
        self.time.stands_still(reading, Instant::now()).then(|| clock.clone())
    }

    fn measure_rates(&mut self, marking: Option<&Marking>) -> Vec<FallenRate> {
        let Some(watch) = &self.watch else { return Vec::new() };
        let picture = watch.picture();
        // What a component published before it was frozen is still a rate for a while, then zero.
        let has_active_ends = |edge: &&ObservedLink| {
            let mut ends = [&edge.from, &edge.to].into_iter().filter_map(|end| end.split_once('.'));
            ends.all(|(component, _)| is_active(component, marking))
        };
        let is_steady = |edge: &&ObservedLink| !self.sources.latched_outputs.contains(&edge.from);
        let up = picture.links.iter().filter(|edge| edge.connected && !edge.paused);
        let up = up.filter(is_steady);
        let rates = up
            .filter(has_active_ends)
            .filter_map(|edge| Some((format!("{} -> {}", edge.from, edge.to), edge.rate_hz?)));
        self.history.update(rates)
    }

    fn list_tasks(&self, marking: Option<&Marking>) -> Vec<TaskStatus> {
        let outputs = self.sources.progress_outputs.iter();
        outputs
            .filter_map(|output| {
                let (component, _) = output.split_once('.')?;
                // Asked even while it is frozen: a link that is not asked for is closed.
                let newest = self.progress.look(output).data?;
                let progress: Progress = codec::decode(&newest.payload).ok()?;
                let is_shown = !progress.task.is_empty() && is_active(component, marking);
                is_shown.then(|| TaskStatus {
                    component: component.into(),
                    fraction: progress.known_fraction(),
                    task: progress.task,
                    detail: progress.detail,
                })
            })
            .collect()
    }
}

fn list_places(marking: &Marking) -> Vec<String> {
    let marked = marking.places.iter().filter(|place| place.tokens > 0);
    let in_words = |place: &MarkedPlace| match place.tokens {
        1 => place.place.clone(),
        tokens => format!("{} ×{tokens}", place.place),
    };
    marked.map(in_words).collect()
}

/// Returns the questions to the operator, with the command that answers, and who has paused the mission.
fn list_orders(marking: &Marking) -> Vec<String> {
    let paused = marking.pause.iter().map(|pause| format!("paused by {}", pause.by));
    let asked = marking.confirmations.iter().map(|asked| {
        let left = asked.answer_by_at_s.filter(|_| !asked.put_off);
        let left = left.map(|until_s| {
            format!(", {} left", format_duration((until_s - marking.now_at_s).max(0.0)))
        });
        let name = &asked.transition;
        format!("asks: {name}{} (armor mission confirm {name})", left.unwrap_or_default())
    });
    paused.chain(asked).collect()
}

/// Returns whether the mission lets the component run, so that its last progress is of now.
fn is_active(component: &str, marking: Option<&Marking>) -> bool {
    let Some(marking) = marking else { return true };
    let of_mission = marking.components.iter().find(|it| it.component == component);
    of_mission.is_none_or(|it| may_work(it, marking.stage))
}

/// Returns whether a component of the mission can have a task. Under the last place none has that the
/// mission controls, although some are active until they have stopped.
fn may_work(component: &MissionComponent, stage: MarkingStage) -> bool {
    let is_over = stage == MarkingStage::Ending || stage.has_ended();
    let is_active = component.state == MissionComponentState::Active;
    !component.controlled || (is_active && !is_over)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stands_still_without_readings_or_with_the_same_one() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut time = TimeWatch { newest: None, changed: start };
        assert!(!time.stands_still(None, at(4)));
        assert!(time.stands_still(None, at(5)), "it has never begun");
        assert!(!time.stands_still(Some(b"1"), at(6)));
        assert!(!time.stands_still(Some(b"1"), at(10)));
        assert!(time.stands_still(Some(b"1"), at(11)));
        assert!(time.stands_still(None, at(12)), "its source has gone");
        assert!(!time.stands_still(Some(b"2"), at(13)));
    }

    #[test]
    fn a_component_that_the_mission_stops_has_no_task() {
        use MissionComponentState::{Active, Frozen};
        let may = |controlled, state, stage| {
            let (component, values) = ("driver".into(), Vec::new());
            may_work(
                &MissionComponent {
                    component,
                    controlled,
                    state,
                    activation: 1,
                    unheard_reports: 0,
                    values,
                },
                stage,
            )
        };
        assert!(may(true, Active, MarkingStage::Playing));
        assert!(may(true, Active, MarkingStage::Retreating), "its task has not ended");
        assert!(!may(true, Frozen, MarkingStage::Playing));
        assert!(!may(true, Active, MarkingStage::Ending), "its last place is marked");
        assert!(!may(true, Active, MarkingStage::Safe));
        assert!(may(false, Frozen, MarkingStage::Ending), "it is not the mission's");
    }
}
