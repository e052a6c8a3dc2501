//! What is measured: each job starts its processes on one side, and returns what they said.

use std::fmt;
use std::net::SocketAddr;
use std::time::Duration;

use anyhow::{Result, ensure};
use armor_registry::BackgroundRegistry;

use crate::options::Options;
use crate::process::Process;

const KIB: usize = 1 << 10;
const MIB: usize = 1 << 20;
/// A small message; the size of a pose.
const SMALL_LEN: usize = 100;
/// What a robot's fast loops send.
const PACE_HZ: u32 = 10_000;
/// How long a role may take beyond what it measures.
const PATIENCE: Duration = Duration::from_secs(20);
/// How long an idle process is left alone before it is looked at.
const IDLE: Duration = Duration::from_secs(2);

/// Who is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    Std,
    Armor,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Std => "std",
            Self::Armor => "armor",
        })
    }
}

/// What is measured together.
#[derive(Clone, Copy, Debug)]
pub enum Job {
    /// There and back, one at a time; both ends sleep or spin meanwhile.
    RoundTrip { len: usize, spin: bool },
    /// Small messages to one subscriber, as fast as it takes them, none lost.
    Flood,
    /// Large messages to several subscribers, as fast as they take them, none lost.
    FanOut { subscribers: usize },
    /// Small messages to one subscriber at 10 kHz.
    Paced,
    /// From the start of a process to the first message it receives.
    First,
    /// What an idle process takes.
    Idle,
    /// A large file read and checked.
    Check,
    /// From a component's report to the activation of the next one; the journal on the disk, or
    /// where nothing is ever waited for.
    Reaction { on_disk: bool },
}

/// What a figure should be.
#[derive(Clone, Copy, Debug)]
pub enum Goal {
    None,
    /// At most this many times what std takes.
    TimesStdAtMost(f64),
    /// At least this many times what std does.
    TimesStdAtLeast(f64),
    AtMost(f64),
    AtLeast(f64),
}

/// One figure of one measurement.
#[derive(Clone, Debug)]
pub struct Reading {
    pub figure: String,
    pub unit: &'static str,
    pub value: f64,
    pub goal: Goal,
}

impl fmt::Display for Reading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {:.2} {}", self.figure, self.value, self.unit)
    }
}

pub fn reading(figure: impl Into<String>, unit: &'static str, value: f64, goal: Goal) -> Reading {
    Reading { figure: figure.into(), unit, value, goal }
}

impl Job {
    /// Everything there is to measure, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        let lens = [50, SMALL_LEN, 1000, 64 * KIB, MIB, 8 * MIB];
        let round_trips = lens.map(|len| Self::RoundTrip { len, spin: false });
        let spinning = [SMALL_LEN, 64 * KIB].map(|len| Self::RoundTrip { len, spin: true });
        let fan_outs = [1, 4, 8].map(|subscribers| Self::FanOut { subscribers });
        let rest = [Self::Flood, Self::Paced];
        round_trips.into_iter().chain(spinning).chain(rest).chain(fan_outs).chain([
            Self::First,
            Self::Idle,
            Self::Check,
            Self::Reaction { on_disk: true },
            Self::Reaction { on_disk: false },
        ])
    }

    /// Its name for `--only`.
    pub fn part(self) -> &'static str {
        match self {
            Self::RoundTrip { spin: false, .. } => "lat",
            Self::RoundTrip { spin: true, .. } => "spin",
            Self::Flood => "flood",
            Self::FanOut { .. } => "fan",
            Self::Paced => "paced",
            Self::First => "first",
            Self::Idle => "idle",
            Self::Check => "check",
            Self::Reaction { .. } => "reaction",
        }
    }
}

/// Does the jobs. Its registry serves all of them.
pub struct Bench {
    registry: BackgroundRegistry,
    window: Duration,
    same_core: bool,
    runs: u32,
}

/// The publishing or asking process is on core 0; the others on core 1, or on the same.
pub const FIRST_CORE: usize = 0;

