//! What an input that pulls does before each call of `exec`: it takes the newest message from the
//! memory of its link, or asks its publisher for data newer than the last and waits a moment for the
//! answer (docs/protocol.md, Links).

use std::cell::OnceCell;
use std::collections::VecDeque;
use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use armor_wire::frame::{DataHeader, Frame};
use parking_lot::{Condvar, Mutex};

use super::arrivals::ArrivedSequence;
use super::catch_up::CatchUp;
use super::memory_in::{MemoryReader, NO_MEMORY, TakenMessage};
use super::payload::HeldSlot;

/// Until when the inputs of one call are waited for. It begins with the first wait: a pull from memory
/// waits for nothing, and reads no clock.
pub(crate) struct PullDeadline {
    limit: Duration,
    at: OnceCell<Instant>,
}

impl PullDeadline {
    pub fn after(limit: Duration) -> Self {
        Self { limit, at: OnceCell::new() }
    }

    fn get(&self) -> Instant {
        *self.at.get_or_init(|| Instant::now() + self.limit)
    }
}

/// The questions of one input, or the memory that makes them unnecessary. The component's thread asks
/// and takes, the input's thread brings answers and slots.
#[derive(Default)]
pub(crate) struct PullState {
    is_pulling: AtomicBool,
    questions: Mutex<CatchUp>,
    answered: Condvar,
    memory: Mutex<Option<PulledMemory>>,
    /// A slot was offered.
    offered: Condvar,
}

/// The memory of the present link.
struct PulledMemory {
    reader: MemoryReader,
    arrived: ArrivedSequence,
}

/// The newest message of a link with memory.
pub(super) struct PulledMessage {
    pub header: DataHeader,
    pub lost: u64,
    pub slot: HeldSlot,
    /// How many others were taken before it.
    pub passed_over: u64,
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

    /// The link has ended: no answer will come on it, and no message in its memory. What has arrived
    /// by memory is passed back.
    pub(super) fn forget(&self, arrived: &mut ArrivedSequence) {
        *self.questions.lock() = CatchUp::default();
        self.answered.notify_all();
        if let Some(memory) = self.memory.lock().take() {
            *arrived = memory.arrived;
        }
        self.offered.notify_all();
    }

    /// The publisher puts its messages into memory from here on.
    pub(super) fn open_memory(&self, mut reader: MemoryReader, arrived: ArrivedSequence) {
        reader.reserve_slot();
        *self.memory.lock() = Some(PulledMemory { reader, arrived });
    }

    pub fn has_memory(&self) -> bool {
        self.memory.lock().is_some()
    }

    /// Follows a frame about the slots of the memory.
    pub fn follow_slot(
        &self,
        frame: &Frame<'_>,
        files: &mut VecDeque<OwnedFd>,
    ) -> Result<(), String> {
        let mut memory = self.memory.lock();
        memory.as_mut().ok_or(NO_MEMORY)?.reader.follow(frame, files)?;
        self.offered.notify_all();
        Ok(())
    }

    /// Takes the newest message from the memory. `follow` compares it with what has arrived: `None` if
    /// it is not new. Only the offer of its slot, which is on its way in the socket, is waited for.
    pub(super) fn take_from_memory(
        &self,
        deadline: &PullDeadline,
        follow: impl Fn(&mut ArrivedSequence, &DataHeader) -> Option<u64>,
    ) -> Result<Option<PulledMessage>, String> {
        let mut memory = self.memory.lock();
        let mut newest: Option<PulledMessage> = None;
        loop {
            let Some(PulledMemory { reader, arrived }) = memory.as_mut() else { return Ok(newest) };
            match reader.take_message()? {
                TakenMessage::Nothing => return Ok(newest),
                TakenMessage::Message(header, slot) => {
                    let Some(lost) = follow(arrived, &header) else { continue };
                    let passed_over = newest.take().map_or(0, |older| older.passed_over + 1);
                    newest = Some(PulledMessage { header, lost, slot, passed_over });
                    // A publisher that is faster than this loop must not keep it.
                    if passed_over > 0 {
                        return Ok(newest);
                    }
                }
                TakenMessage::OfferAwaited => {
                    if self.offered.wait_until(&mut memory, deadline.get()).timed_out() {
                        return Ok(newest);
                    }
                }
            }
        }
    }

    /// Waits for the answer, and for the data that follow it.
    pub fn wait_until(&self, deadline: &PullDeadline) {
        let mut questions = self.questions.lock();
        while !questions.is_done() {
            if self.answered.wait_until(&mut questions, deadline.get()).timed_out() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_waits_for_the_answer_the_data_or_the_end_of_the_link() {
        let far = || PullDeadline::after(Duration::from_secs(60));
        let pull = PullState::default();
        pull.wait_until(&far());
        pull.ask(|| false);
        pull.wait_until(&far());
        for end in 0..3 {
            pull.ask(|| true);
            pull.wait_until(&PullDeadline::after(Duration::ZERO));
            assert!(!pull.questions.lock().is_done());
            std::thread::scope(|scope| {
                scope.spawn(|| match end {
                    0 => pull.answer(false),
                    1 => {
                        pull.answer(true);
                        pull.receive();
                    }
                    _ => pull.forget(&mut ArrivedSequence::default()),
                });
                pull.wait_until(&far());
            });
            assert!(pull.questions.lock().is_done());
        }
    }
}
