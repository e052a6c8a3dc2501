//! The probe of the conformance test in Rust, and its source of data. The probes in Python, C and C++ do
//! the same: what a behaviour is, is in behaviours.json.

use std::collections::HashMap;
use std::path::PathBuf;
use std::time::Duration;

use armor_sdk::prelude::*;

/// Which side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
enum Side {
    #[default]
    Left,
    Right,
}

/// A part of a message.
#[derive(Clone, Debug, Default, PartialEq, Message)]
struct Part {
    id: i32,
    name: String,
}

/// A message with every form of field that all languages have.
#[derive(Clone, Debug, Default, PartialEq, Message)]
struct Mixed {
    flag: bool,
    small: i8,
    wide: u64,
    #[message(unit = "m")]
    number: f64,
    single: f32,
    text: String,
    maybe: Option<f64>,
    side: Side,
    pose: Pose2D,
    parts: Vec<Part>,
    numbers: Array<f64>,
    fixed: [f64; 3],
}

/// The values at the limits of their types.
fn extreme() -> Mixed {
    Mixed {
        flag: true,
        small: i8::MIN,
        wide: u64::MAX,
        number: f64::NEG_INFINITY,
        single: 0.5,
        text: "grün".into(),
        maybe: Some(-0.25),
        side: Side::Right,
        pose: Pose2D { x: 1.0, y: -2.0, theta: 0.5 },
        parts: vec![Part { id: i32::MIN, name: String::new() }, Part { id: 7, name: "b".into() }],
        numbers: vec![1.0, 2.5].into(),
        fixed: [0.1, 0.2, 0.3],
    }
}

const IMAGE_LEN: usize = 1 << 20;

#[derive(Parameters)]
struct Settings {
    /// A speed.
    #[parameter(default = "0.3m/s", unit = "m/s", range = 0.0..=1.0, live)]
    number: f64,
    /// A whole number.
    #[parameter(default = 7)]
    whole: i64,
    /// A flag.
    #[parameter(default = false)]
    flag: bool,
    /// A text.
    #[parameter(default = "none")]
    text: String,
    /// A file.
    #[parameter(default = "mark")]
    file: PathBuf,
}

struct Probe {
    armor: Armor,
    behaviour: String,
    settings: Settings,
    ticks: u32,
    received: u32,
    published: u64,
    images: u32,
    mixed: u32,
    kept: Option<Image>,
    any: Option<AnyMessage>,
    /// Of the data of `in`, by their count.
    stamps: HashMap<u64, f64>,
    since_s: f64,
}

/// Writes what the test looks for into the log.
fn note(text: impl std::fmt::Display) {
    tracing::info!("seen: {text}");
}

/// The behaviour of this process is the name of the component.
fn read_behaviour() -> String {
    let arguments: Vec<_> = std::env::args().collect();
    let after_flag = arguments.iter().position(|it| it == "--name").map(|it| it + 1);
    let attached = arguments.iter().find_map(|it| it.strip_prefix("--name="));
    let separate = after_flag.and_then(|at| arguments.get(at)).map(String::as_str);
    attached.or(separate).unwrap_or_default().to_owned()
}

fn refusal<T>(result: Result<T, impl std::fmt::Display>) {
    match result {
        Ok(_) => note("nothing is refused"),
        Err(error) => note(format_args!("refused: {error}")),
    }
}

