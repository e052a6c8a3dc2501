//! The operator's end: orders to the executive. Each is sent until it is answered, and carried out
//! once.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use armor_socket::random_id;
use armor_wire::control::{Answer, Command, Order, Role};
use armor_wire::hello::Refusal;
use thiserror::Error;

use crate::control::{ControlConnection, ControlEvent};
use crate::directory::{Directory, DirectoryError};

/// The name under which the executive is registered.
pub(crate) const EXECUTIVE: &str = "executive";
/// Between two attempts to reach an executive that is being restarted.
const RETRY: Duration = Duration::from_millis(100);

/// The executive's answer to an order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OrderVerdict {
    /// Whether it is carried out.
    pub accepted: bool,
    /// What follows from it, or why it is refused.
    pub text: String,
}

/// Why the result of an order is unknown.
#[derive(Debug, Error)]
pub enum OrderError {
    /// No executive is registered.
    #[error("no mission runs in this system: {0}")]
    NoExecutive(Refusal),
    /// The registry does not answer, so it is unknown whether an executive is registered.
    #[error(transparent)]
    NoRegistry(DirectoryError),
    /// It does not answer.
    #[error("the executive has not answered within {limit:.1?}: {why}")]
    NoAnswer {
        /// The time waited.
        limit: Duration,
        /// What happened last.
        why: String,
    },
    /// This operator had the command and has lost it; the order was not sent.
    #[error("the command is lost: {0}")]
    Lost(String),
}

/// Sends the orders of one person to the executive of a system.
pub struct Operator {
    directory: Directory,
    author: String,
    from: String,
    /// The holder of the lease: this process start, over all its connections.
    instance: u64,
    connected: Option<ExecutiveConnection>,
    /// Whether it has been granted the command and not been informed of the end of that.
    holds: bool,
    /// Why it has lost the command.
    lost: Option<String>,
}

struct ExecutiveConnection {
    connection: ControlConnection,
    events: Receiver<ControlEvent>,
}

impl Operator {
    /// An operator that is not connected yet; it connects with the first order. `author` is the
    /// person, such as `ruth@station`; `from` is the program.
    pub fn new(directory: Directory, from: &str, author: &str) -> Self {
        let (author, from) = (author.to_owned(), from.to_owned());
        let instance = random_id();
        Self { directory, author, from, instance, connected: None, holds: false, lost: None }
    }

    /// Sends an order and waits for the answer. If the executive dies meanwhile, the order is sent
    /// to the next one; it is carried out once, however many times it is sent. An operator that has
    /// the command of a mission sends the order to that mission and to no other.
    ///
    /// # Errors
    /// [`OrderError`] if there is no answer within `limit`, when the order may have been carried
    /// out; or if the command is lost.
    pub fn order(
        &mut self,
        take: bool,
        order: &Order,
        limit: Duration,
    ) -> Result<OrderVerdict, OrderError> {
        let request = random_id();
        let start = Instant::now();
        let left = || limit.saturating_sub(start.elapsed());
        let mut why = String::new();
        while !left().is_zero() {
            let author = self.author.clone();
            let command = Command::Order { request, author, take, order: order.clone() };
            match self.try_order(&command, request, left()) {
                Ok(verdict) => {
                    self.record_answer(order, &verdict);
                    return Ok(verdict);
                }
                Err(OrderFailure::Directory(DirectoryError::Refused(refusal))) => {
                    return Err(OrderError::NoExecutive(refusal));
                }
                Err(OrderFailure::Directory(error)) => return Err(OrderError::NoRegistry(error)),
                Err(OrderFailure::Lost(why)) => return Err(OrderError::Lost(why)),
                Err(OrderFailure::Broken(reason)) => {
                    (self.connected, why) = (None, reason);
                    thread::sleep(RETRY.min(left()));
                }
            }
        }
        Err(OrderError::NoAnswer { limit, why })
    }

    /// Whether the connection to the executive that was made last is still up.
    pub fn is_connected(&mut self) -> bool {
        let Some(connected) = self.connected.take() else { return false };
        for event in connected.events.try_iter() {
            match event {
                ControlEvent::Closed(_) => return false,
                ControlEvent::Answer(answer) => self.handle_answer(answer),
            }
        }
        self.connected = Some(connected);
        true
    }

