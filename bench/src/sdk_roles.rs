//! Armor's side: components as any user would write them, started without configd.
//!
//! Like the programs they are compared with, they read received bytes without copying them
//! (`data.bytes()`), and they publish messages that were built beforehand.

use std::ffi::OsString;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use armor_sdk::prelude::*;
use parking_lot::Mutex;

use crate::freshness::{SlowSubscriber, TimedPublisher};
use crate::numbered::{NumberedPublisher, NumberedReader};
use crate::readings::{
    MOST_ROUND_TRIPS, monotonic_ns, print_round_trips, publishing_time, watch_window,
};
use crate::stamped::{StampedReader, StampedWriter};
use crate::turn_system::TurnComponent;

/// Plays a role until it is killed.
pub fn play_role(role: &str, arguments: impl Iterator<Item = OsString>) -> Result<()> {
    let ended = match role {
        "echo" => armor_sdk::run_with::<EchoComponent>(arguments),
        "ping" => armor_sdk::run_with::<Ping>(arguments),
        "flood" => armor_sdk::run_with::<Flood>(arguments),
        "sink" => armor_sdk::run_with::<Sink>(arguments),
        "tick" => armor_sdk::run_with::<Tick>(arguments),
        "first" => armor_sdk::run_with::<First>(arguments),
        "timed-publisher" => armor_sdk::run_with::<TimedPublisher>(arguments),
        "slow-subscriber" => armor_sdk::run_with::<SlowSubscriber>(arguments),
        "numbered-publisher" => armor_sdk::run_with::<NumberedPublisher>(arguments),
        "numbered-reader" => armor_sdk::run_with::<NumberedReader>(arguments),
        "stamped-writer" => armor_sdk::run_with::<StampedWriter>(arguments),
        "stamped-reader" => armor_sdk::run_with::<StampedReader>(arguments),
        "pulling-reader" => {
            crate::pull_times::collect();
            armor_sdk::run_with::<StampedReader>(arguments)
        }
        "turn" => armor_sdk::run_with::<TurnComponent>(arguments),
        _ => bail!("there is no role `{role}`"),
    };
    // It never ends by itself: the measurement kills it.
    if ended == ExitCode::SUCCESS { Ok(()) } else { bail!("{role} has failed") }
}

/// The message of all roles: some bytes. Its encoding is 8 bytes longer.
#[derive(Message, Clone, Debug, PartialEq)]
struct Blob {
    bytes: Array<u8>,
}

impl Blob {
    fn new(len: usize) -> Self {
        Self { bytes: vec![0x5a; len].into() }
    }
}

const COUNT_LEN: usize = 8;

const LEN: Parameter = Parameter::integer("len").range(0.0, 6e7).doc("bytes in a message");
const WINDOW: Parameter = Parameter::number("window", "s").doc("how long is measured");

/// Answers each ping from within `data_received`.
struct EchoComponent {
    armor: Armor,
    pong: Blob,
}

impl Component for EchoComponent {
    const KIND: &'static str = "echo";
    const SUMMARY: &'static str = "Answers pings.";
    const PARAMETERS: &'static [Parameter] = &[LEN];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Blob>("pong")?;
        armor.subscribe::<Blob>("ping")?;
        armor.get_parameter("len")?;
        armor.synchronize()?;
        Ok(Self { armor, pong: Blob::new(0) })
    }

    fn parameter_received(&mut self, _: &str, value: &Value) -> Result<(), Fault> {
        self.pong = Blob::new(value.integer()? as usize);
        Ok(())
    }

    fn data_received(&mut self, _: &Header<'_>, _: &Data<'_>) -> Result<(), Fault> {
        self.armor.send_data("pong", &self.pong)?;
        Ok(())
    }
}

/// Sends the next ping when a pong arrives, from within `data_received`.
struct Ping {
    armor: Armor,
    ping: Arc<Blob>,
    window: Duration,
    course: Arc<Mutex<PingCourse>>,
}

