//! A relay between two hosts that spoils what passes through it: a bad network, down to single bytes. It
//! is a process of its own in the namespace of the router, and takes its orders from stdin.
//!
//! Each piece that arrives gets the moment at which it is passed on. So a delay does not narrow the
//! connection, and a narrow connection delays what follows.

use std::ffi::OsString;
use std::io::{BufRead, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use parking_lot::Mutex;
use rustix::net::sockopt::set_socket_linger;

use super::dice::FaultDice;

/// The first argument of the process.
pub const RELAY: &str = "relay";
/// Bytes of a piece.
const PIECE_LEN: usize = 16 << 10;
/// Pieces that a direction holds, like the queue of a router: 1 MiB.
const QUEUE_LEN: usize = 64;
/// TCP repeats what was lost after this time at least; Linux waits this long.
const REPEATED_AFTER: Duration = Duration::from_millis(200);
/// Time between two looks at whether a black hole is over.
const LOOK: Duration = Duration::from_millis(5);

/// What a network does to all connections through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetworkQuality {
    /// Every piece takes this long, and up to `jitter` more.
    pub delay: Duration,
    pub jitter: Duration,
    /// What passes in each direction of each connection in a second; 0: any number.
    pub bytes_per_s: u32,
    /// The share of pieces that arrive only when they are repeated.
    pub loss: f64,
    /// Nothing passes towards the servers, and no connection is closed.
    pub holds_to_server: bool,
    /// Nothing passes towards the clients.
    pub holds_to_client: bool,
}

impl NetworkQuality {
    /// A network without faults.
    pub const GOOD: Self = Self {
        delay: Duration::ZERO,
        jitter: Duration::ZERO,
        bytes_per_s: 0,
        loss: 0.0,
        holds_to_server: false,
        holds_to_client: false,
    };

    /// The order that applies it.
    pub fn to_order(self) -> String {
        format!(
            "quality {} {} {} {} {} {}",
            self.delay.as_micros(),
            self.jitter.as_micros(),
            self.bytes_per_s,
            self.loss,
            self.holds_to_server,
            self.holds_to_client
        )
    }

    fn read(words: &[&str]) -> Option<Self> {
        let [delay, jitter, bytes_per_s, loss, to_server, to_client] = words else { return None };
        Some(Self {
            delay: Duration::from_micros(delay.parse().ok()?),
            jitter: Duration::from_micros(jitter.parse().ok()?),
            bytes_per_s: bytes_per_s.parse().ok()?,
            loss: loss.parse().ok()?,
            holds_to_server: to_server.parse().ok()?,
            holds_to_client: to_client.parse().ok()?,
        })
    }
}

/// Relays until stdin ends: `SEED`, and `LISTEN=TARGET` for each port. Prints a line when it listens, and
/// one for each order that was carried out.
///
/// # Errors
/// If it cannot listen, or does not know an order.
pub fn play_relay(mut arguments: impl Iterator<Item = OsString>) -> Result<()> {
    let mut next = || arguments.next()?.into_string().ok();
    let seed = next().context("no seed")?.parse()?;
    let relay = Arc::new(Relay {
        quality: Mutex::new(NetworkQuality::GOOD),
        dice: Mutex::new(FaultDice::new(seed)),
        connections: Mutex::default(),
        corrupts: AtomicBool::new(false),
        truncates: AtomicBool::new(false),
    });
    while let Some(route) = next() {
        let (listen, target) = route.split_once('=').context("LISTEN=TARGET is expected")?;
        let target: SocketAddr = target.parse()?;
        let listener = TcpListener::bind(listen).with_context(|| format!("port of {listen}"))?;
        let relay = Arc::clone(&relay);
        std::thread::spawn(move || {
            for client in listener.incoming().flatten() {
                let relay = Arc::clone(&relay);
                std::thread::spawn(move || relay.serve(client, target));
            }
        });
    }
    answer("ready");
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let words: Vec<_> = line.split(' ').collect();
        match words[..] {
            ["quality", ref rest @ ..] => {
                let quality = NetworkQuality::read(rest);
                *relay.quality.lock() = quality.with_context(|| format!("what is {line}?"))?;
                answer("quality");
            }
            ["reset"] => answer(&format!("reset {}", relay.reset_all())),
            ["corrupt"] => relay.corrupts.store(true, Ordering::Relaxed),
            ["truncate"] => relay.truncates.store(true, Ordering::Relaxed),
            _ => bail!("what is {line}?"),
        }
    }
    Ok(())
}

fn answer(text: &str) {
    let mut out = std::io::stdout().lock();
    // A bench that has gone needs no answer.
    let _ = writeln!(out, "{text}").and_then(|()| out.flush());
}

struct Relay {
    quality: Mutex<NetworkQuality>,
    dice: Mutex<FaultDice>,
    connections: Mutex<Vec<Weak<RelayedConnection>>>,
    /// The next piece arrives with one bit changed.
    corrupts: AtomicBool,
    /// Of the next piece the first half arrives, and then its connection ends.
    truncates: AtomicBool,
}

struct RelayedConnection {
    client: TcpStream,
    server: TcpStream,
    has_ended: AtomicBool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    ToServer,
    ToClient,
}

/// A piece, and when it is passed on.
type DuePiece = (Instant, Vec<u8>);

