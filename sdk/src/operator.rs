//! The operator's end: orders to the executive, each told until it is answered, once.

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
    NoExecutive(Refusal),
    /// The registry says nothing, so that nobody knows whether one is.
    #[error(transparent)]
    NoRegistry(DirectoryError),
    /// It does not answer.
    #[error("the executive has not answered within {limit:.1?}: {why}")]
    NoAnswer {
        /// How long was waited.
        limit: Duration,
        /// What happened last.
        why: String,
    },
    /// The command was this one's and is not any more; the order was not given.
    #[error("the command is lost: {0}")]
    Lost(String),
}

/// Someone who gives orders to the executive of a system.
pub struct Operator {
    directory: Directory,
    author: String,
    from: String,
    /// Who holds the lease: this process, over all its connections.
    instance: u64,
    connected: Option<Connected>,
    /// Whether the command was given to it, and it has heard of nothing that ended that.
    holds: bool,
    /// Why the command that it held is lost.
    lost: Option<String>,
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
        let instance = random_id();
        Self { directory, author, from, instance, connected: None, holds: false, lost: None }
    }

    /// Gives an order and waits for what becomes of it. If the executive dies meanwhile the order
    /// is told to the next one; it is carried out once however often it is told. Who holds the
    /// command gives it to the mission that they hold it of, and to no other.
    ///
    /// # Errors
    /// [`OrderError`] if there is no answer within `limit`, when the order may have been carried
    /// out; or if the command is lost.
    pub fn order(
        &mut self,
        take: bool,
        order: &Order,
        limit: Duration,
    ) -> Result<Verdict, OrderError> {
        let request = random_id();
        let start = Instant::now();
        let left = || limit.saturating_sub(start.elapsed());
        let mut why = String::new();
        while !left().is_zero() {
            let author = self.author.clone();
            let command = Command::Order { request, author, take, order: order.clone() };
            match self.tell(&command, request, left()) {
                Ok(verdict) => {
                    self.note(order, &verdict);
                    return Ok(verdict);
                }
                Err(Failure::Directory(DirectoryError::Refused(refusal))) => {
                    return Err(OrderError::NoExecutive(refusal));
                }
                Err(Failure::Directory(error)) => return Err(OrderError::NoRegistry(error)),
                Err(Failure::Lost(why)) => return Err(OrderError::Lost(why)),
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
        let Some(connected) = self.connected.take() else { return false };
        for event in connected.events.try_iter() {
            match event {
                ControlEvent::Closed(_) => return false,
                ControlEvent::Answer(answer) => self.hear(answer),
            }
        }
        self.connected = Some(connected);
        true
    }

    /// Why the command that it held is not its own any more, as far as it has been told;
    /// [`Self::is_connected`] listens.
    pub fn lost(&self) -> Option<&str> {
        self.lost.as_deref()
    }

    fn note(&mut self, order: &Order, verdict: &Verdict) {
        match order {
            Order::Lease if verdict.accepted => (self.holds, self.lost) = (true, None),
            Order::Release if verdict.accepted => self.holds = false,
            Order::Rejoin if !verdict.accepted => self.is_lost(verdict.text.clone()),
            _ => {}
        }
    }

    /// What nobody asked for: somebody has taken the command over.
    fn hear(&mut self, answer: Answer) {
        if let Answer::Ordered { request: 0, text, .. } = answer {
            self.is_lost(text);
        }
    }

    fn is_lost(&mut self, why: String) {
        if std::mem::take(&mut self.holds) {
            self.lost = Some(why);
        }
    }

    fn tell(&mut self, order: &Command, request: u64, left: Duration) -> Result<Verdict, Failure> {
        let connected = match self.connected.take() {
            Some(connected) => connected,
            None => {
                let connected = self.connect(left)?;
                self.rejoin(connected, order, left)?
            }
        };
        let (verdict, connected) = self.exchange(connected, order, request, left)?;
        self.connected = Some(connected);
        Ok(verdict)
    }

    /// Who holds the command says so on a new connection before anything else: what is played there
    /// may be another mission.
    fn rejoin(
        &mut self,
        connected: Connected,
        first: &Command,
        left: Duration,
    ) -> Result<Connected, Failure> {
        let about_it = |order: &Order| matches!(order, Order::Lease | Order::Rejoin);
        if !self.holds || matches!(first, Command::Order { order, .. } if about_it(order)) {
            return Ok(connected);
        }
        let (request, author) = (random_id(), self.author.clone());
        let command = Command::Order { request, author, take: false, order: Order::Rejoin };
        let (verdict, connected) = self.exchange(connected, &command, request, left)?;
        if verdict.accepted {
            return Ok(connected);
        }
        self.is_lost(verdict.text.clone());
        Err(Failure::Lost(verdict.text))
    }

    fn exchange(
        &mut self,
        connected: Connected,
        order: &Command,
        request: u64,
        left: Duration,
    ) -> Result<(Verdict, Connected), Failure> {
        let broken = |reason: &dyn std::fmt::Display| Failure::Broken(reason.to_string());
        connected.connection.send(order).map_err(|error| broken(&error))?;
        let deadline = Instant::now() + left;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match connected.events.recv_timeout(left) {
                Ok(ControlEvent::Answer(Answer::Ordered { request: answered, accepted, text }))
                    if answered == request =>
                {
                    return Ok((Verdict { accepted, text }, connected));
                }
                Ok(ControlEvent::Answer(answer)) => self.hear(answer),
                Ok(ControlEvent::Closed(reason)) => return Err(Failure::Broken(reason)),
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    return Err(Failure::Broken("it is connected and says nothing".into()));
                }
            }
        }
    }

    fn connect(&self, left: Duration) -> Result<Connected, Failure> {
        let executive = self.directory.component(EXECUTIVE, left).map_err(Failure::Directory)?;
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
    Directory(DirectoryError),
    Broken(String),
    Lost(String),
}
