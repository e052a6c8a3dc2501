//! What Little-MEC compared, and its blackboard: a direct call, a lock that gives writers priority, and
//! POSIX message queues through a broker. Each prints the latency of stamped messages at a rate.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use nix::mqueue::{MQ_OFlag, MqAttr, MqdT, mq_open, mq_receive, mq_send, mq_unlink};
use nix::sys::stat::Mode;

use crate::readings::{monotonic_ns, percentile_us};

/// Where a message has its stamp.
const STAMP_LEN: usize = 8;
/// Messages that a queue has room for: the most that Linux gives every user.
const QUEUE_ROOM: i64 = 10;
/// Messages before the measurement.
const RUN_UP: Duration = Duration::from_millis(300);

/// Whether it is a role of this module.
pub fn is_role(role: &str) -> bool {
    ["direct-call", "priority-lock", "queue-writer", "queue-broker", "queue-reader"].contains(&role)
}

/// Plays a role: `LEN RATE_HZ WINDOW_S [QUEUE…]`. Those that measure print `ages …` once.
pub fn play_role(role: &str, arguments: &[String]) -> Result<()> {
    let number = |index: usize| -> Result<f64> {
        Ok(arguments.get(index).context("an argument is missing")?.parse()?)
    };
    let queue = |index: usize| arguments.get(index).context("no queue");
    let pace = Pace { len: number(0)? as usize, rate_hz: number(1)?, window_s: number(2)? };
    match role {
        "direct-call" => call_directly(&pace),
        "priority-lock" => share_under_lock(&pace),
        "queue-writer" => write_queue(&pace, queue(3)?),
        "queue-broker" => forward_queue(&pace, queue(3)?, queue(4)?),
        "queue-reader" => read_queue(&pace, queue(3)?),
        _ => bail!("there is no role `{role}`"),
    }
}

struct Pace {
    len: usize,
    rate_hz: f64,
    window_s: f64,
}

impl Pace {
    fn message(&self) -> Vec<u8> {
        vec![0x5a; STAMP_LEN + self.len]
    }

    fn window(&self) -> Duration {
        Duration::from_secs_f64(self.window_s)
    }

    /// Calls `send` at the rate until the window is over.
    fn write(&self, mut send: impl FnMut() -> Result<()>) -> Result<()> {
        let (start, period) = (Instant::now(), Duration::from_secs_f64(1.0 / self.rate_hz));
        let mut due = start;
        while start.elapsed() < RUN_UP + self.window() {
            due += period;
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            send()?;
        }
        Ok(())
    }
}

fn stamp(message: &mut [u8]) {
    message[..STAMP_LEN].copy_from_slice(&monotonic_ns().to_le_bytes());
}

/// The ages of messages, from the end of the run-up on.
struct Ages {
    begun: Instant,
    ages_ns: Vec<u64>,
}

impl Ages {
    fn begin() -> Self {
        Self { begun: Instant::now(), ages_ns: Vec::new() }
    }

    fn take(&mut self, message: &[u8]) {
        let now_ns = monotonic_ns();
        let sent = message.first_chunk().map_or(now_ns, |stamp| u64::from_le_bytes(*stamp));
        if self.begun.elapsed() > RUN_UP {
            self.ages_ns.push(now_ns.saturating_sub(sent));
        }
    }

    fn print(&mut self) {
        println!(
            "ages n={} p50_us={} p99_us={}",
            self.ages_ns.len(),
            percentile_us(&mut self.ages_ns, 0.5),
            percentile_us(&mut self.ages_ns, 0.99)
        );
    }
}

/// The receiver is a function of the same thread, which copies the message.
fn call_directly(pace: &Pace) -> Result<()> {
    let (mut message, mut received) = (pace.message(), pace.message());
    let mut ages = Ages::begin();
    pace.write(|| {
        stamp(&mut message);
        receive_call(std::hint::black_box(&message), &mut received);
        ages.take(&received);
        Ok(())
    })?;
    ages.print();
    Ok(())
}

#[inline(never)]
fn receive_call(message: &[u8], received: &mut [u8]) {
    received.copy_from_slice(message);
    std::hint::black_box(received);
}

/// Shared state under a lock with which many read or one writes, and waiting writers go first: the
/// blackboard of Little-MEC.
struct PriorityLock {
    state: Mutex<LockState>,
    changed: Condvar,
    value: Mutex<Vec<u8>>,
}

