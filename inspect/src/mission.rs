//! The state of a running mission and its firings, from the marking that the executive publishes at
//! every change.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use armor_marking::{Fired, Marking};
use armor_sdk::directory::Directory;
use armor_sdk::tap::Tap;
use armor_wire::WireType;
use armor_wire::clock::Clock;
use armor_wire::codec;
use armor_wire::keep::Keep;
use parking_lot::Mutex;

use crate::wake::{WakeCallback, spawn_detached};

/// The executive's output, latched and published at every change.
const MARKING: &str = "executive.marking";
/// Only the newest marking matters: it contains the whole state.
const KEEP: Keep = Keep::Latest;
/// How long one attempt waits for a provider.
const PROVIDER_WITHIN: Duration = Duration::from_secs(1);
/// How long to wait for data before checking whether the watch was dropped.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Most firings remembered; older ones are in the journal.
const MAX_FIRED: usize = 10_000;

/// All firings seen, the oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FiringHistory {
    /// The firings.
    pub fired: VecDeque<Fired>,
    /// How many other firings there were, before these or between two markings.
    pub unseen: u64,
    count: u64,
}

impl FiringHistory {
    /// Adds the firings that are new in a marking.
    pub fn add_marking(&mut self, marking: &Marking) {
        if marking.fired < self.count {
            // The count fell: this is another mission.
            *self = Self::default();
        }
        let new = marking.fired - self.count;
        self.count = marking.fired;
        let listed = usize::try_from(new).unwrap_or(usize::MAX).min(marking.history.len());
        self.unseen += new - listed as u64;
        self.fired.extend(marking.history[marking.history.len() - listed..].iter().cloned());
        while self.fired.len() > MAX_FIRED {
            self.fired.pop_front();
            self.unseen += 1;
        }
    }
}

/// The present state of the mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MissionLook {
    /// The executive's last marking; `None` before the first.
    pub marking: Option<Arc<Marking>>,
    /// The firings.
    pub history: Arc<FiringHistory>,
    /// Why no marking arrives; empty if one does.
    pub problem: String,
    /// The last value of the clock that mission time follows, in seconds.
    clock_s: Option<f64>,
}

impl MissionLook {
    /// Returns the state that this marking describes.
    pub fn of(marking: Marking) -> Self {
        let mut look = Self::default();
        Arc::make_mut(&mut look.history).add_marking(&marking);
        look.marking = Some(Arc::new(marking));
        look
    }

    /// Returns the present mission time, in seconds; `timestamp` is system time by the registry's
    /// clock. It is the time in the marking plus the time that has passed since its stamp.
    pub fn now_at_s(&self, timestamp: f64) -> f64 {
        let Some(marking) = &self.marking else { return 0.0 };
        let now_s = if marking.clock.is_empty() { Some(timestamp) } else { self.clock_s };
        // A stamp of 0: the executive has not received the clock yet, so no time has passed.
        let stamp_s = Some(marking.stamp).filter(|stamp_s| *stamp_s > 0.0);
        let age_s = now_s.zip(stamp_s).map_or(0.0, |(now_s, stamp_s)| (now_s - stamp_s).max(0.0));
        marking.now_at_s + if marking.stage.has_ended() { 0.0 } else { age_s }
    }
}

/// Watches the mission of a system until it is dropped: one link to the executive, and one to the
/// clock that mission time follows, if there is one.
pub struct MissionWatch {
    shared: Arc<SharedMission>,
}

struct SharedMission {
    look: Mutex<MissionLook>,
    is_closing: AtomicBool,
    wake: WakeCallback,
}

