//! Reads the data of one output without being a component: for `echo`, `hz` and recordings.

use std::io::Read;
use std::time::{Duration, Instant};

use armor_socket::{is_temporary, random_id};
use armor_wire::frame::{self, DataHeader, FrameError, FrameKind};
use armor_wire::hello::{HandshakeError, Hello, LinkRequest, Purpose, RefusalCode};
use armor_wire::keep::{Keep, Wake};
use armor_wire::liveness::{BEAT, LOOK, SILENCE};
use armor_wire::registry::ComponentEntry;
use armor_wire::schema::{self, Schema};
use armor_wire::shared_memory::MemoryUse;
use armor_wire::transport::Transport;
use thiserror::Error;

use crate::dial::{self, ConnectError, Dialled};
use crate::directory::{Directory, DirectoryError};
use crate::session::LEAST_WAIT;

/// How the names of tools begin, which are no components of the system.
pub(crate) const TOOL_PREFIX: &str = "tool-";

/// Why data cannot be read.
#[derive(Debug, Error)]
pub enum TapError {
    /// The registry does not know it.
    #[error(transparent)]
    Directory(#[from] DirectoryError),
    /// Its provider cannot be reached.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// The provider's schema cannot be read.
    #[error("the schema of the data cannot be read: {0}")]
    Schema(#[from] schema::ParseError),
    /// The provider does not speak the protocol.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The link has ended.
    #[error("the link has ended: {0}")]
    Ended(String),
}

impl TapError {
    /// Whether the provider does not have the data.
    pub fn is_unknown_data(&self) -> bool {
        let Self::Connect(ConnectError::Handshake { error, .. }) = self else { return false };
        matches!(error, HandshakeError::Refused(refusal) if refusal.code == RefusalCode::UnknownData)
    }
}

/// The hello of a link that one process asks for: its name and its start.
fn link_hello(
    provider: &ComponentEntry,
    data: &str,
    (from, instance): &(String, u64),
    keep: Keep,
) -> Hello {
    let link = LinkRequest {
        data: data.into(),
        instance: provider.instance,
        schema: String::new(),
        schema_hash: 0,
        keep,
        wake: Wake::Sleep,
        paused: false,
        history: 1,
        memory: MemoryUse::Never,
        datagrams: false,
    };
    Hello::new(from, *instance, Purpose::Link { link })
}

/// One message, as published.
#[derive(Clone, Debug, PartialEq)]
pub struct TapData {
    /// Sequence, stamp and publisher.
    pub header: DataHeader,
    /// The encoded message.
    pub payload: Vec<u8>,
    /// How many messages were lost immediately before it.
    pub lost: u64,
}

/// A link that belongs to a tool.
pub struct Tap {
    dialled: Dialled,
    schema: Schema,
    type_name: String,
    heard: Instant,
    spoke: Instant,
    last: Option<u64>,
}

impl Tap {
    /// Links to `data`; waits for a provider until `timeout`.
    ///
    /// # Errors
    /// [`TapError`] if it has no provider or the provider cannot be reached.
    pub fn open(
        directory: &Directory,
        data: &str,
        keep: Keep,
        timeout: Duration,
    ) -> Result<Self, TapError> {
        let from = (format!("{TOOL_PREFIX}{}", std::process::id()), random_id());
        Self::open_from(directory, data, from, keep, timeout)
    }

    /// Links to data that its provider does not register, such as its
    /// [calls](crate::call_trace::CALLS).
    ///
    /// # Errors
    /// [`TapError`] if the provider cannot be reached, or does not have the data.
    pub fn open_unregistered(
        provider: &ComponentEntry,
        data: &str,
        keep: Keep,
    ) -> Result<Self, TapError> {
        let from = (format!("{TOOL_PREFIX}{}", std::process::id()), random_id());
        let hello = link_hello(provider, data, &from, keep);
        Self::dial(provider, &hello, String::new())
    }

    /// As [`Self::open`], in the name of a process: its name and its start.
    pub(crate) fn open_from(
        directory: &Directory,
        data: &str,
        from: (String, u64),
        keep: Keep,
        timeout: Duration,
    ) -> Result<Self, TapError> {
        let found = directory.find_provider(data, timeout)?;
        let mut hello = link_hello(&found.provider, data, &from, keep);
        found.prove_link(&mut hello);
        Self::dial(&found.provider, &hello, found.entry.type_name)
    }

    fn dial(provider: &ComponentEntry, hello: &Hello, type_name: String) -> Result<Self, TapError> {
        let dialled = dial::dial_component(provider, hello, Transport::Auto)?;
        let schema = schema::parse(&dialled.welcome.schema)?;
        let now = Instant::now();
        Ok(Self { dialled, schema, type_name, heard: now, spoke: now, last: None })
    }

    /// Layout of the data.
    pub fn schema(&self) -> &Schema {
        &self.schema
    }

    /// Name of its type.
    pub fn type_name(&self) -> &str {
        &self.type_name
    }

    /// Returns the next message; `None` if none arrives within `timeout`.
    ///
    /// # Errors
    /// [`TapError`] if the link has ended.
    pub fn next(&mut self, timeout: Duration) -> Result<Option<TapData>, TapError> {
        let ended = |reason: String| TapError::Ended(reason);
        let deadline = Instant::now() + timeout;
        loop {
            while let Some(frame) = self.dialled.reader.next_frame()? {
                if frame.kind == FrameKind::Beat {
                    continue;
                }
                let (header, payload) = frame.data()?;
                let lost = match self.last {
                    Some(last) if !header.fresh => header.sequence.saturating_sub(last + 1),
                    _ => 0,
                };
                self.last = Some(header.sequence);
                return Ok(Some(TapData { header, payload: payload.to_vec(), lost }));
            }
            let now = Instant::now();
            if now >= deadline {
                return Ok(None);
            }
            if now.duration_since(self.spoke) >= BEAT {
                let beat = frame::signal(FrameKind::Beat);
                std::io::Write::write_all(&mut &self.dialled.stream, &beat)
                    .map_err(|error| ended(error.to_string()))?;
                self.spoke = now;
            }
            let wait = deadline.duration_since(now).min(LOOK).max(LEAST_WAIT);
            self.dialled.stream.set_read_timeout(Some(wait)).map_err(|e| ended(e.to_string()))?;
            match (&self.dialled.stream).read(self.dialled.reader.space()) {
                Ok(0) => return Err(ended("the provider closed it".into())),
                Ok(len) => {
                    self.dialled.reader.filled(len);
                    self.heard = Instant::now();
                }
                Err(error) if is_temporary(&error) && self.heard.elapsed() < SILENCE => {}
                Err(error) if is_temporary(&error) => {
                    return Err(ended("the provider fell silent".into()));
                }
                Err(error) => return Err(ended(error.to_string())),
            }
        }
    }
}
