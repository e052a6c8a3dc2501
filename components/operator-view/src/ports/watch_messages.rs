//! The messages between a component and a window that watches its system, over a Unix socket of this
//! user: what the component receives goes to the window, what the operator orders comes back.

use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use armor_inspect::systems::{RunRecord, list_running, record_directory};
use armor_sdk::prelude::*;
use armor_sdk::wire::limits::MAX_DATA_LEN;
use armor_sdk::wire::{Message, codec};
use parking_lot::Mutex;
use rustix::net::sockopt::socket_peercred;
use rustix::process::getuid;

/// How long a write may take before the other end counts as stuck. A command is a few bytes, which
/// the socket's buffer takes without a wait.
const WRITE_LIMIT: Duration = Duration::from_secs(1);
/// Bytes that a message may have in front of the data that it carries.
const MAX_FRONT_LEN: usize = 64 << 10;

/// From the component to the window.
#[derive(Debug, Message)]
pub(super) enum ToWindow {
    /// The first message.
    Hello {
        /// Name of the component.
        component: String,
        /// Name of the run.
        system: String,
        /// Name of the robot: that of its system in the file.
        robot: String,
        /// Number of the run: a component that is restarted has the same one.
        run: String,
        /// The launcher's process on this host; 0 if it is on another one.
        launcher: u32,
        /// The launcher's log on this host; empty if it is on another one.
        log: String,
        /// The linked inputs and what feeds them.
        links: Vec<LinkedInput>,
    },
    /// The parameters, at the start and when one has changed.
    Settings {
        /// Fastest by hand, in m/s.
        speed_mps: f64,
        /// Fastest turn by hand, in rad/s.
        turn_radps: f64,
        /// A goal is reached within this, in metres.
        tolerance_m: f64,
        /// Radius of the circle that is drawn for the robot, in metres.
        robot_radius_m: f64,
        /// Pose of the laser on the robot: x, y in metres, yaw in radians; empty if it is not known.
        laser: Vec<f64>,
        /// Why it is not known.
        no_laser: String,
        /// The buttons of the mission.
        buttons: Vec<String>,
        /// Whether the theme is light.
        is_light: bool,
    },
    /// Data at an input, as they arrived.
    Data {
        /// The input.
        input: String,
        /// Start of their provider.
        instance: u64,
        /// Their number there.
        sequence: u64,
        /// System time of their creation, in seconds.
        stamp_s: f64,
        /// The encoded message.
        bytes: Array<u8>,
    },
    /// At every tick: system time, in seconds.
    Tick {
        /// The time.
        system_s: f64,
    },
    /// The hosts of a system on several.
    Hosts {
        /// Each of them.
        hosts: Vec<ShownHost>,
    },
    /// Both ends of the links of the inputs.
    Links {
        /// Each of them.
        links: Vec<LinkReport>,
    },
    /// A command was sent to so many links.
    Sent {
        /// The output.
        output: String,
        /// Their number.
        to: u64,
    },
    /// What was published on `stop` last: at each order, and at the beginning of a connection.
    StopState {
        /// Whether STOP is active.
        is_on: bool,
        /// The number of links that have accepted it.
        to: u64,
    },
    /// The state of the mission.
    Mission {
        /// Its name.
        name: String,
        /// Its stage, in a word.
        stage: String,
        /// Why it retreats or has given up; empty if it does not.
        why: String,
        /// Mission time now, in seconds.
        now_at_s: f64,
        /// Whether that time passes.
        is_running: bool,
        /// Who has paused it; empty if it is not paused.
        paused_by: String,
        /// The components that are frozen.
        frozen: Vec<String>,
        /// The marked places.
        places: Vec<String>,
        /// Why the last transition fired.
        last_cause: String,
        /// The transitions that ask, and what each does without an answer, in words.
        questions: Vec<AskedQuestion>,
    },
    /// The result of an answer to a question of the mission.
    Answered {
        /// The order in words.
        order: String,
        /// Whether it was accepted.
        is_accepted: bool,
        /// The consequence, or the reason of the refusal.
        text: String,
    },
}

/// A transition that asks the operator.
#[derive(Debug, Message)]
pub(super) struct AskedQuestion {
    /// The transition.
    pub(super) transition: String,
    /// Mission time until which an answer is waited for, in seconds, if not without a limit.
    pub(super) answer_by_at_s: Option<f64>,
    /// What it does without an answer.
    pub(super) unanswered: String,
}

/// A host as it is shown.
#[derive(Clone, Debug, PartialEq, Message)]
pub(crate) struct ShownHost {
    /// Its name.
    pub(crate) name: String,
    /// Whether its agent is connected; none for the launcher's host.
    pub(crate) link: Option<ShownLink>,
    /// Its connection, its clock and what runs there, in words.
    pub(crate) texts: Vec<String>,
}

/// The connection to the agent of a host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
pub(crate) enum ShownLink {
    /// It has not been reached yet.
    Awaited,
    /// It is connected.
    Connected,
    /// It was connected.
    CutOff,
}

/// What both ends of the link of an input report.
#[derive(Clone, Debug, PartialEq, Message)]
pub(crate) struct LinkReport {
    /// The input.
    pub(crate) input: String,
    /// What carries its data (`unix`, `tcp`, `shm`, `udp`); empty while it is down.
    pub(crate) transport: String,
    /// Number of data that passed between two pulls, which the input has not asked for.
    pub(crate) skipped: u64,
    /// Number of data lost in transport.
    pub(crate) lost: u64,
    /// Number of data dropped at either end, because this program was slow.
    pub(crate) dropped: u64,
}

