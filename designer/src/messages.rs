//! Messages to the user, shown over the drawing for a few seconds.

use std::time::{Duration, Instant};

/// How long a message is shown.
const SHOWN_FOR: Duration = Duration::from_secs(8);

/// What a message reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// Something was done.
    Done,
    /// Something was not done.
    Refused,
}

/// The messages, the newest last.
#[derive(Debug, Default)]
pub struct Messages {
    list: Vec<(Instant, MessageKind, String)>,
}

impl Messages {
    /// Reports that something was done.
    pub fn report(&mut self, text: impl Into<String>) {
        self.push(MessageKind::Done, text.into());
    }

    /// Reports that something was not done, and why.
    pub fn warn(&mut self, text: impl Into<String>) {
        self.push(MessageKind::Refused, text.into());
    }

    /// Returns the messages that are still shown.
    pub fn current(&mut self) -> &[(Instant, MessageKind, String)] {
        self.list.retain(|(since, ..)| since.elapsed() < SHOWN_FOR);
        &self.list
    }

    /// Returns the time until the oldest message disappears.
    pub fn next_change(&self) -> Option<Duration> {
        self.list.first().map(|(since, ..)| SHOWN_FOR.saturating_sub(since.elapsed()))
    }

    /// Returns the newest message, also if it is no longer shown.
    pub fn last(&self) -> Option<&str> {
        self.list.last().map(|(.., text)| text.as_str())
    }

    /// Removes one message.
    pub fn dismiss(&mut self, number: usize) {
        if number < self.list.len() {
            self.list.remove(number);
        }
    }

    fn push(&mut self, tone: MessageKind, text: String) {
        self.list.retain(|(.., old)| *old != text);
        self.list.push((Instant::now(), tone, text));
        // More would cover the drawing.
        if self.list.len() > 4 {
            self.list.remove(0);
        }
    }
}
