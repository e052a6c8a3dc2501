//! What an input that pulls has asked for: before each call of `exec` it asks its publisher for data
//! newer than the last, and waits a moment for the answer (docs/protocol.md, Links).

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use parking_lot::{Condvar, Mutex};

use super::catch_up::CatchUp;

/// The questions of one input. The component's thread asks, the input's thread brings the answer.
#[derive(Default)]
pub(crate) struct PullState {
    is_pulling: AtomicBool,
    questions: Mutex<CatchUp>,
    answered: Condvar,
}

impl PullState {
    pub fn set_pulling(&self, is_pulling: bool) {
        self.is_pulling.store(is_pulling, Ordering::Relaxed);
    }

    pub fn is_pulling(&self) -> bool {
        self.is_pulling.load(Ordering::Relaxed)
    }

    /// Counts a question, if `send` has sent it.
    pub fn ask(&self, send: impl FnOnce() -> bool) {
        // Locked first: the answer may be here before `send` returns.
        let mut questions = self.questions.lock();
        if send() {
            questions.asked();
        }
    }

    /// The publisher has answered; `follows` if data come behind the answer.
    pub fn answer(&self, follows: bool) {
        self.questions.lock().answered(follows);
        self.answered.notify_all();
    }

    /// Data have come, and can be taken.
    pub fn receive(&self) {
        self.questions.lock().received();
        self.answered.notify_all();
    }

    /// The link has ended: no answer will come on it.
    pub fn forget(&self) {
        *self.questions.lock() = CatchUp::default();
        self.answered.notify_all();
    }

    /// Waits for the answer, and for the data that follow it.
    pub fn wait_until(&self, deadline: Instant) {
        let mut questions = self.questions.lock();
        while !questions.is_done() {
            if self.answered.wait_until(&mut questions, deadline).timed_out() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn it_waits_for_the_answer_the_data_or_the_end_of_the_link() {
        let far = || Instant::now() + Duration::from_secs(60);
        let pull = PullState::default();
        pull.wait_until(far());
        pull.ask(|| false);
        pull.wait_until(far());
        for end in 0..3 {
            pull.ask(|| true);
            let past = Instant::now();
            pull.wait_until(past);
            assert!(!pull.questions.lock().is_done());
            std::thread::scope(|scope| {
                scope.spawn(|| match end {
                    0 => pull.answer(false),
                    1 => {
                        pull.answer(true);
                        pull.receive();
                    }
                    _ => pull.forget(),
                });
                pull.wait_until(far());
            });
            assert!(pull.questions.lock().is_done());
        }
    }
}
