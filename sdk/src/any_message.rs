//! A message whose type the component does not know: it is passed on as it came.

use std::any::Any;
use std::sync::Arc;

use armor_wire::bincode::Encode;
use armor_wire::bincode::de::{BorrowDecoder, Decoder};
use armor_wire::bincode::enc::Encoder;
use armor_wire::bincode::enc::write::Writer;
use armor_wire::bincode::error::{DecodeError, EncodeError};
use armor_wire::message::{Message, WireType};
use armor_wire::schema::{ANY_NAME, Schema};

use crate::data::{Data, DataError, Header};
use crate::link::payload::StoredPayload;
use crate::message_type::MessageType;

/// A message of any type, for a component that passes messages on and does not read them.
///
/// An input that is declared with it (`subscribe::<AnyMessage>`, `Many<AnyMessage>`) has the type of the
/// first link that is made; links of another type are refused. An output that is declared with it gets
/// that type too, so a component with such outputs has exactly one such input. Until the type is
/// known, nothing can be published there, and subscribers wait.
///
/// [`send_data`](crate::Armor::send_data) passes it on with its bytes and its stamp unchanged.
///
/// ```
/// # use armor_sdk::prelude::*;
/// fn pass_on(armor: &Armor, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
///     armor.send_data("element", &AnyMessage::received(header, data)?)?;
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct AnyMessage {
    message_type: Arc<MessageType>,
    stamp_s: f64,
    payload: StoredPayload,
}

impl AnyMessage {
    /// The message that has arrived at an input declared with this type. Large messages stay in the
    /// shared memory in which they came; others are copied once.
    ///
    /// # Errors
    /// [`DataError`] if the input is declared with a type of its own.
    pub fn received(header: &Header<'_>, data: &Data<'_>) -> Result<Self, DataError> {
        Ok(Self {
            message_type: Arc::clone(data.message_type()?),
            stamp_s: header.stamp_s,
            payload: data.store(),
        })
    }

    /// A message of this type, from its bytes.
    pub(crate) fn from_bytes(
        message_type: &Arc<MessageType>,
        stamp_s: f64,
        bytes: Vec<u8>,
    ) -> Self {
        let payload = StoredPayload::Copied(bytes);
        Self { message_type: Arc::clone(message_type), stamp_s, payload }
    }

    /// A message from its type and its bytes, as a tool makes it that knows the type only while it
    /// runs. It can be sent on an output with this schema; its bytes are not checked.
    pub fn encoded(type_name: &str, schema: &str, stamp_s: f64, bytes: Vec<u8>) -> Self {
        let message_type = Arc::new(MessageType::of_schema(type_name, schema));
        Self { message_type, stamp_s, payload: StoredPayload::Copied(bytes) }
    }

    /// The name of its type.
    pub fn type_name(&self) -> &str {
        &self.message_type.name
    }

    /// The schema of its type.
    pub fn schema(&self) -> &str {
        &self.message_type.schema
    }

    /// When it was created: system time in seconds.
    pub fn stamp_s(&self) -> f64 {
        self.stamp_s
    }

    /// The encoded message.
    pub fn bytes(&self) -> &[u8] {
        &self.payload
    }

    /// `message` itself, if it is of this type.
    pub(crate) fn find_in<T: Message>(message: &T) -> Option<&Self> {
        (message as &dyn Any).downcast_ref()
    }

    pub(crate) fn message_type(&self) -> &MessageType {
        &self.message_type
    }
}

impl Encode for AnyMessage {
    fn encode<E: Encoder>(&self, encoder: &mut E) -> Result<(), EncodeError> {
        encoder.writer().write(&self.payload)
    }
}

/// What `decode` cannot do.
const NOT_DECODED: &str = "a message of any type is taken with AnyMessage::received";

impl WireType for AnyMessage {
    const MIN_LEN: usize = 0;

    fn schema() -> Schema {
        Schema::Struct { name: ANY_NAME.into(), fields: Vec::new() }
    }

    fn read_value<D: Decoder>(_: &mut D) -> Result<Self, DecodeError> {
        Err(DecodeError::Other(NOT_DECODED))
    }

    type View<'a> = Self;

    fn view_value<'a, D: BorrowDecoder<'a>>(decoder: &mut D) -> Result<Self, DecodeError> {
        Self::read_value(decoder)
    }

    fn encode_field<E: Encoder>(&self, _: &mut E) -> Result<(), EncodeError> {
        Err(EncodeError::Other("a message of any type cannot be a field of another"))
    }
}

impl Message for AnyMessage {
    const NAME: &'static str = ANY_NAME;
}
