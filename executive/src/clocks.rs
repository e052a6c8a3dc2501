//! The clocks that the executive reads: the host's, and the data that mission time follows.

use crate::hub::ExecutiveInput;
use crate::journal::{self, Anchor, Life, Story};
use crate::time::{ClockReadings, Deadlines, FollowedTime};
use armor_plan::Plan;
use armor_sdk::node::SystemNode;
use armor_sdk::{ClockReading, Passage};
use parking_lot::Mutex;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Duration;

/// Reads both clocks.
pub(crate) struct Clocks {
    life: Life,
    followed: Option<Arc<Mutex<SharedTime>>>,
}

/// The state shared by the executive and the thread that receives the data.
struct SharedTime {
    time: FollowedTime,
    /// The anchor that is not in the journal yet.
    anchor: Option<Anchor>,
    /// The executive has been woken and has not read the time yet: no need to wake it again.
    is_woken: bool,
}

impl Clocks {
    /// Continues the clocks from the end of a journal. Returns the time now.
    pub(crate) fn begin(plan: &Plan, story: &Story) -> (Self, ClockReadings) {
        if plan.clock().is_none() {
            let (life, now) = journal::clock(story, &boot_name(), monotonic_now());
            return (Self { life, followed: None }, now.into());
        }
        let (life, mission) = journal::followed_clock(story, &boot_name(), monotonic_now());
        let time = FollowedTime::new(mission, life.anchor);
        let shared = SharedTime { time, anchor: None, is_woken: false };
        let clocks = Self { life, followed: Some(Arc::new(Mutex::new(shared))) };
        (clocks, ClockReadings { mission, host: Duration::ZERO })
    }

    /// Whether mission time follows data.
    pub(crate) fn follow_data(&self) -> bool {
        self.followed.is_some()
    }

    /// Returns the state of the clocks, for the journal.
    pub(crate) fn life(&self) -> &Life {
        &self.life
    }

    /// Starts to receive the data, if mission time follows any; each reading wakes the executive.
    pub(crate) fn follow(&self, plan: &Plan, node: &SystemNode, inputs: Sender<ExecutiveInput>) {
        let (Some(shared), Some(clock)) = (self.followed.clone(), plan.clock()) else {
            return;
        };
        let busy = node.busy_marker();
        let hear = move |reading: ClockReading, passage: Passage| {
            let mut shared = shared.lock();
            if let Some(anchor) = shared.time.read(reading, passage) {
                shared.anchor = Some(anchor);
            }
            busy.mark();
            if !std::mem::replace(&mut shared.is_woken, true) {
                // The receiver is gone only when the executive is about to end.
                let _ = inputs.send(ExecutiveInput::Time);
            }
        };
        if let Err(error) = node.follow_time(clock, hear) {
            tracing::error!("no thread to follow the time of {clock}: {error}");
        }
    }

    /// Whether there is a reading that has not been looked at.
    pub(crate) fn has_unread_time(&self) -> bool {
        self.followed.as_ref().is_some_and(|shared| shared.lock().is_woken)
    }

    pub(crate) fn now(&self) -> ClockReadings {
        let monotonic = i64::try_from(monotonic_now().as_nanos()).unwrap_or(i64::MAX);
        let host = monotonic.saturating_sub(self.life.zero_ns);
        let host = Duration::from_nanos(u64::try_from(host).unwrap_or(0));
        match &self.followed {
            None => host.into(),
            Some(shared) => ClockReadings { mission: shared.lock().time.now(), host },
        }
    }

    /// Returns how long to wait until the next deadline. Deadlines in mission time that follows
    /// data need no wait: the data wakes the executive.
    pub(crate) fn left(&self, due: Deadlines) -> Option<Duration> {
        let now = self.now();
        let mission = due.mission.filter(|_| self.followed.is_none());
        let left = |due: Duration| due.saturating_sub(now.host);
        mission.into_iter().chain(due.host).map(left).min()
    }

    /// Reads the time that follows data. Returns the life to be written down if the data has jumped
    /// or has another source.
    pub(crate) fn look(&mut self) -> Option<&Life> {
        let mut shared = self.followed.as_ref()?.lock();
        // Under the same lock as the reading: data that arrives later wakes the executive again.
        shared.is_woken = false;
        self.life.anchor = Some(shared.anchor.take()?);
        drop(shared);
        Some(&self.life)
    }
}

fn monotonic_now() -> Duration {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    Duration::try_from(now).unwrap_or_default()
}

/// Names this start of the machine.
fn boot_name() -> String {
    let id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    id.trim().to_owned()
}