impl Bench {
    pub fn new(options: &Options) -> Result<Self> {
        let listen: SocketAddr = ([127, 0, 0, 1], 0).into();
        let registry = armor_registry::RegistryOptions { listen, ..Default::default() };
        Ok(Self {
            registry: BackgroundRegistry::start(registry)?,
            window: options.window,
            same_core: options.same_core,
            runs: 0,
        })
    }

    /// Measures once.
    pub fn measure(&mut self, job: Job, side: Side) -> Result<Vec<Reading>> {
        // The registry may still know those of the run before.
        self.runs += 1;
        match job {
            Job::RoundTrip { len, spin } => self.round_trip(side, len, spin),
            Job::Flood => self.flood(side, SMALL_LEN, 1, None),
            Job::FanOut { subscribers } => self.flood(side, MIB, subscribers, None),
            Job::Paced => self.flood(side, SMALL_LEN, 1, Some(PACE_HZ)),
            Job::First => self.first(side),
            Job::Idle => self.idle(side),
            Job::Check => self.check(side),
            Job::Reaction { on_disk } => self.reaction(side, on_disk),
        }
    }

    pub fn other_core(&self) -> usize {
        if self.same_core { FIRST_CORE } else { 1 }
    }

    fn plain(&self, core: usize, role: &str, arguments: &[f64]) -> Result<Process> {
        let arguments: Vec<_> = arguments.iter().map(ToString::to_string).collect();
        Process::start(core, Side::Std, role, &arguments)
    }

    /// The system's name of a component of this run.
    fn name(&self, name: &str) -> String {
        format!("{name}-{}", self.runs)
    }

    fn component(
        &self,
        core: usize,
        kind: &str,
        name: &str,
        settings: &[String],
    ) -> Result<Process> {
        let registry = self.registry.address();
        let mut arguments: Vec<String> =
            vec!["--alone".into(), "--name".into(), self.name(name), "--registry".into()];
        arguments.push(registry.to_string());
        arguments.extend_from_slice(settings);
        Process::start(core, Side::Armor, kind, &arguments)
    }

    fn link(&self, input: &str, output: &str, how: &str) -> [String; 2] {
        let (component, output) = output.split_once('.').unwrap_or((output, "data"));
        ["--link".into(), format!("{input}={}.{output}{how}", self.name(component))]
    }

    fn window_s(&self) -> f64 {
        self.window.as_secs_f64()
    }

    fn round_trip(&self, side: Side, len: usize, spin: bool) -> Result<Vec<Reading>> {
        // The other process lives until the figures are there.
        let (_other, ping) = match side {
            Side::Std => {
                let spin = f64::from(u8::from(spin));
                let echo = self.plain(self.other_core(), "echo", &[len as f64, spin])?;
                let port = echo.said("listening", PATIENCE)?["port"];
                let arguments = [port, spin, len as f64, self.window_s()];
                let ping = self.plain(FIRST_CORE, "ping", &arguments)?;
                (echo, ping)
            }
            Side::Armor => {
                let how = if spin { ",wake=spin" } else { "" };
                let mut settings = set("len", len).to_vec();
                settings.extend(self.link("ping", "ping.ping", how));
                let echo = self.component(self.other_core(), "echo", "echo", &settings)?;
                let mut settings = set("len", len).to_vec();
                settings.extend(set("window", format!("{}s", self.window_s())));
                settings.extend(self.link("pong", "echo.pong", how));
                let ping = self.component(FIRST_CORE, "ping", "ping", &settings)?;
                (echo, ping)
            }
        };
        let said = ping.said("round", PATIENCE + self.window * 2)?;
        let goal = match (len, spin) {
            (_, true) if len > KIB => Goal::None,
            (_, true) => Goal::TimesStdAtMost(1.2),
            (..=KIB, _) if self.same_core => Goal::TimesStdAtMost(1.3),
            _ if self.same_core => Goal::None,
            (..=65_536, _) => Goal::TimesStdAtMost(1.05),
            (MIB, _) => Goal::TimesStdAtMost(0.88),
            _ => Goal::None,
        };
        let what = format!("round trip{}, {}", if spin { " spinning" } else { "" }, bytes(len));
        Ok(vec![
            reading(format!("{what}, p50"), "µs", said["p50_us"], goal),
            reading(format!("{what}, p99"), "µs", said["p99_us"], Goal::None),
        ])
    }

