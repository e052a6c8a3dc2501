//! The handshake of every connection: the client sends its name and purpose; the server welcomes or
//! refuses it, with a reason for people.

use thiserror::Error;

use crate::Message;
use crate::codec;
use crate::control::Role;
use crate::frame::{Frame, FrameError, FrameKind};
use crate::keep::{Keep, MAX_KEEP, Wake};
use crate::limits::KEY_LEN;
use crate::name::split_data;
pub use crate::refusal::{Refusal, RefusalCode};
use crate::registry::ComponentEntry;
use crate::shared_memory::MemoryUse;

/// The first bytes of the first frame's body.
pub const MAGIC: [u8; 4] = *b"ARMR";
/// Longest name that a hello may be from, in bytes: a component's, or a tool's with its process id.
pub const MAX_FROM_LEN: usize = 128;
pub use crate::version::VERSION;

/// The client's name and purpose.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Hello {
    /// [`MAGIC`].
    pub magic: [u8; 4],
    /// [`VERSION`].
    pub version: u16,
    /// The client's name: a component's, or a tool's with its process id.
    pub from: String,
    /// Its process start.
    pub instance: u64,
    /// The purpose of the connection.
    pub purpose: Purpose,
    /// The proof of the key that the launcher has given this process, or of the key of a link between
    /// hosts ([`crate::run_key`]); none from a process that was started by hand.
    pub proof: Option<[u8; KEY_LEN]>,
}

/// What a connection is for.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub enum Purpose {
    /// To the registry: to register, or only to ask.
    Registry {
        /// The process that registers; `None` for an observer.
        entry: Option<ComponentEntry>,
    },
    /// To configd: settings and parameters of the component that connects.
    Config,
    /// To a component: data of one of its outputs.
    Link {
        /// The data, and how they should be sent.
        link: LinkRequest,
    },
    /// To a component: to command or to watch it.
    Control {
        /// Its role.
        role: Role,
    },
}

impl Purpose {
    /// What the client registers as, if it does.
    pub fn entry(&self) -> Option<&ComponentEntry> {
        match self {
            Self::Registry { entry } => entry.as_ref(),
            Self::Config | Self::Link { .. } | Self::Control { .. } => None,
        }
    }
}

/// A request for the data of an output.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct LinkRequest {
    /// Unique name of the data, `component.output`.
    pub data: String,
    /// The process start that the registry named; another one refuses. 0 takes any.
    pub instance: u64,
    /// The subscriber's schema as canonical text; empty takes any.
    pub schema: String,
    /// Hash of that schema; 0 takes any.
    pub schema_hash: u64,
    /// Which data the subscriber gets when it is slow.
    pub keep: Keep,
    /// How both ends wait.
    pub wake: Wake,
    /// Whether the subscriber is frozen: nothing is sent until it sends `Resume`.
    pub paused: bool,
    /// How many of its last values a latched output sends at the beginning.
    pub history: u32,
    /// Whether it takes data from shared memory.
    pub memory: MemoryUse,
    /// Whether it takes data in datagrams.
    pub datagrams: bool,
}

/// Accepts a hello.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Welcome {
    /// The server's name.
    pub name: String,
    /// Its process start.
    pub instance: u64,
    /// For a link: the schema of the data, as canonical text; otherwise empty.
    pub schema: String,
}

