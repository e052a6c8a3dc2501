//! How long a sender waits for a subscriber of `keep="all"` that takes nothing. Pure.

use std::time::{Duration, Instant};

use armor_wire::keep::Keep;

/// The patience with one subscriber.
pub(crate) struct Patience {
    limit: Option<Duration>,
    /// When a sender that waits has first seen that nothing is taken.
    stuck_since: Option<Instant>,
}

impl Patience {
    /// That of the policy; only `keep="all"` has any.
    pub fn of(keep: Keep) -> Self {
        let limit = match keep {
            Keep::All { patience_ms } => Some(Duration::from_millis(patience_ms.into())),
            _ => None,
        };
        Self { limit, stuck_since: None }
    }

    /// The subscriber has taken something.
    pub fn restart(&mut self) {
        self.stuck_since = None;
    }

    /// Returns how long the sender has been patient, once that is over.
    pub fn end_at(&mut self, now: Instant) -> Option<Duration> {
        let limit = self.limit?;
        let since = *self.stuck_since.get_or_insert(now);
        (now.duration_since(since) >= limit).then_some(limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_ends_after_the_time_in_which_nothing_was_taken() {
        let (begin, ms) = (Instant::now(), Duration::from_millis);
        let mut patience = Patience::of(Keep::All { patience_ms: 200 });
        assert_eq!(patience.end_at(begin), None);
        assert_eq!(patience.end_at(begin + ms(199)), None);
        patience.restart();
        assert_eq!(patience.end_at(begin + ms(300)), None);
        assert_eq!(patience.end_at(begin + ms(499)), None);
        assert_eq!(patience.end_at(begin + ms(500)), Some(ms(200)));
        assert_eq!(Patience::of(Keep::Latest).end_at(begin + ms(100_000)), None);
    }
}