    fn flood(
        &self,
        side: Side,
        len: usize,
        subscribers: usize,
        rate_hz: Option<u32>,
    ) -> Result<Vec<Reading>> {
        let (publisher, sinks) = match side {
            Side::Std => self.plain_flood(len, subscribers, rate_hz)?,
            Side::Armor => self.our_flood(len, subscribers, rate_hz)?,
        };
        let limit = PATIENCE + self.window * 2;
        let mut cpu_s_per_million = publisher.said("window", limit)?["cpu_ns"] / 1e3;
        let mut rate_hz_sum = 0.0;
        for sink in &sinks {
            let said = sink.said("window", limit)?;
            rate_hz_sum += said["rate_hz"];
            cpu_s_per_million += said["cpu_ns"] / 1e3;
        }
        let published = publisher.said("published", limit)?["count"];
        for sink in &sinks {
            let said = sink.said("received", limit)?;
            // Our publisher also counts what it tried before all subscribers were there.
            let all = side == Side::Armor || said["count"] == published;
            ensure!(said["lost"] == 0.0 && all, "{said:?} of {published} received");
        }
        Ok(match (len, rate_hz) {
            (SMALL_LEN, None) => vec![
                reading("100 B, flood", "M msg/s", rate_hz_sum / 1e6, Goal::AtLeast(6.0)),
                reading("100 B, flood, CPU", "s/M msg", cpu_s_per_million, Goal::AtMost(0.3)),
            ],
            (SMALL_LEN, Some(_)) => vec![
                reading("100 B at 10 kHz, rate", "k msg/s", rate_hz_sum / 1e3, Goal::None),
                reading("100 B at 10 kHz, CPU", "s/M msg", cpu_s_per_million, Goal::AtMost(48.0)),
            ],
            _ => {
                let goal = if subscribers == 4 { Goal::None } else { Goal::TimesStdAtLeast(1.0) };
                let figure = format!("{} to {subscribers}, sum", bytes(len));
                vec![reading(figure, "MB/s", rate_hz_sum * len as f64 / 1e6, goal)]
            }
        })
    }

    fn plain_flood(
        &self,
        len: usize,
        subscribers: usize,
        rate_hz: Option<u32>,
    ) -> Result<(Process, Vec<Process>)> {
        let rate_hz = rate_hz.map_or(0.0, f64::from);
        let arguments = [len as f64, subscribers as f64, self.window_s(), rate_hz];
        let publisher = self.plain(FIRST_CORE, "flood", &arguments)?;
        let port = publisher.said("listening", PATIENCE)?["port"];
        let sink = [port, len as f64, self.window_s()];
        let sinks = (0..subscribers).map(|_| self.plain(self.other_core(), "sink", &sink));
        Ok((publisher, sinks.collect::<Result<_>>()?))
    }

    fn our_flood(
        &self,
        len: usize,
        subscribers: usize,
        rate_hz: Option<u32>,
    ) -> Result<(Process, Vec<Process>)> {
        let mut common = set("len", len).to_vec();
        common.extend(set("window", format!("{}s", self.window_s())));
        let mut settings = common.clone();
        settings.extend(set("subscribers", subscribers));
        settings.extend(set("paced", rate_hz.is_some()));
        settings.extend(["--rate".into(), format!("{}Hz", rate_hz.unwrap_or(100))]);
        let publisher = self.component(FIRST_CORE, "flood", "flood", &settings)?;
        let sink = |index: usize| {
            let mut settings = common.clone();
            settings.extend(self.link("data", "flood.data", ",keep=all"));
            self.component(self.other_core(), "sink", &format!("sink{index}"), &settings)
        };
        Ok((publisher, (0..subscribers).map(sink).collect::<Result<_>>()?))
    }

