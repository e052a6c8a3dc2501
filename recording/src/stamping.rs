//! System time for what is published by processes that do not follow it: where time follows data,
//! their source and the daemons have the host's clock.

use std::collections::VecDeque;

use armor_wire::clock::Clock;
use armor_wire::codec;

use crate::taps::TappedMessage;
use crate::trail::OWN_COMPONENT;

/// The process of configd that publishes.
const CONFIGURATION: &str = "configuration";

/// Gives each message its system time.
#[derive(Debug)]
pub(crate) struct Stamper {
    /// The data that time follows, if it follows any.
    clock: Option<String>,
    /// The last reading of it.
    now_s: Option<f64>,
    /// Messages from before the first reading.
    waiting: Vec<TappedMessage>,
    stamped: VecDeque<TappedMessage>,
}

impl Stamper {
    pub fn new(clock: Option<String>) -> Self {
        Self { clock, now_s: None, waiting: Vec::new(), stamped: VecDeque::new() }
    }

    /// Takes a message; it comes out with its system time, perhaps later.
    pub fn push(&mut self, mut message: TappedMessage) {
        let Some(clock) = &self.clock else { return self.stamped.push_back(message) };
        if message.data == *clock
            && let Ok(reading) = codec::decode::<Clock>(&message.payload)
        {
            self.now_s = Some(reading.clock);
            let waiting = std::mem::take(&mut self.waiting);
            for message in waiting.into_iter().chain([message]) {
                self.stamped.push_back(set_stamp(message, reading.clock));
            }
            return;
        }
        let component = |data: &str| data.split('.').next().unwrap_or_default().to_owned();
        let publisher = component(&message.data);
        if publisher == component(clock) {
            // What it measures has the time of its own clock.
            if let Some(stamp_s) = find_stamp(&message) {
                message.head.stamp_s = stamp_s;
                return self.stamped.push_back(message);
            }
        } else if publisher != CONFIGURATION && publisher != OWN_COMPONENT {
            return self.stamped.push_back(message);
        }
        match self.now_s {
            Some(now_s) => self.stamped.push_back(set_stamp(message, now_s)),
            None => self.waiting.push(message),
        }
    }

    /// Returns the next message.
    pub fn take(&mut self) -> Option<TappedMessage> {
        self.stamped.pop_front()
    }

    /// Returns a message that still waits for the first reading, at the end.
    pub fn take_waiting(&mut self) -> Option<TappedMessage> {
        self.waiting.pop()
    }
}

fn set_stamp(mut message: TappedMessage, stamp_s: f64) -> TappedMessage {
    message.head.stamp_s = stamp_s;
    // What the recorder itself adds begins with the same stamp.
    let is_own = message.data.split('.').next() == Some(OWN_COMPONENT);
    if is_own && let Some(first) = message.payload.copied().first_chunk_mut() {
        *first = stamp_s.to_le_bytes();
    }
    message
}

/// The stamp with which the message itself begins, if it does.
fn find_stamp(message: &TappedMessage) -> Option<f64> {
    let (_, fields) = message.output_type.schema.split_once('{')?;
    let bytes = message.payload.first_chunk().filter(|_| fields.starts_with("stamp:f64"))?;
    Some(f64::from_le_bytes(*bytes)).filter(|stamp_s| stamp_s.is_finite())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::head::MessageHead;
    use crate::writer::OutputType;

    fn message(data: &str, schema: &str, value: f64) -> TappedMessage {
        TappedMessage {
            data: data.into(),
            output_type: Arc::new(OutputType {
                name: "T".into(),
                schema: schema.into(),
                latched: false,
            }),
            head: MessageHead { stamp_s: 7.0, ..MessageHead::default() },
            payload: value.to_le_bytes().to_vec().into(),
        }
    }

    fn drain(stamper: &mut Stamper) -> Vec<(String, f64)> {
        std::iter::from_fn(|| stamper.take()).map(|it| (it.data, it.head.stamp_s)).collect()
    }

    fn expected<const N: usize>(messages: [(&str, f64); N]) -> Vec<(String, f64)> {
        messages.map(|(data, stamp_s)| (data.to_owned(), stamp_s)).into()
    }

    #[test]
    fn what_does_not_follow_the_time_gets_it() {
        let mut stamper = Stamper::new(Some("sim.clock".into()));
        stamper.push(message("configuration.state", "T{stamp:f64(s)}", 3.0));
        stamper.push(message("sim.flag", "T{x:f64}", 3.0));
        stamper.push(message("armor.logs", "T{stamp:f64(s)}", 3.0));
        assert_eq!(drain(&mut stamper), [], "the time is not known");
        stamper.push(message("sim.clock", "Clock{clock:f64}", 100.0));
        let mut passed = std::iter::from_fn(|| stamper.take()).collect::<Vec<_>>();
        let payload = passed.remove(2).payload;
        assert_eq!(*payload, 100.0_f64.to_le_bytes(), "the stamp in the message, too");
        let first = [("configuration.state", 100.0), ("sim.flag", 100.0), ("sim.clock", 100.0)];
        let passed: Vec<_> = passed.into_iter().map(|it| (it.data, it.head.stamp_s)).collect();
        assert_eq!(passed, expected(first));
        stamper.push(message("sim.scan", "T{stamp:f64(s),x:f64}", 99.5));
        stamper.push(message("sim.flag", "T{x:f64}", 3.0));
        stamper.push(message("slam.pose", "T{stamp:f64(s)}", 3.0));
        let later = [("sim.scan", 99.5), ("sim.flag", 100.0), ("slam.pose", 7.0)];
        assert_eq!(drain(&mut stamper), expected(later));
    }

    #[test]
    fn without_such_a_clock_every_stamp_is_right() {
        let mut stamper = Stamper::new(None);
        stamper.push(message("sim.clock", "Clock{clock:f64}", 100.0));
        assert_eq!(drain(&mut stamper), expected([("sim.clock", 7.0)]));
    }
}
