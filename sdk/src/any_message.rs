//! A message whose type the component does not know: it is passed on as it came.

use std::any::Any;
use std::sync::{Arc, OnceLock};

use armor_wire::bincode::Encode;
use armor_wire::bincode::de::{BorrowDecoder, Decoder};
use armor_wire::bincode::enc::Encoder;
use armor_wire::bincode::enc::write::Writer;
use armor_wire::bincode::error::{DecodeError, EncodeError};
use armor_wire::message::{Message, WireType};
use armor_wire::registry::DataEntry;
use armor_wire::schema::{self, ANY_NAME, ANY_SCHEMA, Schema};

use crate::data::{Data, DataError, Header};
use crate::link::payload::StoredPayload;

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

    /// The name of its type.
    pub fn type_name(&self) -> &str {
        &self.message_type.name
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

    pub(crate) fn stamp_s(&self) -> f64 {
        self.stamp_s
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

/// The type of the messages of a port that was declared without one.
#[derive(Debug)]
pub(crate) struct MessageType {
    pub name: String,
    pub schema: String,
    pub schema_hash: u64,
    /// The data that it was learned from.
    pub data: String,
}

impl MessageType {
    /// That of what a component provides.
    pub fn of_entry(entry: &DataEntry) -> Self {
        Self {
            name: entry.type_name.clone(),
            schema: entry.schema.clone(),
            schema_hash: schema::hash_text(&entry.schema),
            data: entry.data.clone(),
        }
    }

    /// That of a message type in Rust.
    pub fn of_message<T: Message>(data: &str) -> Self {
        Self {
            name: T::NAME.into(),
            schema: T::schema().to_string(),
            schema_hash: T::schema_hash(),
            data: data.into(),
        }
    }
}

/// The type of an input that takes any, from the first link on: one for all its sources.
#[derive(Debug, Default)]
pub(crate) struct LearnedType(OnceLock<Arc<MessageType>>);

impl LearnedType {
    /// For an input of message type `T`; `None` if it has a type of its own.
    pub fn of_input<T: Message>() -> Option<Arc<Self>> {
        (T::NAME == ANY_NAME && T::schema().to_string() == ANY_SCHEMA).then(Arc::default)
    }

    /// The type, once it is known.
    pub fn known(&self) -> Option<&Arc<MessageType>> {
        self.0.get()
    }

    /// Whether data of this type may feed `input`.
    ///
    /// # Errors
    /// Both data and their types, and the fields that differ.
    pub fn check(&self, given: &MessageType, input: &str) -> Result<(), String> {
        let Some(known) = self.known().filter(|known| known.schema != given.schema) else {
            return Ok(());
        };
        let how = schema::difference((&given.data, &given.schema), (&known.data, &known.schema));
        Err(format!(
            "`{}` is a {}, which input `{input}` does not take: it takes what `{}` is, a {}, which \
             was linked first\n{how}",
            given.data, given.name, known.data, known.name
        ))
    }

    /// Takes the type of the first link. Returns it if it was not known before.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn learn(
        &self,
        given: MessageType,
        input: &str,
    ) -> Result<Option<Arc<MessageType>>, String> {
        let given = Arc::new(given);
        match self.0.set(Arc::clone(&given)) {
            Ok(()) => Ok(Some(given)),
            Err(_) => self.check(&given, input).map(|()| None),
        }
    }
}
