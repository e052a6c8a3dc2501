//! A tool's connection to configd, to ask it its [`Questions`].

use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use armor_socket::{is_temporary, random_id};
use armor_wire::codec;
use armor_wire::config::{ConfigReply, ConfigRequest};
use armor_wire::frame::{self, FrameKind};
use armor_wire::hello::{Hello, Purpose};
use armor_wire::liveness::BEAT;

use super::questions::{ConfigdError, Questions};
use crate::dial::{self, Dialled};
use crate::directory::Directory;
use crate::session::LEAST_WAIT;

/// Name under which configd is registered.
pub(crate) const CONFIGD: &str = "configd";
/// How long an answer may take: a busy disk writes a file within it.
const ANSWER_LIMIT: Duration = Duration::from_secs(10);

/// A connection to configd.
pub struct ConfigdConnection {
    dialled: Dialled,
    next_request: u64,
}

impl ConfigdConnection {
    /// Finds configd and connects to it; `from` is the name of the asking process.
    ///
    /// # Errors
    /// If it is not registered within `limit`, or cannot be reached.
    pub fn open(directory: &Directory, from: &str, limit: Duration) -> Result<Self, ConfigdError> {
        let found = directory.find_process(CONFIGD, limit)?;
        let hello = Hello::new(from, random_id(), Purpose::Config);
        Ok(Self { dialled: dial::dial(&found.endpoint, &hello)?, next_request: 0 })
    }

    /// Reads the bytes that have arrived; sends beats while there are none.
    fn read_more(&mut self, deadline: Instant) -> Result<(), ConfigdError> {
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(ended(format!("none within {ANSWER_LIMIT:?}")));
            }
            let wait = left.min(BEAT).max(LEAST_WAIT);
            self.dialled.stream.set_read_timeout(Some(wait)).map_err(ended)?;
            match (&self.dialled.stream).read(self.dialled.reader.space()) {
                Ok(0) => return Err(ended("it closed the connection")),
                Ok(len) => {
                    self.dialled.reader.filled(len);
                    return Ok(());
                }
                Err(error) if is_temporary(&error) => {
                    self.write_bytes(&frame::signal(FrameKind::Beat))?;
                }
                Err(error) => return Err(ended(error)),
            }
        }
    }

    fn write_bytes(&self, bytes: &[u8]) -> Result<(), ConfigdError> {
        (&self.dialled.stream).write_all(bytes).map_err(|error: io::Error| ended(error))
    }
}

impl Questions for ConfigdConnection {
    type Error = ConfigdError;

    fn ask(
        &mut self,
        request: impl FnOnce(u64) -> ConfigRequest,
    ) -> Result<ConfigReply, ConfigdError> {
        self.next_request += 1;
        let bytes = frame::to_bytes(FrameKind::Control, &request(self.next_request))
            .map_err(|error| ConfigdError::Ended(error.to_string()))?;
        self.write_bytes(&bytes)?;
        let deadline = Instant::now() + ANSWER_LIMIT;
        loop {
            while let Some(frame) = self.dialled.reader.next_frame().map_err(ended)? {
                if frame.kind == FrameKind::Beat {
                    continue;
                }
                let reply = codec::decode_control(frame.body).map_err(ended)?;
                match find_request(&reply) {
                    Some(number) if number == self.next_request => {
                        return match reply {
                            ConfigReply::Refused { refusal, .. } => {
                                Err(ConfigdError::Refused(refusal))
                            }
                            reply => Ok(reply),
                        };
                    }
                    _ => {}
                }
            }
            self.read_more(deadline)?;
        }
    }
}

fn ended(reason: impl ToString) -> ConfigdError {
    ConfigdError::Ended(reason.to_string())
}

/// The number of the request that `reply` answers.
fn find_request(reply: &ConfigReply) -> Option<u64> {
    match reply {
        ConfigReply::Settings { request, .. }
        | ConfigReply::Parameter { request, .. }
        | ConfigReply::Refused { request, .. }
        | ConfigReply::Listed { request, .. }
        | ConfigReply::Set { request, .. }
        | ConfigReply::Rejected { request, .. }
        | ConfigReply::Differences { request, .. } => Some(*request),
        ConfigReply::Beat => None,
    }
}
