//! A tool's connection to configd: for listing and setting parameters, and for what changed.

use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use armor_wire::codec;
use armor_wire::config::{Change, Finding, ListedParameter, Reply, Request};
use armor_wire::frame::{self, FrameKind};
use armor_wire::hello::{Hello, Purpose, Refusal};
use armor_wire::liveness::BEAT;
use thiserror::Error;

use super::CONFIGD;
use crate::directory::{Directory, DirectoryError};
use crate::session::is_timeout;
use crate::socket::{self, ConnectError, Dialled, fresh_instance};

/// How long an answer may take: a busy disk writes a file within it.
const ANSWER_LIMIT: Duration = Duration::from_secs(10);

/// Why configd gave no answer.
#[derive(Debug, Error)]
pub enum ConfigdError {
    /// The registry does not know it.
    #[error(transparent)]
    Directory(#[from] DirectoryError),
    /// It cannot be reached.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// It cannot answer that, with its reason.
    #[error("{}", .0.text)]
    Refused(Refusal),
    /// The connection ended before the answer.
    #[error("configd gave no answer: {0}")]
    Ended(String),
}

/// The parameters of a running system.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// The version of the file that is in force.
    pub version: u64,
    /// Whether the file on the disk is another one, and refused.
    pub refused: bool,
    /// The parameters, component by component.
    pub parameters: Vec<ListedParameter>,
}

/// What became of a wish to set a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum SetOutcome {
    /// It is in the file, and in force.
    Set {
        /// The version that has it.
        version: u64,
        /// What changed by it, and when that takes effect; empty if it was so already.
        changes: Vec<Change>,
    },
    /// Nothing was written.
    Rejected {
        /// Why.
        text: String,
        /// What is wrong with the file as it would be, or as it is.
        findings: Vec<Finding>,
        /// How many more findings there are.
        left_out: u32,
    },
}

/// What changed between two versions.
#[derive(Clone, Debug, PartialEq)]
pub struct Differences {
    /// The earlier version.
    pub from: u64,
    /// The later version.
    pub to: u64,
    /// What changed, and when that takes or took effect.
    pub changes: Vec<Change>,
    /// How many more changes there are.
    pub left_out: u32,
}

/// A connection to configd.
pub struct ConfigdConnection {
    dialled: Dialled,
    next_request: u64,
}

impl ConfigdConnection {
    /// Finds configd and connects to it; `from` says who asks.
    ///
    /// # Errors
    /// If it is not there within `limit`, or cannot be reached.
    pub fn open(directory: &Directory, from: &str, limit: Duration) -> Result<Self, ConfigdError> {
        let found = directory.component(CONFIGD, limit)?;
        let hello = Hello::new(from, fresh_instance(), Purpose::Config);
        Ok(Self { dialled: socket::dial(&found.endpoint, &hello)?, next_request: 0 })
    }

    /// The parameters of all components, or of one.
    ///
    /// # Errors
    /// If there is no such component, or no answer.
    pub fn parameters(&mut self, component: Option<&str>) -> Result<Parameters, ConfigdError> {
        let mut all = Parameters { version: 0, refused: false, parameters: Vec::new() };
        loop {
            let from = u32::try_from(all.parameters.len()).unwrap_or(u32::MAX);
            let component = component.map(Into::into);
            match self.ask(|request| Request::List { request, component, from })? {
                Reply::Listed { version, refused, parameters, total, .. } => {
                    if from > 0 && version != all.version {
                        // The pages would not fit together.
                        all.parameters.clear();
                        continue;
                    }
                    (all.version, all.refused) = (version, refused);
                    let is_last = parameters.is_empty();
                    all.parameters.extend(parameters);
                    if is_last || all.parameters.len() >= total as usize {
                        return Ok(all);
                    }
                }
                other => return Err(unexpected(&other)),
            }
        }
    }

