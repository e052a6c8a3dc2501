//! The components of the system under test. Each writes what happens to it into a diary, a file that
//! no fault reaches: the kernel keeps what a killed process has written.

use std::ffi::OsString;
use std::fmt::Display;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use armor_sdk::prelude::*;
use rustix::fs::{FlockOperation, flock};

use crate::readings::monotonic_ns;

/// The variable with the folder of the diaries.
pub const DIARY_FOLDER: &str = "ARMOR_BENCH_DIARY";
/// What the base is commanded, in rad/s: it turns where it stands.
const TURN_RADPS: f64 = 0.1;

/// Plays a component until it ends: `KIND` and the arguments of any component.
///
/// # Errors
/// If there is no such kind, or it ends with an error.
pub fn play_part(mut arguments: impl Iterator<Item = OsString>) -> Result<()> {
    let kind = arguments.next().context("no kind")?;
    let ended = match kind.to_str() {
        Some("pulse") => armor_sdk::run_with::<PulseComponent>(arguments),
        Some("hand") => armor_sdk::run_with::<HandComponent>(arguments),
        Some("pusher") => armor_sdk::run_with::<PusherComponent>(arguments),
        Some("witness") => armor_sdk::run_with::<WitnessComponent>(arguments),
        _ => bail!("there is no kind {}", kind.display()),
    };
    match ended == std::process::ExitCode::SUCCESS {
        true => Ok(()),
        false => bail!("{} has failed", kind.display()),
    }
}

/// The diary of one process: `NAME.PID`, one line per event, each with the time. Without the folder, as
/// when the program describes its kinds, nothing is written.
struct PartDiary(Option<OpenDiary>);

struct OpenDiary {
    folder: PathBuf,
    file: File,
    /// Held while the process lives: a second one of the component cannot have it.
    _alone: File,
}

impl PartDiary {
    fn open() -> Result<Self, Fault> {
        let folder = std::env::var_os(DIARY_FOLDER).map(PathBuf::from);
        let name = std::env::args().skip_while(|word| word != "--name").nth(1);
        let Some((folder, name)) = folder.zip(name) else { return Ok(Self(None)) };
        let path = folder.join(format!("{name}.{}", std::process::id()));
        let mut file = OpenOptions::new().create(true).append(true).open(path)?;
        let alone = take_lock(&folder, &name, &mut file)?;
        let mut diary = Self(Some(OpenDiary { folder, file, _alone: alone }));
        diary.note("new")?;
        Ok(diary)
    }

    fn note(&mut self, what: impl Display) -> Result<(), Fault> {
        match &mut self.0 {
            Some(open) => note_in(&mut open.file, what),
            None => Ok(()),
        }
    }

    fn note_call(&mut self, call: Call) -> Result<(), Fault> {
        match call {
            Call::Started => self.note("on"),
            Call::Stopping => self.note("off"),
            _ => Ok(()),
        }
    }
}

fn note_in(file: &mut File, what: impl Display) -> Result<(), Fault> {
    // One write: a kill leaves whole lines.
    Ok(file.write_all(format!("{} {what}\n", monotonic_ns()).as_bytes())?)
}

/// Takes the lock `NAME`, which the kernel gives to one process at a time and takes from a dead one.
/// A lock that another one has is an event of the diary.
fn take_lock(folder: &Path, name: &str, diary: &mut File) -> Result<File, Fault> {
    let lock =
        OpenOptions::new().create(true).append(true).open(folder.join(format!("{name}.lock")))?;
    if flock(&lock, FlockOperation::NonBlockingLockExclusive).is_err() {
        note_in(diary, format!("twice {name}"))?;
    }
    Ok(lock)
}

/// A numbered message.
#[derive(Message, Clone, Debug, PartialEq)]
struct PulseMessage {
    /// The process that sent it.
    process: u64,
    /// Counts its messages, from 1.
    number: u64,
    /// When it was sent, on the clock of the machine.
    sent_ns: u64,
}

/// Sends numbered messages at its rate, and notes those that it receives.
struct PulseComponent {
    armor: Armor,
    diary: PartDiary,
    message: PulseMessage,
}

impl Component for PulseComponent {
    const KIND: &'static str = "pulse";
    const SUMMARY: &'static str = "Sends numbered messages and notes those that it receives.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<PulseMessage>("pulse")?;
        armor.subscribe::<PulseMessage>("far")?;
        armor.subscribe::<PulseMessage>("near")?;
        let message = PulseMessage { process: std::process::id().into(), number: 0, sent_ns: 0 };
        Ok(Self { diary: PartDiary::open()?, armor, message })
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let PulseMessage { process, number, sent_ns } = data.decode()?;
        let (input, lost) = (header.id(), header.lost);
        self.diary.note(format!("got {input} {process} {number} {lost} {sent_ns}"))
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        self.diary.note_call(call)?;
        if call == Call::Tick {
            self.message.number += 1;
            self.message.sent_ns = monotonic_ns();
            self.armor.send_data("pulse", &self.message)?;
        }
        Ok(Outcome::CarryOn)
    }
}

/// One of two components that exclude each other.
struct HandComponent {
    diary: PartDiary,
    held: Option<File>,
}

impl Component for HandComponent {
    const KIND: &'static str = "hand";
    const SUMMARY: &'static str = "Holds, while it is active, what only one process may hold.";

    fn new(_: Armor) -> Result<Self, Fault> {
        Ok(Self { diary: PartDiary::open()?, held: None })
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        self.diary.note_call(call)?;
        match call {
            Call::Started => {
                if let Some(open) = &mut self.diary.0 {
                    self.held = Some(take_lock(&open.folder, "hands", &mut open.file)?);
                }
            }
            Call::Stopping => self.held = None,
            _ => {}
        }
        Ok(Outcome::CarryOn)
    }
}

/// Commands a base on another host to turn.
struct PusherComponent {
    armor: Armor,
    diary: PartDiary,
}

impl Component for PusherComponent {
    const KIND: &'static str = "pusher";
    const SUMMARY: &'static str = "Commands a base to turn where it stands.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Twist>("velocity")?;
        Ok(Self { diary: PartDiary::open()?, armor })
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        self.diary.note_call(call)?;
        self.armor.send_data("velocity", &Twist::planar(0.0, TURN_RADPS))?;
        Ok(Outcome::CarryOn)
    }
}

/// Notes when the base begins to move and when it comes to rest.
struct WitnessComponent {
    diary: PartDiary,
    is_moving: bool,
}

impl Component for WitnessComponent {
    const KIND: &'static str = "witness";
    const SUMMARY: &'static str = "Notes whether a base moves.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Odometry>("odometry")?;
        Ok(Self { diary: PartDiary::open()?, is_moving: false })
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let odometry: Odometry = data.decode()?;
        let is_moving = odometry.twist.twist.angular.z.abs() > TURN_RADPS / 100.0;
        if std::mem::replace(&mut self.is_moving, is_moving) != is_moving {
            self.diary.note(if is_moving { "moves" } else { "rests" })?;
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        self.diary.note_call(call)?;
        Ok(Outcome::CarryOn)
    }
}
