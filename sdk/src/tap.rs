//! Reads the data of one output without being a component: for `echo`, `hz` and recordings.

use std::collections::VecDeque;
use std::io;
use std::ops::Deref;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::time::{Duration, Instant};

use armor_socket::{is_temporary, random_id};
use armor_wire::frame::{self, DataHeader, Frame, FrameError, FrameKind};
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
use crate::link::memory_in::{MemoryReader, NO_MEMORY, TakenMessage};
use crate::link::payload::{Payload, StoredPayload};
use crate::session::LEAST_WAIT;

/// Most slots of a publisher's memory that a tool holds. It copies what it keeps beyond that: a tool that
/// is slow must not make the publisher add many slots.
const MOST_HELD: u32 = 8;

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
    memory: MemoryUse,
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
        memory,
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

/// One message, as published, perhaps still in the memory of its publisher.
#[derive(Debug)]
pub struct TapMessage {
    /// Sequence, stamp and publisher.
    pub header: DataHeader,
    /// The encoded message.
    pub payload: TapPayload,
    /// How many messages were lost immediately before it.
    pub lost: u64,
}

/// The bytes of a message: a copy, or a slot in the memory of the publisher, which is held until this
/// is dropped.
#[derive(Debug)]
pub struct TapPayload(StoredPayload);

impl TapPayload {
    /// Whether the bytes are in the memory of the publisher.
    pub fn is_shared(&self) -> bool {
        matches!(self.0, StoredPayload::Slot(_))
    }

    /// The bytes as a copy that can be changed. What was held is given back.
    pub fn copied(&mut self) -> &mut [u8] {
        if let StoredPayload::Slot(slot) = &self.0 {
            self.0 = StoredPayload::Copied(slot.to_vec());
        }
        match &mut self.0 {
            StoredPayload::Copied(bytes) => bytes,
            StoredPayload::Slot(_) => &mut [],
        }
    }
}

impl Deref for TapPayload {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

impl From<Vec<u8>> for TapPayload {
    fn from(bytes: Vec<u8>) -> Self {
        Self(StoredPayload::Copied(bytes))
    }
}

impl From<TapPayload> for Vec<u8> {
    fn from(payload: TapPayload) -> Self {
        match payload.0 {
            StoredPayload::Copied(bytes) => bytes,
            StoredPayload::Slot(slot) => slot.to_vec(),
        }
    }
}

/// A copy, whatever the original is.
impl Clone for TapPayload {
    fn clone(&self) -> Self {
        self.to_vec().into()
    }
}

impl PartialEq for TapPayload {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

/// A link that belongs to a tool.
pub struct Tap {
    dialled: Dialled,
    schema: Schema,
    type_name: String,
    heard: Instant,
    spoke: Instant,
    last: Option<u64>,
    /// Once the publisher has offered it.
    memory: Option<MemoryReader>,
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
        Self::open_from(directory, data, name_tool(), keep, timeout)
    }

    /// As [`Self::open`]; a publisher on this host puts large messages into memory that the tool
    /// reads them from, if `keep` allows it ([the rules](crate::count_slots)).
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_in_memory(
        directory: &Directory,
        data: &str,
        keep: Keep,
        timeout: Duration,
    ) -> Result<Self, TapError> {
        Self::find_and_dial(directory, data, (name_tool(), keep, MemoryUse::Large), timeout)
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
        let hello = link_hello(provider, data, &name_tool(), keep, MemoryUse::Never);
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
        Self::find_and_dial(directory, data, (from, keep, MemoryUse::Never), timeout)
    }

    fn find_and_dial(
        directory: &Directory,
        data: &str,
        (from, keep, memory): ((String, u64), Keep, MemoryUse),
        timeout: Duration,
    ) -> Result<Self, TapError> {
        let found = directory.find_provider(data, timeout)?;
        let mut hello = link_hello(&found.provider, data, &from, keep, memory);
        found.prove_link(&mut hello);
        Self::dial(&found.provider, &hello, found.entry.type_name)
    }

    fn dial(provider: &ComponentEntry, hello: &Hello, type_name: String) -> Result<Self, TapError> {
        let dialled = dial::dial_component(provider, hello, Transport::Auto)?;
        let schema = schema::parse(&dialled.welcome.schema)?;
        let now = Instant::now();
        Ok(Self { dialled, schema, type_name, heard: now, spoke: now, last: None, memory: None })
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
        let deadline = Instant::now() + timeout;
        loop {
            if let Some(TapMessage { header, payload, lost }) = self.take_arrived()? {
                return Ok(Some(TapData { header, payload: payload.into(), lost }));
            }
            let now = Instant::now();
            if now >= deadline {
                return Ok(None);
            }
            self.keep_alive(now)?;
            let wait = deadline.duration_since(now).min(LOOK).max(LEAST_WAIT);
            self.dialled.stream.set_read_timeout(Some(wait)).map_err(end_link)?;
            if self.announce_sleep() {
                let Dialled { stream, reader, files, .. } = &mut self.dialled;
                let received = stream.receive_with_files(reader.space(), files);
                self.follow_receipt(received)?;
            }
        }
    }

