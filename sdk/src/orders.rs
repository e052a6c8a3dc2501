//! Passes orders of operators to the process that carries them out, and its answers back; counts the
//! orders that are repeated.

mod repeats;

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};

use armor_wire::control::{Answer, Order};
use parking_lot::Mutex;

pub use repeats::{MAX_REPEATED, Repeats};

/// Most orders that wait for their answers: people send few, and each is written to the disk.
const MAX_WAITING: usize = 64;

/// An event on a connection of an operator.
#[derive(Clone, Debug, PartialEq)]
pub enum OrderEvent {
    /// An order; it needs an answer.
    Given(GivenOrder),
    /// A connection has ended: closed, broken, or silent for too long.
    Closed {
        /// Which.
        connection: u64,
    },
}

/// An order as it arrived.
#[derive(Clone, Debug, PartialEq)]
pub struct GivenOrder {
    /// The connection it came on, counted in this process.
    pub connection: u64,
    /// The process that sends it, in words: its name, and its address if it is not on this host.
    pub from: String,
    /// The start of that process.
    pub instance: u64,
    /// Identifies the order.
    pub request: u64,
    /// The person who gives it.
    pub author: String,
    /// Whether to take the command over first.
    pub take: bool,
    /// The order.
    pub order: Order,
}

/// Stands between the connections and the thread that carries out orders.
#[derive(Default)]
pub(crate) struct OrderInbox {
    taker: Mutex<OrderTaker>,
    answers: Mutex<VecDeque<(u64, Answer)>>,
    waiting: AtomicUsize,
}

/// Where orders go.
#[derive(Default)]
enum OrderTaker {
    /// They are refused.
    #[default]
    None,
    /// They wait until they are accepted: an executive that is being started again can be reached
    /// before it has read its journal, and an operator who returns then must not be refused.
    Awaited(Vec<OrderEvent>),
    Accepted(Sender<OrderEvent>),
}

impl OrderInbox {
    /// An inbox whose orders wait until they are accepted.
    pub fn awaiting_taker() -> Self {
        Self { taker: Mutex::new(OrderTaker::Awaited(Vec::new())), ..Self::default() }
    }

    /// Accepts orders from now on. Returns where they arrive.
    pub fn accept_orders(&self) -> Receiver<OrderEvent> {
        let (sender, receiver) = mpsc::channel();
        let mut taker = self.taker.lock();
        if let OrderTaker::Awaited(early) = std::mem::take(&mut *taker) {
            // The receiver is here, so none of them is lost; the lock keeps their order.
            early.into_iter().for_each(|event| drop(sender.send(event)));
        }
        *taker = OrderTaker::Accepted(sender);
        drop(taker);
        receiver
    }

    /// Passes an order on. Returns an answer if it is refused immediately.
    pub fn submit_order(&self, order: GivenOrder) -> Option<Answer> {
        let request = order.request;
        let refused =
            |text: &str| Some(Answer::Ordered { request, accepted: false, text: text.into() });
        if self.waiting.load(Ordering::Relaxed) >= MAX_WAITING {
            return refused("too many orders wait for their answers; try again");
        }
        match &mut *self.taker.lock() {
            OrderTaker::None => {
                return refused("this process takes no orders; the executive does");
            }
            OrderTaker::Awaited(early) => early.push(OrderEvent::Given(order)),
            OrderTaker::Accepted(taker) => {
                if taker.send(OrderEvent::Given(order)).is_err() {
                    return refused("the mission is over");
                }
            }
        }
        self.waiting.fetch_add(1, Ordering::Relaxed);
        None
    }

    /// A connection has ended.
    pub fn report_closed(&self, connection: u64) {
        match &mut *self.taker.lock() {
            OrderTaker::None => {}
            // An order of it that waits must not make its operator the holder.
            OrderTaker::Awaited(early) => {
                let is_its = |event: &OrderEvent| match event {
                    OrderEvent::Given(order) => order.connection == connection,
                    OrderEvent::Closed { .. } => false,
                };
                let before = early.len();
                early.retain(|event| !is_its(event));
                self.waiting.fetch_sub(before - early.len(), Ordering::Relaxed);
            }
            OrderTaker::Accepted(taker) => {
                let _ = taker.send(OrderEvent::Closed { connection });
            }
        }
    }

    pub fn queue_answer(&self, connection: u64, answer: Answer) {
        // Request 0 is a message that answers no order.
        if !matches!(answer, Answer::Ordered { request: 0, .. }) {
            self.waiting.fetch_sub(1, Ordering::Relaxed);
        }
        self.answers.lock().push_back((connection, answer));
    }

    pub fn take_answer(&self) -> Option<(u64, Answer)> {
        self.answers.lock().pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(request: u64) -> GivenOrder {
        let (author, from) = ("ruth".to_owned(), "tool-1".to_owned());
        let order = Order::Pause;
        GivenOrder { connection: 1, from, instance: 7, request, author, take: false, order }
    }

    fn is_refused(answer: Option<Answer>, why: &str) -> bool {
        matches!(answer, Some(Answer::Ordered { accepted: false, text, .. }) if text.contains(why))
    }

    #[test]
    fn early_orders_wait_until_they_are_accepted_unless_their_connection_ends() {
        let orders = OrderInbox::awaiting_taker();
        let of = |connection, request| GivenOrder { connection, ..order(request) };
        for (connection, request) in [(1, 10), (2, 20), (1, 11)] {
            assert_eq!(orders.submit_order(of(connection, request)), None);
        }
        orders.report_closed(2);
        let taken = orders.accept_orders();
        assert_eq!(orders.submit_order(of(3, 30)), None);
        let given = taken.try_iter().map(|event| match event {
            OrderEvent::Given(order) => order.request,
            OrderEvent::Closed { .. } => panic!("it was closed before"),
        });
        assert_eq!(given.collect::<Vec<_>>(), [10, 11, 30]);
        assert_eq!(orders.waiting.load(Ordering::Relaxed), 3);
    }

    #[test]
    fn orders_are_passed_on_up_to_a_limit_and_refused_where_none_are_accepted() {
        let orders = OrderInbox::default();
        assert!(is_refused(orders.submit_order(order(1)), "no orders"));
        let taken = orders.accept_orders();
        for request in 0..MAX_WAITING as u64 {
            assert_eq!(orders.submit_order(order(request)), None);
        }
        assert!(is_refused(orders.submit_order(order(99)), "too many"));
        let unasked = Answer::Ordered { request: 0, accepted: false, text: String::new() };
        orders.queue_answer(1, unasked.clone());
        assert_eq!(orders.take_answer(), Some((1, unasked)));
        assert!(is_refused(orders.submit_order(order(99)), "too many"), "it answers no order");
        let answer = Answer::Ordered { request: 7, accepted: true, text: String::new() };
        orders.queue_answer(1, answer.clone());
        assert_eq!(orders.take_answer(), Some((1, answer)));
        assert_eq!(orders.submit_order(order(99)), None);
        orders.report_closed(1);
        assert_eq!(taken.try_iter().count(), MAX_WAITING + 2);
        drop(taken);
        let answer = Answer::Ordered { request: 1, accepted: true, text: String::new() };
        orders.queue_answer(1, answer);
        assert!(is_refused(orders.submit_order(order(100)), "over"));
    }
}