/// The state of the measurement.
#[derive(Default)]
struct PingCourse {
    stage: PingStage,
    sent: Option<Instant>,
    start: Option<Instant>,
    window: Duration,
    times_ns: Vec<u64>,
    over: Option<Sender<()>>,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum PingStage {
    /// Both links are being established.
    #[default]
    Opening,
    /// Several pings were sent while the links were established; their answers may still arrive.
    Settling,
    Measuring,
}

impl Component for Ping {
    const KIND: &'static str = "ping";
    const SUMMARY: &'static str = "Measures round trips.";
    const PARAMETERS: &'static [Parameter] = &[LEN, WINDOW];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Blob>("ping")?;
        armor.subscribe::<Blob>("pong")?;
        armor.get_parameter("len")?;
        armor.get_parameter("window")?;
        armor.synchronize()?;
        Ok(Self {
            armor,
            ping: Blob::new(0).into(),
            window: Duration::ZERO,
            course: Arc::default(),
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "len" => self.ping = Blob::new(value.integer()? as usize).into(),
            _ => self.window = Duration::try_from_secs_f64(value.number()?)?,
        }
        Ok(())
    }

    fn data_received(&mut self, _: &Header<'_>, _: &Data<'_>) -> Result<(), Fault> {
        let now = Instant::now();
        let mut course = self.course.lock();
        if course.note_answer(now) {
            course.sent = Some(Instant::now());
            drop(course);
            self.armor.send_data("ping", &*self.ping)?;
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            let (armor, ping) = (self.armor.clone(), Arc::clone(&self.ping));
            let (course, window) = (Arc::clone(&self.course), self.window);
            std::thread::spawn(move || measure_round_trips(&armor, &ping, &course, window));
        }
        Ok(Outcome::CarryOn)
    }
}

impl PingCourse {
    /// Records an answer. Returns whether the next ping is due.
    fn note_answer(&mut self, now: Instant) -> bool {
        if self.stage == PingStage::Settling {
            return false;
        }
        if let (Some(sent), Some(start)) = (self.sent, self.start) {
            self.times_ns.push((now - sent).as_nanos() as u64);
            if now - start < self.window && self.times_ns.len() < MOST_ROUND_TRIPS {
                return true;
            }
        }
        self.stage = PingStage::Settling;
        if let Some(over) = &self.over {
            let _ = over.send(());
        }
        false
    }