/// Why a handshake failed.
#[derive(Debug, Error)]
pub enum HandshakeError {
    /// The bytes are not this protocol's.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The body of the frame is not what it should be.
    #[error("a malformed handshake: {0}")]
    Body(#[from] codec::DecodeError),
    /// The peer speaks another protocol.
    #[error("the peer does not speak Armor's protocol")]
    Magic,
    /// The peer refused, or must be refused.
    #[error(transparent)]
    Refused(#[from] Refusal),
}

impl Hello {
    /// A hello of this version.
    pub fn new(from: &str, instance: u64, purpose: Purpose) -> Self {
        Self { magic: MAGIC, version: VERSION, from: from.into(), instance, purpose, proof: None }
    }

    /// Reads the first frame of a connection.
    ///
    /// # Errors
    /// [`HandshakeError::Refused`] if the reason should be sent to the peer; on any other error the
    /// connection should be closed without an answer.
    pub fn read(frame: &Frame<'_>) -> Result<Self, HandshakeError> {
        if frame.kind != FrameKind::Hello {
            return Err(FrameError::Unexpected { got: frame.kind, wanted: "hello" }.into());
        }
        // Magic and version keep their place in every version, whatever follows them.
        let Some(([a, b, c, d, low, high], _)) = frame.body.split_first_chunk::<6>() else {
            return Err(HandshakeError::Magic);
        };
        if [*a, *b, *c, *d] != MAGIC {
            return Err(HandshakeError::Magic);
        }
        let version = u16::from_le_bytes([*low, *high]);
        if version != VERSION {
            let older = if version < VERSION { "yours" } else { "this one" };
            let text = format!(
                "you speak version {version} of the protocol, this is version {VERSION}: build the \
                 older program, {older}, with the release of the other"
            );
            return Err(Refusal::new(RefusalCode::Version, text).into());
        }
        let hello: Self = codec::decode_control(frame.body)?;
        hello.check()?;
        Ok(hello)
    }

    /// What no port could make sense of, whatever it serves.
    fn check(&self) -> Result<(), Refusal> {
        let malformed = |text: String| Err(Refusal::new(RefusalCode::Malformed, text));
        // It goes into logs and onto terminals.
        if self.from.len() > MAX_FROM_LEN || self.from.chars().any(char::is_control) {
            return malformed(format!("your name is not {MAX_FROM_LEN} bytes of plain text"));
        }
        match &self.purpose {
            Purpose::Link { link } if split_data(&link.data).is_none() => {
                malformed("the name of the data is not component.output".into())
            }
            Purpose::Link { link } if !link.keep.is_allowed() => {
                malformed(format!("keep is not a number from 1 to {MAX_KEEP}"))
            }
            _ => Ok(()),
        }
    }
}

/// Reads the answer to a hello.
///
/// # Errors
/// [`HandshakeError::Refused`] with the peer's reason, or what is wrong with its bytes.
pub fn read_answer(frame: &Frame<'_>) -> Result<Welcome, HandshakeError> {
    match frame.kind {
        FrameKind::Welcome => Ok(codec::decode_control(frame.body)?),
        FrameKind::Refusal => Err(codec::decode_control::<Refusal>(frame.body)?.into()),
        got => Err(FrameError::Unexpected { got, wanted: "welcome or refusal" }.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{self, PREFIX_LEN, to_bytes};

    fn link() -> LinkRequest {
        LinkRequest {
            data: "laser.scan".into(),
            instance: 0,
            schema: String::new(),
            schema_hash: 0,
            keep: Keep::Latest,
            wake: Wake::Sleep,
            paused: false,
            history: 1,
            memory: MemoryUse::Never,
            datagrams: false,
        }
    }

    fn hello(from: &str, link: LinkRequest) -> Hello {
        Hello::new(from, 5, Purpose::Link { link })
    }

    fn read(kind: FrameKind, body: &[u8]) -> Result<Hello, HandshakeError> {
        Hello::read(&Frame { kind, flags: 0, body })
    }

    fn check(hello: &Hello, refused: Option<RefusalCode>) {
        let bytes = to_bytes(FrameKind::Hello, hello).expect("short");
        match (read(FrameKind::Hello, &bytes[PREFIX_LEN..]), refused) {
            (Ok(read), None) => assert_eq!(read, *hello),
            (Err(HandshakeError::Refused(refusal)), Some(code)) => assert_eq!(refusal.code, code),
            (found, _) => panic!("{found:?} instead of {refused:?}"),
        }
    }

    #[test]
    fn a_hello_comes_back_as_it_was_or_is_refused_with_its_fault() {
        let malformed = Some(RefusalCode::Malformed);
        check(&hello("echo 4711", link()), None);
        check(&hello("\u{1b}[2J", link()), malformed);
        check(&hello(&"x".repeat(MAX_FROM_LEN + 1), link()), malformed);
        check(&hello("echo", LinkRequest { data: "scan".into(), ..link() }), malformed);
        for count in [0, MAX_KEEP + 1] {
            let keep = Keep::Last { count };
            check(&hello("echo", LinkRequest { keep, ..link() }), malformed);
        }
        let newer = Hello { version: VERSION + 1, ..hello("echo", link()) };
        check(&newer, Some(RefusalCode::Version));
    }

    #[test]
    fn another_version_is_refused_whatever_follows() {
        let body = [&MAGIC[..], &9_u16.to_le_bytes(), b"anything"].concat();
        let error = read(FrameKind::Hello, &body).expect_err("another version");
        assert_eq!(
            error.to_string(),
            "you speak version 9 of the protocol, this is version 4: build the older program, this \
             one, with the release of the other"
        );
        let body = [&MAGIC[..], &3_u16.to_le_bytes(), b"anything"].concat();
        let error = read(FrameKind::Hello, &body).expect_err("another version").to_string();
        assert!(error.ends_with("build the older program, yours, with the release of the other"));
    }

    #[test]
    fn strangers_get_no_answer() {
        assert!(matches!(read(FrameKind::Hello, b"ARMS\x01\0"), Err(HandshakeError::Magic)));
        assert!(matches!(read(FrameKind::Hello, b"ARMR"), Err(HandshakeError::Magic)));
        assert!(matches!(read(FrameKind::Hello, b"ARMR\x04\0"), Err(HandshakeError::Body(_))));
        assert!(matches!(read(FrameKind::Control, b""), Err(HandshakeError::Frame(_))));
    }

    #[test]
    fn an_answer_is_a_welcome_or_a_reason() {
        let welcome = Welcome { name: "laser".into(), instance: 8, schema: "u8".into() };
        let refusal = Refusal::new(RefusalCode::UnknownData, "there is no laser.scan here");
        let answer = |bytes: Vec<u8>, kind| {
            read_answer(&Frame { kind, flags: 0, body: &bytes[PREFIX_LEN..] })
        };
        let bytes = to_bytes(FrameKind::Welcome, &welcome).expect("short");
        assert_eq!(answer(bytes, FrameKind::Welcome).expect("a welcome"), welcome);
        let bytes = to_bytes(FrameKind::Refusal, &refusal).expect("short");
        let error = answer(bytes, FrameKind::Refusal).expect_err("a refusal");
        assert_eq!(error.to_string(), refusal.text);
        let beat = frame::signal(FrameKind::Beat).to_vec();
        assert!(matches!(answer(beat, FrameKind::Beat), Err(HandshakeError::Frame(_))));
    }
}