impl MissionWatch {
    /// Begins to watch; `wake` is called at every change.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(directory: &Directory, wake: WakeCallback) -> io::Result<Self> {
        let shared = Arc::new(SharedMission {
            look: Mutex::default(),
            is_closing: AtomicBool::new(false),
            wake,
        });
        let follower =
            MissionFollower { shared: Arc::clone(&shared), directory: directory.clone() };
        spawn_detached("look-mission", move || follower.follow_marking())?;
        let clock = MissionFollower { shared: Arc::clone(&shared), directory: directory.clone() };
        spawn_detached("look-clock", move || clock.follow_clock())?;
        Ok(Self { shared })
    }

    /// Returns a watch that always shows `look`, without a system: for tests of displays.
    pub fn still(look: MissionLook) -> Self {
        let (look, wake): (_, WakeCallback) = (Mutex::new(look), Arc::new(|| {}));
        Self { shared: Arc::new(SharedMission { look, is_closing: AtomicBool::new(true), wake }) }
    }

    /// Returns the present state of the mission.
    pub fn look(&self) -> MissionLook {
        self.shared.look.lock().clone()
    }

    /// Stops watching; the mission stays as it was last seen.
    pub fn rest(&self) {
        self.shared.is_closing.store(true, Ordering::Relaxed);
    }
}

impl Drop for MissionWatch {
    fn drop(&mut self) {
        self.rest();
    }
}

impl SharedMission {
    fn is_closing(&self) -> bool {
        self.is_closing.load(Ordering::Relaxed)
    }

    /// Reports a problem, and wakes the window if it is a new one.
    fn report_problem(&self, problem: String) {
        let mut look = self.look.lock();
        if look.problem != problem {
            look.problem = problem;
            drop(look);
            (self.wake)();
        }
    }
}

struct MissionFollower {
    shared: Arc<SharedMission>,
    directory: Directory,
}

impl MissionFollower {
    fn follow_marking(self) {
        while !self.shared.is_closing() {
            let problem = match Tap::open(&self.directory, MARKING, KEEP, PROVIDER_WITHIN) {
                Ok(tap) if tap.schema().hash() == Marking::schema().hash() => {
                    self.read_markings(tap)
                }
                Ok(_) => {
                    thread::sleep(PROVIDER_WITHIN);
                    "the executive of this system has another version than this program".into()
                }
                Err(error) => error.to_string(),
            };
            self.shared.report_problem(problem);
            thread::sleep(LOOK_EVERY);
        }
    }

    /// Reads until the link ends, and returns why.
    fn read_markings(&self, mut tap: Tap) -> String {
        while !self.shared.is_closing() {
            let payload = match tap.next(LOOK_EVERY) {
                Ok(Some(data)) => data.payload,
                Ok(None) => continue,
                Err(error) => return error.to_string(),
            };
            match codec::decode::<Marking>(&payload) {
                Ok(marking) => self.show_marking(marking),
                Err(error) => return format!("the marking cannot be read: {error}"),
            }
        }
        String::new()
    }

    fn show_marking(&self, marking: Marking) {
        let mut look = self.shared.look.lock();
        Arc::make_mut(&mut look.history).add_marking(&marking);
        if look.marking.as_ref().is_none_or(|before| before.clock != marking.clock) {
            look.clock_s = None;
        }
        look.marking = Some(Arc::new(marking));
        look.problem.clear();
        drop(look);
        (self.shared.wake)();
    }

    fn follow_clock(self) {
        while !self.shared.is_closing() {
            let clock = self.clock_name();
            if !clock.is_empty()
                && let Ok(tap) = Tap::open(&self.directory, &clock, KEEP, PROVIDER_WITHIN)
                && tap.schema().hash() == Clock::schema().hash()
            {
                self.read_clock(&clock, tap);
            }
            thread::sleep(LOOK_EVERY);
        }
    }

    /// Returns the data that mission time follows; empty if it follows the host's clock.
    fn clock_name(&self) -> String {
        let look = self.shared.look.lock();
        look.marking.as_ref().map(|marking| marking.clock.clone()).unwrap_or_default()
    }

    fn read_clock(&self, clock: &str, mut tap: Tap) {
        while !self.shared.is_closing() && self.clock_name() == clock {
            match tap.next(LOOK_EVERY) {
                Ok(Some(data)) => {
                    let clock = codec::decode(&data.payload).map(|time: Clock| time.clock);
                    self.shared.look.lock().clock_s = clock.ok();
                }
                Ok(None) => {}
                Err(_) => return,
            }
        }
    }
}
