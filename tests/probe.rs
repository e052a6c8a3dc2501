//! The component of the whole-system tests. It counts, receives, fails as its parameters specify,
//! and records every call with its time.
//!
//! A line of its trace is `NANOSECONDS PID WORDS…`, in time of the monotonic clock, which all
//! processes share. Each line is a single appending write, so that it is complete or missing even
//! if the process is killed.

mod next_probe;

use std::fmt::Display;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use armor_sdk::prelude::*;
use rustix::time::{ClockId, clock_gettime};

use next_probe::NextProbe;

/// What a probe publishes.
#[derive(Clone, Debug, PartialEq, Message)]
struct Numbered {
    /// Counts from 0 in each process.
    count: u64,
    bulk: Array<u8>,
}

const INPUTS: [&str; 5] = ["a", "b", "c", "d", "e"];
/// Longer than any test.
const FOREVER: Duration = Duration::from_secs(3600);

struct Probe {
    armor: Armor,
    trace: Trace,
    /// File that is locked while the probe is active. Probes that exclude each other name the same
    /// file.
    alone: Option<PathBuf>,
    held: Option<File>,
    bulk_len: usize,
    burst: u64,
    limit: u64,
    /// Ticks of this activation after which it reports an event, is done, hangs, panics, has a thread
    /// that panics, or fails; 0: never.
    event: u64,
    done: u64,
    hang: u64,
    panic: u64,
    thread_panic: u64,
    fail: u64,
    work: Duration,
    ticks: u64,
    count: u64,
}

impl Component for Probe {
    const KIND: &'static str = "probe";
    const SUMMARY: &'static str = "Counts, and writes down what happens to it.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::path("trace").default("").doc("file for what happens; empty: none"),
        Parameter::path("alone").default("").doc("file locked while active; empty: none"),
        Parameter::integer("bulk").default("0").range(0.0, 67e6).doc("bytes in each message"),
        Parameter::integer("burst").default("1").range(0.0, 1e6).doc("messages per tick"),
        Parameter::integer("limit").default("0").doc("messages in all; 0: no limit"),
        Parameter::integer("event").default("0").doc("ticks until an event; 0: never"),
        Parameter::integer("done").default("0").doc("ticks until it reports done; 0: never"),
        Parameter::integer("hang").default("0").doc("ticks until it hangs; 0: never"),
        Parameter::integer("panic").default("0").doc("ticks until it panics; 0: never"),
        Parameter::integer("thread_panic")
            .default("0")
            .doc("ticks until its thread panics; 0: never"),
        Parameter::integer("fail").default("0").doc("ticks until it reports a failure; 0: never"),
        Parameter::number("work", "s").default("0s").doc("how long each tick takes"),
        Parameter::text("mark").default("").doc("written down when it arrives").live(),
        Parameter::text("ask").default("").doc("another parameter that it asks for"),
    ];

    const EVENTS: &'static [DeclaredEvent] = &[DeclaredEvent::new("ticked")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Numbered>("numbers")?;
        for input in INPUTS {
            armor.subscribe::<Optional<Numbered>>(input)?;
        }
        for parameter in Self::PARAMETERS {
            armor.get_parameter(&parameter.manifest().name)?;
        }
        armor.synchronize()?;
        Ok(Self {
            armor,
            trace: Trace::default(),
            alone: None,
            held: None,
            bulk_len: 0,
            burst: 1,
            limit: 0,
            event: 0,
            done: 0,
            hang: 0,
            panic: 0,
            thread_panic: 0,
            fail: 0,
            work: Duration::ZERO,
            ticks: 0,
            count: 0,
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "trace" => self.trace.path = Some(value.path()?).filter(|path| is_file_path(path)),
            "alone" => self.alone = Some(value.path()?).filter(|path| is_file_path(path)),
            "bulk" => self.bulk_len = usize::try_from(value.integer()?)?,
            "burst" => self.burst = u64::try_from(value.integer()?)?,
            "limit" => self.limit = u64::try_from(value.integer()?)?,
            "event" => self.event = u64::try_from(value.integer()?)?,
            "done" => self.done = u64::try_from(value.integer()?)?,
            "hang" => self.hang = u64::try_from(value.integer()?)?,
            "panic" => self.panic = u64::try_from(value.integer()?)?,
            "thread_panic" => self.thread_panic = u64::try_from(value.integer()?)?,
            "fail" => self.fail = u64::try_from(value.integer()?)?,
            "work" => self.work = Duration::from_secs_f64(value.number()?),
            "mark" if value.text()? == "refused" => return Err("it is refused".into()),
            "mark" => self.trace.note(format_args!("mark {}", value.text()?))?,
            "ask" if !value.text()?.is_empty() => self.armor.get_parameter(value.text()?)?,
            _ => {}
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header, data: &Data) -> Result<(), Fault> {
        let numbered: Numbered = data.decode()?;
        let (id, lost, from) = (header.id(), header.lost, header.instance);
        self.trace.note(format_args!("got {id} {} {lost} {from:016x}", numbered.count))
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => {
                self.ticks = 0;
                self.trace.note("started")?;
                self.be_alone()?;
            }
            Call::Stopping => {
                self.trace.note("stopping")?;
                self.held = None;
            }
            Call::Tick => return self.tick(),
            Call::Data => {}
        }
        Ok(Outcome::CarryOn)
    }
}

