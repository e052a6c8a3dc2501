//! What waits for one client: a bounded queue, so that a client that reads nothing costs the robot
//! neither time nor memory. Its own messages are dropped and counted.
//!
//! When too many bytes wait, the oldest message of the topic that has the most of them is dropped:
//! images make room, and the odometry next to them arrives. Of a latched topic only the newest value
//! waits, and it is never dropped, since no other would follow.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::Notify;

use crate::viewer_protocol::compose_data;

/// Most bytes of data that wait for a client: a raw image of 640 × 480 takes 0.9 MB. A single message
/// may be longer.
const MAX_WAITING_BYTES: usize = 4 << 20;
/// Most messages that wait for a client.
const MAX_WAITING: usize = 1024;
/// Most bytes of answers that wait for a client: it has requested each of them.
const MAX_ANSWER_BYTES: usize = 16 << 20;

/// A message of the robot, encoded once for all clients.
#[derive(Debug, PartialEq)]
pub(crate) struct ViewerSample {
    /// System time at which it arrived here.
    pub(crate) stamp_ns: u64,
    /// Its bytes in CDR.
    pub(crate) payload: Vec<u8>,
}

/// What is sent next.
#[derive(Debug, PartialEq)]
pub(crate) enum OutgoingMessage {
    Text(String),
    Binary(Vec<u8>),
}

/// The numbers of one client.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct OutboxCounts {
    /// Messages given to the client's connection.
    pub(crate) sent: u64,
    /// Messages dropped because the client read too slowly.
    pub(crate) dropped: u64,
    /// Bytes of data that wait.
    pub(crate) waiting_bytes: usize,
}

/// The queue of one client.
#[derive(Default)]
pub(crate) struct ViewerOutbox {
    state: Mutex<WaitingMessages>,
    arrived: Notify,
}

#[derive(Default)]
struct WaitingMessages {
    answers: VecDeque<OutgoingMessage>,
    answer_bytes: usize,
    topics: BTreeMap<u32, WaitingTopic>,
    /// Numbers the messages in the order in which they arrived.
    arrivals: u64,
    waiting: usize,
    counts: OutboxCounts,
    /// The client has not taken the answers to its own requests.
    is_overrun: bool,
}

/// The messages of one subscription.
#[derive(Default)]
struct WaitingTopic {
    messages: VecDeque<(u64, Arc<ViewerSample>)>,
    bytes: usize,
    is_latched: bool,
}

impl ViewerOutbox {
    /// Puts a message of the robot into the queue.
    pub(crate) fn push_sample(
        &self,
        subscription: u32,
        is_latched: bool,
        sample: &Arc<ViewerSample>,
    ) {
        let mut state = self.state.lock();
        state.arrivals += 1;
        let (arrival, len) = (state.arrivals, sample.payload.len());
        let topic = state.topics.entry(subscription).or_default();
        topic.is_latched = is_latched;
        let replaced = if is_latched { topic.messages.pop_front() } else { None };
        topic.messages.push_back((arrival, Arc::clone(sample)));
        topic.bytes += len;
        if let Some((_, replaced)) = replaced {
            topic.bytes -= replaced.payload.len();
            state.counts.waiting_bytes -= replaced.payload.len();
            state.waiting -= 1;
            state.counts.dropped += 1;
        }
        state.counts.waiting_bytes += len;
        state.waiting += 1;
        state.make_room();
        drop(state);
        self.arrived.notify_one();
    }

    /// Puts an answer or an announcement into the queue; it goes before all data.
    pub(crate) fn push_answer(&self, answer: OutgoingMessage) {
        let mut state = self.state.lock();
        state.answer_bytes += answer.len();
        if state.answer_bytes > MAX_ANSWER_BYTES {
            state.is_overrun = true;
        } else {
            state.answers.push_back(answer);
        }
        drop(state);
        self.arrived.notify_one();
    }

    /// Forgets a subscription and what waits for it.
    pub(crate) fn forget_subscription(&self, subscription: u32) {
        let mut state = self.state.lock();
        if let Some(topic) = state.topics.remove(&subscription) {
            state.counts.waiting_bytes -= topic.bytes;
            state.waiting -= topic.messages.len();
        }
    }

    /// Returns the next message, and the time of its arrival if it is data; waits for one. `None`:
    /// the client must be disconnected, since it takes no answers.
    pub(crate) async fn take(&self) -> Option<(OutgoingMessage, Option<u64>)> {
        loop {
            {
                let mut state = self.state.lock();
                if state.is_overrun {
                    return None;
                }
                if let Some(next) = state.take_next() {
                    return Some(next);
                }
            }
            self.arrived.notified().await;
        }
    }

    /// Returns its numbers.
    pub(crate) fn counts(&self) -> OutboxCounts {
        self.state.lock().counts
    }
}

impl WaitingMessages {
    fn make_room(&mut self) {
        while self.waiting > 1
            && (self.counts.waiting_bytes > MAX_WAITING_BYTES || self.waiting > MAX_WAITING)
        {
            let is_bytes = self.counts.waiting_bytes > MAX_WAITING_BYTES;
            let droppable =
                self.topics.values_mut().filter(|it| !it.is_latched && !it.messages.is_empty());
            let longest =
                droppable.max_by_key(|it| if is_bytes { it.bytes } else { it.messages.len() });
            let Some(topic) = longest else { return };
            if let Some((_, oldest)) = topic.messages.pop_front() {
                let len = oldest.payload.len();
                topic.bytes -= len;
                self.counts.waiting_bytes -= len;
                self.waiting -= 1;
                self.counts.dropped += 1;
            }
        }
    }