    /// Why it has lost the command, as far as the executive has reported; [`Self::is_connected`]
    /// reads these reports.
    pub fn lost(&self) -> Option<&str> {
        self.lost.as_deref()
    }

    fn record_answer(&mut self, order: &Order, verdict: &OrderVerdict) {
        match order {
            Order::Lease if verdict.accepted => (self.holds, self.lost) = (true, None),
            Order::Release if verdict.accepted => self.holds = false,
            Order::Rejoin if !verdict.accepted => self.set_lost(verdict.text.clone()),
            _ => {}
        }
    }

    /// Handles an answer that was not asked for: another operator has taken the command over.
    fn handle_answer(&mut self, answer: Answer) {
        if let Answer::Ordered { request: 0, text, .. } = answer {
            self.set_lost(text);
        }
    }

    fn set_lost(&mut self, why: String) {
        if std::mem::take(&mut self.holds) {
            self.lost = Some(why);
        }
    }

    fn try_order(
        &mut self,
        order: &Command,
        request: u64,
        left: Duration,
    ) -> Result<OrderVerdict, OrderFailure> {
        let connected = match self.connected.take() {
            Some(connected) => connected,
            None => {
                let connected = self.connect_executive(left)?;
                self.rejoin_mission(connected, order, left)?
            }
        };
        let (verdict, connected) = self.exchange_order(connected, order, request, left)?;
        self.connected = Some(connected);
        Ok(verdict)
    }

    /// An operator that has the command claims it on a new connection before anything else: another
    /// mission may be played there by now.
    fn rejoin_mission(
        &mut self,
        connected: ExecutiveConnection,
        first: &Command,
        left: Duration,
    ) -> Result<ExecutiveConnection, OrderFailure> {
        let about_it = |order: &Order| matches!(order, Order::Lease | Order::Rejoin);
        if !self.holds || matches!(first, Command::Order { order, .. } if about_it(order)) {
            return Ok(connected);
        }
        let (request, author) = (random_id(), self.author.clone());
        let command = Command::Order { request, author, take: false, order: Order::Rejoin };
        let (verdict, connected) = self.exchange_order(connected, &command, request, left)?;
        if verdict.accepted {
            return Ok(connected);
        }
        self.set_lost(verdict.text.clone());
        Err(OrderFailure::Lost(verdict.text))
    }

    fn exchange_order(
        &mut self,
        connected: ExecutiveConnection,
        order: &Command,
        request: u64,
        left: Duration,
    ) -> Result<(OrderVerdict, ExecutiveConnection), OrderFailure> {
        let broken = |reason: &dyn std::fmt::Display| OrderFailure::Broken(reason.to_string());
        connected.connection.send(order).map_err(|error| broken(&error))?;
        let deadline = Instant::now() + left;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match connected.events.recv_timeout(left) {
                Ok(ControlEvent::Answer(Answer::Ordered { request: answered, accepted, text }))
                    if answered == request =>
                {
                    return Ok((OrderVerdict { accepted, text }, connected));
                }
                Ok(ControlEvent::Answer(answer)) => self.handle_answer(answer),
                Ok(ControlEvent::Closed(reason)) => return Err(OrderFailure::Broken(reason)),
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    return Err(OrderFailure::Broken("it is connected and does not answer".into()));
                }
            }
        }
    }

    fn connect_executive(&self, left: Duration) -> Result<ExecutiveConnection, OrderFailure> {
        let executive =
            self.directory.find_process(EXECUTIVE, left).map_err(OrderFailure::Directory)?;
        let (sender, events) = mpsc::channel();
        let sink = move |event| {
            let news = match &event {
                ControlEvent::Answer(answer) => matches!(answer, Answer::Ordered { .. }),
                ControlEvent::Closed(_) => true,
            };
            if news {
                // Fails if the operator is gone, which then needs no answer.
                let _ = sender.send(event);
            }
        };
        let (role, from) = (Role::Operator, self.from.as_str());
        let instance = self.instance;
        let connection = ControlConnection::connect_as(&executive, role, from, instance, sink)
            .map_err(|error| OrderFailure::Broken(error.to_string()))?;
        Ok(ExecutiveConnection { connection, events })
    }
}

enum OrderFailure {
    Directory(DirectoryError),
    Broken(String),
    Lost(String),
}