    /// Takes the next message of those that have been received, or are in the publisher's memory.
    ///
    /// # Errors
    /// [`TapError`] if the link has ended.
    pub fn take_arrived(&mut self) -> Result<Option<TapMessage>, TapError> {
        loop {
            let Self { dialled: Dialled { reader, files, .. }, memory, last, .. } = self;
            // What came by the socket is older than what is in the memory that was offered behind it.
            while let Some(frame) = reader.next_frame()? {
                match frame.kind {
                    FrameKind::Beat | FrameKind::Ready => {}
                    FrameKind::MemoryOffer | FrameKind::SlotOffer | FrameKind::SlotEnd => {
                        follow_memory(memory, &frame, files).map_err(TapError::Ended)?;
                    }
                    _ => {
                        let (header, payload) = frame.data()?;
                        let payload = Payload::Buffer(payload).store(StoredPayload::default());
                        return Ok(Some(number_message(last, header, payload)));
                    }
                }
            }
            let Some(memory) = memory else { return Ok(None) };
            match memory.take_message().map_err(TapError::Ended)? {
                TakenMessage::Nothing => return Ok(None),
                TakenMessage::Message(header, slot) => {
                    let payload = Payload::Slot(&slot).store(StoredPayload::default());
                    return Ok(Some(number_message(last, header, payload)));
                }
                // It was sent before the message was put into the ring.
                TakenMessage::OfferAwaited => {
                    if self.receive()? == 0 {
                        return Err(TapError::Ended("memory was used but not offered".into()));
                    }
                }
            }
        }
    }

    /// Receives what has arrived at the socket, without waiting, once [`Self::take_arrived`] has returned
    /// `None`: at most as much as one read brings. Returns whether there may be more.
    ///
    /// # Errors
    /// [`TapError`] if the link has ended.
    pub fn receive_now(&mut self) -> Result<bool, TapError> {
        let room = self.dialled.reader.space().len();
        Ok(self.receive()? == room)
    }

    fn receive(&mut self) -> Result<usize, TapError> {
        let Dialled { stream, reader, files, .. } = &mut self.dialled;
        let received = stream.try_receive_with_files(reader.space(), files);
        self.follow_receipt(received)
    }

    /// Asks the publisher to wake this tool, through the socket, for the next message in its memory.
    /// `false` if there is one already, and then it asks nothing. Without memory each message comes
    /// through the socket.
    pub fn announce_sleep(&self) -> bool {
        self.memory.as_ref().is_none_or(|memory| !memory.has_messages() && memory.announce_sleep())
    }

    /// Sends a beat, if one is due. A tool that does not call [`Self::next`] calls this at least twice
    /// per second.
    ///
    /// # Errors
    /// [`TapError`] if the link has ended.
    pub fn keep_alive(&mut self, now: Instant) -> Result<(), TapError> {
        if now.duration_since(self.spoke) < BEAT {
            return Ok(());
        }
        self.spoke = now;
        match self.dialled.stream.try_send(&frame::signal(FrameKind::Beat)) {
            // A publisher that does not read will be silent soon.
            Err(error) if !is_temporary(&error) => Err(end_link(error)),
            _ => Ok(()),
        }
    }

    /// Whether nothing has arrived for a time after which the publisher may be dead: the next
    /// [`Self::receive_now`] ends the link, unless something waits in the socket.
    pub fn is_silent(&self, now: Instant) -> bool {
        now.duration_since(self.heard) >= SILENCE
    }

    fn follow_receipt(&mut self, received: io::Result<usize>) -> Result<usize, TapError> {
        match received {
            Ok(0) => Err(TapError::Ended("the provider closed it".into())),
            Ok(len) => {
                self.dialled.reader.filled(len);
                self.heard = Instant::now();
                Ok(len)
            }
            Err(error) if is_temporary(&error) && self.heard.elapsed() < SILENCE => Ok(0),
            Err(error) if is_temporary(&error) => {
                Err(TapError::Ended("the provider fell silent".into()))
            }
            Err(error) => Err(end_link(error)),
        }
    }
}

/// Its socket, to wait for.
impl AsFd for Tap {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.dialled.stream.as_fd()
    }
}

fn name_tool() -> (String, u64) {
    (format!("{TOOL_PREFIX}{}", std::process::id()), random_id())
}

fn end_link(error: io::Error) -> TapError {
    TapError::Ended(error.to_string())
}

fn follow_memory(
    memory: &mut Option<MemoryReader>,
    frame: &Frame<'_>,
    files: &mut VecDeque<OwnedFd>,
) -> Result<(), String> {
    if frame.kind == FrameKind::MemoryOffer {
        let mut opened = MemoryReader::open(frame, files)?;
        opened.limit_held(MOST_HELD);
        *memory = Some(opened);
        return Ok(());
    }
    memory.as_mut().ok_or(NO_MEMORY)?.follow(frame, files)
}

/// Counts what is missing between the last message and this one.
fn number_message(
    last: &mut Option<u64>,
    header: DataHeader,
    payload: StoredPayload,
) -> TapMessage {
    let lost = match *last {
        Some(last) if !header.fresh => header.sequence.saturating_sub(last + 1),
        _ => 0,
    };
    *last = Some(header.sequence);
    TapMessage { header, payload: TapPayload(payload), lost }
}
