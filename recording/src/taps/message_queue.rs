//! The messages that wait to be written, from all outputs, within a limit of memory.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use armor_sdk::tap::TapPayload;
use armor_wire::clock::Clock;
use armor_wire::codec;
use parking_lot::{Condvar, Mutex};

use crate::head::MessageHead;
use crate::reports::REPORTS;
use crate::writer::OutputType;

/// Most bytes that wait to be written: more than a second of 200 MB/s. Beyond it nothing is read, and
/// publishers drop.
const MAX_WAITING: usize = 256 << 20;
/// Time after which a thread that waits for room checks whether it must end.
const LOOK: Duration = Duration::from_millis(100);

/// A message of an output.
#[derive(Clone, Debug, PartialEq)]
pub struct TappedMessage {
    /// The output.
    pub data: String,
    /// Its type.
    pub output_type: Arc<OutputType>,
    /// Sequence, stamp and publisher.
    pub head: MessageHead,
    /// Its bytes, perhaps still in the memory of its publisher.
    pub payload: TapPayload,
}

/// See the module.
#[derive(Default)]
pub(super) struct MessageQueue {
    /// The data that system time follows.
    clock: Option<String>,
    state: Mutex<QueueState>,
    arrived: Condvar,
    room: Condvar,
    is_ended: AtomicBool,
}

#[derive(Default)]
struct QueueState {
    messages: VecDeque<TappedMessage>,
    waiting_bytes: usize,
    /// Outputs whose link has ended: they are tapped again when the registry lists them.
    ended: Vec<String>,
    /// Of each output, the last message so far: its publisher and its number.
    last: BTreeMap<String, (u64, u64)>,
    /// The last reading of the data that system time follows.
    clock_s: f64,
}

impl MessageQueue {
    /// An empty one. `clock` is the data that system time follows, if it follows any.
    pub fn new(clock: Option<String>) -> Self {
        Self { clock, ..Self::default() }
    }

    /// Takes a message, waiting for it until `deadline`.
    pub fn take(&self, deadline: Instant) -> Option<TappedMessage> {
        let mut state = self.state.lock();
        loop {
            if let Some(message) = state.messages.pop_front() {
                state.waiting_bytes -= message.payload.len();
                self.room.notify_one();
                return Some(message);
            }
            if self.arrived.wait_until(&mut state, deadline).timed_out() {
                return None;
            }
        }
    }

    /// Adds messages of outputs, which the caller has read because there was [room](Self::has_room).
    pub fn push_all(&self, messages: Vec<TappedMessage>) {
        if messages.is_empty() || self.is_ended() {
            return;
        }
        let mut state = self.state.lock();
        messages.into_iter().for_each(|message| state.push(message, self.clock.as_deref()));
        self.arrived.notify_one();
    }

    /// Adds a message of the recorder itself, without waiting.
    pub fn push_own(&self, message: TappedMessage) {
        if self.is_ended() {
            return;
        }
        let mut state = self.state.lock();
        state.waiting_bytes += message.payload.len();
        state.messages.push_back(message);
        self.arrived.notify_one();
    }

    /// Whether more may be read.
    pub fn has_room(&self) -> bool {
        self.state.lock().has_room()
    }

    /// Waits until there is room, or nothing more is taken.
    pub fn await_room(&self) {
        let mut state = self.state.lock();
        while !state.has_room() && !self.is_ended() {
            self.room.wait_for(&mut state, LOOK);
        }
    }

    /// Takes no more messages.
    pub fn end(&self) {
        self.is_ended.store(true, Ordering::Relaxed);
        self.room.notify_all();
    }

    /// Whether it takes no more messages.
    pub fn is_ended(&self) -> bool {
        self.is_ended.load(Ordering::Relaxed)
    }

    /// Notes that the link of an output has ended.
    pub fn add_ended(&self, data: String) {
        self.state.lock().ended.push(data);
    }

    /// The outputs whose link has ended since the last call.
    pub fn take_ended(&self) -> Vec<String> {
        std::mem::take(&mut self.state.lock().ended)
    }

    /// The last reading of the data that system time follows; `None` if it follows none.
    pub fn clock_s(&self) -> Option<f64> {
        self.clock.as_ref().map(|_| self.state.lock().clock_s)
    }
}

impl QueueState {
    fn has_room(&self) -> bool {
        self.waiting_bytes <= MAX_WAITING
    }

    fn push(&mut self, mut message: TappedMessage, clock: Option<&str>) {
        let MessageHead { instance, sequence, .. } = message.head;
        match self.last.get_mut(&message.data) {
            // Their numbers are those of their components.
            _ if message.data == REPORTS => {}
            // A latched value is sent again at the start of each link.
            Some((same, last)) if *same == instance && sequence <= *last => return,
            Some(before) => {
                // What was published between two links counts, too.
                if before.0 == instance {
                    message.head.lost = sequence - before.1 - 1;
                }
                *before = (instance, sequence);
            }
            None => {
                self.last.insert(message.data.clone(), (instance, sequence));
            }
        }
        if clock == Some(message.data.as_str())
            && let Ok(reading) = codec::decode::<Clock>(&message.payload)
        {
            self.clock_s = reading.clock;
        }
        self.waiting_bytes += message.payload.len();
        self.messages.push_back(message);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_between_two_links_is_lost_and_what_comes_again_is_left_out() {
        let queue = MessageQueue::default();
        let message = |(instance, sequence): (u64, u64)| TappedMessage {
            data: "a.x".into(),
            output_type: Arc::default(),
            head: MessageHead { instance, sequence, ..MessageHead::default() },
            payload: Vec::new().into(),
        };
        queue.push_all([(1, 5), (1, 6), (1, 6)].map(message).into());
        queue.push_all([(1, 9), (2, 4), (2, 5)].map(message).into());
        queue.end();
        queue.push_all(vec![message((2, 6))]);
        let heads = std::mem::take(&mut queue.state.lock().messages);
        let heads: Vec<_> = heads.iter().map(|it| (it.head.sequence, it.head.lost)).collect();
        assert_eq!(heads, [(5, 0), (6, 0), (9, 2), (4, 0), (5, 0)]);
    }
}
