//! Which data have arrived on the links of an input, and how many are missing. Pure.

use armor_wire::frame::DataHeader;

/// The last data that arrived.
#[derive(Clone, Copy, Debug)]
struct LastArrival {
    instance: u64,
    sequence: u64,
}

/// The sequence of an input's data, over all links that it has had.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ArrivedSequence {
    last: Option<LastArrival>,
    /// Data have come on the present link.
    has_begun: bool,
}

impl ArrivedSequence {
    /// A new link begins.
    pub fn begin_link(&mut self) {
        self.has_begun = false;
    }

    /// Compares with the data so far: how many are missing before these, or `None` if they have been
    /// received before. `was_paused` if the component has been frozen since the last.
    pub fn follow(&mut self, header: &DataHeader, was_paused: bool) -> Option<u64> {
        let is_first = !std::mem::replace(&mut self.has_begun, true);
        let lost = match self.last {
            // A link never begins before the end of the one before: that one's last number was
            // false, as a damaged one is, and must not hold up what is true.
            Some(last) if is_first && header.sequence < last.sequence => 0,
            Some(last) if last.instance == header.instance => {
                // A latched value is sent again at the start of each link.
                if header.sequence <= last.sequence {
                    return None;
                }
                // The first data of every link is marked fresh, but after a reconnect a gap before
                // it is a loss.
                let is_intended = was_paused || (header.fresh && !is_first);
                if is_intended { 0 } else { header.sequence - last.sequence - 1 }
            }
            _ => 0,
        };
        self.last = Some(LastArrival { instance: header.instance, sequence: header.sequence });
        Some(lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(instance: u64, sequence: u64, fresh: bool) -> DataHeader {
        DataHeader { sequence, stamp_s: 0.0, instance, fresh }
    }

    #[test]
    fn a_gap_is_a_loss_unless_it_is_intended() {
        let mut it = ArrivedSequence::default();
        it.begin_link();
        assert_eq!(
            it.follow(&header(1, 5, true), false),
            Some(0),
            "what came before was another's"
        );
        assert_eq!(it.follow(&header(1, 6, false), false), Some(0));
        assert_eq!(it.follow(&header(1, 9, false), false), Some(2));
        assert_eq!(it.follow(&header(1, 12, true), false), Some(0), "it has resumed");
        assert_eq!(it.follow(&header(1, 15, false), true), Some(0), "it was frozen");
        it.begin_link();
        assert_eq!(it.follow(&header(1, 15, true), false), None, "it came on the link before");
        assert_eq!(it.follow(&header(1, 18, true), false), Some(0));
        it.begin_link();
        assert_eq!(it.follow(&header(1, 20, true), false), Some(1), "lost between two links");
        it.begin_link();
        assert_eq!(it.follow(&header(1, 3, true), false), Some(0), "the number before was false");
        assert_eq!(it.follow(&header(2, 1, false), false), Some(0), "another process publishes");
    }
}
