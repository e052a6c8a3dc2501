//! How old data are when a component gets them that is slower than their publisher: always, or now and
//! then. There is no counterpart in plain TCP, which keeps everything.

use std::time::{Duration, Instant};

use anyhow::Result;
use armor_sdk::prelude::*;

use crate::bench::{Bench, FIRST_CORE};
use crate::figure::{Contender, Figure, FigureGoal};
use crate::readings::monotonic_ns;

/// Rate of the publisher.
const RATE_HZ: u32 = 30;
/// What a slow call takes.
const SLOW: Duration = Duration::from_millis(200);
/// A subscriber that is slow now and then: so many calls of each sort.
const TURNS: usize = 20;
/// Shortest measurement, with the first second: slow calls are few.
const AT_LEAST: Duration = Duration::from_secs(10);
/// How long the processes have to start and to link.
const PATIENCE: Duration = Duration::from_secs(20);
/// One period, and 10 ms.
const GOAL_MS: f64 = 43.3;

/// A message that contains when it was published, on the clock that all processes share.
#[derive(Message, Clone, Debug, PartialEq)]
struct TimedBlob {
    published_ns: u64,
    bytes: Array<u8>,
}

/// Publishes at its rate.
pub struct TimedPublisher {
    armor: Armor,
    message: TimedBlob,
}

impl Component for TimedPublisher {
    const KIND: &'static str = "timed-publisher";
    const SUMMARY: &'static str = "Publishes the time at its rate.";
    const PARAMETERS: &'static [Parameter] =
        &[Parameter::integer("len").range(0.0, 6e7).doc("bytes in a message")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<TimedBlob>("data")?;
        armor.get_parameter("len")?;
        armor.synchronize()?;
        Ok(Self { armor, message: TimedBlob { published_ns: 0, bytes: Vec::new().into() } })
    }

    fn parameter_received(&mut self, _: &str, value: &Value) -> Result<(), Fault> {
        self.message.bytes = vec![0x5a; value.integer()? as usize].into();
        Ok(())
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        self.message.published_ns = monotonic_ns();
        self.armor.send_data("data", &self.message)?;
        Ok(Outcome::CarryOn)
    }
}

/// Takes its time for a message, and prints how old they were.
pub struct SlowSubscriber {
    turns: usize,
    window: Duration,
    start: Option<Instant>,
    ages_ms: Vec<f64>,
}

impl Component for SlowSubscriber {
    const KIND: &'static str = "slow-subscriber";
    const SUMMARY: &'static str = "Is slower than its publisher.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::number("window", "s").doc("how long is measured"),
        Parameter::integer("turns").doc("calls that are fast, then slow; 0: all are slow"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<TimedBlob>("data")?;
        armor.get_parameter("window")?;
        armor.get_parameter("turns")?;
        armor.synchronize()?;
        Ok(Self { turns: 0, window: Duration::ZERO, start: None, ages_ms: Vec::new() })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "turns" => self.turns = value.integer()? as usize,
            _ => self.window = Duration::try_from_secs_f64(value.number()?)?,
        }
        Ok(())
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        // The first field; the rest is not copied.
        let Some(published) = data.bytes().first_chunk::<8>() else {
            return Err("a message without a time".into());
        };
        let age_ns = monotonic_ns().saturating_sub(u64::from_le_bytes(*published));
        self.ages_ms.push(age_ns as f64 / 1e6);
        let start = *self.start.get_or_insert_with(Instant::now);
        if start.elapsed() > self.window && !self.window.is_zero() {
            self.window = Duration::ZERO;
            let mut ages = self.ages_ms.clone();
            ages.sort_by(f64::total_cmp);
            let at = |share: f64| ages[((ages.len() - 1) as f64 * share).round() as usize];
            println!(
                "ages n={} p50_ms={:.2} p99_ms={:.2} most_ms={:.2}",
                ages.len(),
                at(0.5),
                at(0.99),
                at(1.0)
            );
        }
        let is_slow = self.turns == 0 || self.ages_ms.len() / self.turns % 2 == 1;
        if is_slow {
            std::thread::sleep(SLOW);
        }
        Ok(())
    }
}

impl Bench {
    /// Measures the ages of messages of one length at a slow subscriber.
    pub fn measure_freshness(
        &self,
        side: Contender,
        len: usize,
        (always, tcp): (bool, bool),
    ) -> Result<Vec<Figure>> {
        if side == Contender::Std {
            return Ok(Vec::new());
        }
        let window = self.window.max(AT_LEAST);
        let set = |name: &str, value: String| ["--set".to_owned(), format!("{name}={value}")];
        let mut settings = set("len", len.to_string()).to_vec();
        settings.extend(["--rate".into(), format!("{RATE_HZ}Hz")]);
        let _publisher = self.start_component(FIRST_CORE, "timed-publisher", "timed", &settings)?;
        let mut settings = set("window", format!("{}s", window.as_secs_f64())).to_vec();
        settings.extend(set("turns", if always { 0 } else { TURNS }.to_string()));
        let how = if tcp { ",transport=tcp" } else { "" };
        settings.extend(self.link_arguments("data", "timed.data", how));
        let subscriber =
            self.start_component(self.other_core(), "slow-subscriber", "slow", &settings)?;
        let ages = subscriber.wait_for_line("ages", PATIENCE + window)?;
        let when = if always { "always slow" } else { "slow now and then" };
        let transport = if tcp { ", TCP" } else { "" };
        let what = format!("age of {len} B, {when}{transport}");
        Ok(vec![
            Figure::new(format!("{what}, p50"), "ms", ages["p50_ms"], FigureGoal::None),
            Figure::new(format!("{what}, p99"), "ms", ages["p99_ms"], FigureGoal::AtMost(GOAL_MS)),
            Figure::new(format!("{what}, most"), "ms", ages["most_ms"], FigureGoal::None),
        ])
    }
}
