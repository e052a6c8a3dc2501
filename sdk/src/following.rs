//! Follows the data that set the system's time: one thread and one link, kept up for the life of
//! the process. While the data have no provider, time stands still.

use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_wire::WireType;
use armor_wire::clock::Clock;
use armor_wire::codec;
use armor_wire::keep::Keep;
use armor_wire::message::Message;

use crate::background_thread::spawn_background;
use crate::participant::Participant;
use crate::tap::{Tap, TapError};
use crate::timeline::{ClockReading, Passage};

/// How long a provider may be missing before a warning: all processes of a system start together.
const PROVIDER_LIMIT: Duration = Duration::from_secs(2);
/// How long to wait for data before checking whether the process ends.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Time between two attempts to link to a provider that the registry knows.
const RETRY: Duration = Duration::from_millis(100);

/// Returns the name under which the provider sees the link that brings the time to process `name`.
pub fn time_link(name: &str) -> String {
    format!("{name}:time")
}

/// Lets the time of this process follow `data` from now on. Calls `on_reading` for every reading by
/// which time begins, passes or jumps, in order.
pub(crate) fn start_following(
    participant: &Arc<Participant>,
    data: &str,
    on_reading: impl FnMut(ClockReading, Passage) + Send + 'static,
) -> std::io::Result<()> {
    participant.clock.follow_readings();
    let follower =
        ClockFollower { participant: Arc::clone(participant), data: data.into(), on_reading };
    spawn_background("time", move || follower.stay_linked())
}

struct ClockFollower<F> {
    participant: Arc<Participant>,
    data: String,
    on_reading: F,
}

impl<F: FnMut(ClockReading, Passage)> ClockFollower<F> {
    fn stay_linked(mut self) {
        let mut reported = String::new();
        let mut ended: Option<(String, Instant)> = None;
        while !self.participant.lifecycle.has_left() {
            match self.open_link() {
                // The provider may be back soon, or the whole system ends: the next attempt to open
                // the link shows it.
                Ok(tap) => {
                    reported.clear();
                    ended = Some((self.read_link(tap), Instant::now()));
                }
                Err(problem) => {
                    let is_new =
                        ended.as_ref().is_some_and(|(_, at)| at.elapsed() < PROVIDER_LIMIT);
                    if !is_new && !self.participant.lifecycle.has_left() && reported != problem {
                        let before = ended.take().map(|(why, _)| format!(" (the link: {why})"));
                        let before = before.unwrap_or_default();
                        tracing::warn!(
                            "time stands still, it follows {}: {problem}{before}",
                            self.data
                        );
                        reported = problem;
                    }
                }
            }
            std::thread::sleep(RETRY);
        }
    }

    fn open_link(&self) -> Result<Tap, String> {
        let identity = &self.participant.identity;
        let from = (time_link(&identity.name), identity.instance);
        let directory = self.participant.directory();
        let tap = Tap::open_from(directory, &self.data, from, Keep::Latest, PROVIDER_LIMIT)
            .map_err(|error| error.to_string())?;
        if tap.schema().to_string() == Clock::schema().to_string() {
            return Ok(tap);
        }
        Err(format!("it is a {}, and time follows a {}", tap.type_name(), Clock::NAME))
    }

    /// Reads until the link ends. Returns why it did.
    fn read_link(&mut self, mut tap: Tap) -> String {
        while !self.participant.lifecycle.has_left() {
            match self.read_next(&mut tap) {
                Ok(()) => {}
                Err(error) => return error.to_string(),
            }
        }
        "this process ends".into()
    }

    fn read_next(&mut self, tap: &mut Tap) -> Result<(), TapError> {
        let Some(data) = tap.next(LOOK_EVERY)? else { return Ok(()) };
        let message: Clock = codec::decode(&data.payload)
            .map_err(|error| TapError::Ended(format!("it cannot be read: {error}")))?;
        let reading = ClockReading { stamp_s: message.clock, instance: data.header.instance };
        if let Some(passage) = self.participant.clock.apply_reading(reading) {
            if passage == Passage::Jumps {
                tracing::info!("time jumps to {:.3} s, set by {}", message.clock, self.data);
            }
            self.participant.wakers.wake_main();
            (self.on_reading)(reading, passage);
        }
        Ok(())
    }
}