/// A linked input.
#[derive(Debug, Message)]
pub(super) struct LinkedInput {
    /// Its name.
    pub(super) input: String,
    /// `component.output`.
    pub(super) data: String,
}

/// From the window to the component.
#[derive(Debug, Message)]
pub(super) enum ToComponent {
    /// The answer to the hello.
    Welcome {
        /// Whether the window shows the system by this component. It shows one at a time.
        is_accepted: bool,
    },
    /// Drive there.
    Goal {
        /// The frame of the place.
        frame: String,
        /// On the map, in metres.
        x_m: f64,
        /// On the map, in metres.
        y_m: f64,
        /// On the map, in radians.
        yaw_rad: f64,
    },
    /// Drive like this.
    Velocity {
        /// Ahead, in m/s.
        forward_mps: f64,
        /// To the left, in rad/s.
        turn_radps: f64,
    },
    /// Stand, or stand no more.
    Stop {
        /// Whether it must stand.
        is_on: bool,
    },
    /// Report an event to the mission.
    Event {
        /// Its name.
        name: String,
    },
    /// End a pause of the mission.
    Resume,
    /// Answer a question of the mission.
    Answer {
        /// The transition that asks.
        transition: String,
        /// Whether it may fire.
        is_confirmed: bool,
    },
}

/// Checks that the other end belongs to this user or to root, before a byte of it is read.
///
/// # Errors
/// If it belongs to another user, or the kernel does not answer.
pub(super) fn check_owner(stream: &UnixStream) -> io::Result<()> {
    let (other, own) = (socket_peercred(stream)?.uid, getuid());
    if other == own || other.is_root() {
        Ok(())
    } else {
        Err(io::ErrorKind::PermissionDenied.into())
    }
}

/// The writing half of a connection; clones share it.
#[derive(Clone)]
pub(super) struct MessageWriter(Arc<Mutex<UnixStream>>);

impl MessageWriter {
    /// The writing half of `stream`.
    pub(super) fn new(stream: &UnixStream) -> io::Result<Self> {
        let stream = stream.try_clone()?;
        stream.set_write_timeout(Some(WRITE_LIMIT))?;
        Ok(Self(Arc::new(Mutex::new(stream))))
    }

    /// Sends a message. A connection of which a write has failed is closed: half a message may be
    /// written.
    pub(super) fn send<T: Message>(&self, message: &T) -> io::Result<()> {
        let bytes = codec::encode(message).map_err(io::Error::other)?;
        let len = u32::try_from(bytes.len()).map_err(io::Error::other)?;
        let mut stream = self.0.lock();
        let written = stream.write_all(&len.to_le_bytes()).and_then(|()| stream.write_all(&bytes));
        if written.is_err() {
            let _ = stream.shutdown(std::net::Shutdown::Both);
        }
        written
    }

    /// Ends the connection; the reader at both ends notices.
    pub(super) fn close(&self) {
        let _ = self.0.lock().shutdown(std::net::Shutdown::Both);
    }
}

/// Reads the next message; `None` at the end of the connection.
pub(super) fn read_message<T: Message>(stream: &mut UnixStream) -> io::Result<Option<T>> {
    let mut len = [0; 4];
    match stream.read_exact(&mut len) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
        other => other?,
    }
    let len = u32::from_le_bytes(len) as usize;
    if len > MAX_DATA_LEN + MAX_FRONT_LEN {
        return Err(io::Error::other(format!("a message of {len} bytes")));
    }
    // The memory grows with what has arrived, whatever the length promises.
    let mut bytes = Vec::new();
    if stream.take(len as u64).read_to_end(&mut bytes)? < len {
        return Ok(None);
    }
    codec::decode(&bytes).map(Some).map_err(io::Error::other)
}

/// Returns the socket of a window that watches `subject`: a file, or the address of a registry.
pub(super) fn socket_of(subject: &str) -> Option<PathBuf> {
    // A path may be longer than the name of a socket may be: FNV-1a of it instead.
    let hash = subject.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    Some(record_directory().ok()?.join(format!("screen-{hash:016x}.watch")))
}

/// Returns what a window that watches this file or address calls it.
pub(super) fn subject_of(watched: &str) -> String {
    let whole = Path::new(watched).canonicalize();
    whole.map_or_else(|_| watched.to_owned(), |path| path.to_string_lossy().into_owned())
}

/// Returns the record of the run whose registry is at `address`, if its launcher is on this host.
pub(super) fn find_record(address: &str) -> Option<RunRecord> {
    let address = address.parse().ok()?;
    let running = list_running(&record_directory().ok()?).ok()?;
    running.into_iter().find(|record| record.registry == address).map(RunRecord::resolved)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_arrives_whole_and_a_lie_about_its_length_ends_the_connection() {
        let (mut near, far) = UnixStream::pair().unwrap();
        check_owner(&near).unwrap();
        let writer = MessageWriter::new(&far).unwrap();
        writer.send(&ToComponent::Stop { is_on: true }).unwrap();
        let read = read_message::<ToComponent>(&mut near).unwrap();
        assert!(matches!(read, Some(ToComponent::Stop { is_on: true })), "{read:?}");
        (&far).write_all(&u32::MAX.to_le_bytes()).unwrap();
        assert!(read_message::<ToComponent>(&mut near).is_err());
        (&far).write_all(&9_u32.to_le_bytes()).unwrap();
        writer.close();
        assert!(read_message::<ToComponent>(&mut near).unwrap().is_none(), "it is cut off");
    }

    #[test]
    fn each_file_has_its_own_socket() {
        assert_eq!(socket_of("/a/robot.xml"), socket_of("/a/robot.xml"));
        assert_ne!(socket_of("/a/robot.xml"), socket_of("/b/robot.xml"));
    }
}
