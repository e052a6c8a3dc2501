//! The peer of `measure.sh` and `memory.sh` in Rust: what `tests/peers` has in C and C++, step by step.

use std::time::Instant;

use armor_sdk::messages::Image;
use armor_sdk::prelude::*;

const ROUND_TRIPS: u64 = 5_000;
const IMAGE_TRIPS: u32 = 1_000;
/// The first trips of each are not counted: memory that is touched for the first time, and caches.
const WARM_UP: usize = 100;
const IMAGE_LENS: [usize; 3] = [64 << 10, 1 << 20, 8 << 20];

/// 100 bytes.
#[derive(Clone, Debug, PartialEq, Message)]
struct Small {
    number: u64,
    payload: [u8; 92],
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    Ask,
    Answer,
    Flood,
    Count,
}

#[derive(Parameters)]
struct PeerParameters {
    /// what is measured
    #[parameter(
        default = "answer",
        choices(
            "ask" = Role::Ask,
            "answer" = Role::Answer,
            "flood" = Role::Flood,
            "count" = Role::Count
        )
    )]
    role: Role,
    /// messages of a flood
    #[parameter(default = 2_000_000, range = 10.0..=1e12)]
    flood: i64,
}

struct Peer {
    armor: Armor,
    parameters: PeerParameters,
    /// Messages that were counted, or ticks, and the count at which the memory is logged next.
    count: u64,
    next_log: u64,
    sent: Instant,
    times_us: Vec<f64>,
    /// The images that are still to be measured, the next one last.
    images: Vec<Vec<u8>>,
}

impl Component for Peer {
    const KIND: &'static str = "rust-peer";
    const SUMMARY: &'static str = "Measures links.";
    const PARAMETERS: &'static [Parameter] = PeerParameters::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Optional<Small>>("small-in")?;
        armor.provide::<Small>("small-out")?;
        armor.subscribe::<Optional<Image>>("image-in")?;
        armor.provide::<Image>("image-out")?;
        let parameters = PeerParameters::request(&armor)?;
        let (times_us, images) = (Vec::new(), Vec::new());
        Ok(Self {
            armor,
            parameters,
            count: 0,
            next_log: 0,
            sent: Instant::now(),
            times_us,
            images,
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        if header.id() == "image-in" {
            return self.take_image(data);
        }
        let small: Small = data.decode()?;
        match self.parameters.role {
            Role::Answer => {
                self.armor.send_data("small-out", &small)?;
            }
            Role::Ask => {
                self.take_time();
                if small.number + 1 < ROUND_TRIPS {
                    self.send_small(small.number + 1)?;
                } else {
                    self.log_times("round trip 100 B");
                    self.send_image(0)?;
                }
            }
            Role::Flood | Role::Count => self.count_flood(),
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let is_first = matches!(self.parameters.role, Role::Ask | Role::Flood);
        if call != Call::Tick || !is_first || self.count == 2 {
            return Ok(Outcome::CarryOn);
        }
        self.count += 1;
        match (self.count, self.parameters.role) {
            (1, Role::Ask) => self.make_ready(),
            (2, Role::Ask) => self.send_small(0)?,
            // At the second tick the links are up.
            (2, _) => (0..self.parameters.flood as u64).try_for_each(|n| self.send_small(n))?,
            _ => {}
        }
        Ok(Outcome::CarryOn)
    }
}

impl Peer {
    /// Touches all memory of the measurement.
    fn make_ready(&mut self) {
        self.times_us = vec![1.0; ROUND_TRIPS as usize];
        self.times_us.clear();
        self.images = IMAGE_LENS.iter().rev().map(|len| vec![7; *len]).collect();
    }

    fn send_small(&mut self, number: u64) -> Result<(), Fault> {
        self.sent = if self.parameters.role == Role::Ask { Instant::now() } else { self.sent };
        self.armor.send_data("small-out", &Small { number, payload: [0; 92] })?;
        Ok(())
    }

    fn send_image(&mut self, number: u32) -> Result<(), Fault> {
        let Some(pixels) = self.images.last_mut() else { return Ok(()) };
        let data = std::mem::take(pixels).into();
        let image = Image { width: number, height: 1, data, ..Image::default() };
        self.sent = Instant::now();
        self.armor.send_data("image-out", &image)?;
        *pixels = image.data.into();
        Ok(())
    }

    fn take_image(&mut self, data: &Data<'_>) -> Result<(), Fault> {
        let view = data.view::<Image>()?;
        if self.parameters.role == Role::Answer {
            // The answer is small: what is measured is one image on its way.
            let sum = view.data[0] + view.data[view.data.len() - 1];
            let image = Image { width: view.width, height: u32::from(sum), ..Image::default() };
            self.armor.send_data("image-out", &image)?;
            return Ok(());
        }
        self.take_time();
        if view.width + 1 < IMAGE_TRIPS {
            return self.send_image(view.width + 1);
        }
        let len = self.images.pop().map_or(0, |pixels| pixels.len());
        self.log_times(&format!("image of {} KiB and answer", len >> 10));
        match self.images.is_empty() {
            true => tracing::info!("measured: end"),
            false => self.send_image(0)?,
        }
        Ok(())
    }

    fn count_flood(&mut self) {
        let messages = self.parameters.flood as u64;
        if self.count == 0 {
            (self.sent, self.next_log) = (Instant::now(), messages / 10);
        }
        self.count += 1;
        if self.count == self.next_log {
            tracing::info!("measured: {} messages, {} kB resident", self.count, resident_kb());
            self.next_log += messages / 10;
        }
        if self.count == messages {
            let rate = messages as f64 / self.sent.elapsed().as_secs_f64() / 1e6;
            tracing::info!("measured: flood 100 B: {rate:.3} M msg/s");
        }
    }

    fn take_time(&mut self) {
        self.times_us.push(self.sent.elapsed().as_secs_f64() * 1e6);
    }

    fn log_times(&mut self, what: &str) {
        let times_us = &mut self.times_us[WARM_UP..];
        times_us.sort_by(f64::total_cmp);
        let (p50, p99) = (times_us[times_us.len() / 2], times_us[times_us.len() * 99 / 100]);
        tracing::info!("measured: {what}: {p50:.2} us p50, {p99:.2} us p99");
        self.times_us.clear();
    }
}

/// Resident memory of this process.
fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

fn main() -> std::process::ExitCode {
    armor_sdk::run::<Peer>()
}