    /// A publisher, and a process that receives from it once it publishes. Also when the second one
    /// received its first message, in milliseconds after its start.
    fn publisher_and_subscriber(
        &self,
        side: Side,
        period: Duration,
    ) -> Result<(Process, Process, f64)> {
        let (publisher, subscriber) = match side {
            Side::Std => {
                let publisher = self.plain(FIRST_CORE, "tick", &[period.as_secs_f64()])?;
                let port = publisher.said("listening", PATIENCE)?["port"];
                std::thread::sleep(IDLE / 2);
                (publisher, self.plain(self.other_core(), "first", &[port])?)
            }
            Side::Armor => {
                let rate = ["--rate".into(), format!("{}Hz", 1.0 / period.as_secs_f64())];
                let publisher = self.component(FIRST_CORE, "tick", "tick", &rate)?;
                std::thread::sleep(IDLE / 2);
                let link = self.link("data", "tick.data", "");
                (publisher, self.component(self.other_core(), "first", "first", &link)?)
            }
        };
        let first_ns = subscriber.said("first", PATIENCE)?["at_ns"];
        let first_ms = (first_ns - subscriber.started_ns as f64) / 1e6;
        Ok((publisher, subscriber, first_ms))
    }

    fn first(&self, side: Side) -> Result<Vec<Reading>> {
        let (_publisher, _subscriber, first_ms) =
            self.publisher_and_subscriber(side, Duration::from_millis(1))?;
        Ok(vec![reading("start to first message", "ms", first_ms, Goal::AtMost(5.0))])
    }

    fn idle(&self, side: Side) -> Result<Vec<Reading>> {
        let (_publisher, subscriber, _) =
            self.publisher_and_subscriber(side, Duration::from_secs(1))?;
        std::thread::sleep(IDLE);
        let rss_mb = subscriber.status("VmRSS")? * 1024.0 / 1e6;
        Ok(vec![
            reading("idle, resident", "MB", rss_mb, Goal::AtMost(4.0)),
            reading(
                "idle, of it not shared",
                "MB",
                subscriber.status("RssAnon")? * 1024.0 / 1e6,
                Goal::None,
            ),
            reading("idle, threads", "", subscriber.status("Threads")?, Goal::AtMost(6.0)),
        ])
    }
}

/// What only we do is nothing on the other side.
impl Bench {
    fn check(&self, side: Side) -> Result<Vec<Reading>> {
        if side == Side::Std {
            return Ok(Vec::new());
        }
        let file = std::env::temp_dir().join(format!("armor-bench-{}.xml", std::process::id()));
        std::fs::write(&file, crate::check::file())?;
        let arguments = [file.display().to_string(), self.window_s().to_string()];
        let checking = Process::start(FIRST_CORE, Side::Armor, "check", &arguments);
        let said = checking.and_then(|checking| checking.said("checked", PATIENCE + self.window));
        let _ = std::fs::remove_file(&file);
        let said = said?;
        let mib = said["peak_kib"] / 1024.0;
        Ok(vec![
            reading("1,000 components, check", "ms", said["p50_ms"], Goal::AtMost(100.0)),
            reading("1,000 components, first check", "ms", said["first_ms"], Goal::AtMost(100.0)),
            reading("1,000 components, memory", "MiB", mib, Goal::AtMost(50.0)),
        ])
    }
}

fn set(name: &str, value: impl ToString) -> [String; 2] {
    ["--set".into(), format!("{name}={}", value.to_string())]
}

/// 100 B, 64 KiB, 1 MiB.
fn bytes(len: usize) -> String {
    match len {
        len if len >= MIB => format!("{} MiB", len / MIB),
        len if len >= KIB && len % KIB == 0 => format!("{} KiB", len / KIB),
        len => format!("{len} B"),
    }
}
