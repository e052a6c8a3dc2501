//! Orders that wait for the executive: how long each may wait, and which of them are not sent.
//!
//! They wait while the executive hangs. An order that lets the robot move is dangerous if it arrives
//! late: the person who gave it may look elsewhere. It is sent only while its client waits for the
//! answer, and not after STOP was ordered. STOP is harmless if it arrives late and dangerous if it is
//! lost, so it is sent even if its client has left, and no other order takes its place or its time.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use armor_sdk::control::Order;
use armor_sdk::operator::OrderVerdict;
use axum::http::StatusCode;
use tokio::sync::oneshot;

use crate::failure::WebFailure;

/// Longest time from an order to its answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// The same for an order that releases STOP. It is shorter, so that STOP behind it has time left.
const RELEASE_WITHIN: Duration = Duration::from_secs(3);
/// Orders that wait; more means that the executive does not answer.
const MAX_WAITING: usize = 16;

/// An order and its client, which waits for the answer.
pub(crate) struct WaitingOrder {
    /// Who gives it; none: the user of the system.
    pub(crate) author: Option<String>,
    /// Whether it takes the command over from its holder.
    pub(crate) take: bool,
    pub(crate) order: Order,
    pub(crate) reply: oneshot::Sender<Result<OrderVerdict, WebFailure>>,
}

/// Orders in the order in which they were given, each with its deadline.
#[derive(Default)]
pub(crate) struct OrderQueue {
    waiting: VecDeque<(WaitingOrder, Instant)>,
}

impl OrderQueue {
    /// Adds an order. STOP removes the orders that would release it: they were given before.
    ///
    /// # Errors
    /// If too many wait.
    pub(crate) fn push(&mut self, order: WaitingOrder, now: Instant) -> Result<(), WebFailure> {
        if brings_to_rest(&order.order) {
            self.remove_releases();
        }
        if self.waiting.len() >= MAX_WAITING {
            return Err(fail_order(
                StatusCode::BAD_GATEWAY,
                format!("{MAX_WAITING} orders wait for an answer"),
            ));
        }
        let limit = if order.order == Order::Resume { RELEASE_WITHIN } else { ANSWER_WITHIN };
        self.waiting.push_back((order, now + limit));
        Ok(())
    }

    /// Takes the next order that is to be sent, and returns it with the time that is left for its answer.
    pub(crate) fn take_next(&mut self, now: Instant) -> Option<(WaitingOrder, Duration)> {
        while let Some((order, deadline)) = self.waiting.pop_front() {
            let left = deadline.saturating_duration_since(now);
            if left.is_zero() {
                let what = "the order was not sent: the executive has not answered those before it";
                // Fails if the client has left, which then needs no answer.
                let _ = order.reply.send(Err(fail_order(StatusCode::GATEWAY_TIMEOUT, what)));
            } else if brings_to_rest(&order.order) || !order.reply.is_closed() {
                return Some((order, left));
            }
        }
        None
    }

    fn remove_releases(&mut self) {
        let (releases, others): (VecDeque<_>, _) =
            self.waiting.drain(..).partition(|(waiting, _)| waiting.order == Order::Resume);
        self.waiting = others;
        for (release, _) in releases {
            let what = "the order was not sent: STOP or a pause was ordered after it";
            let remedy = "order it again when the robot may move";
            let failure = WebFailure::new(StatusCode::CONFLICT, what, "the mission", remedy);
            let _ = release.reply.send(Err(failure));
        }
    }
}

/// Returns the failure of an order whose result is not known, or that was not sent.
pub(crate) fn fail_order(status: StatusCode, what: impl Into<String>) -> WebFailure {
    let remedy = "see with `armor ps` whether the executive answers, and try again";
    WebFailure::new(status, what, "the mission", remedy)
}

fn brings_to_rest(order: &Order) -> bool {
    matches!(order, Order::Pause | Order::Safe)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Answer = oneshot::Receiver<Result<OrderVerdict, WebFailure>>;

    struct Scene {
        queue: OrderQueue,
        begin: Instant,
    }

    impl Scene {
        fn begin() -> Self {
            Self { queue: OrderQueue::default(), begin: Instant::now() }
        }

        fn at(&self, passed_s: f64) -> Instant {
            self.begin + Duration::from_secs_f64(passed_s)
        }

        fn push(&mut self, passed_s: f64, order: Order) -> Result<Answer, WebFailure> {
            let (reply, answer) = oneshot::channel();
            let waiting = WaitingOrder { author: None, take: false, order, reply };
            self.queue.push(waiting, self.at(passed_s)).map(|()| answer)
        }

        /// Takes the next order, as its name and the seconds that are left.
        fn take(&mut self, passed_s: f64) -> Option<(Order, f64)> {
            let taken = self.queue.take_next(self.at(passed_s));
            taken.map(|(waiting, left)| (waiting.order, (left.as_secs_f64() * 10.0).round() / 10.0))
        }
    }

    fn status(answer: &mut Answer) -> Option<u64> {
        let failure = answer.try_recv().ok()?.err()?;
        failure.to_json()["error"]["status"].as_u64()
    }

    #[test]
    fn an_order_that_has_waited_for_its_time_is_answered_and_not_sent() {
        let mut scene = Scene::begin();
        let fire = Order::Fire { transition: "leave".into() };
        let orders = [Order::Pause, Order::Resume, fire.clone(), Order::Pause];
        let mut answers = orders.map(|order| scene.push(0.0, order).expect("a place"));
        assert_eq!(scene.take(1.0), Some((Order::Pause, 4.0)));
        let _late = scene.push(4.0, Order::Pause);
        assert_eq!(scene.take(4.5), Some((fire, 0.5)), "the release was removed");
        assert_eq!(scene.take(5.0), Some((Order::Pause, 4.0)), "the newest");
        assert_eq!(scene.take(5.0), None);
        let statuses = answers.each_mut().map(status);
        assert_eq!(statuses, [None, Some(409), None, Some(504)]);
    }

    #[test]
    fn a_release_waits_shorter_than_stop() {
        let mut scene = Scene::begin();
        let _first = scene.push(0.0, Order::Resume).expect("a place");
        let mut second = scene.push(0.0, Order::Resume).expect("a place");
        assert_eq!(scene.take(0.0), Some((Order::Resume, 3.0)));
        assert_eq!(scene.take(3.0), None);
        assert_eq!(status(&mut second), Some(504));
    }

    #[test]
    fn of_the_orders_of_clients_that_have_left_only_stop_is_sent() {
        let mut scene = Scene::begin();
        for order in [Order::Pause, Order::Resume, Order::Confirm { transition: "leave".into() }] {
            drop(scene.push(0.0, order).expect("a place"));
        }
        assert_eq!(scene.take(0.1), Some((Order::Pause, 4.9)));
        assert_eq!(scene.take(0.1), None);
    }

    #[test]
    fn stop_removes_the_releases_before_it_and_takes_their_places() {
        let mut scene = Scene::begin();
        let release = |_| scene.push(0.0, Order::Resume).expect("a place");
        let mut releases: Vec<_> = (0..MAX_WAITING).map(release).collect();
        assert!(scene.push(0.1, Order::Resume).is_err(), "too many");
        let _stop = scene.push(0.2, Order::Pause).expect("a place");
        let _later = scene.push(0.3, Order::Resume).expect("a place");
        assert!(releases.iter_mut().all(|answer| status(answer) == Some(409)));
        assert_eq!(scene.take(0.4), Some((Order::Pause, 4.8)));
        assert_eq!(scene.take(0.4), Some((Order::Resume, 2.9)), "it was given after STOP");
    }
}