    fn take_next(&mut self) -> Option<(OutgoingMessage, Option<u64>)> {
        if let Some(answer) = self.answers.pop_front() {
            self.answer_bytes -= answer.len();
            return Some((answer, None));
        }
        let arrival = |topic: &WaitingTopic| topic.messages.front().map(|(arrival, _)| *arrival);
        let waiting = self.topics.iter_mut().filter(|(_, topic)| !topic.messages.is_empty());
        let (subscription, topic) = waiting.min_by_key(|(_, topic)| arrival(topic))?;
        let (_, sample) = topic.messages.pop_front()?;
        topic.bytes -= sample.payload.len();
        let frame = compose_data(*subscription, sample.stamp_ns, &sample.payload);
        self.counts.waiting_bytes -= sample.payload.len();
        self.waiting -= 1;
        self.counts.sent += 1;
        Some((OutgoingMessage::Binary(frame), Some(sample.stamp_ns)))
    }
}

impl OutgoingMessage {
    fn len(&self) -> usize {
        match self {
            Self::Text(text) => text.len(),
            Self::Binary(bytes) => bytes.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(stamp_ns: u64, len: usize) -> Arc<ViewerSample> {
        Arc::new(ViewerSample { stamp_ns, payload: vec![0; len] })
    }

    /// The subscriptions and stamps of everything that waits.
    fn drain(outbox: &ViewerOutbox) -> Vec<(u32, u64)> {
        let mut all = Vec::new();
        while let Some((outgoing, Some(stamp_ns))) = outbox.state.lock().take_next() {
            let OutgoingMessage::Binary(frame) = outgoing else { panic!("no data") };
            all.push((u32::from_le_bytes([frame[1], frame[2], frame[3], frame[4]]), stamp_ns));
        }
        all
    }

    #[test]
    fn messages_leave_in_the_order_of_their_arrival_and_answers_first() {
        let outbox = ViewerOutbox::default();
        outbox.push_sample(5, false, &sample(1, 10));
        outbox.push_sample(2, false, &sample(2, 10));
        outbox.push_sample(5, false, &sample(3, 10));
        outbox.push_answer(OutgoingMessage::Text("hello".into()));
        let first = outbox.state.lock().take_next();
        assert_eq!(first, Some((OutgoingMessage::Text("hello".into()), None)));
        assert_eq!(drain(&outbox), [(5, 1), (2, 2), (5, 3)]);
        assert_eq!(outbox.counts(), OutboxCounts { sent: 3, ..OutboxCounts::default() });
    }

    #[test]
    fn the_topic_with_most_bytes_makes_room_for_the_others() {
        let outbox = ViewerOutbox::default();
        for stamp in 0..100 {
            outbox.push_sample(1, false, &sample(stamp, 1 << 20));
            outbox.push_sample(2, false, &sample(stamp, 100));
        }
        let counts = outbox.counts();
        assert!(counts.waiting_bytes <= MAX_WAITING_BYTES, "{counts:?}");
        let left = drain(&outbox);
        assert_eq!(left.iter().filter(|(topic, _)| *topic == 2).count(), 100, "none is dropped");
        let images: Vec<_> = left.iter().filter(|(topic, _)| *topic == 1).collect();
        assert_eq!(images.last(), Some(&&(1, 99)), "the newest stays");
        assert_eq!(counts.dropped as usize, 100 - images.len());
    }

    #[test]
    fn no_more_than_a_number_of_small_messages_waits() {
        let outbox = ViewerOutbox::default();
        for stamp in 0..10_000 {
            outbox.push_sample(1, false, &sample(stamp, 1));
        }
        assert_eq!(outbox.counts().dropped, 10_000 - MAX_WAITING as u64);
        assert_eq!(drain(&outbox).len(), MAX_WAITING);
    }

    #[test]
    fn of_a_latched_topic_the_newest_value_waits_and_is_never_dropped() {
        let outbox = ViewerOutbox::default();
        outbox.push_sample(7, true, &sample(1, 3 << 20));
        outbox.push_sample(7, true, &sample(2, 3 << 20));
        for stamp in 3..20 {
            outbox.push_sample(1, false, &sample(stamp, 1 << 20));
        }
        let left = drain(&outbox);
        assert!(left.contains(&(7, 2)) && !left.contains(&(7, 1)), "{left:?}");
        assert!(left.contains(&(1, 19)), "{left:?}");
    }

    #[test]
    fn a_single_message_may_be_longer_than_the_limit() {
        let outbox = ViewerOutbox::default();
        outbox.push_sample(1, false, &sample(1, 2 * MAX_WAITING_BYTES));
        assert_eq!(drain(&outbox), [(1, 1)]);
    }

    #[test]
    fn what_waits_for_a_subscription_ends_with_it() {
        let outbox = ViewerOutbox::default();
        outbox.push_sample(1, false, &sample(1, 10));
        outbox.push_sample(2, false, &sample(2, 10));
        outbox.forget_subscription(1);
        assert_eq!(outbox.counts().waiting_bytes, 10);
        assert_eq!(drain(&outbox), [(2, 2)]);
    }

    #[tokio::test]
    async fn a_client_that_takes_no_answers_is_given_up() {
        let outbox = ViewerOutbox::default();
        for _ in 0..=(MAX_ANSWER_BYTES >> 20) {
            outbox.push_answer(OutgoingMessage::Text("x".repeat(1 << 20)));
        }
        assert_eq!(outbox.take().await, None);
    }
}
