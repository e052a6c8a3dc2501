//! A writer that stamps each message and measures how late it is, and readers that measure the age of
//! what they have. Both print one line for each window.

use std::time::{Duration, Instant};

use armor_sdk::prelude::*;

use crate::readings::{monotonic_ns, percentile_us};

const LEN: Parameter = Parameter::integer("len").range(0.0, 6e7).doc("bytes in a message");
const WINDOW: Parameter = Parameter::number("window", "s").doc("between two lines");

/// A message that states when it was sent.
#[derive(Message, Clone, Debug, PartialEq)]
struct StampedBlob {
    sent_ns: u64,
    bytes: Array<u8>,
}

/// Publishes at a rate, on a thread of its own, so that it is known when each write is due.
pub struct StampedWriter {
    armor: Armor,
    len: usize,
    period: Duration,
    /// How many writes for each trigger.
    triggered: usize,
    window: Duration,
}

impl Component for StampedWriter {
    const KIND: &'static str = "stamped-writer";
    const SUMMARY: &'static str = "Publishes stamped messages, and how late they are.";
    const PARAMETERS: &'static [Parameter] = &[
        LEN,
        WINDOW,
        Parameter::number("period", "s").doc("between two writes"),
        Parameter::integer("triggered").default("1").doc("writes for each trigger"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<StampedBlob>("value")?;
        armor.provide::<StampedBlob>("trigger")?;
        for parameter in Self::PARAMETERS {
            armor.get_parameter(&parameter.manifest().name)?;
        }
        armor.synchronize()?;
        Ok(Self { armor, len: 0, period: Duration::ZERO, triggered: 1, window: Duration::ZERO })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "len" => self.len = value.integer()? as usize,
            "triggered" => self.triggered = (value.integer()? as usize).max(1),
            "period" => self.period = Duration::try_from_secs_f64(value.number()?)?,
            _ => self.window = Duration::try_from_secs_f64(value.number()?)?,
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            let (armor, window) = (self.armor.clone(), self.window);
            let pace = (self.period, self.triggered);
            let message = StampedBlob { sent_ns: 0, bytes: vec![0x5a; self.len].into() };
            std::thread::Builder::new().name("writer".into()).spawn(move || {
                if let Err(error) = write_for_ever(&armor, message, pace, window) {
                    println!("failed {error}");
                }
            })?;
        }
        Ok(Outcome::CarryOn)
    }
}

fn write_for_ever(
    armor: &Armor,
    mut message: StampedBlob,
    (period, triggered): (Duration, usize),
    window: Duration,
) -> Result<(), Fault> {
    let mut trigger = StampedBlob { sent_ns: 0, bytes: Array::default() };
    let mut late_ns = Vec::new();
    loop {
        let begun = Instant::now();
        let mut due = begun;
        while begun.elapsed() < window {
            due += period;
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            message.sent_ns = monotonic_ns();
            armor.send_data("value", &message)?;
            late_ns.push(due.elapsed().as_nanos() as u64);
            if late_ns.len() % triggered == 0 {
                trigger.sent_ns = monotonic_ns();
                armor.send_data("trigger", &trigger)?;
            }
        }
        println!(
            "writes n={} late_p50_us={} late_p99_us={} late_most_us={}",
            late_ns.len(),
            percentile_us(&mut late_ns, 0.5),
            percentile_us(&mut late_ns, 0.99),
            percentile_us(&mut late_ns, 1.0)
        );
        late_ns.clear();
    }
}

/// Measures the age of what it receives.
pub struct StampedReader {
    work: Duration,
    window: Duration,
    begun: Instant,
    last_sent_ns: Option<u64>,
    /// Of each message when it arrived.
    arrived_ns: Vec<u64>,
    /// Of each message when the next one arrived.
    replaced_ns: Vec<u64>,
    /// Of each trigger when it arrived.
    triggered_ns: Vec<u64>,
}

impl Component for StampedReader {
    const KIND: &'static str = "stamped-reader";
    const SUMMARY: &'static str = "Measures the age of what it receives.";
    const PARAMETERS: &'static [Parameter] =
        &[WINDOW, Parameter::number("work", "s").doc("how long each message takes")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Optional<StampedBlob>>("value")?;
        armor.subscribe::<Optional<StampedBlob>>("trigger")?;
        for parameter in Self::PARAMETERS {
            armor.get_parameter(&parameter.manifest().name)?;
        }
        armor.synchronize()?;
        Ok(Self {
            work: Duration::ZERO,
            window: Duration::ZERO,
            begun: Instant::now(),
            last_sent_ns: None,
            arrived_ns: Vec::new(),
            replaced_ns: Vec::new(),
            triggered_ns: Vec::new(),
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let time = Duration::try_from_secs_f64(value.number()?)?;
        if name == "work" {
            self.work = time;
        } else {
            self.window = time;
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let now_ns = monotonic_ns();
        let StampedBlob { sent_ns, .. } = data.decode()?;
        if header.id() == "trigger" {
            self.triggered_ns.push(now_ns.saturating_sub(sent_ns));
        } else {
            let now_ns = monotonic_ns();
            self.arrived_ns.push(now_ns.saturating_sub(sent_ns));
            if let Some(last) = self.last_sent_ns.replace(sent_ns) {
                self.replaced_ns.push(now_ns.saturating_sub(last));
            }
            std::thread::sleep(self.work);
        }
        if self.begun.elapsed() > self.window {
            println!(
                "triggers n={} p50_us={} p99_us={}",
                self.triggered_ns.len(),
                percentile_us(&mut self.triggered_ns, 0.5),
                percentile_us(&mut self.triggered_ns, 0.99),
            );
            println!(
                "ages n={} p50_us={} p99_us={} replaced_p99_us={}",
                self.arrived_ns.len(),
                percentile_us(&mut self.arrived_ns, 0.5),
                percentile_us(&mut self.arrived_ns, 0.99),
                percentile_us(&mut self.replaced_ns, 0.99)
            );
            let mut pulls = crate::pull_times::take();
            println!(
                "pulls n={} p50_us={} p99_us={} taking_p50_us={} taking_p99_us={}",
                pulls.took_ns.len(),
                percentile_us(&mut pulls.took_ns, 0.5),
                percentile_us(&mut pulls.took_ns, 0.99),
                percentile_us(&mut pulls.taking_ns, 0.5),
                percentile_us(&mut pulls.taking_ns, 0.99),
            );
            self.arrived_ns.clear();
            self.replaced_ns.clear();
            self.triggered_ns.clear();
            self.begun = Instant::now();
        }
        Ok(())
    }
}