impl Component for Probe {
    const KIND: &'static str = "probe";
    const SUMMARY: &'static str = "Shows how a component behaves.";
    const PARAMETERS: &'static [Parameter] = Settings::DECLARED;
    const READS_ALL: bool = true;
    const EVENTS: &'static [DeclaredEvent] = &[
        DeclaredEvent::new("near").doc("something is near").number("m"),
        DeclaredEvent::new("over").doc("it is over"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        let behaviour = read_behaviour();
        armor.provide::<Count>("out")?;
        armor.provide::<Latched<Count>>("state")?;
        armor.provide::<Mixed>("mixed")?;
        armor.provide::<Image>("image")?;
        armor.subscribe::<Optional<Count>>("in")?;
        armor.subscribe::<Optional<Count>>("other")?;
        armor.subscribe::<Optional<Many<Count>>>("many")?;
        armor.subscribe::<Optional<Mixed>>("mixed_in")?;
        armor.subscribe::<Optional<Image>>("image_in")?;
        armor.subscribe::<Optional<Many<AnyMessage>>>("any_in")?;
        armor.provide::<AnyMessage>("any_out")?;
        armor.provide::<Latched<AnyMessage>>("any_last")?;
        match behaviour.as_str() {
            "declare-twice" => armor.provide::<Count>("out")?,
            "declare-bad-name" => armor.provide::<Count>("7 up")?,
            "construct-fails" => return Err("no hardware".into()),
            _ => {}
        }
        let settings = Settings::request(&armor)?;
        Ok(Self {
            armor,
            behaviour,
            settings,
            ticks: 0,
            received: 0,
            published: 0,
            images: 0,
            mixed: 0,
            kept: None,
            any: None,
            stamps: HashMap::new(),
            since_s: 0.0,
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.settings.set(name, value)?;
        if name == "number" && self.settings.number == 0.9 {
            return Err("0.9 is not for this probe".into());
        }
        match name {
            "number" => note(format_args!("parameter number={}", self.settings.number)),
            "whole" => note(format_args!("parameter whole={}", self.settings.whole)),
            "flag" => note(format_args!("parameter flag={}", self.settings.flag)),
            "text" => note(format_args!("parameter text={}", self.settings.text)),
            _ => note(format_args!("parameter file={}", self.settings.file.display())),
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        self.received += 1;
        match header.id() {
            "mixed_in" => return self.receive_mixed(data),
            "image_in" => return self.receive_image(data),
            "any_in" => return self.pass_on(header, data),
            _ => {}
        }
        let count = data.decode::<Count>()?.count;
        if self.behaviour == "any-receiver" {
            self.compare_stamps(header, count);
        }
        if self.received <= 40 {
            let (id, lost, from) = (header.id(), header.lost, header.data());
            note(format_args!("data {id} count={count} lost={lost} from={from}"));
        }
        if self.received == 1 {
            let is_recent = (self.armor.timestamp() - header.stamp_s).abs() < 5.0;
            note(format_args!("stamp recent={is_recent} instance={}", header.instance != 0));
        }
        match (self.behaviour.as_str(), self.received) {
            ("data-failure", _) => Err("the data are spoilt".into()),
            ("history" | "history-forgotten", 1..=4) => {
                let history = data.history("in")?;
                let counts = history.iter().map(|it| it.data.decode::<Count>());
                let counts = counts.collect::<Result<Vec<_>, _>>()?;
                let base = counts.last().map_or(0, |it| it.count);
                let ages: Vec<_> = counts.iter().map(|it| (it.count - base).to_string()).collect();
                note(format_args!("history {}", ages.join(" ")));
                let stamp = |age| history.get(age).map_or(0.0, |it| it.header.stamp_s);
                if self.received == 4 {
                    let between_s = (stamp(0) + stamp(1)) / 2.0;
                    let ages = history.ages_around(between_s).unwrap_or_default();
                    let nearest = history.nearest_age(stamp(2) + 1e-4).unwrap_or_default();
                    note(format_args!("around {} {} nearest {nearest}", ages.0, ages.1));
                    let before = history.around(stamp(2) - 10.0).is_none();
                    note(format_args!("around nothing={before}"));
                }
                Ok(())
            }
            ("history-none", 1) => {
                refusal(data.history("in"));
                refusal(data.history("none"));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let word = match call {
            Call::Started => "started",
            Call::Tick => "tick",
            Call::Data => "data",
            Call::Stopping => "stopping",
        };
        match call {
            Call::Tick | Call::Data => self.ticks += 1,
            Call::Started => (self.ticks, self.received) = (0, 0),
            Call::Stopping => {}
        }
        if self.ticks <= 5 || call == Call::Stopping {
            note(format_args!("call {word}"));
        }
        match call {
            Call::Started => self.begin(),
            Call::Tick | Call::Data => self.work(),
            Call::Stopping => Ok(Outcome::CarryOn),
        }
    }
}

impl Probe {
    fn begin(&mut self) -> Result<Outcome, Fault> {
        self.since_s = self.armor.timestamp();
        match self.behaviour.as_str() {
            "source" | "second" => {
                self.armor.send_data("state", &Count { count: 42 })?;
            }
            "declare-late" => refusal(self.armor.provide::<Count>("late")),
            "forbid-late" => refusal(self.armor.set_non_controllable()),
            "send-unknown" => refusal(self.armor.send_data("nothing", &Count { count: 1 })),
            "send-wrong-type" => refusal(self.armor.send_data("out", &Number { data: 1.0 })),
            "names" => {
                let show = |name: Option<String>| name.unwrap_or_else(|| "none".into());
                note(format_args!("provided {}", show(self.armor.provided_data("out"))));
                note(format_args!("provided {}", show(self.armor.provided_data("nothing"))));
                note(format_args!("subscribed {}", show(self.armor.subscribed_data("in"))));
                note(format_args!("subscribed {}", show(self.armor.subscribed_data("other"))));
            }
            _ => {}
        }
        Ok(Outcome::CarryOn)
    }

    fn work(&mut self) -> Result<Outcome, Fault> {
        let tick = self.ticks;
        match (self.behaviour.as_str(), tick) {
            ("source" | "second", _) => self.publish()?,
            ("failed", 2) => return Ok(Outcome::Failed("no power".into())),
            ("failed-silently", 2) => return Ok(Outcome::Failed(String::new())),
            ("exception", 2) => return Err("no power at all".into()),
            ("done", 2) => return Ok(Outcome::Done),
            ("event", 3) => return Ok(Outcome::event("near", 0.5)),
            ("event-undeclared", 2) => return Ok(Outcome::event("far", 0.5)),
            ("crash", 2) if !self.settings.file.exists() => {
                std::fs::write(&self.settings.file, "")?;
                std::process::abort();
            }
            ("hang", 2) => std::thread::sleep(Duration::from_secs(600)),
            ("busy", 2) => std::thread::sleep(Duration::from_millis(2600)),
            ("slow" | "slow-all", 1..=6) => std::thread::sleep(Duration::from_millis(300)),
            ("freeze-in-exec", 2) => {
                std::thread::sleep(Duration::from_millis(1500));
                note("the call ends");
            }
            ("print", 1) => println!("printed on stdout"),
            ("synchronize", 2) => {
                self.armor.get_parameter("number")?;
                self.armor.synchronize()?;
                note("synchronized");
            }
            ("time", 3) => {
                let now_s = self.armor.timestamp();
                let wall = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH)?;
                let is_right = (now_s - wall.as_secs_f64()).abs() < 5.0;
                note(format_args!("time right={is_right} passes={}", now_s > self.since_s));
            }
            ("any", 5) => {
                if let Some(message) = &self.any {
                    self.armor.send_data("any_last", message)?;
                }
            }
            ("sender", _) => {
                self.published += 1;
                self.armor.send_data("out", &Count { count: self.published })?;
            }
            _ => {}
        }
        Ok(Outcome::CarryOn)
    }

    fn publish(&mut self) -> Result<(), Fault> {
        self.published += 1;
        self.armor.send_data("out", &Count { count: self.published })?;
        if self.published.is_multiple_of(10) {
            self.armor.send_data("mixed", &extreme())?;
            self.armor.send_data("image", &image(self.published as u8))?;
        }
        Ok(())
    }

    fn pass_on(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let message = AnyMessage::received(header, data)?;
        self.armor.send_data("any_out", &message)?;
        if self.any.is_none() {
            let (of, schema, len) = (message.type_name(), message.schema(), message.bytes().len());
            let is_same = message.stamp_s() == header.stamp_s;
            note(format_args!("any type={of} schema={schema} len={len} stamp={is_same}"));
            self.any = Some(message);
        }
        Ok(())
    }

    fn compare_stamps(&mut self, header: &Header<'_>, count: u64) {
        if header.id() == "in" {
            self.stamps.insert(count, header.stamp_s);
        } else if self.stamps.get(&count) == Some(&header.stamp_s) {
            note("passed on with its stamp=true");
        }
    }

    fn receive_mixed(&mut self, data: &Data<'_>) -> Result<(), Fault> {
        let mixed: Mixed = data.decode()?;
        if self.behaviour == "source" {
            let is_equal = mixed == Mixed { maybe: None, ..extreme() };
            note(format_args!("mixed back={is_equal}"));
            return Ok(());
        }
        self.mixed += 1;
        if self.mixed == 1 {
            note(format_args!(
                "mixed wide={} small={} text={}",
                mixed.wide, mixed.small, mixed.text
            ));
            let maybe = mixed.maybe.map_or("none".into(), |it| it.to_string());
            let (parts, numbers) = (mixed.parts.len(), mixed.numbers.len());
            note(format_args!("mixed maybe={maybe} parts={parts} numbers={numbers}"));
        }
        self.armor.send_data("mixed", &Mixed { maybe: None, ..mixed })?;
        Ok(())
    }

    fn receive_image(&mut self, data: &Data<'_>) -> Result<(), Fault> {
        let image: Image = data.decode()?;
        self.images += 1;
        let is_whole =
            image.data.len() == IMAGE_LEN && image.data.iter().all(|it| *it == image.data[0]);
        if self.images == 1 {
            let verb = if self.behaviour == "source" { "back" } else { "whole" };
            note(format_args!("image {verb}={is_whole}"));
        }
        if self.behaviour != "source" {
            self.armor.send_data("image", &image)?;
        }
        match (&self.kept, self.images) {
            (None, _) => self.kept = Some(image),
            (Some(kept), 4) => {
                let is_same = kept.data.iter().all(|it| *it == kept.data[0]);
                note(format_args!("kept unchanged={is_same}"));
            }
            _ => {}
        }
        Ok(())
    }
}

/// An image whose bytes are all the same.
fn image(shade: u8) -> Image {
    let encoding = "mono8".into();
    Image {
        width: 1024,
        height: 1024,
        step: 1024,
        encoding,
        data: vec![shade; IMAGE_LEN].into(),
        ..Image::default()
    }
}

/// The same as the source of data of the system: a kind of its own.
struct Source(Probe);

impl Component for Source {
    const KIND: &'static str = "conformance-source";
    const SUMMARY: &'static str = "Publishes what the probes receive.";
    const PARAMETERS: &'static [Parameter] = Settings::DECLARED;
    const EVENTS: &'static [DeclaredEvent] = Probe::EVENTS;

    fn new(armor: Armor) -> Result<Self, Fault> {
        Ok(Self(Probe::new(armor)?))
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.0.parameter_received(name, value)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        self.0.data_received(header, data)
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        self.0.exec(call)
    }
}

fn main() -> std::process::ExitCode {
    let path = std::env::args_os().next().map(PathBuf::from).unwrap_or_default();
    if path.file_name().is_some_and(|name| name == Source::KIND) {
        return armor_sdk::run::<Source>();
    }
    armor_sdk::run::<Probe>()
}
