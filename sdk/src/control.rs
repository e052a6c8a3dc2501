//! The other end of a component's control connection: for the executive, the launcher and tools.

use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use armor_socket::{own_key, random_id};
use armor_wire::codec;
use armor_wire::frame::FrameKind;
use armor_wire::hello::{Hello, Purpose};
use armor_wire::registry::ComponentEntry;
use armor_wire::run_key::NameKey;
use armor_wire::transport::Transport;
use parking_lot::Mutex;
use thiserror::Error;

pub use armor_wire::config::Assigned;
pub use armor_wire::control::{
    Answer, Command, CurrentCall, GivenParameter, InputStatus, LinkStatus, Order, OutputStatus,
    PlaybackOrder, ReportKind, Role, RunState, Status, TokenMove,
};

use crate::background_thread::spawn_background;
use crate::dial::{self, ConnectError, Dialled};
use crate::session::{self, FrameWriter};

/// What happens on a control connection.
#[expect(clippy::large_enum_variant, reason = "almost every event is an answer")]
#[derive(Clone, Debug, PartialEq)]
pub enum ControlEvent {
    /// The component has sent an answer.
    Answer(Answer),
    /// The connection has ended, and why.
    Closed(String),
}

/// Why a component's status is not available.
#[derive(Debug, Error)]
pub enum StatusError {
    /// The connection has ended.
    #[error("the connection has ended: {0}")]
    Closed(#[from] io::Error),
    /// It does not answer.
    #[error("no answer within {0:.1?}")]
    Timeout(Duration),
}

type StatusAnswers = Arc<Mutex<Vec<(u64, mpsc::Sender<Status>)>>>;

/// A control connection to one component. Closed when dropped.
pub struct ControlConnection {
    writer: FrameWriter,
    next_request: AtomicU64,
    answers: StatusAnswers,
}

impl ControlConnection {
    /// Connects to the process `entry`. Calls `sink` with every event, on a thread of its own.
    ///
    /// # Errors
    /// [`ConnectError`] if it cannot be reached or another process has taken its place.
    pub fn connect(
        entry: &ComponentEntry,
        role: Role,
        from: &str,
        sink: impl FnMut(ControlEvent) + Send + 'static,
    ) -> Result<Self, ConnectError> {
        Self::connect_as(entry, role, from, random_id(), sink)
    }

    /// As [`Self::connect`], for a process that is identified by its `instance` over all its
    /// connections.
    pub(crate) fn connect_as(
        entry: &ComponentEntry,
        role: Role,
        from: &str,
        instance: u64,
        sink: impl FnMut(ControlEvent) + Send + 'static,
    ) -> Result<Self, ConnectError> {
        let hello = name_role(from, instance, role, own_key(&entry.name));
        let dialled = dial::dial_component(entry, &hello, Transport::Auto)?;
        Self::begin(dialled, &entry.endpoint, sink)
    }

    /// As [`Self::connect`], for a process that is known only by where it listens. A process that has
    /// taken its place is not noticed. `key` is its own, if the launcher of its run has given it one.
    ///
    /// # Errors
    /// [`ConnectError`] if it cannot be reached.
    pub fn connect_to(
        address: &str,
        key: Option<NameKey>,
        role: Role,
        from: &str,
        sink: impl FnMut(ControlEvent) + Send + 'static,
    ) -> Result<Self, ConnectError> {
        let hello = name_role(from, random_id(), role, key);
        Self::begin(dial::dial(address, &hello)?, address, sink)
    }

    fn begin(
        dialled: Dialled,
        address: &str,
        mut sink: impl FnMut(ControlEvent) + Send + 'static,
    ) -> Result<Self, ConnectError> {
        let unreachable = |error| ConnectError::Unreachable { address: address.into(), error };
        let writer = FrameWriter::new(&dialled.stream).map_err(unreachable)?;
        let answers = StatusAnswers::default();
        let (reading, waiting) = (writer.clone(), Arc::clone(&answers));
        let serve = move || {
            let reason = session::serve_frames(
                dialled,
                &reading,
                |frame| {
                    if frame.kind != FrameKind::Control {
                        return Err(format!("a {:?} frame on a control connection", frame.kind));
                    }
                    let answer = codec::decode_control(frame.body).map_err(|e| e.to_string())?;
                    deliver_status(&waiting, &answer);
                    sink(ControlEvent::Answer(answer));
                    Ok(())
                },
                || Duration::MAX,
            );
            waiting.lock().clear();
            sink(ControlEvent::Closed(reason));
        };
        spawn_background("control", serve).map_err(unreachable)?;
        Ok(Self { writer, next_request: AtomicU64::new(1), answers })
    }

    /// Sends a command.
    ///
    /// # Errors
    /// If the connection has ended; the sink gets a [`ControlEvent::Closed`] too.
    pub fn send(&self, command: &Command) -> io::Result<()> {
        self.writer.send(command)
    }

    /// Asks for the component's status and waits for it.
    ///
    /// # Errors
    /// [`StatusError`] if the connection ends or the answer does not come in time.
    pub fn status(&self, timeout: Duration) -> Result<Status, StatusError> {
        let request = self.next_request.fetch_add(1, Ordering::Relaxed);
        let (sender, receiver) = mpsc::channel();
        self.answers.lock().push((request, sender));
        self.send(&Command::Status { request })?;
        receiver.recv_timeout(timeout).map_err(|error| match error {
            mpsc::RecvTimeoutError::Timeout => StatusError::Timeout(timeout),
            mpsc::RecvTimeoutError::Disconnected => {
                StatusError::Closed(io::ErrorKind::ConnectionAborted.into())
            }
        })
    }
}

/// Returns the hello of a connection to a component with this key, which it needs for some roles.
fn name_role(from: &str, instance: u64, role: Role, key: Option<NameKey>) -> Hello {
    let mut hello = Hello::new(from, instance, Purpose::Control { role });
    if let Some(key) = key {
        key.prove(&mut hello);
    }
    hello
}

impl Drop for ControlConnection {
    fn drop(&mut self) {
        self.writer.close();
    }
}

fn deliver_status(waiting: &StatusAnswers, answer: &Answer) {
    if let Answer::Status { request, status } = answer {
        waiting.lock().retain(|(asked, sender)| {
            if asked == request {
                let _ = sender.send(status.clone());
            }
            asked != request
        });
    }
}