#[derive(Default)]
struct LockState {
    readers: u32,
    waiting_writers: u32,
    is_written: bool,
    version: u64,
}

impl PriorityLock {
    fn lock_state(&self) -> MutexGuard<'_, LockState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, state: MutexGuard<'a, LockState>) -> MutexGuard<'a, LockState> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_value(&self) -> MutexGuard<'_, Vec<u8>> {
        self.value.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self, message: &[u8]) {
        let mut state = self.lock_state();
        state.waiting_writers += 1;
        while state.readers > 0 || state.is_written {
            state = self.wait(state);
        }
        state.waiting_writers -= 1;
        state.is_written = true;
        drop(state);
        self.lock_value().copy_from_slice(message);
        let mut state = self.lock_state();
        (state.is_written, state.version) = (false, state.version + 1);
        self.changed.notify_all();
    }

    /// Waits for a version after `seen` and copies it. Returns its number.
    fn read(&self, seen: u64, received: &mut [u8]) -> u64 {
        let mut state = self.lock_state();
        while state.version == seen || state.is_written || state.waiting_writers > 0 {
            state = self.wait(state);
        }
        let version = state.version;
        state.readers += 1;
        drop(state);
        received.copy_from_slice(&self.lock_value());
        let mut state = self.lock_state();
        state.readers -= 1;
        self.changed.notify_all();
        version
    }
}

fn share_under_lock(pace: &Pace) -> Result<()> {
    let value = Mutex::new(pace.message());
    let board = PriorityLock { state: Mutex::default(), changed: Condvar::new(), value };
    let board = Arc::new(board);
    let (shared, mut received) = (Arc::clone(&board), pace.message());
    let end = Instant::now() + RUN_UP + pace.window();
    let reader = std::thread::spawn(move || {
        let (mut ages, mut seen) = (Ages::begin(), 0);
        while Instant::now() < end {
            seen = shared.read(seen, &mut received);
            ages.take(&received);
        }
        ages.print();
    });
    let mut message = pace.message();
    pace.write(|| {
        stamp(&mut message);
        board.write(&message);
        Ok(())
    })?;
    // The reader may wait for one more.
    while !reader.is_finished() {
        board.write(&message);
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}

fn open_queue(name: &str, len: usize, how: MQ_OFlag) -> Result<MqdT> {
    let attributes = MqAttr::new(0, QUEUE_ROOM, (STAMP_LEN + len) as i64, 0);
    let how = how | MQ_OFlag::O_CREAT;
    mq_open(name, how, Mode::S_IRUSR | Mode::S_IWUSR, Some(&attributes)).context("no queue")
}

fn write_queue(pace: &Pace, queue: &str) -> Result<()> {
    let queue = open_queue(queue, pace.len, MQ_OFlag::O_WRONLY)?;
    let mut message = pace.message();
    pace.write(|| {
        stamp(&mut message);
        Ok(mq_send(&queue, &message, 0)?)
    })
}

/// Forwards each message by its kind, as the broker does that queues between two ends need.
fn forward_queue(pace: &Pace, from: &str, to: &str) -> Result<()> {
    let from = open_queue(from, pace.len, MQ_OFlag::O_RDONLY)?;
    let to = open_queue(to, pace.len, MQ_OFlag::O_WRONLY)?;
    println!("linked");
    let mut message = pace.message();
    loop {
        let len = mq_receive(&from, &mut message, &mut 0)?;
        mq_send(&to, &message[..len], 0)?;
    }
}

fn read_queue(pace: &Pace, queue: &str) -> Result<()> {
    let opened = open_queue(queue, pace.len, MQ_OFlag::O_RDONLY)?;
    println!("linked");
    let (mut message, mut ages) = (pace.message(), None);
    loop {
        mq_receive(&opened, &mut message, &mut 0)?;
        let ages = ages.get_or_insert_with(Ages::begin);
        ages.take(&message);
        // Before the writer's last one, so that there is one to be woken by.
        if ages.begun.elapsed() > RUN_UP + pace.window().mul_f64(0.9) {
            ages.print();
            return Ok(());
        }
    }
}

/// Removes queues that are no longer used; those that do not exist are none.
pub fn remove_queues(names: &[String]) {
    for name in names {
        let _ = mq_unlink(name.as_str());
    }
}
