//! Orders of operators, handed to the process that takes them, and its answers handed back.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Mutex, MutexGuard, PoisonError};

use armor_wire::control::{Answer, Order};

/// Most orders that wait for their answers: people give few, and each is written to a disk.
const MAX_WAITING: usize = 64;

/// What comes from the connections of operators.
#[derive(Clone, Debug, PartialEq)]
pub enum OrderEvent {
    /// An order; it wants an answer.
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
    /// The process that sends it, in words: its name, and where it is if not on this host.
    pub from: String,
    /// The start of that process.
    pub instance: u64,
    /// Names the order.
    pub request: u64,
    /// Who gives it.
    pub author: String,
    /// Whether to take the command over.
    pub take: bool,
    /// What is to be done.
    pub order: Order,
}

/// Between the connections and whoever takes orders.
#[derive(Default)]
pub(crate) struct OrderDesk {
    taker: Mutex<Option<Sender<OrderEvent>>>,
    answers: Mutex<VecDeque<(u64, Answer)>>,
    waiting: AtomicUsize,
}

impl OrderDesk {
    /// From now on orders are taken here.
    pub fn take(&self) -> Receiver<OrderEvent> {
        let (sender, receiver) = mpsc::channel();
        *lock(&self.taker) = Some(sender);
        receiver
    }

    /// Hands an order on; an answer comes back at once if nobody takes it.
    pub fn give(&self, order: GivenOrder) -> Option<Answer> {
        let request = order.request;
        let refused =
            |text: &str| Some(Answer::Ordered { request, accepted: false, text: text.into() });
        if self.waiting.load(Ordering::Relaxed) >= MAX_WAITING {
            return refused("too many orders wait for their answers; try again");
        }
        let taker = lock(&self.taker);
        let Some(taker) = &*taker else {
            return refused("this process takes no orders; the executive does");
        };
        if taker.send(OrderEvent::Given(order)).is_err() {
            return refused("the mission is over");
        }
        self.waiting.fetch_add(1, Ordering::Relaxed);
        None
    }

    /// A connection has ended.
    pub fn closed(&self, connection: u64) {
        if let Some(taker) = &*lock(&self.taker) {
            let _ = taker.send(OrderEvent::Closed { connection });
        }
    }

    pub fn answer(&self, connection: u64, answer: Answer) {
        if !matches!(answer, Answer::Ordered { request: 0, .. }) {
            // What nobody asked for is no answer that was waited for.
            self.waiting.fetch_sub(1, Ordering::Relaxed);
        }
        lock(&self.answers).push_back((connection, answer));
    }

    pub fn next_answer(&self) -> Option<(u64, Answer)> {
        lock(&self.answers).pop_front()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
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
    fn orders_are_handed_on_up_to_a_bound_and_refused_where_nobody_takes_them() {
        let orders = OrderDesk::default();
        assert!(is_refused(orders.give(order(1)), "no orders"));
        let taken = orders.take();
        for request in 0..MAX_WAITING as u64 {
            assert_eq!(orders.give(order(request)), None);
        }
        assert!(is_refused(orders.give(order(99)), "too many"));
        let unasked = Answer::Ordered { request: 0, accepted: false, text: String::new() };
        orders.answer(1, unasked.clone());
        assert_eq!(orders.next_answer(), Some((1, unasked)));
        assert!(is_refused(orders.give(order(99)), "too many"), "it answers no order");
        let answer = Answer::Ordered { request: 7, accepted: true, text: String::new() };
        orders.answer(1, answer.clone());
        assert_eq!(orders.next_answer(), Some((1, answer)));
        assert_eq!(orders.give(order(99)), None);
        orders.closed(1);
        assert_eq!(taken.try_iter().count(), MAX_WAITING + 2);
        drop(taken);
        let answer = Answer::Ordered { request: 1, accepted: true, text: String::new() };
        orders.answer(1, answer);
        assert!(is_refused(orders.give(order(100)), "over"));
    }
}