impl Probe {
    fn tick(&mut self) -> Result<Outcome, Fault> {
        self.ticks += 1;
        self.trace.note("tick")?;
        std::thread::sleep(self.work);
        for _ in 0..self.burst {
            if self.limit > 0 && self.count >= self.limit {
                break;
            }
            let bulk = Array::from(vec![0; self.bulk_len]);
            self.armor.send_data("numbers", &Numbered { count: self.count, bulk })?;
            self.count += 1;
            if self.count == self.limit {
                self.trace.note("sent all")?;
            }
        }
        if self.ticks == self.hang {
            self.trace.note("hangs")?;
            std::thread::sleep(FOREVER);
        }
        assert!(self.ticks != self.panic, "as the test wants it");
        if self.ticks == self.thread_panic {
            let panics = || panic!("as the test wants it");
            std::thread::Builder::new().name("aside".into()).spawn(panics)?;
        }
        Ok(match self.ticks {
            ticks if ticks == self.done => Outcome::Done,
            ticks if ticks == self.fail => Outcome::Failed("as the test wants it".into()),
            ticks if ticks == self.event => Outcome::event("ticked", 1.0),
            _ => Outcome::CarryOn,
        })
    }

    /// Records a clash if another probe with the same file is active.
    fn be_alone(&mut self) -> Result<(), Fault> {
        if let Some(path) = &self.alone {
            let file = OpenOptions::new().create(true).append(true).open(path)?;
            if file.try_lock().is_err() {
                self.trace.note("clash")?;
            }
            self.held = Some(file);
        }
        Ok(())
    }
}

/// Whether a path parameter names a file. An empty one arrives as the folder it is relative to.
fn is_file_path(path: &std::path::Path) -> bool {
    !path.as_os_str().is_empty() && !path.is_dir()
}

#[derive(Default)]
struct Trace {
    path: Option<PathBuf>,
    file: Option<File>,
}

impl Trace {
    fn note(&mut self, words: impl Display) -> Result<(), Fault> {
        let Some(path) = &self.path else { return Ok(()) };
        let file = match &mut self.file {
            Some(file) => file,
            None => self.file.insert(OpenOptions::new().create(true).append(true).open(path)?),
        };
        let now = clock_gettime(ClockId::Monotonic);
        let at_ns = now.tv_sec * 1_000_000_000 + now.tv_nsec;
        Ok(file.write_all(format!("{at_ns} {} {words}\n", std::process::id()).as_bytes())?)
    }
}

/// Reports the progress of a task; done after 20 ticks.
struct Worker {
    armor: Armor,
    ticks: u8,
}

impl Component for Worker {
    const KIND: &'static str = "worker";
    const SUMMARY: &'static str = "Reports its progress.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Latched<Progress>>("progress")?;
        Ok(Self { armor, ticks: 0 })
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Tick {
            self.ticks += 1;
            let fraction = f32::from(self.ticks) / 20.0;
            let task = "sorting".to_owned();
            self.armor
                .send_data("progress", &Progress { task, fraction, ..Progress::default() })?;
        }
        Ok(if self.ticks >= 20 { Outcome::Done } else { Outcome::CarryOn })
    }
}

/// Prints in its constructor.
struct Talker;

impl Component for Talker {
    const KIND: &'static str = "talker";
    const SUMMARY: &'static str = "Prints where only its manifest may be.";

    fn new(_: Armor) -> Result<Self, Fault> {
        print!("the talker is ready");
        Ok(Self)
    }
}

/// Declares a parameter that it never requests.
struct Quirk;

impl Component for Quirk {
    const KIND: &'static str = "quirk";
    const SUMMARY: &'static str = "Ignores its speed.";
    const PARAMETERS: &'static [Parameter] =
        &[Parameter::number("speed", "m/s").default("1m/s").doc("never requested").live()];

    fn new(_: Armor) -> Result<Self, Fault> {
        Ok(Self)
    }
}

/// Runs a probe; an executable named `worker`, `talker`, `quirk` or `next-probe` runs that.
fn main() -> ExitCode {
    let path = std::env::args_os().next().map(PathBuf::from).unwrap_or_default();
    match path.file_name().and_then(|name| name.to_str()) {
        Some("worker") => armor_sdk::run::<Worker>(),
        Some("talker") => armor_sdk::run::<Talker>(),
        Some("quirk") => armor_sdk::run::<Quirk>(),
        Some("next-probe") => armor_sdk::run::<NextProbe>(),
        _ => armor_sdk::run::<Probe>(),
    }
}
