//! The operator's end: orders to the executive, each told until it is answered, once.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use armor_wire::control::{Answer, Command, Order, Role};
use thiserror::Error;

use crate::control::{ControlConnection, ControlEvent};
use crate::directory::{Directory, DirectoryError};
use crate::socket::fresh_instance;

/// The name under which the executive is registered.
const EXECUTIVE: &str = "executive";
/// Between two attempts to reach an executive that is being restarted.
const RETRY: Duration = Duration::from_millis(100);

/// What became of an order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// Whether it is carried out.
    pub accepted: bool,
    /// What follows from it, or why it is refused.
    pub text: String,
}

/// Why it is not known what became of an order.
#[derive(Debug, Error)]
pub enum OrderError {
    /// No executive is registered.
    #[error("no mission runs in this system: {0}")]
    NoExecutive(#[from] DirectoryError),
    /// It does not answer.
    #[error("the executive has not answered within {limit:?}: {why}")]
    NoAnswer {
        /// How long was waited.
        limit: Duration,
        /// What happened last.
        why: String,
    },
}

/// Someone who gives orders to the executive of a system.
pub struct Operator {
    directory: Directory,
    author: String,
    from: String,
    /// Who holds the lease: this process, over all its connections.
    instance: u64,
    connected: Option<Connected>,
}

struct Connected {
    connection: ControlConnection,
    events: Receiver<ControlEvent>,
}

impl Operator {
    /// `author` is the person, such as `ruth@station`; `from` the program they use. Connects with
    /// the first order.
    pub fn new(directory: Directory, from: &str, author: &str) -> Self {
        let (author, from) = (author.to_owned(), from.to_owned());
        Self { directory, author, from, instance: fresh_instance(), connected: None }
    }

    /// Gives an order and waits for what becomes of it. If the executive dies meanwhile the order
    /// is told to the next one; it is carried out once however often it is told.
    ///
    /// # Errors
    /// [`OrderError`] if there is no answer within `limit`; the order may have been carried out.
    pub fn order(
        &mut self,
        take: bool,
        order: &Order,
        limit: Duration,
    ) -> Result<Verdict, OrderError> {
        let request = fresh_instance();
        let start = Instant::now();
        let left = || limit.saturating_sub(start.elapsed());
        let mut why = String::new();
        while !left().is_zero() {
            let author = self.author.clone();
            let command = Command::Order { request, author, take, order: order.clone() };
            match self.tell(&command, request, left()) {
                Ok(verdict) => return Ok(verdict),
                Err(Failure::NoExecutive(error)) => return Err(error.into()),
                Err(Failure::Broken(reason)) => {
                    (self.connected, why) = (None, reason);
                    thread::sleep(RETRY.min(left()));
                }
            }
        }
        Err(OrderError::NoAnswer { limit, why })
    }

    /// Whether the connection to the executive that was made last is still up.
    pub fn is_connected(&mut self) -> bool {
        let ended = self.connected.as_ref().is_none_or(|connected| {
            connected.events.try_iter().any(|event| matches!(event, ControlEvent::Closed(_)))
        });
        if ended {
            self.connected = None;
        }
        !ended
    }

    fn tell(&mut self, order: &Command, request: u64, left: Duration) -> Result<Verdict, Failure> {
        let connected = match self.connected.take() {
            Some(connected) => connected,
            None => self.connect(left)?,
        };
        let broken = |reason: &dyn std::fmt::Display| Failure::Broken(reason.to_string());
        connected.connection.send(order).map_err(|error| broken(&error))?;
        let deadline = Instant::now() + left;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match connected.events.recv_timeout(left) {
                Ok(ControlEvent::Answer(Answer::Ordered { request: answered, accepted, text }))
                    if answered == request =>
                {
                    self.connected = Some(connected);
                    return Ok(Verdict { accepted, text });
                }
                Ok(ControlEvent::Answer(_)) => {}
                Ok(ControlEvent::Closed(reason)) => return Err(Failure::Broken(reason)),
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    return Err(Failure::Broken("it is connected and says nothing".into()));
                }
            }
        }
    }

    fn connect(&self, left: Duration) -> Result<Connected, Failure> {
        let executive = self.directory.component(EXECUTIVE, left).map_err(Failure::NoExecutive)?;
        let (sender, events) = mpsc::channel();
        let sink = move |event| {
            let news = match &event {
                ControlEvent::Answer(answer) => matches!(answer, Answer::Ordered { .. }),
                ControlEvent::Closed(_) => true,
            };
            if news {
                // Nobody listens any more: then nobody waits for it either.
                let _ = sender.send(event);
            }
        };
        let (role, from) = (Role::Operator, self.from.as_str());
        let instance = self.instance;
        let connection = ControlConnection::connect_as(&executive, role, from, instance, sink)
            .map_err(|error| Failure::Broken(error.to_string()))?;
        Ok(Connected { connection, events })
    }
}

enum Failure {
    NoExecutive(DirectoryError),
    Broken(String),
}
