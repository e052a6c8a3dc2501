//! Follows the data that a system's time follows: one thread and one link, kept up for the life of the
//! process. While nobody provides the data, time stands still.

use std::sync::Arc;
use std::time::Duration;

use armor_wire::WireType;
use armor_wire::clock::Clock;
use armor_wire::codec;
use armor_wire::keep::Keep;
use armor_wire::message::Message;

use crate::participant::Participant;
use crate::tap::{Tap, TapError};
use crate::timeline::{Passage, Reading};

/// How long a provider may be missing before that is said: they all start at once.
const PROVIDER_LIMIT: Duration = Duration::from_secs(2);
/// How long to wait for data before looking whether it is all over.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Time between two attempts to link to a provider that the registry knows.
const RETRY: Duration = Duration::from_millis(100);

/// Name under which the link that brings a process its time is seen at the provider.
pub fn time_link(name: &str) -> String {
    format!("{name}:time")
}

/// From now on the time of this process follows `data`; `hear` is told of every reading that means
/// something, in order.
pub(crate) fn start(
    participant: &Arc<Participant>,
    data: &str,
    hear: impl FnMut(Reading, Passage) + Send + 'static,
) -> std::io::Result<()> {
    participant.clock.follow();
    let follower = Follower { participant: Arc::clone(participant), data: data.into(), hear };
    std::thread::Builder::new()
        .name("time".into())
        .stack_size(256 << 10)
        .spawn(move || follower.run())?;
    Ok(())
}

struct Follower<F> {
    participant: Arc<Participant>,
    data: String,
    hear: F,
}

impl<F: FnMut(Reading, Passage)> Follower<F> {
    fn run(mut self) {
        let mut said = String::new();
        while !self.participant.lifecycle.has_left() {
            let problem = match self.link() {
                Ok(tap) => {
                    said.clear();
                    self.follow(tap)
                }
                Err(problem) => problem,
            };
            if !self.participant.lifecycle.has_left() && said != problem {
                tracing::warn!("time stands still, it follows {}: {problem}", self.data);
                said = problem;
            }
            std::thread::sleep(RETRY);
        }
    }

    fn link(&self) -> Result<Tap, String> {
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

    /// Reads until the link ends; why it did.
    fn follow(&mut self, mut tap: Tap) -> String {
        while !self.participant.lifecycle.has_left() {
            match self.read(&mut tap) {
                Ok(()) => {}
                Err(error) => return error.to_string(),
            }
        }
        "this process ends".into()
    }

    fn read(&mut self, tap: &mut Tap) -> Result<(), TapError> {
        let Some(data) = tap.next(LOOK_EVERY)? else { return Ok(()) };
        let said: Clock = codec::decode(&data.payload)
            .map_err(|error| TapError::Ended(format!("it cannot be read: {error}")))?;
        let reading = Reading { stamp_s: said.clock, instance: data.header.instance };
        if let Some(passage) = self.participant.clock.read(reading) {
            if passage == Passage::Jumps {
                tracing::info!("time jumps to {:.3} s, as {} says", said.clock, self.data);
            }
            self.participant.wakers.wake_main();
            (self.hear)(reading, passage);
        }
        Ok(())
    }
}
