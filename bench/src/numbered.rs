//! Roles that see whether shared memory keeps its word: messages full of their own number, from a
//! publisher that measures its ticks, to a subscriber that looks for a message that is not whole, not
//! new, or changes while it is held.

use std::time::{Duration, Instant};

use armor_sdk::prelude::*;

use crate::readings::monotonic_ns;

/// The interval at which each of them prints what it has counted.
const PRINT: Duration = Duration::from_millis(250);
/// One of so many words of a message is looked at: each page of memory, and some more.
const STEP: usize = 512 - 1;

const LEN: Parameter = Parameter::integer("len").range(8.0, 6e7).doc("bytes in a message");

/// A message that is full of its number.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(view)]
struct NumberedBlob {
    words: Array<u64>,
}

/// Publishes the next number at its rate.
pub struct NumberedPublisher {
    armor: Armor,
    message: NumberedBlob,
    next: u64,
    last_tick_ns: u64,
    intervals_ns: Vec<u64>,
    sends_ns: Vec<u64>,
    printed: Instant,
}

impl Component for NumberedPublisher {
    const KIND: &'static str = "numbered-publisher";
    const SUMMARY: &'static str = "Publishes messages that are full of their number.";
    const PARAMETERS: &'static [Parameter] = &[LEN];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<NumberedBlob>("data")?;
        armor.get_parameter("len")?;
        armor.synchronize()?;
        Ok(Self {
            armor,
            message: NumberedBlob { words: Vec::new().into() },
            next: 0,
            last_tick_ns: 0,
            intervals_ns: Vec::new(),
            sends_ns: Vec::new(),
            printed: Instant::now(),
        })
    }

    fn parameter_received(&mut self, _: &str, value: &Value) -> Result<(), Fault> {
        self.message.words = vec![0; value.integer()? as usize / 8].into();
        Ok(())
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        let now_ns = monotonic_ns();
        if self.last_tick_ns != 0 {
            self.intervals_ns.push(now_ns - self.last_tick_ns);
        }
        self.last_tick_ns = now_ns;
        self.message.words.fill(self.next);
        self.next += 1;
        let start = Instant::now();
        self.armor.send_data("data", &self.message)?;
        self.sends_ns.push(start.elapsed().as_nanos() as u64);
        if self.printed.elapsed() > PRINT {
            self.printed = Instant::now();
            for (interval, send) in self.intervals_ns.drain(..).zip(self.sends_ns.drain(..)) {
                println!("tick interval_us={} send_us={}", interval / 1000, send / 1000);
            }
        }
        Ok(Outcome::CarryOn)
    }
}

/// Looks at what it receives.
pub struct NumberedReader {
    hold: Duration,
    instance: u64,
    last: Option<u64>,
    received: u64,
    lost: u64,
    torn: u64,
    stale: u64,
    printed: Instant,
}

impl Component for NumberedReader {
    const KIND: &'static str = "numbered-reader";
    const SUMMARY: &'static str = "Looks for messages that are not whole or not new.";
    const PARAMETERS: &'static [Parameter] =
        &[Parameter::number("hold", "s").doc("how long each message is held")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<NumberedBlob>("data")?;
        armor.get_parameter("hold")?;
        armor.synchronize()?;
        Ok(Self {
            hold: Duration::ZERO,
            instance: 0,
            last: None,
            received: 0,
            lost: 0,
            torn: 0,
            stale: 0,
            printed: Instant::now(),
        })
    }

    fn parameter_received(&mut self, _: &str, value: &Value) -> Result<(), Fault> {
        self.hold = Duration::try_from_secs_f64(value.number()?)?;
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let words = data.view::<NumberedBlob>()?.words;
        let number = words.get(0).unwrap_or(u64::MAX);
        let is_whole = || {
            let mut places = (0..words.len()).step_by(STEP).chain(words.len().checked_sub(1));
            places.all(|place| words.get(place) == Some(number))
        };
        let was_whole = is_whole();
        if !self.hold.is_zero() {
            std::thread::sleep(self.hold);
        }
        self.torn += u64::from(!was_whole || !is_whole());
        let is_first = self.instance != header.instance;
        if is_first {
            self.instance = header.instance;
            println!("linked at_ns={}", monotonic_ns());
        } else {
            self.stale += u64::from(self.last.is_some_and(|last| number <= last));
            self.lost += header.lost;
        }
        self.last = Some(number);
        self.received += 1;
        if is_first || self.printed.elapsed() > PRINT {
            self.printed = Instant::now();
            let Self { received, lost, torn, stale, .. } = self;
            println!("seen received={received} lost={lost} torn={torn} stale={stale}");
        }
        Ok(())
    }
}
