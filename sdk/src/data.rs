//! Data as a component receives them.

use std::sync::Arc;

use armor_wire::codec::{self, DecodeError};
use armor_wire::message::Message;
use armor_wire::schema::ANY_NAME;
use thiserror::Error;

use crate::declared::DeclaredType;
use crate::fed_input::FedInput;
use crate::history::{History, HistoryOfInput};
use crate::link::payload::{Payload, StoredPayload};
use crate::message_type::MessageType;

/// Where data comes from, when it was created, and what is missing before it.
#[derive(Clone, Copy, Debug)]
pub struct Header<'a> {
    pub(crate) id: &'a str,
    pub(crate) data: &'a str,
    /// Counts what the output has published, from 0.
    pub sequence: u64,
    /// When it was created: system time in seconds.
    pub stamp_s: f64,
    /// Process start that published it.
    pub instance: u64,
    /// How many messages were lost immediately before it.
    pub lost: u64,
}

impl<'a> Header<'a> {
    /// Local name of the input.
    pub fn id(&self) -> &'a str {
        self.id
    }

    /// System-wide name of the data, `component.output`.
    pub fn data(&self) -> &'a str {
        self.data
    }
}

/// The content of data, as it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Data<'a> {
    payload: Payload<'a>,
    declared: DeclaredType<'a>,
    /// The inputs of the component, one for each source; none for data that are themselves of a history.
    inputs: &'a [FedInput],
    /// Which of them the data are of.
    place: usize,
}

/// Why data cannot be read as the type asked for.
#[derive(Debug, Error)]
pub enum DataError {
    /// The input was declared with another type.
    #[error("input `{input}` is declared as {declared}, but was decoded as {asked}{}; {}",
        if declared == asked { " with other fields" } else { "" },
        "declare the input with the type that `data_received` decodes")]
    OtherType {
        /// The input.
        input: String,
        /// The type that it was declared with.
        declared: String,
        /// The type that it was decoded as.
        asked: &'static str,
    },
    /// The component has no such input.
    #[error("there is no input `{asked}` whose history could be read (there are: {known})")]
    UnknownInput {
        /// The name that was asked for.
        asked: String,
        /// The inputs that there are.
        known: String,
    },
    /// The input has several sources, and it was not stated which one's history is meant.
    #[error(
        "input `{input}` has several sources: read the history of one with \
             history_from(\"{input}\", SOURCE), of {sources}"
    )]
    SeveralSources {
        /// The input.
        input: String,
        /// The data that feed it.
        sources: String,
    },
    /// The data do not feed the input.
    #[error("`{source_data}` does not feed the input `{input}` (these do: {sources})")]
    UnknownSource {
        /// The input.
        input: String,
        /// The data that were asked for.
        source_data: String,
        /// The data that feed it.
        sources: String,
    },
    /// The file does not ask for a history of the input.
    #[error("input `{input}` keeps no history; write history=\"n\" on its link in the file")]
    NoHistory {
        /// The input.
        input: String,
    },
    /// The bytes are not one message of the declared type.
    #[error("input `{input}`, a {declared}: {cause}")]
    Malformed {
        /// The input.
        input: String,
        /// The type that it was declared with.
        declared: String,
        /// What is wrong with the bytes.
        cause: DecodeError,
    },
}

impl<'a> Data<'a> {
    /// Data of the input at `place`, from which the history of each input can be read.
    pub(crate) fn of_input(payload: Payload<'a>, inputs: &'a [FedInput], place: usize) -> Self {
        Self { payload, declared: inputs[place].port.declared(), inputs, place }
    }

    /// Data from which no history can be read.
    pub(crate) fn alone(payload: Payload<'a>, declared: DeclaredType<'a>) -> Self {
        Self { payload, declared, inputs: &[], place: 0 }
    }

