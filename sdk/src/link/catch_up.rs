//! What a subscriber of `keep="latest"` does when the component has been busy: up to then the
//! publisher has filled the socket with data that are old by now. It asks for the newest (`Sync`),
//! and passes over all that comes before the answer (docs/protocol.md, Links).

use armor_wire::frame::DataHeader;

/// The question of one link, and what is still to come. Pure.
#[derive(Debug, Default)]
pub(super) struct CatchUp {
    /// Questions without an answer: one that came late must not count for the next question.
    unanswered: u32,
    /// The newest data follow the answer.
    follows: bool,
}

impl CatchUp {
    /// A question was sent.
    pub fn asked(&mut self) {
        self.unanswered += 1;
        self.follows = false;
    }

    /// An answer arrived; `follows` if the newest data come behind it.
    pub fn answered(&mut self, follows: bool) {
        self.unanswered = self.unanswered.saturating_sub(1);
        self.follows = follows && self.unanswered == 0;
    }

    /// Data arrived.
    pub fn received(&mut self) {
        self.follows &= self.unanswered > 0;
    }

    /// Whether no newer data are on their way than those that have arrived.
    pub fn is_done(&self) -> bool {
        self.unanswered == 0 && !self.follows
    }
}

/// The newest data so far.
pub(super) struct NewestFrame {
    pub header: DataHeader,
    pub lost: u64,
    pub payload: Vec<u8>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_waits_for_what_follows_the_answer_and_for_nothing_after_it() {
        let mut it = CatchUp::default();
        assert!(it.is_done(), "nothing was asked");
        it.asked();
        it.received();
        assert!(!it.is_done());
        it.answered(false);
        assert!(it.is_done());
        it.asked();
        it.answered(true);
        assert!(!it.is_done());
        it.received();
        assert!(it.is_done());
        it.answered(true);
        assert!(!it.is_done(), "an answer without a question is believed");
        it.received();
        assert!(it.is_done());
    }

    #[test]
    fn a_late_answer_is_none_to_the_next_question() {
        let mut it = CatchUp::default();
        it.asked();
        it.asked();
        it.answered(true);
        it.received();
        assert!(!it.is_done());
        it.answered(false);
        assert!(it.is_done());
    }
}
