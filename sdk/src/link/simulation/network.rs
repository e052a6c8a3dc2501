//! The queue of the simulation: what arrives where and when, by the seed.

use std::collections::BTreeMap;
use std::time::Duration;

use armor_wire::hello::Hello;
use armor_wire::registry::{RegistryReply, RegistryRequest};

/// Ports on which publishers listen: so few that each is soon another one's.
const PORTS: [u16; 3] = [4001, 4002, 4003];
/// Longest delay of a delivery, without and with a fault, in milliseconds.
const DELAY_MS: u64 = 3;
const LONG_DELAY_MS: u64 = 400;
/// How long deliveries are slow.
const SLOW_FOR: Duration = Duration::from_millis(600);
/// Bytes on their way to a subscriber, beyond which its socket takes no more.
const WINDOW_LEN: usize = 160;

/// A connection, in the order in which they are made.
pub type ConnectionId = u64;

/// An end of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    Client,
    Server,
}

/// What arrives at one end.
#[derive(Clone, Debug)]
pub enum Delivery {
    /// The request to connect.
    Dialled {
        port: u16,
    },
    /// Bytes of a link.
    Bytes(Vec<u8>),
    ToRegistry(ToRegistry),
    FromRegistry(FromRegistry),
    /// The other end has closed it, or it was reset.
    Closed,
}

#[derive(Clone, Debug)]
pub enum ToRegistry {
    Hello(Hello),
    Request(RegistryRequest),
    Beat,
}

#[derive(Clone, Debug)]
pub enum FromRegistry {
    Welcome,
    Refusal,
    Reply(Box<RegistryReply>),
    Beat,
}

#[derive(Clone, Debug)]
pub enum Timer {
    StartRegistry,
    StartPublisher(usize),
    Publish(usize),
    Look,
    Retry { subscriber: usize, attempt: u64 },
    Fault,
}

#[derive(Clone, Debug)]
pub enum Event {
    Arrival { connection: ConnectionId, to: End, delivery: Delivery },
    Timer(Timer),
}

/// One connection.
pub struct Connection {
    pub is_of_registry: bool,
    /// When the last delivery arrives, at the client and at the server: a stream keeps its order.
    last: [Duration; 2],
    /// Bytes on their way to the client.
    in_flight: usize,
    /// It carries nothing any more, and neither end is informed.
    is_lost: bool,
}

pub struct Network {
    now: Duration,
    random: fastrand::Rng,
    queue: BTreeMap<(Duration, u64), Event>,
    count: u64,
    connections: BTreeMap<ConnectionId, Connection>,
    slow_until: Duration,
}

impl Network {
    pub fn new(seed: u64) -> Self {
        Self {
            now: Duration::ZERO,
            random: fastrand::Rng::with_seed(seed),
            queue: BTreeMap::new(),
            count: 0,
            connections: BTreeMap::new(),
            slow_until: Duration::ZERO,
        }
    }

    pub fn now(&self) -> Duration {
        self.now
    }

    /// Returns a number below `end`.
    pub fn draw(&mut self, end: u64) -> u64 {
        self.random.u64(..end)
    }

    pub fn draw_ms(&mut self, from: u64, to: u64) -> Duration {
        Duration::from_micros(self.random.u64(from * 1000..=to * 1000))
    }

    /// Returns a port that none of these is.
    pub fn draw_port(&mut self, taken: &[u16]) -> u16 {
        let free: Vec<u16> = PORTS.into_iter().filter(|port| !taken.contains(port)).collect();
        free[self.random.usize(..free.len())]
    }

    pub fn set_timer(&mut self, delay: Duration, timer: Timer) {
        self.push(self.now + delay, Event::Timer(timer));
    }

    fn push(&mut self, at: Duration, event: Event) {
        self.count += 1;
        self.queue.insert((at, self.count), event);
    }

    /// Takes the next event before `end`, and advances the time to it.
    pub fn next_event(&mut self, end: Duration) -> Option<Event> {
        loop {
            let ((at, _), event) = self.queue.pop_first()?;
            if at >= end {
                return None;
            }
            self.now = at;
            let Event::Arrival { connection, to, delivery } = &event else { return Some(event) };
            // What was on its way when the connection was lost, or closed by this end, is gone.
            let Some(known) = self.connections.get_mut(connection) else { continue };
            if known.is_lost {
                continue;
            }
            if let (Delivery::Bytes(bytes), End::Client) = (delivery, to) {
                known.in_flight -= bytes.len();
            }
            return Some(event);
        }
    }

    pub fn connect(&mut self, is_of_registry: bool) -> ConnectionId {
        self.count += 1;
        let last = [self.now; 2];
        let connection = Connection { is_of_registry, last, in_flight: 0, is_lost: false };
        self.connections.insert(self.count, connection);
        self.count
    }

    /// How many bytes the server's socket takes now.
    pub fn room(&self, connection: ConnectionId) -> usize {
        let known = self.connections.get(&connection);
        known.map_or(0, |it| WINDOW_LEN.saturating_sub(it.in_flight))
    }

    pub fn send(&mut self, connection: ConnectionId, to: End, delivery: Delivery) {
        let slow = self.now < self.slow_until;
        let delay = self.draw_ms(0, if slow { LONG_DELAY_MS } else { DELAY_MS });
        let Some(known) = self.connections.get_mut(&connection) else { return };
        if let (Delivery::Bytes(bytes), End::Client) = (&delivery, to) {
            known.in_flight += bytes.len();
        }
        let last = &mut known.last[usize::from(to == End::Server)];
        *last = (self.now + delay).max(*last);
        let at = *last;
        self.push(at, Event::Arrival { connection, to, delivery });
    }

    /// One end closes the connection: what it has sent arrives before the other is informed.
    pub fn close(&mut self, connection: ConnectionId, by: End) {
        let other = if by == End::Client { End::Server } else { End::Client };
        self.send(connection, other, Delivery::Closed);
    }

    /// The servers of these connections have died.
    pub fn close_all(&mut self, is_of_dead: impl Fn(&Connection) -> bool) {
        let dead = self.connections.iter().filter(|(_, it)| is_of_dead(it));
        for connection in dead.map(|(id, _)| *id).collect::<Vec<_>>() {
            self.close(connection, End::Server);
        }
    }

    /// A connection is reset, or carries nothing from now on.
    pub fn cut_any(&mut self) {
        let all: Vec<ConnectionId> = self.connections.keys().copied().collect();
        // Old ones are closed already.
        let recent = &all[all.len().saturating_sub(12)..];
        if recent.is_empty() {
            return;
        }
        let connection = recent[self.random.usize(..recent.len())];
        if self.random.bool() {
            self.send(connection, End::Client, Delivery::Closed);
            self.send(connection, End::Server, Delivery::Closed);
        } else if let Some(known) = self.connections.get_mut(&connection) {
            known.is_lost = true;
        }
    }

    pub fn begin_delays(&mut self) {
        self.slow_until = self.now + SLOW_FOR;
    }

    pub fn end_delays(&mut self) {
        self.slow_until = self.now;
    }
}
