//! How every connection begins: the one who connects says who it is and what for; the other welcomes
//! or refuses it, with the reason in words.

use thiserror::Error;

use crate::Message;
use crate::codec;
use crate::control::Role;
use crate::frame::{Frame, FrameError, FrameKind};
use crate::keep::{Keep, Wake};
use crate::registry::ComponentEntry;

/// The first bytes of the first frame's body.
pub const MAGIC: [u8; 4] = *b"ARMR";
/// Version of the protocol. Ends of different versions do not talk.
pub const VERSION: u16 = 1;

/// Who connects, and what for.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Hello {
    /// [`MAGIC`].
    pub magic: [u8; 4],
    /// [`VERSION`].
    pub version: u16,
    /// Name of who connects: a component's, or a tool's with its process id.
    pub from: String,
    /// Its process start.
    pub instance: u64,
    /// What it wants.
    pub purpose: Purpose,
}

/// What a connection is for.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub enum Purpose {
    /// To the registry: to register, or only to ask.
    Registry {
        /// Who registers; `None` for an observer.
        entry: Option<ComponentEntry>,
    },
    /// To configd: settings and parameters of the component that connects.
    Config,
    /// To a component: data of one of its outputs.
    Link {
        /// Which, and how it should be sent.
        link: LinkRequest,
    },
    /// To a component: to command or to watch it.
    Control {
        /// By what right.
        role: Role,
    },
}

/// Asks for the data of an output.
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
    /// What the subscriber wants when it is slow.
    pub keep: Keep,
    /// How both ends wait.
    pub wake: Wake,
    /// Whether the subscriber is frozen: nothing is sent until it says `Resume`.
    pub paused: bool,
}

/// "Go on."
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Welcome {
    /// Name of who was connected to.
    pub name: String,
    /// Its process start.
    pub instance: u64,
    /// For a link: the schema of the data, as canonical text; otherwise empty.
    pub schema: String,
}

/// Why a connection or a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum RefusalCode {
    /// The protocol version differs.
    Version,
    /// The one asked is another process start than the one meant.
    WrongInstance,
    /// There is no such data here.
    UnknownData,
    /// The two ends mean different types.
    TypeMismatch,
    /// The name is taken.
    DuplicateName,
    /// A limit is reached.
    Limit,
    /// This port does not serve that purpose.
    WrongPurpose,
    /// A name or another part of the request is malformed.
    Malformed,
}

/// "No", and why.
#[derive(Clone, Debug, PartialEq, Message, Error)]
#[message(wire = "armor_wire")]
#[error("{text}")]
pub struct Refusal {
    /// For programs.
    pub code: RefusalCode,
    /// For people: what was wrong, where, what to do.
    pub text: String,
}

impl Refusal {
    /// A refusal with its reason in words.
    pub fn new(code: RefusalCode, text: impl Into<String>) -> Self {
        Self { code, text: text.into() }
    }
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
    /// The peer speaks something else.
    #[error("the peer does not speak Armor's protocol")]
    Magic,
    /// The peer refused, or must be refused.
    #[error(transparent)]
    Refused(#[from] Refusal),
}

impl Hello {
    /// A hello of this version.
    pub fn new(from: &str, instance: u64, purpose: Purpose) -> Self {
        Self { magic: MAGIC, version: VERSION, from: from.into(), instance, purpose }
    }

    /// Reads the first frame of a connection.
    ///
    /// # Errors
    /// [`HandshakeError::Refused`] if the peer should be told why; any other: close without a word.
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
            let text =
                format!("you speak version {version} of the protocol, this is version {VERSION}");
            return Err(Refusal::new(RefusalCode::Version, text).into());
        }
        Ok(codec::decode_control(frame.body)?)
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