    /// The last messages of an input of this component, this one or another, as many as its link keeps
    /// (`history="n"` of its link).
    ///
    /// A history is that of one source: messages of two are no series to interpolate in. For an input
    /// that takes several ([`Many`](crate::Many)), it is that of the source of these data, if they are
    /// of this input; otherwise [`history_from`](Self::history_from) names the source.
    ///
    /// # Errors
    /// [`DataError`] if there is no such input, its link keeps no history, or it has several sources
    /// and these data are of none of them.
    pub fn history(&self, input: &str) -> Result<History<'a>, DataError> {
        if let Some(own) = self.inputs.get(self.place).filter(|own| own.port.id == input) {
            return open_history(own);
        }
        match self.list_sources(input)?.as_slice() {
            [only] => open_history(only),
            several => Err(DataError::SeveralSources {
                input: input.into(),
                sources: name_sources(several),
            }),
        }
    }

    /// How many messages the history of the input has that these data are of; `None` if the link keeps
    /// no history.
    pub(crate) fn own_history_len(&self) -> Option<usize> {
        let own = self.inputs.get(self.place)?;
        own.history.is_kept().then(|| open_history(own).map_or(0, |history| history.len()))
    }

    /// The last messages that an input with several sources has from the data `source`,
    /// `component.output`, as [`history`](Self::history).
    ///
    /// # Errors
    /// [`DataError`] if there is no such input, `source` does not feed it, or its link keeps no history.
    pub fn history_from(&self, input: &str, source: &str) -> Result<History<'a>, DataError> {
        let sources = self.list_sources(input)?;
        match sources.iter().find(|one| one.data == source) {
            Some(found) => open_history(found),
            None => Err(DataError::UnknownSource {
                input: input.into(),
                source_data: source.into(),
                sources: name_sources(&sources),
            }),
        }
    }

    /// The sources of an input; never empty.
    fn list_sources(&self, input: &str) -> Result<Vec<&'a FedInput>, DataError> {
        let sources: Vec<_> = self.inputs.iter().filter(|one| one.port.id == input).collect();
        if !sources.is_empty() {
            return Ok(sources);
        }
        let mut known: Vec<_> = self.inputs.iter().map(|one| one.port.id.as_str()).collect();
        known.dedup();
        Err(DataError::UnknownInput { asked: input.into(), known: known.join(", ") })
    }

    /// Reads the content as a message of the type the input was declared with.
    ///
    /// # Errors
    /// [`DataError`] if the input was declared with a type of another schema, or the bytes are not one
    /// message of type `T`.
    pub fn decode<T: Message>(&self) -> Result<T, DataError> {
        self.check_type::<T>()?;
        codec::decode(self.bytes()).map_err(|cause| self.explain_bytes(cause))
    }

    fn check_type<T: Message>(&self) -> Result<(), DataError> {
        let DeclaredType { input, name, schema_hash, .. } = self.declared;
        if T::schema_hash() == schema_hash {
            return Ok(());
        }
        Err(DataError::OtherType { input: input.into(), declared: name.into(), asked: T::NAME })
    }

    fn explain_bytes(&self, cause: DecodeError) -> DataError {
        let DeclaredType { input, name, .. } = self.declared;
        DataError::Malformed { input: input.into(), declared: name.into(), cause }
    }

    /// Reads the content where it is, in the receive buffer or in shared memory: bulk arrays and texts
    /// are borrowed, not copied. What [`decode`](Self::decode) accepts and refuses, this does too.
    ///
    /// The standard messages with bulk arrays have a view of their own (`ImageView` of `Image`), and so
    /// does each message that is derived with `#[message(view)]`; every other message is copied.
    ///
    /// ```
    /// # use armor_sdk::prelude::*;
    /// use armor_sdk::messages::Image;
    ///
    /// fn mean_brightness(data: &Data<'_>) -> Result<f64, Fault> {
    ///     let image = data.view::<Image>()?;
    ///     let sum: u64 = image.data.iter().map(u64::from).sum();
    ///     Ok(sum as f64 / image.data.len() as f64)
    /// }
    /// ```
    ///
    /// # Errors
    /// As [`decode`](Self::decode).
    pub fn view<T: Message>(&self) -> Result<T::View<'a>, DataError> {
        self.check_type::<T>()?;
        codec::view::<T>(self.bytes()).map_err(|cause| self.explain_bytes(cause))
    }

    /// The encoded message (`docs/protocol.md`, Values).
    pub fn bytes(&self) -> &'a [u8] {
        self.payload.bytes()
    }

    /// The type of the data, of an input that takes any.
    pub(crate) fn message_type(&self) -> Result<&'a Arc<MessageType>, DataError> {
        let DeclaredType { input, name, learned, .. } = self.declared;
        learned.ok_or_else(|| DataError::OtherType {
            input: input.into(),
            declared: name.into(),
            asked: ANY_NAME,
        })
    }

    /// Keeps the content beyond the call.
    pub(crate) fn store(&self) -> StoredPayload {
        self.payload.store(StoredPayload::default())
    }
}