    /// Writes a value into the file; `None` takes it out, so that the default holds.
    ///
    /// # Errors
    /// If there is no answer; whether it was written is then not known.
    pub fn set(
        &mut self,
        component: &str,
        parameter: &str,
        value: Option<&str>,
    ) -> Result<SetOutcome, ConfigdError> {
        let reply = self.ask(|request| Request::Set {
            request,
            component: component.into(),
            parameter: parameter.into(),
            value: value.map(Into::into),
        })?;
        match reply {
            Reply::Set { version, changes, .. } => Ok(SetOutcome::Set { version, changes }),
            Reply::Rejected { text, findings, left_out, .. } => {
                Ok(SetOutcome::Rejected { text, findings, left_out })
            }
            other => Err(unexpected(&other)),
        }
    }

    /// What changed from version `from` (by default the one before `to`) to version `to` (by
    /// default the one in force).
    ///
    /// # Errors
    /// If configd does not hold them any more, or there is no answer.
    pub fn differences(
        &mut self,
        from: Option<u64>,
        to: Option<u64>,
    ) -> Result<Differences, ConfigdError> {
        match self.ask(|request| Request::Diff { request, from, to })? {
            Reply::Differences { from, to, changes, left_out, .. } => {
                Ok(Differences { from, to, changes, left_out })
            }
            other => Err(unexpected(&other)),
        }
    }

    fn ask(&mut self, request: impl FnOnce(u64) -> Request) -> Result<Reply, ConfigdError> {
        self.next_request += 1;
        let bytes = frame::to_bytes(FrameKind::Control, &request(self.next_request))
            .map_err(|error| ConfigdError::Ended(error.to_string()))?;
        self.write(&bytes)?;
        let deadline = Instant::now() + ANSWER_LIMIT;
        loop {
            while let Some(frame) = self.dialled.reader.next_frame().map_err(ended)? {
                if frame.kind == FrameKind::Beat {
                    continue;
                }
                let reply = codec::decode_control(frame.body).map_err(ended)?;
                match number(&reply) {
                    Some(number) if number == self.next_request => {
                        return match reply {
                            Reply::Refused { refusal, .. } => Err(ConfigdError::Refused(refusal)),
                            reply => Ok(reply),
                        };
                    }
                    _ => {}
                }
            }
            self.fill(deadline)?;
        }
    }

    /// Reads some bytes; beats while there are none.
    fn fill(&mut self, deadline: Instant) -> Result<(), ConfigdError> {
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(ended(format!("none within {ANSWER_LIMIT:?}")));
            }
            let wait = left.min(BEAT).max(Duration::from_millis(1));
            self.dialled.stream.set_read_timeout(Some(wait)).map_err(ended)?;
            match (&self.dialled.stream).read(self.dialled.reader.space()) {
                Ok(0) => return Err(ended("it closed the connection")),
                Ok(len) => {
                    self.dialled.reader.filled(len);
                    return Ok(());
                }
                Err(error) if is_timeout(&error) => self.write(&frame::signal(FrameKind::Beat))?,
                Err(error) => return Err(ended(error)),
            }
        }
    }

    fn write(&self, bytes: &[u8]) -> Result<(), ConfigdError> {
        (&self.dialled.stream).write_all(bytes).map_err(|error: io::Error| ended(error))
    }
}

fn ended(reason: impl ToString) -> ConfigdError {
    ConfigdError::Ended(reason.to_string())
}

fn unexpected(reply: &Reply) -> ConfigdError {
    ended(format!("it answers something else: {reply:?}"))
}

/// The request that is answered.
fn number(reply: &Reply) -> Option<u64> {
    match reply {
        Reply::Settings { request, .. }
        | Reply::Parameter { request, .. }
        | Reply::Refused { request, .. }
        | Reply::Listed { request, .. }
        | Reply::Set { request, .. }
        | Reply::Rejected { request, .. }
        | Reply::Differences { request, .. } => Some(*request),
        Reply::Beat => None,
    }
}
