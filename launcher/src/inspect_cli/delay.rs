//! `armor delay DATA`: how old data are when they arrive.

mod age;
mod system_time;

use std::process::ExitCode;

use anyhow::Result;
use armor_inspect::FollowingTap;
use armor_sdk::tap::TapData;
use armor_wire::schema::{FieldPath, Scalar, Schema, parse};
use clap::Args;

use super::measurement::{Measurement, MeasuringArguments, print_measurement};
use crate::arguments::OutputFormat;
use crate::verb::Verb;
use age::{AgeWindow, DelaySummary};
use system_time::{MeasuredTime, ProviderClock};

/// The field in which a message has the time of what it describes, such as that of its measurement.
const STAMP: &str = "stamp";

/// Measure how old data are when they arrive: the time since they were published, and for messages
/// with a stamp also the time since that.
///
/// The error of both clocks together is shown with `clock`: an age below it means nothing. In a system
/// whose time follows data, ages are in that time, and no finer than its steps.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor delay simulator.scan              a line per second, and one for the messages' own stamps
  armor delay simulator.scan --count 5    the next five seconds
  armor delay simulator.scan --for 10s    one result over ten seconds")]
pub struct DelayArguments {
    #[command(flatten)]
    measuring: MeasuringArguments,
}

impl Verb for DelayArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(print_measurement(&self.measuring, "delay", format, DelayMeasurement::begin)?.into())
    }
}

struct DelayMeasurement {
    time: MeasuredTime,
    provider: ProviderClock,
    schema: Schema,
    published: AgeWindow,
    stamped: AgeWindow,
    received: u64,
    lost: u64,
}

impl DelayMeasurement {
    fn begin(following: &FollowingTap) -> Result<Self> {
        let provider = ProviderClock::new(following.observed(), following.data());
        let time = MeasuredTime::find(following.observed(), following.data())?;
        // The text is the same for all starts of a provider, unless its executable is replaced.
        let schema = parse(&following.schema().to_string())?;
        Ok(Self {
            time,
            provider,
            schema,
            published: AgeWindow::default(),
            stamped: AgeWindow::default(),
            received: 0,
            lost: 0,
        })
    }
}

impl Measurement for DelayMeasurement {
    type Summary = DelaySummary;

    fn add(&mut self, _: f64, item: &TapData) {
        self.received += 1;
        self.lost += item.lost;
        self.provider.note_instance(item.header.instance);
        let Some(now_s) = self.time.now_s() else { return };
        self.published.add(now_s - item.header.stamp_s);
        if let Some(stamp_s) = read_stamp(&self.schema, &item.payload) {
            self.stamped.add(now_s - stamp_s);
        }
    }

    fn close(&mut self, _: f64) -> DelaySummary {
        let errors_s = [self.time.error_s(), self.provider.error_s()];
        DelaySummary {
            published: self.published.close(),
            stamp: self.stamped.close(),
            clock_error_s: errors_s.into_iter().sum(),
            clock: self.time.source().map(str::to_owned),
            received: std::mem::take(&mut self.received),
            lost: std::mem::take(&mut self.lost),
        }
    }
}

/// Returns the stamp that a message has; none if it has no such field, or one that was never set.
fn read_stamp(schema: &Schema, payload: &[u8]) -> Option<f64> {
    let path = FieldPath::find(schema, &[STAMP]).ok()?;
    match path.read(schema, payload).ok()?? {
        Scalar::Number(stamp_s) if stamp_s > 0.0 => Some(stamp_s),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stamp_of_a_message_is_read_if_it_has_one() {
        let stamped = parse("Scan{frame:string,stamp:f64(s)}").expect("a schema");
        let payload =
            |stamp_s: f64| [&1_u64.to_le_bytes()[..], b"a", &stamp_s.to_le_bytes()].concat();
        assert_eq!(read_stamp(&stamped, &payload(7.5)), Some(7.5));
        assert_eq!(read_stamp(&stamped, &payload(0.0)), None, "it was never set");
        assert_eq!(read_stamp(&stamped, &[1, 2]), None, "it is not such a message");
        let plain = parse("Number{data:f64}").expect("a schema");
        assert_eq!(read_stamp(&plain, &7.5_f64.to_le_bytes()), None);
    }
}