impl Relay {
    fn serve(self: &Arc<Self>, client: TcpStream, target: SocketAddr) {
        // Without a server the client is refused.
        let Ok(server) = TcpStream::connect(target) else { return };
        let _ = (client.set_nodelay(true), server.set_nodelay(true));
        let connection =
            Arc::new(RelayedConnection { client, server, has_ended: AtomicBool::new(false) });
        {
            let mut connections = self.connections.lock();
            connections.retain(|other| other.strong_count() > 0);
            connections.push(Arc::downgrade(&connection));
        }
        let back = (Arc::clone(self), Arc::clone(&connection));
        let back = std::thread::spawn(move || back.0.pass(&back.1, Direction::ToClient));
        self.pass(&connection, Direction::ToServer);
        let _ = back.join();
    }

    /// Passes one direction on until an end closes, and then closes both.
    fn pass(self: &Arc<Self>, connection: &Arc<RelayedConnection>, direction: Direction) {
        let (sender, pieces) = sync_channel::<DuePiece>(QUEUE_LEN);
        let writing = (Arc::clone(self), Arc::clone(connection));
        let writer =
            std::thread::spawn(move || writing.0.write_pieces(&writing.1, direction, &pieces));
        self.read_pieces(connection, direction, &sender);
        // What has been read is still passed on.
        drop(sender);
        let _ = writer.join();
        connection.end();
    }

    fn read_pieces(
        &self,
        connection: &RelayedConnection,
        direction: Direction,
        sender: &SyncSender<DuePiece>,
    ) {
        let (mut from, _) = connection.ends(direction);
        let mut piece = vec![0; PIECE_LEN];
        // When the one before has passed, and when the connection is free for the next one.
        let (mut last, mut free) = (Instant::now(), Instant::now());
        while !connection.has_ended() {
            match from.read(&mut piece) {
                Ok(0) | Err(_) => return,
                Ok(len) => {
                    let quality = *self.quality.lock();
                    free = free.max(Instant::now());
                    if quality.bytes_per_s > 0 {
                        free +=
                            Duration::from_secs_f64(len as f64 / f64::from(quality.bytes_per_s));
                    }
                    last = last.max(free + self.draw_delay(quality));
                    if sender.send((last, piece[..len].to_vec())).is_err() {
                        return;
                    }
                }
            }
        }
    }

    fn draw_delay(&self, quality: NetworkQuality) -> Duration {
        let mut dice = self.dice.lock();
        let mut delay = quality.delay + quality.jitter.mul_f64(dice.draw_share());
        while dice.draw_share() < quality.loss {
            delay += REPEATED_AFTER;
        }
        delay
    }

    fn write_pieces(
        &self,
        connection: &RelayedConnection,
        direction: Direction,
        pieces: &Receiver<DuePiece>,
    ) {
        let (_, mut to) = connection.ends(direction);
        for (due, mut piece) in pieces {
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            while self.holds(direction) && !connection.has_ended() {
                std::thread::sleep(LOOK);
            }
            if connection.has_ended() {
                return;
            }
            if self.corrupts.swap(false, Ordering::Relaxed) {
                let bit = self.dice.lock().draw_below(8 * piece.len());
                piece[bit / 8] ^= 1 << (bit % 8);
                answer(&format!("corrupted {}", piece.len()));
            }
            let truncates = self.truncates.swap(false, Ordering::Relaxed);
            if truncates {
                answer(&format!("truncated {}", piece.len()));
                piece.truncate(piece.len() / 2);
            }
            if to.write_all(&piece).is_err() || truncates {
                return connection.end();
            }
        }
    }

    fn holds(&self, direction: Direction) -> bool {
        let quality = self.quality.lock();
        match direction {
            Direction::ToServer => quality.holds_to_server,
            Direction::ToClient => quality.holds_to_client,
        }
    }

    /// Ends all connections at both ends with a reset; returns how many there were.
    fn reset_all(&self) -> usize {
        let all = std::mem::take(&mut *self.connections.lock());
        let open = all.iter().filter_map(Weak::upgrade).filter(|it| !it.has_ended());
        let mut count = 0;
        for connection in open {
            for stream in [&connection.client, &connection.server] {
                // With this the kernel sends a reset when the last thread lets go of it.
                let _ = set_socket_linger(stream, Some(Duration::ZERO));
            }
            connection.end();
            count += 1;
        }
        count
    }
}

impl RelayedConnection {
    /// Where a direction comes from, and where it leads.
    fn ends(&self, direction: Direction) -> (&TcpStream, &TcpStream) {
        match direction {
            Direction::ToServer => (&self.client, &self.server),
            Direction::ToClient => (&self.server, &self.client),
        }
    }

    fn has_ended(&self) -> bool {
        self.has_ended.load(Ordering::Relaxed)
    }

    /// The threads of both directions let go of it, which closes it.
    fn end(&self) {
        self.has_ended.store(true, Ordering::Relaxed);
        for stream in [&self.client, &self.server] {
            // It wakes who reads, and sends nothing. One that has gone needs no waking.
            let _ = stream.shutdown(Shutdown::Read);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_is_read_as_it_was_written() {
        let bad = NetworkQuality {
            delay: Duration::from_millis(20),
            jitter: Duration::from_micros(1500),
            bytes_per_s: 100_000,
            loss: 0.03,
            holds_to_server: false,
            holds_to_client: true,
        };
        for quality in [bad, NetworkQuality::GOOD] {
            let order = quality.to_order();
            let words: Vec<_> = order.split(' ').skip(1).collect();
            assert_eq!(NetworkQuality::read(&words), Some(quality), "{order}");
        }
        assert_eq!(NetworkQuality::read(&["1", "2"]), None);
    }
}
