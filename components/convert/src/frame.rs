//! The epoch of a map frame: `map` is the first one of a run, `map#3f2a` a later one, whose origin
//! is another place. Coordinates of one epoch mean nothing in another.

/// Separates the name of a frame (REP-105) from its epoch.
const SEPARATOR: char = '#';

/// Returns the epoch in the name of a frame; empty for the first one of a run, and for a frame
/// whose origin never changes.
pub fn read_epoch(frame: &str) -> &str {
    frame.split_once(SEPARATOR).map_or("", |(_, epoch)| epoch)
}

/// Returns the name of a frame without its epoch.
pub(crate) fn read_name(frame: &str) -> &str {
    frame.split_once(SEPARATOR).map_or(frame, |(name, _)| name)
}

/// Makes the name of a frame in an epoch.
pub fn build_frame(name: &str, epoch: &str) -> String {
    if epoch.is_empty() { name.into() } else { format!("{name}{SEPARATOR}{epoch}") }
}

/// What a pose or a map shows about the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameNews {
    /// It is of the epoch that is known.
    Same,
    /// It is the first one: what came before it may be of another epoch.
    First,
    /// It is of another epoch: whatever was known in the map frame is of no more use.
    Changed,
}

/// The frame that the newest pose or map is in.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameWatch {
    frame: Option<String>,
    has_changed: bool,
}

impl FrameWatch {
    /// Takes the frame of a pose or a map.
    pub fn frame_seen(&mut self, frame: &str) -> FrameNews {
        let news = match &self.frame {
            None => FrameNews::First,
            Some(known) if read_epoch(known) == read_epoch(frame) => FrameNews::Same,
            Some(_) => FrameNews::Changed,
        };
        if news == FrameNews::Changed {
            self.has_changed = true;
        }
        if self.frame.as_deref() != Some(frame) {
            self.frame = Some(frame.into());
        }
        news
    }

    /// Returns the frame of the newest pose or map.
    pub fn frame(&self) -> Option<&str> {
        self.frame.as_deref()
    }

    /// Returns whether something in `frame` can be used together with the newest pose or map. As
    /// long as neither is known, anything can.
    pub fn is_usable(&self, frame: &str) -> bool {
        self.frame.as_deref().is_none_or(|known| read_epoch(known) == read_epoch(frame))
    }

    /// Returns whether the epoch has changed since the last call.
    pub fn take_change(&mut self) -> bool {
        std::mem::take(&mut self.has_changed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_epoch_of_a_frame_is_its_plain_name() {
        assert_eq!((build_frame("map", ""), read_epoch("map")), ("map".into(), ""));
        assert_eq!(build_frame("map", "3f2a"), "map#3f2a");
        assert_eq!((read_epoch("map#3f2a"), read_epoch("")), ("3f2a", ""));
    }

    #[test]
    fn another_epoch_is_a_change_and_another_name_is_none() {
        let mut watch = FrameWatch::default();
        assert!(watch.is_usable("map#3f2a"), "nothing is known yet");
        let seen: Vec<_> = ["map", "", "map#1", "map#1", "map#2", "map"]
            .map(|frame| (watch.frame_seen(frame), watch.take_change()))
            .into();
        use FrameNews::{Changed, First, Same};
        let expected = [First, Same, Changed, Same, Changed, Changed];
        assert_eq!(seen, expected.map(|news| (news, news == Changed)));
        assert!(watch.is_usable("odom") && !watch.is_usable("map#2"));
        assert_eq!(watch.frame(), Some("map"));
    }
}
