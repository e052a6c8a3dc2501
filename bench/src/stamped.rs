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

/// Publishes at its rate.
pub struct StampedWriter {
    armor: Armor,
    message: StampedBlob,
    window: Duration,
    begun: Instant,
    /// Start and end of each write.
    writes_ns: Vec<(u64, u64)>,
}

impl Component for StampedWriter {
    const KIND: &'static str = "stamped-writer";
    const SUMMARY: &'static str = "Publishes stamped messages, and how late they are.";
    const PARAMETERS: &'static [Parameter] = &[LEN, WINDOW];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<StampedBlob>("value")?;
        armor.provide::<Count>("trigger")?;
        for parameter in Self::PARAMETERS {
            armor.get_parameter(&parameter.manifest().name)?;
        }
        armor.synchronize()?;
        let message = StampedBlob { sent_ns: 0, bytes: Vec::new().into() };
        let (window, begun, writes_ns) = (Duration::ZERO, Instant::now(), Vec::new());
        Ok(Self { armor, message, window, begun, writes_ns })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "len" => self.message.bytes = vec![0x5a; value.integer()? as usize].into(),
            "window" => self.window = Duration::try_from_secs_f64(value.number()?)?,
            _ => {}
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call != Call::Tick {
            return Ok(Outcome::CarryOn);
        }
        let start_ns = monotonic_ns();
        self.message.sent_ns = start_ns;
        self.armor.send_data("value", &self.message)?;
        self.writes_ns.push((start_ns, monotonic_ns()));
        self.armor.send_data("trigger", &Count { count: self.writes_ns.len() as u64 })?;
        if self.begun.elapsed() > self.window {
            let mut late_ns = list_lateness(&self.writes_ns);
            println!(
                "writes n={} late_p50_us={} late_p99_us={} late_most_us={}",
                late_ns.len(),
                percentile_us(&mut late_ns, 0.5),
                percentile_us(&mut late_ns, 0.99),
                percentile_us(&mut late_ns, 1.0)
            );
            self.writes_ns.clear();
            self.begun = Instant::now();
        }
        Ok(Outcome::CarryOn)
    }
}

/// The period of the writer in the measurement of its lateness.
pub const PERIOD_NS: u64 = 1_000_000;

/// How long after its tick each write has ended. A component does not know when its ticks are due: they
/// are a period apart, and the write that began earliest in its period began at its tick.
fn list_lateness(writes_ns: &[(u64, u64)]) -> Vec<u64> {
    let Some((first, _)) = writes_ns.first() else { return Vec::new() };
    let period = PERIOD_NS as i64;
    let since = |at: u64| at as i64 - *first as i64;
    let tick_of = |start: u64| (since(start) + period / 2).div_euclid(period) * period;
    let earliest = writes_ns.iter().map(|(start, _)| since(*start) - tick_of(*start)).min();
    let earliest = earliest.unwrap_or_default();
    let late = |(start, end): &(u64, u64)| since(*end) - tick_of(*start) - earliest;
    writes_ns.iter().map(|write| late(write).max(0) as u64).collect()
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
}

impl Component for StampedReader {
    const KIND: &'static str = "stamped-reader";
    const SUMMARY: &'static str = "Measures the age of what it receives.";
    const PARAMETERS: &'static [Parameter] =
        &[WINDOW, Parameter::number("work", "s").doc("how long each message takes")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<StampedBlob>("value")?;
        armor.subscribe::<Optional<Count>>("trigger")?;
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
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let time = Duration::try_from_secs_f64(value.number()?)?;
        if name == "work" {
            self.work = time
        } else {
            self.window = time
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        if header.id() != "value" {
            return Ok(());
        }
        let StampedBlob { sent_ns, .. } = data.decode()?;
        let now_ns = monotonic_ns();
        self.arrived_ns.push(now_ns.saturating_sub(sent_ns));
        if let Some(last) = self.last_sent_ns.replace(sent_ns) {
            self.replaced_ns.push(now_ns.saturating_sub(last));
        }
        std::thread::sleep(self.work);
        if self.begun.elapsed() > self.window {
            println!(
                "ages n={} p50_us={} p99_us={} replaced_p99_us={}",
                self.arrived_ns.len(),
                percentile_us(&mut self.arrived_ns, 0.5),
                percentile_us(&mut self.arrived_ns, 0.99),
                percentile_us(&mut self.replaced_ns, 0.99)
            );
            self.arrived_ns.clear();
            self.replaced_ns.clear();
            self.begun = Instant::now();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_write_is_late_by_the_time_since_its_tick() {
        let at = |tick: u64, start: u64, end: u64| {
            let tick_ns = 7_000_000 + tick * PERIOD_NS;
            (tick_ns + start, tick_ns + end)
        };
        // The third tick was skipped.
        let writes = [at(0, 50, 60), at(1, 0, 10), at(3, 200_000, 210_000), at(4, 30, 300_000)];
        assert_eq!(list_lateness(&writes), [60, 10, 210_000, 300_000]);
        assert!(list_lateness(&[]).is_empty());
    }
}
