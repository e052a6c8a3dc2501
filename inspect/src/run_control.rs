//! Requests to the launcher of a running system: to start a component again, or to stop it. They go
//! through a Unix socket next to the record of the run, in a folder that only this user can enter.
//! One line of JSON each way.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::systems::{RunRecord, SystemsError, record_directory};

/// Longest request or reply, in bytes: twenty components with the ends of their processes.
pub const MAX_LINE_LEN: usize = 32 << 10;
/// Time within which the launcher must answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);

/// A request to the launcher.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunRequest {
    /// End the component's process, if it runs, and start it again.
    Restart {
        /// The component.
        component: String,
    },
    /// End the component's process; it stays down until it is restarted.
    Stop {
        /// The component.
        component: String,
    },
    /// Stop the whole system in order, as Ctrl-C does.
    StopAll,
    /// List the components whose processes do not run and the other hosts, and report whether there is an
    /// executive.
    List,
    /// Return the starts and ends of the processes of a component or a daemon.
    History {
        /// The component or daemon.
        component: String,
    },
}

/// The launcher's reply.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunReply {
    /// Whether the request is carried out.
    pub accepted: bool,
    /// The consequence, or why it is refused.
    pub text: String,
    /// The components whose processes do not run, if they were asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub absent: Vec<AbsentComponent>,
    /// The other hosts of the system, if the components were asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hosts: Vec<HostReport>,
    /// Whether an executive runs or is going to be started, if the components were asked for; none from
    /// a launcher that does not report it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub has_executive: Option<bool>,
    /// The starts and ends of the component's processes, if they were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub history: Option<ComponentHistory>,
}

/// Another host of the system, as the launcher sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HostReport {
    /// Its name in the file.
    pub host: String,
    /// Whether its agent is connected.
    pub link: HostLink,
    /// Why it is not, in words.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub reason: String,
    /// How long this has been so, in seconds.
    #[serde(default)]
    pub for_s: f64,
    /// Its wall clock minus that of the launcher's host, in seconds.
    #[serde(default)]
    pub clock_offset_s: Option<f64>,
    /// The error of that is at most this, in seconds.
    #[serde(default)]
    pub clock_error_s: Option<f64>,
}

/// Whether the agent of a host is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HostLink {
    /// It has not been reached yet.
    Awaited,
    /// It is.
    Connected,
    /// It was.
    CutOff,
}

/// The starts and ends of a component's processes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ComponentHistory {
    /// What becomes of it; none if its process runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<AbsentState>,
    /// Number of processes that were started.
    pub starts: u32,
    /// Number of processes that have ended.
    pub ended: u32,
    /// How its last process ended and what follows, in words; empty if none has.
    pub last_end: String,
}

/// A component whose process does not run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AbsentComponent {
    /// The component.
    pub component: String,
    /// The host on which it runs, if that is not the launcher's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub host: Option<String>,
    /// What becomes of it.
    pub state: AbsentState,
    /// How its last process ended and what follows, in words; empty if none has run.
    pub reason: String,
    /// Number of processes that were started.
    #[serde(default)]
    pub starts: u32,
    /// How its last processes ended by themselves, in words, the newest last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ends: Vec<String>,
}

/// What becomes of a component whose process does not run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AbsentState {
    /// It is started, now or after a delay.
    Starting,
    /// It has ended and stays down.
    Ended,
    /// An operator has stopped it.
    Stopped,
    /// It has died too often and stays down.
    GivenUp,
}

impl std::fmt::Display for AbsentState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Starting => "starting",
            Self::Ended => "ended",
            Self::Stopped => "stopped",
            Self::GivenUp => "given up",
        })
    }
}

/// Why the launcher has not answered.
#[derive(Debug, Error)]
pub enum RunControlError {
    /// Its socket cannot be found.
    #[error(transparent)]
    Systems(#[from] SystemsError),
    /// It cannot be reached, or has closed the connection.
    #[error("the launcher (process {pid}) does not answer: {error}")]
    Unreachable {
        /// The launcher's process id.
        pid: u32,
        /// The cause.
        error: io::Error,
    },
}

/// Returns the path of the launcher's socket.
///
/// # Errors
/// If the folder of the records cannot be used.
pub fn socket_path(system: &str, pid: u32) -> Result<PathBuf, SystemsError> {
    Ok(record_directory()?.join(format!("{system}-{pid}.sock")))
}

/// Sends a request to the launcher of a system, and returns its reply.
///
/// # Errors
/// If the launcher does not answer.
pub fn request(record: &RunRecord, request: &RunRequest) -> Result<RunReply, RunControlError> {
    let path = socket_path(&record.system, record.pid)?;
    let exchange = || -> io::Result<RunReply> {
        let mut stream = UnixStream::connect(&path)?;
        stream.set_read_timeout(Some(ANSWER_WITHIN))?;
        stream.set_write_timeout(Some(ANSWER_WITHIN))?;
        stream.write_all(format!("{}\n", serde_json::to_string(request)?).as_bytes())?;
        let mut line = String::new();
        BufReader::new(stream.take(MAX_LINE_LEN as u64)).read_line(&mut line)?;
        if line.is_empty() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(serde_json::from_str(&line)?)
    };
    exchange().map_err(|error| RunControlError::Unreachable { pid: record.pid, error })
}
