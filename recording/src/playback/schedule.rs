//! What is published next, and when: the messages, the readings of the clock between them, and the
//! moments at which the system must have taken what was published. No clock of its own.

use std::collections::BTreeSet;
use std::time::Duration;

use super::pace::{PlaybackPace, PlaybackSpeed};
use super::queue::{MessageSource, PlaybackQueue, QueuedMessage};
use crate::message_stream::ReadError;
use crate::reports::REPORTS;

/// The longest step of the time: ticks of 100 Hz are kept.
const CLOCK_STEP_S: f64 = 0.01;

/// Times that differ by less are the same.
const ROUNDING_S: f64 = 1e-6;

/// The part of a recording that is played, in system time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlayedPart {
    pub from_s: f64,
    pub to_s: f64,
}

/// What is to be done now.
#[derive(Debug, PartialEq)]
pub(crate) enum PlaybackStep {
    /// Publish this time.
    Clock(f64),
    /// Publish this message.
    Message(Box<QueuedMessage>),
    /// Wait until the system has taken everything, and then call [`Schedule::mark_taken`].
    AwaitTaken,
    /// Wait for an order, and no longer than this.
    Wait(Duration),
    /// The part has been played.
    Over,
}

/// See the module.
pub(crate) struct Schedule<S> {
    queue: PlaybackQueue<S>,
    pace: PlaybackPace,
    part: PlayedPart,
    /// Where it begins, or continues after a jump.
    start_s: f64,
    /// The time that was published last; none at the start.
    clock_s: Option<f64>,
    /// Whether time waits for the system.
    is_lossless: bool,
    /// The outputs that components subscribe to.
    followed: BTreeSet<String>,
    /// Nothing that the system must take was published since it had taken everything.
    is_taken: bool,
}

impl<S: MessageSource> Schedule<S> {
    /// Begins at the beginning of the part.
    ///
    /// # Errors
    /// If the recording cannot be read.
    pub fn new(
        mut queue: PlaybackQueue<S>,
        part: PlayedPart,
        pace: PlaybackPace,
        is_lossless: bool,
    ) -> Result<Self, ReadError> {
        queue.seek(part.from_s)?;
        let start_s = part.from_s;
        Ok(Self {
            queue,
            pace,
            part,
            start_s,
            clock_s: None,
            is_lossless,
            followed: BTreeSet::new(),
            is_taken: false,
        })
    }

    pub fn pace(&self) -> &PlaybackPace {
        &self.pace
    }

    pub fn unreadable(&self) -> u64 {
        self.queue.unreadable
    }

    pub fn damaged_chunks(&self) -> u64 {
        self.queue.damaged_chunks()
    }

    /// Returns what is to be done at the moment `now` of the clock.
    ///
    /// # Errors
    /// If the recording cannot be read.
    pub fn next_step(&mut self, now: Duration) -> Result<PlaybackStep, ReadError> {
        let Some(clock_s) = self.clock_s else {
            self.clock_s = Some(self.start_s);
            return Ok(PlaybackStep::Clock(self.start_s));
        };
        let PlayedPart { to_s, .. } = self.part;
        let next = self.queue.peek()?.map(|queued| (queued.due_s, queued.message.data.clone()));
        // A stamp in the summary is rounded to a nanosecond.
        let next = next.filter(|(due_s, _)| *due_s <= to_s + ROUNDING_S);
        if next.is_none() && clock_s >= to_s {
            if self.pace.step_end_s().is_some() {
                self.pace.pause();
            }
            if self.pace.is_paused() {
                return Ok(PlaybackStep::Wait(Duration::MAX));
            }
            let is_over = self.is_taken || !self.is_lossless;
            return Ok(if is_over { PlaybackStep::Over } else { PlaybackStep::AwaitTaken });
        }
        let due_s = next.as_ref().map_or(to_s, |(due_s, _)| *due_s).max(clock_s);
        let step_s = clock_s + CLOCK_STEP_S;
        let moment_s = if due_s <= step_s + ROUNDING_S { due_s } else { step_s };
        let moment_s = moment_s.min(self.pace.step_end_s().unwrap_or(f64::MAX)).max(clock_s);
        match self.pace.time_until(moment_s, now) {
            Some(Duration::ZERO) => {}
            left => return Ok(PlaybackStep::Wait(left.unwrap_or(Duration::MAX))),
        }
        let is_message = due_s <= clock_s;
        // What a component does with a message depends on what it has done before, and on its time.
        let is_awaited = next.as_ref().is_some_and(|(_, data)| {
            !is_message || data == REPORTS || self.followed.contains(data)
        });
        if self.is_lossless && !self.is_taken && (is_awaited || next.is_none()) {
            return Ok(PlaybackStep::AwaitTaken);
        }
        if !is_message {
            (self.clock_s, self.is_taken) = (Some(moment_s), false);
            self.pace.reach(moment_s, now);
            return Ok(PlaybackStep::Clock(moment_s));
        }
        let Some(queued) = self.queue.take() else { return Ok(PlaybackStep::Over) };
        let data = &queued.message.data;
        if data == REPORTS || self.followed.contains(data) {
            self.is_taken = false;
        }
        Ok(PlaybackStep::Message(Box::new(queued)))
    }

    /// Sets the outputs that components subscribe to; only these are waited for.
    pub fn set_followed(&mut self, followed: BTreeSet<String>) {
        self.followed = followed;
    }

    /// Marks that the system has taken everything that was published.
    pub fn mark_taken(&mut self) {
        self.is_taken = true;
    }

    pub fn pause(&mut self) {
        self.pace.pause();
    }

    pub fn resume(&mut self, now: Duration) {
        self.pace.resume(now);
    }

    pub fn set_speed(&mut self, speed: PlaybackSpeed, now: Duration) {
        self.pace.set_speed(speed, now);
    }

    /// Lets this much time pass, in seconds, or with 0 the time up to the next message; then pauses.
    ///
    /// # Errors
    /// If the recording cannot be read.
    pub fn step(&mut self, time_s: f64, now: Duration) -> Result<(), ReadError> {
        let until_s = match self.queue.peek()? {
            _ if time_s > 0.0 => self.pace.reached_s() + time_s,
            Some(next) => next.due_s,
            None => self.part.to_s,
        };
        self.pace.step_until(until_s, now);
        Ok(())
    }

    /// Continues at this moment of the system time, or at the nearest one of the part.
    ///
    /// # Errors
    /// If the recording cannot be read.
    pub fn seek(&mut self, to_s: f64, now: Duration) -> Result<(), ReadError> {
        let to_s = to_s.clamp(self.part.from_s, self.part.to_s);
        self.queue.seek(to_s)?;
        self.pace.jump(to_s, now);
        (self.start_s, self.clock_s) = (to_s, None);
        self.mark_taken();
        Ok(())
    }
}
