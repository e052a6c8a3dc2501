//! Messages to the user, shown over the drawing for a few seconds.

use std::time::{Duration, Instant};

/// How long a message is shown.
const SHOWN_FOR: Duration = Duration::from_secs(8);
/// Most messages at a time: more would cover the drawing.
const MAX_SHOWN: usize = 3;

/// What a message reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// Something was done.
    Done,
    /// Something was not done.
    Refused,
}

/// A message to the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShownMessage {
    since: Instant,
    /// What it reports.
    pub kind: MessageKind,
    /// What it states.
    pub text: String,
    /// How many times it came while it was shown.
    pub count: u32,
}

/// The messages, the newest last.
#[derive(Debug, Default)]
pub struct Messages {
    list: Vec<ShownMessage>,
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
    pub fn current(&mut self) -> &[ShownMessage] {
        self.list.retain(|message| message.since.elapsed() < SHOWN_FOR);
        &self.list
    }

    /// Returns the time until the oldest message disappears.
    pub fn next_change(&self) -> Option<Duration> {
        self.list.first().map(|message| SHOWN_FOR.saturating_sub(message.since.elapsed()))
    }

    /// Returns the newest message, also if it is no longer shown.
    pub fn last(&self) -> Option<&str> {
        self.list.last().map(|message| message.text.as_str())
    }

    /// Removes one message.
    pub fn dismiss(&mut self, number: usize) {
        if number < self.list.len() {
            self.list.remove(number);
        }
    }

    /// Adds a message. The same one again is counted; of those that something was done, only the
    /// newest is shown, since it replaces what was done before.
    fn push(&mut self, kind: MessageKind, text: String) {
        self.current();
        let same = self.list.iter().position(|old| old.text == text && old.kind == kind);
        let count = same.map_or(0, |same| self.list.remove(same).count) + 1;
        if kind == MessageKind::Done {
            self.list.retain(|old| old.kind != MessageKind::Done);
        }
        self.list.push(ShownMessage { since: Instant::now(), kind, text, count });
        if self.list.len() > MAX_SHOWN {
            self.list.remove(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(messages: &mut Messages) -> Vec<(String, u32)> {
        messages.current().iter().map(|it| (it.text.clone(), it.count)).collect()
    }

    #[test]
    fn the_same_message_is_counted_and_no_more_than_three_are_shown() {
        let mut messages = Messages::default();
        for text in ["a", "b", "a", "a"] {
            messages.warn(text);
        }
        assert_eq!(texts(&mut messages), [("b".into(), 1), ("a".into(), 3)]);
        for text in ["c", "d"] {
            messages.warn(text);
        }
        assert_eq!(texts(&mut messages), [("a".into(), 3), ("c".into(), 1), ("d".into(), 1)]);
    }

    #[test]
    fn of_what_was_done_only_the_newest_is_shown() {
        let mut messages = Messages::default();
        messages.warn("not saved");
        messages.report("undone: one");
        messages.report("undone: two");
        assert_eq!(texts(&mut messages), [("not saved".into(), 1), ("undone: two".into(), 1)]);
    }
}
