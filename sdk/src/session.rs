//! Serves one connection on the thread that reads it: receives frames, sends beats, and ends the
//! connection when the other side falls silent.

use std::io::{self, Read, Write};
use std::net::Shutdown;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::{Stream, is_temporary};
use armor_wire::frame::{self, Frame, FrameKind};
use armor_wire::liveness::Liveness;
use armor_wire::message::WireType;
use parking_lot::Mutex;

use crate::dial::Dialled;

/// How long a write may take before the peer counts as stuck.
const WRITE_LIMIT: Duration = Duration::from_secs(2);
/// Shortest read timeout: a timeout of zero is an error.
pub(crate) const LEAST_WAIT: Duration = Duration::from_millis(1);

/// The writing half of a connection; threads share it.
#[derive(Clone)]
pub(crate) struct FrameWriter(Arc<Mutex<Stream>>);

impl FrameWriter {
    /// The writing half of `stream`. Writing fails after two seconds.
    pub fn new(stream: &Stream) -> io::Result<Self> {
        let stream = stream.try_clone()?;
        stream.set_write_timeout(Some(WRITE_LIMIT))?;
        Ok(Self(Arc::new(Mutex::new(stream))))
    }

    /// Sends `value` as a control frame.
    pub fn send<T: WireType>(&self, value: &T) -> io::Result<()> {
        let bytes = frame::to_bytes(FrameKind::Control, value)
            .map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
        self.send_bytes(&bytes)
    }

    /// Sends whole frames.
    pub fn send_bytes(&self, bytes: &[u8]) -> io::Result<()> {
        let mut stream = self.0.lock();
        let result = stream.write_all(bytes);
        if result.is_err() {
            // Half a frame may be written: nothing valid can follow on this connection.
            let _ = stream.shutdown(Shutdown::Both);
        }
        result
    }

    /// Ends the connection; the reading thread notices.
    pub fn close(&self) {
        let _ = self.0.lock().shutdown(Shutdown::Both);
    }
}

/// Reads `dialled` until it ends, and returns why, in words.
///
/// `on_frame` gets every frame but beats; its error ends the conversation. `on_time` is called at
/// least as often as it asks for: it returns how long it can wait.
pub(crate) fn serve_frames(
    mut dialled: Dialled,
    writer: &FrameWriter,
    mut on_frame: impl FnMut(&Frame<'_>) -> Result<(), String>,
    mut on_time: impl FnMut() -> Duration,
) -> String {
    let start = Instant::now();
    let mut liveness = Liveness::new(Duration::ZERO);
    let mut timeout = Duration::ZERO;
    loop {
        loop {
            match dialled.reader.next_frame() {
                Ok(Some(frame)) if frame.kind == FrameKind::Beat => {}
                Ok(Some(frame)) => {
                    if let Err(reason) = on_frame(&frame) {
                        return reason;
                    }
                }
                Ok(None) => break,
                Err(error) => return error.to_string(),
            }
        }
        let wait = on_time();
        let now = start.elapsed();
        if liveness.is_silent(now) {
            return "it fell silent".into();
        }
        if liveness.owes_beat(now) {
            if let Err(error) = writer.send_bytes(&frame::signal(FrameKind::Beat)) {
                return error.to_string();
            }
            liveness.spoke(now);
        }
        let wait = wait.min(liveness.time_until_due(now)).max(LEAST_WAIT);
        if wait != timeout {
            timeout = wait;
            if let Err(error) = dialled.stream.set_read_timeout(Some(wait)) {
                return error.to_string();
            }
        }
        match (&dialled.stream).read(dialled.reader.space()) {
            Ok(0) => return "it closed the connection".into(),
            Ok(len) => {
                dialled.reader.filled(len);
                liveness.heard(start.elapsed());
            }
            Err(error) if is_temporary(&error) => {}
            Err(error) => return error.to_string(),
        }
    }
}
