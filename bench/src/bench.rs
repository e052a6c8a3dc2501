//! Does the jobs: each starts its processes on one side and returns the figures that they print.

use std::net::SocketAddr;
use std::time::Duration;

use anyhow::{Result, ensure};
use armor_registry::BackgroundRegistry;

use crate::figure::{Contender, Figure, FigureGoal};
use crate::job::{BenchJob, KIB, MIB, SMALL_LEN};
use crate::options::BenchOptions;
use crate::process::RoleProcess;

/// The rate of a robot's fast loops.
const PACE_HZ: u32 = 10_000;
/// How long a role may take beyond what it measures.
const PATIENCE: Duration = Duration::from_secs(20);
/// How long an idle process is left alone before its memory is read.
const IDLE: Duration = Duration::from_secs(2);

/// Does the jobs. Its registry serves all of them.
pub struct Bench {
    registry: BackgroundRegistry,
    pub window: Duration,
    same_core: bool,
    runs: u32,
}

/// The publishing or asking process is on core 0; the others on core 1, or on the same.
pub const FIRST_CORE: usize = 0;

impl Bench {
    pub fn new(options: &BenchOptions) -> Result<Self> {
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
    pub fn measure(&mut self, job: BenchJob, side: Contender) -> Result<Vec<Figure>> {
        // The registry may still list the components of the previous run.
        self.runs += 1;
        match job {
            BenchJob::RoundTrip { len, spin } => self.measure_round_trip(side, len, spin),
            BenchJob::Flood => self.measure_flood(side, SMALL_LEN, 1, None),
            BenchJob::FanOut { subscribers } => self.measure_flood(side, MIB, subscribers, None),
            BenchJob::Paced => self.measure_flood(side, SMALL_LEN, 1, Some(PACE_HZ)),
            BenchJob::First => self.measure_first(side),
            BenchJob::Idle => self.measure_idle(side),
            BenchJob::Check => self.measure_check(side),
            BenchJob::Reaction { on_disk } => self.measure_reaction(side, on_disk),
            BenchJob::Freshness { len, always, tcp } => {
                self.measure_freshness(side, len, (always, tcp))
            }
        }
    }

    pub fn other_core(&self) -> usize {
        if self.same_core { FIRST_CORE } else { 1 }
    }

    fn start_tcp_role(&self, core: usize, role: &str, arguments: &[f64]) -> Result<RoleProcess> {
        let arguments: Vec<_> = arguments.iter().map(ToString::to_string).collect();
        RoleProcess::start(core, Contender::Std, role, &arguments)
    }

    /// The name of a component of this run in the system.
    fn name(&self, name: &str) -> String {
        format!("{name}-{}", self.runs)
    }

    pub fn start_component(
        &self,
        core: usize,
        kind: &str,
        name: &str,
        settings: &[String],
    ) -> Result<RoleProcess> {
        let registry = self.registry.address();
        let mut arguments: Vec<String> =
            vec!["--alone".into(), "--name".into(), self.name(name), "--registry".into()];
        arguments.push(registry.to_string());
        arguments.extend_from_slice(settings);
        RoleProcess::start(core, Contender::Armor, kind, &arguments)
    }

    pub fn link_arguments(&self, input: &str, output: &str, how: &str) -> [String; 2] {
        let (component, output) = output.split_once('.').unwrap_or((output, "data"));
        ["--link".into(), format!("{input}={}.{output}{how}", self.name(component))]
    }

    fn window_s(&self) -> f64 {
        self.window.as_secs_f64()
    }

    fn measure_round_trip(&self, side: Contender, len: usize, spin: bool) -> Result<Vec<Figure>> {
        // Kept alive until the figures have been printed.
        let (_other, ping) = match side {
            Contender::Std => {
                let spin = f64::from(u8::from(spin));
                let echo = self.start_tcp_role(self.other_core(), "echo", &[len as f64, spin])?;
                let port = echo.wait_for_line("listening", PATIENCE)?["port"];
                let arguments = [port, spin, len as f64, self.window_s()];
                let ping = self.start_tcp_role(FIRST_CORE, "ping", &arguments)?;
                (echo, ping)
            }
            Contender::Armor => {
                let how = if spin { ",wake=spin,transport=shm" } else { "" };
                let mut settings = set_argument("len", len).to_vec();
                settings.extend(self.link_arguments("ping", "ping.ping", how));
                let echo = self.start_component(self.other_core(), "echo", "echo", &settings)?;
                let mut settings = set_argument("len", len).to_vec();
                settings.extend(set_argument("window", format!("{}s", self.window_s())));
                settings.extend(self.link_arguments("pong", "echo.pong", how));
                let ping = self.start_component(FIRST_CORE, "ping", "ping", &settings)?;
                (echo, ping)
            }
        };
        let reported = ping.wait_for_line("round", PATIENCE + self.window * 2)?;
        let goal = match (len, spin) {
            (_, true) if len > KIB => FigureGoal::AtMost(6.0),
            (_, true) => FigureGoal::AtMost(3.0),
            (..=KIB, _) if self.same_core => FigureGoal::TimesStdAtMost(1.3),
            _ if self.same_core => FigureGoal::None,
            (..=65_536, _) => FigureGoal::TimesStdAtMost(1.05),
            (MIB, _) => FigureGoal::TimesStdAtMost(0.88),
            _ => FigureGoal::None,
        };
        let what =
            format!("round trip{}, {}", if spin { " spinning" } else { "" }, format_bytes(len));
        Ok(vec![
            Figure::new(format!("{what}, p50"), "µs", reported["p50_us"], goal),
            Figure::new(format!("{what}, p99"), "µs", reported["p99_us"], FigureGoal::None),
        ])
    }

    fn measure_flood(
        &self,
        side: Contender,
        len: usize,
        subscribers: usize,
        rate_hz: Option<u32>,
    ) -> Result<Vec<Figure>> {
        let (publisher, sinks) = match side {
            Contender::Std => self.start_tcp_flood(len, subscribers, rate_hz)?,
            Contender::Armor => self.start_sdk_flood(len, subscribers, rate_hz)?,
        };
        let limit = PATIENCE + self.window * 2;
        let mut cpu_s_per_million = publisher.wait_for_line("window", limit)?["cpu_ns"] / 1e3;
        let mut rate_hz_sum = 0.0;
        for sink in &sinks {
            let reported = sink.wait_for_line("window", limit)?;
            rate_hz_sum += reported["rate_hz"];
            cpu_s_per_million += reported["cpu_ns"] / 1e3;
        }
        let published = publisher.wait_for_line("published", limit)?["count"];
        for sink in &sinks {
            let reported = sink.wait_for_line("received", limit)?;
            // Armor's publisher also counts what it sent before all subscribers were connected.
            let all = side == Contender::Armor || reported["count"] == published;
            ensure!(reported["lost"] == 0.0 && all, "{reported:?} of {published} received");
        }
        Ok(match (len, rate_hz) {
            (SMALL_LEN, None) => vec![
                Figure::new("100 B, flood", "M msg/s", rate_hz_sum / 1e6, FigureGoal::AtLeast(6.0)),
                Figure::new(
                    "100 B, flood, CPU",
                    "s/M msg",
                    cpu_s_per_million,
                    FigureGoal::AtMost(0.3),
                ),
            ],
            (SMALL_LEN, Some(_)) => vec![
                Figure::new(
                    "100 B at 10 kHz, rate",
                    "k msg/s",
                    rate_hz_sum / 1e3,
                    FigureGoal::None,
                ),
                Figure::new(
                    "100 B at 10 kHz, CPU",
                    "s/M msg",
                    cpu_s_per_million,
                    FigureGoal::AtMost(48.0),
                ),
            ],
            _ => {
                let goal = if subscribers == 4 {
                    FigureGoal::None
                } else {
                    FigureGoal::TimesStdAtLeast(1.0)
                };
                let name = format!("{} to {subscribers}, sum", format_bytes(len));
                vec![Figure::new(name, "MB/s", rate_hz_sum * len as f64 / 1e6, goal)]
            }
        })
    }

    fn start_tcp_flood(
        &self,
        len: usize,
        subscribers: usize,
        rate_hz: Option<u32>,
    ) -> Result<(RoleProcess, Vec<RoleProcess>)> {
        let rate_hz = rate_hz.map_or(0.0, f64::from);
        let arguments = [len as f64, subscribers as f64, self.window_s(), rate_hz];
        let publisher = self.start_tcp_role(FIRST_CORE, "flood", &arguments)?;
        let port = publisher.wait_for_line("listening", PATIENCE)?["port"];
        let sink = [port, len as f64, self.window_s()];
        let sinks = (0..subscribers).map(|_| self.start_tcp_role(self.other_core(), "sink", &sink));
        Ok((publisher, sinks.collect::<Result<_>>()?))
    }

    fn start_sdk_flood(
        &self,
        len: usize,
        subscribers: usize,
        rate_hz: Option<u32>,
    ) -> Result<(RoleProcess, Vec<RoleProcess>)> {
        let mut common = set_argument("len", len).to_vec();
        common.extend(set_argument("window", format!("{}s", self.window_s())));
        let mut settings = common.clone();
        settings.extend(set_argument("subscribers", subscribers));
        settings.extend(set_argument("paced", rate_hz.is_some()));
        settings.extend(["--rate".into(), format!("{}Hz", rate_hz.unwrap_or(100))]);
        let publisher = self.start_component(FIRST_CORE, "flood", "flood", &settings)?;
        let sink = |index: usize| {
            let mut settings = common.clone();
            settings.extend(self.link_arguments("data", "flood.data", ",keep=all"));
            self.start_component(self.other_core(), "sink", &format!("sink{index}"), &settings)
        };
        Ok((publisher, (0..subscribers).map(sink).collect::<Result<_>>()?))
    }

    /// Starts a publisher, then a subscriber. Returns both, and the time from the subscriber's
    /// start to its first message in milliseconds.
    fn start_publisher_and_subscriber(
        &self,
        side: Contender,
        period: Duration,
    ) -> Result<(RoleProcess, RoleProcess, f64)> {
        let (publisher, subscriber) = match side {
            Contender::Std => {
                let publisher = self.start_tcp_role(FIRST_CORE, "tick", &[period.as_secs_f64()])?;
                let port = publisher.wait_for_line("listening", PATIENCE)?["port"];
                std::thread::sleep(IDLE / 2);
                (publisher, self.start_tcp_role(self.other_core(), "first", &[port])?)
            }
            Contender::Armor => {
                let rate = ["--rate".into(), format!("{}Hz", 1.0 / period.as_secs_f64())];
                let publisher = self.start_component(FIRST_CORE, "tick", "tick", &rate)?;
                std::thread::sleep(IDLE / 2);
                let link = self.link_arguments("data", "tick.data", "");
                (publisher, self.start_component(self.other_core(), "first", "first", &link)?)
            }
        };
        let first_ns = subscriber.wait_for_line("first", PATIENCE)?["at_ns"];
        let first_ms = (first_ns - subscriber.started_ns as f64) / 1e6;
        Ok((publisher, subscriber, first_ms))
    }

    fn measure_first(&self, side: Contender) -> Result<Vec<Figure>> {
        let (_publisher, _subscriber, first_ms) =
            self.start_publisher_and_subscriber(side, Duration::from_millis(1))?;
        Ok(vec![Figure::new("start to first message", "ms", first_ms, FigureGoal::AtMost(5.0))])
    }

    fn measure_idle(&self, side: Contender) -> Result<Vec<Figure>> {
        let (_publisher, subscriber, _) =
            self.start_publisher_and_subscriber(side, Duration::from_secs(1))?;
        std::thread::sleep(IDLE);
        let rss_mb = subscriber.read_status("VmRSS")? * 1024.0 / 1e6;
        Ok(vec![
            Figure::new("idle, resident", "MB", rss_mb, FigureGoal::AtMost(4.0)),
            Figure::new(
                "idle, of it not shared",
                "MB",
                subscriber.read_status("RssAnon")? * 1024.0 / 1e6,
                FigureGoal::None,
            ),
            Figure::new(
                "idle, threads",
                "",
                subscriber.read_status("Threads")?,
                FigureGoal::AtMost(6.0),
            ),
        ])
    }
}

/// Jobs without a counterpart in plain TCP: they return no figures for that side.
impl Bench {
    fn measure_check(&self, side: Contender) -> Result<Vec<Figure>> {
        if side == Contender::Std {
            return Ok(Vec::new());
        }
        let file = std::env::temp_dir().join(format!("armor-bench-{}.xml", std::process::id()));
        std::fs::write(&file, crate::large_file::write_large_file())?;
        let arguments = [file.display().to_string(), self.window_s().to_string()];
        let checking = RoleProcess::start(FIRST_CORE, Contender::Armor, "check", &arguments);
        let reported =
            checking.and_then(|checking| checking.wait_for_line("checked", PATIENCE + self.window));
        let _ = std::fs::remove_file(&file);
        let reported = reported?;
        let mib = reported["peak_kib"] / 1024.0;
        Ok(vec![
            Figure::new(
                "1,000 components, check",
                "ms",
                reported["p50_ms"],
                FigureGoal::AtMost(100.0),
            ),
            Figure::new(
                "1,000 components, first check",
                "ms",
                reported["first_ms"],
                FigureGoal::AtMost(100.0),
            ),
            Figure::new("1,000 components, memory", "MiB", mib, FigureGoal::AtMost(50.0)),
        ])
    }
}

fn set_argument(name: &str, value: impl ToString) -> [String; 2] {
    ["--set".into(), format!("{name}={}", value.to_string())]
}

/// 100 B, 64 KiB, 1 MiB.
fn format_bytes(len: usize) -> String {
    match len {
        len if len >= MIB => format!("{} MiB", len / MIB),
        len if len >= KIB && len % KIB == 0 => format!("{} KiB", len / KIB),
        len => format!("{len} B"),
    }
}
