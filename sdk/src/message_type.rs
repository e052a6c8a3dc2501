//! The type of ports that are declared without one: learned from the first link.

use std::sync::{Arc, OnceLock};

use armor_wire::message::Message;
use armor_wire::registry::DataEntry;
use armor_wire::schema::{self, ANY_NAME, ANY_SCHEMA};

/// The type of the messages of a port that was declared without one.
#[derive(Clone, Debug)]
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

    /// That of a schema, as text.
    pub fn of_schema(name: &str, schema: &str) -> Self {
        Self {
            name: name.into(),
            schema: schema.into(),
            schema_hash: schema::hash_text(schema),
            data: String::new(),
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