fn open_history(input: &FedInput) -> Result<History<'_>, DataError> {
    if !input.history.is_kept() {
        return Err(DataError::NoHistory { input: input.port.id.clone() });
    }
    Ok(History(HistoryOfInput {
        store: &input.history,
        data: &input.data,
        declared: input.port.declared(),
    }))
}

fn name_sources(sources: &[&FedInput]) -> String {
    let named = sources.iter().map(|one| one.data.as_str()).filter(|data| !data.is_empty());
    let named: Vec<_> = named.collect();
    if named.is_empty() { "none".into() } else { named.join(", ") }
}

#[cfg(test)]
mod tests {
    use armor_wire::{Message, codec};

    use super::*;
    use crate::messages::{Count, Image, Number};

    #[derive(Debug, PartialEq, Message)]
    #[message(name = "Count", wire = "armor_wire")]
    struct LongerCount {
        count: u64,
        since_s: f64,
    }

    #[derive(Debug, PartialEq, Message)]
    #[message(name = "Count", wire = "armor_wire")]
    struct OwnCount {
        count: u64,
    }

    #[test]
    fn an_image_is_viewed_in_the_bytes_that_arrived() {
        let image = Image { width: 2, height: 1, data: vec![7, 9].into(), ..Image::default() };
        let bytes = codec::encode(&image).unwrap();
        let view = declared_as::<Image>(&bytes).view::<Image>().unwrap();
        assert_eq!((view.width, view.encoding, &*view.data), (2, "", &[7, 9][..]));
        assert!(bytes.as_ptr_range().contains(&view.data.as_ptr()), "no copy");
        let error = declared_as::<Image>(&bytes[..9]).view::<Image>().unwrap_err().to_string();
        assert!(error.contains("input `steps`, a Image: the bytes do not fit"), "{error}");
    }

    fn declared_as<T: Message>(bytes: &[u8]) -> Data<'_> {
        let (name, schema_hash) = (T::NAME, T::schema_hash());
        let declared = DeclaredType { input: "steps", name, schema_hash, learned: None };
        Data::alone(Payload::Buffer(bytes), declared)
    }

    #[test]
    fn only_the_declared_type_is_decoded() {
        let bytes = codec::encode(&Count { count: 3 }).unwrap();
        let data = declared_as::<Count>(&bytes);
        assert_eq!(data.decode::<Count>().unwrap(), Count { count: 3 });
        assert_eq!(data.decode::<OwnCount>().unwrap(), OwnCount { count: 3 }, "the same schema");
        let error = data.decode::<Number>().unwrap_err().to_string();
        for part in ["input `steps`", "declared as Count", "decoded as Number;"] {
            assert!(error.contains(part), "{error}");
        }
        let error = data.decode::<LongerCount>().unwrap_err().to_string();
        assert!(error.contains("declared as Count, but was decoded as Count with other fields"));
        let error = data.view::<Number>().unwrap_err().to_string();
        assert!(error.contains("declared as Count, but was decoded as Number"), "{error}");
        let error = declared_as::<Count>(&bytes[..7]).decode::<Count>().unwrap_err().to_string();
        assert!(error.contains("input `steps`, a Count: the bytes do not fit"), "{error}");
    }
}