    fn begin_window(&mut self, window: Duration) {
        let now = Instant::now();
        (self.stage, self.sent, self.start) = (PingStage::Measuring, Some(now), Some(now));
        self.window = window;
        self.times_ns.clear();
        self.times_ns.reserve(MOST_ROUND_TRIPS);
    }
}

/// Waits for both links, then starts a warm-up and the measurement.
fn measure_round_trips(armor: &Armor, ping: &Blob, course: &Mutex<PingCourse>, window: Duration) {
    let course = || course.lock();
    let (sender, over): (_, Receiver<()>) = channel();
    course().over = Some(sender);
    loop {
        if let Err(error) = armor.send_data("ping", ping) {
            println!("failed {error}");
        }
        if over.recv_timeout(Duration::from_millis(200)).is_ok() {
            break;
        }
    }
    std::thread::sleep(Duration::from_millis(300));
    for window in [window.mul_f64(0.15), window] {
        course().begin_window(window);
        let _ = armor.send_data("ping", ping);
        let _ = over.recv();
    }
    print_round_trips(&mut course().times_ns);
}

/// Publishes to its subscribers, once all are connected: one message for each `exec` if the file
/// gives it a rate, otherwise as fast as they take it, in one long `exec`.
struct Flood {
    armor: Armor,
    message: Blob,
    window: Duration,
    subscribers: usize,
    paced: bool,
    /// The count and the end, once all subscribers are connected.
    flow: Option<(Arc<AtomicU64>, Instant)>,
    published: u64,
}

impl Component for Flood {
    const KIND: &'static str = "flood";
    const SUMMARY: &'static str = "Publishes as fast as it can.";
    const PARAMETERS: &'static [Parameter] = &[
        LEN,
        WINDOW,
        Parameter::integer("subscribers").doc("number of subscribers to wait for"),
        Parameter::flag("paced").doc("one message for each exec"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Blob>("data")?;
        for parameter in Self::PARAMETERS {
            armor.get_parameter(&parameter.manifest().name)?;
        }
        armor.synchronize()?;
        let (message, window) = (Blob::new(0), Duration::ZERO);
        Ok(Self { armor, message, window, subscribers: 1, paced: false, flow: None, published: 0 })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "len" => self.message = Blob::new(value.integer()? as usize),
            "window" => self.window = Duration::try_from_secs_f64(value.number()?)?,
            "subscribers" => self.subscribers = value.integer()? as usize,
            _ => self.paced = value.flag()?,
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call != Call::Tick {
            return Ok(Outcome::CarryOn);
        }
        let sent = self.publish_message()?;
        let Some((count, end)) = &self.flow else {
            if sent == self.subscribers {
                let end = Instant::now() + publishing_time(self.window);
                self.flow = Some((watch_window(self.window), end));
            }
            return Ok(Outcome::CarryOn);
        };
        let (count, end) = (Arc::clone(count), *end);
        loop {
            count.store(self.published, Ordering::Relaxed);
            let look =
                self.paced || self.message.bytes.len() > 4096 || self.published.is_multiple_of(16);
            if look && Instant::now() >= end {
                println!("published count={}", self.published);
                // An empty message marks the end.
                self.armor.send_data("data", &Blob::new(0))?;
                return Ok(Outcome::Done);
            }
            if self.paced {
                return Ok(Outcome::CarryOn);
            }
            self.publish_message()?;
        }
    }
}

impl Flood {
    fn publish_message(&mut self) -> Result<usize, Fault> {
        let sent = self.armor.send_data("data", &self.message)?;
        self.published += 1;
        Ok(sent.to)
    }
}

/// Counts what it receives.
struct Sink {
    len: usize,
    window: Duration,
    count: Option<Arc<AtomicU64>>,
    received: u64,
    lost: u64,
}

impl Component for Sink {
    const KIND: &'static str = "sink";
    const SUMMARY: &'static str = "Counts what it receives.";
    const PARAMETERS: &'static [Parameter] = &[LEN, WINDOW];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Blob>("data")?;
        armor.get_parameter("len")?;
        armor.get_parameter("window")?;
        armor.synchronize()?;
        Ok(Self { len: 0, window: Duration::ZERO, count: None, received: 0, lost: 0 })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "len" => self.len = value.integer()? as usize,
            _ => self.window = Duration::try_from_secs_f64(value.number()?)?,
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        self.lost += header.lost;
        match data.bytes().len() {
            COUNT_LEN => println!("received count={} lost={}", self.received, self.lost),
            len if len != COUNT_LEN + self.len => return Err("a message of another length".into()),
            _ => self.received += 1,
        }
        let window = self.window;
        let count = self.count.get_or_insert_with(|| watch_window(window));
        count.store(self.received, Ordering::Relaxed);
        Ok(())
    }
}

/// Publishes at its rate.
struct Tick {
    armor: Armor,
    message: Blob,
}

impl Component for Tick {
    const KIND: &'static str = "tick";
    const SUMMARY: &'static str = "Publishes at its rate.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Blob>("data")?;
        Ok(Self { armor, message: Blob::new(100) })
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        self.armor.send_data("data", &self.message)?;
        Ok(Outcome::CarryOn)
    }
}

/// Prints the time of the first message.
struct First {
    has_printed: bool,
}

impl Component for First {
    const KIND: &'static str = "first";
    const SUMMARY: &'static str = "Prints the time of the first message.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Blob>("data")?;
        Ok(Self { has_printed: false })
    }

    fn data_received(&mut self, _: &Header<'_>, _: &Data<'_>) -> Result<(), Fault> {
        if !std::mem::replace(&mut self.has_printed, true) {
            println!("first at_ns={}", monotonic_ns());
        }
        Ok(())
    }
}
