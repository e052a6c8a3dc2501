//! The peer of `measure.sh` in Rust: what `tests/peers` has in C and C++, step by step.

use std::time::Instant;

use armor_sdk::messages::Image;
use armor_sdk::prelude::*;

const ROUND_TRIPS: u64 = 20_000;
const IMAGE_TRIPS: u64 = 2_000;
/// The first trips of each are not counted: memory that is touched for the first time, and caches.
const WARM_UP: usize = 200;
const FLOOD: u64 = 2_000_000;

/// 100 bytes.
#[derive(Clone, Debug, PartialEq, Message)]
struct Small {
    number: u64,
    payload: [u8; 92],
}

#[derive(Parameters)]
struct PeerParameters {
    /// ask, answer, flood or count
    #[parameter(default = "answer")]
    role: String,
    /// bytes of an image
    #[parameter(default = 8_388_608, range = 1.0..=6e7)]
    image: i64,
}

struct Peer {
    armor: Armor,
    parameters: PeerParameters,
    count: u64,
    sent: Instant,
    times_us: Vec<f64>,
    pixels: Vec<u8>,
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
        let (times_us, pixels) = (Vec::new(), Vec::new());
        Ok(Self { armor, parameters, count: 0, sent: Instant::now(), times_us, pixels })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        if header.id() == "image-in" {
            return self.take_image(data);
        }
        let small: Small = data.decode()?;
        match self.parameters.role.as_str() {
            "answer" => {
                self.armor.send_data("small-out", &small)?;
            }
            "ask" => {
                self.take_time();
                if small.number + 1 < ROUND_TRIPS {
                    self.send_small(small.number + 1)?;
                } else {
                    self.log_times("round trip 100 B");
                    self.pixels = vec![7; self.parameters.image as usize];
                    self.send_image(0)?;
                }
            }
            _ => {
                if self.count == 0 {
                    self.sent = Instant::now();
                }
                self.count += 1;
                if self.count == FLOOD {
                    let rate = FLOOD as f64 / self.sent.elapsed().as_secs_f64() / 1e6;
                    tracing::info!("measured: flood 100 B: {rate:.3} M msg/s");
                }
            }
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let is_first = matches!(self.parameters.role.as_str(), "ask" | "flood");
        if call == Call::Tick && is_first && self.count < 2 {
            self.count += 1;
            // At the second tick the links are up.
            let messages = match (self.count, self.parameters.role.as_str()) {
                (1, _) => 0,
                (_, "ask") => 1,
                _ => FLOOD,
            };
            for number in 0..messages {
                self.send_small(number)?;
            }
        }
        Ok(Outcome::CarryOn)
    }
}

impl Peer {
    fn send_small(&mut self, number: u64) -> Result<(), Fault> {
        self.sent = if self.parameters.role == "ask" { Instant::now() } else { self.sent };
        self.armor.send_data("small-out", &Small { number, payload: [0; 92] })?;
        Ok(())
    }

    fn send_image(&mut self, number: u32) -> Result<(), Fault> {
        let data = std::mem::take(&mut self.pixels).into();
        let image = Image { width: number, height: 1, data, ..Image::default() };
        self.sent = Instant::now();
        self.armor.send_data("image-out", &image)?;
        self.pixels = image.data.into();
        Ok(())
    }

    fn take_image(&mut self, data: &Data<'_>) -> Result<(), Fault> {
        let view = data.view::<Image>()?;
        if self.parameters.role == "answer" {
            // The answer is small: what is measured is one image on its way.
            let sum = view.data[0] + view.data[view.data.len() - 1];
            let image = Image { width: view.width, height: u32::from(sum), ..Image::default() };
            self.armor.send_data("image-out", &image)?;
            return Ok(());
        }
        self.take_time();
        if u64::from(view.width) + 1 < IMAGE_TRIPS {
            return self.send_image(view.width + 1);
        }
        self.log_times(&format!("{} B image and answer", self.parameters.image));
        tracing::info!("measured: end");
        Ok(())
    }

    fn take_time(&mut self) {
        self.times_us.push(self.sent.elapsed().as_secs_f64() * 1e6);
    }

    fn log_times(&mut self, what: &str) {
        self.times_us.drain(..WARM_UP);
        self.times_us.sort_by(f64::total_cmp);
        let (p50, p99) = (self.times_us.len() / 2, self.times_us.len() * 99 / 100);
        let (p50, p99) = (self.times_us[p50], self.times_us[p99]);
        tracing::info!("measured: {what}: {p50:.1} us p50, {p99:.1} us p99");
        self.times_us.clear();
    }
}

fn main() -> std::process::ExitCode {
    armor_sdk::run::<Peer>()
}
