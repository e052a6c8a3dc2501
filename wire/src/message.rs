//! The types that can be sent: a field type has a layout and is read by it; a message type has a
//! name as well.
//!
//! Reading is ours, not bincode's, for the sake of lists: a count is accepted only if the
//! remaining bytes suffice for that many values, so that a short frame never causes a large
//! allocation.

use std::fmt::Display;
use std::str::FromStr;

use bincode::Encode;
use bincode::de::read::{BorrowReader, Reader};
use bincode::de::{BorrowDecoder, Decode, Decoder};
use bincode::enc::Encoder;
use bincode::error::{DecodeError, EncodeError};

pub use crate::limits::MAX_FIXED_COUNT;
use crate::schema::{Schema, hash_text};

/// A list of unknown size starts with room for so many bytes; it grows with the items that are
/// read.
const FIRST_LIST_LEN: usize = 4 << 10;

/// A type that can be part of a message. Derived by `#[derive(Message)]`.
///
/// A recursive type does not compile: its least length would depend on itself.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no wire form, so no message can contain it",
    label = "no wire form",
    note = "numbers are u8 to u64, i8 to i64, f32 and f64: use u32 or u64 for usize; text is a String",
    note = "a map is a Vec of a struct with key and value; a tuple is a struct or an array",
    note = "derive `Message` for a struct or enum of your own, or mark the field `#[message(text)]`"
)]
pub trait WireType: Encode + Sized + 'static {
    /// The fewest bytes a value takes. 0 only for a type without fields, which cannot be the item
    /// of a list.
    const MIN_LEN: usize;

    /// The layout of the type.
    fn schema() -> Schema;

    /// Reads one value.
    ///
    /// # Errors
    /// If the bytes are not a value of this type or end too early.
    fn read_value<D: Decoder>(decoder: &mut D) -> Result<Self, DecodeError>;

    /// A value that is read where its bytes are: of an [`Array`](crate::Array) an
    /// [`ArrayView`](crate::ArrayView), of a text a `&str`, of a type derived with `#[message(view)]` a
    /// struct of the views of its fields. Every other value is copied and is its own view.
    type View<'a>;

    /// Reads one value without copying its arrays and texts.
    ///
    /// # Errors
    /// As [`read_value`](Self::read_value).
    fn view_value<'a, D: BorrowDecoder<'a>>(decoder: &mut D)
    -> Result<Self::View<'a>, DecodeError>;

    /// Encodes a field. By this trait, not `Encode`, so that a type without a wire form is one error.
    #[doc(hidden)]
    fn encode_field<E: Encoder>(&self, encoder: &mut E) -> Result<(), EncodeError> {
        self.encode(encoder)
    }

    /// Reads `count` values; the remaining bytes are known to suffice.
    #[doc(hidden)]
    fn read_items<D: Decoder>(decoder: &mut D, count: usize) -> Result<Vec<Self>, DecodeError> {
        let mut items = Vec::with_capacity(count.min(FIRST_LIST_LEN / size_of::<Self>().max(1)));
        for _ in 0..count {
            items.push(Self::read_value(decoder)?);
        }
        Ok(items)
    }

    /// Reads an array of fixed length.
    #[doc(hidden)]
    fn read_array<D: Decoder, const N: usize>(decoder: &mut D) -> Result<[Self; N], DecodeError> {
        let items = Self::read_items(decoder, N)?;
        items.try_into().map_err(|_| DecodeError::Other("an array of another length"))
    }
}

/// A type that an output may publish.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a message",
    label = "not a message",
    note = "derive `Message` for it, or take one of `armor_sdk::messages`"
)]
pub trait Message: WireType + Send {
    /// The name of the type as shown to people and compared at link time.
    const NAME: &'static str;

    /// The hash of the schema's text. The derive computes it once per process.
    fn schema_hash() -> u64 {
        hash_text(&Self::schema().to_string())
    }
}

/// Reads the count of a list whose items take at least `item_len` bytes each.
pub(crate) fn read_count<D: Decoder>(
    decoder: &mut D,
    item_len: usize,
) -> Result<usize, DecodeError> {
    let count = u64::decode(decoder)?;
    let least = usize::try_from(count).ok().and_then(|count| count.checked_mul(item_len));
    let least = least.ok_or(DecodeError::LimitExceeded)?;
    if decoder.reader().peek_read(least).is_none() {
        return Err(DecodeError::UnexpectedEnd { additional: least });
    }
    Ok(count as usize)
}

/// Reads `count` values without copying their arrays and texts.
fn view_items<'a, T: WireType, D: BorrowDecoder<'a>>(
    decoder: &mut D,
    count: usize,
) -> Result<Vec<T::View<'a>>, DecodeError> {
    let first = FIRST_LIST_LEN / size_of::<T::View<'a>>().max(1);
    let mut items = Vec::with_capacity(count.min(first));
    for _ in 0..count {
        items.push(T::view_value(decoder)?);
    }
    Ok(items)
}

/// Encodes a value as the string it is displayed as: a field marked `#[message(text)]`.
#[doc(hidden)]
pub fn encode_text<T: Display, E: Encoder>(value: &T, encoder: &mut E) -> Result<(), EncodeError> {
    value.to_string().encode(encoder)
}

/// Reads a value from the string it is displayed as.
#[doc(hidden)]
pub fn read_text<T: FromStr, D: Decoder>(decoder: &mut D) -> Result<T, DecodeError> {
    let text = String::read_value(decoder)?;
    text.parse().map_err(|_| DecodeError::Other("a text that is not one of those allowed"))
}

/// The least of some lengths, at compile time.
#[doc(hidden)]
pub const fn least(lengths: &[usize]) -> usize {
    let (mut least, mut at) = (usize::MAX, 0);
    while at < lengths.len() {
        if lengths[at] < least {
            least = lengths[at];
        }
        at += 1;
    }
    least
}

impl WireType for bool {
    const MIN_LEN: usize = 1;
    fn schema() -> Schema {
        Schema::Bool
    }
    fn read_value<D: Decoder>(decoder: &mut D) -> Result<Self, DecodeError> {
        Self::decode(decoder)
    }
    type View<'a> = Self;
    fn view_value<'a, D: BorrowDecoder<'a>>(decoder: &mut D) -> Result<Self, DecodeError> {
        Self::read_value(decoder)
    }
}

macro_rules! numbers {
    ($($rust:ty => $schema:ident, $len:expr;)*) => {$(
        impl WireType for $rust {
            const MIN_LEN: usize = $len;
            fn schema() -> Schema {
                Schema::$schema
            }
            fn read_value<D: Decoder>(decoder: &mut D) -> Result<Self, DecodeError> {
                Self::decode(decoder)
            }
            type View<'a> = Self;
            fn view_value<'a, D: BorrowDecoder<'a>>(decoder: &mut D) -> Result<Self, DecodeError> {
                Self::read_value(decoder)
            }
            // Numbers travel as they lie in memory (array.rs): one copy for all of them.
            fn read_items<D: Decoder>(
                decoder: &mut D, count: usize,
            ) -> Result<Vec<Self>, DecodeError> {
                let len = count.checked_mul($len).ok_or(DecodeError::LimitExceeded)?;
                let blob = decoder.reader().peek_read(len);
                let blob = blob.ok_or(DecodeError::UnexpectedEnd { additional: len })?;
                // Where the bytes happen to be aligned, without zeroing the memory first.
                let items = bytemuck::try_cast_slice(blob)
                    .map_or_else(|_| bytemuck::pod_collect_to_vec(blob), <[Self]>::to_vec);
                decoder.reader().consume(len);
                Ok(items)
            }
            fn read_array<D: Decoder, const N: usize>(
                decoder: &mut D,
            ) -> Result<[Self; N], DecodeError> {
                let mut items = [<$rust>::default(); N];
                decoder.reader().read(bytemuck::cast_slice_mut(&mut items))?;
                Ok(items)
            }
        }
    )*};
}

numbers! {
    u8 => U8, 1;
    i8 => I8, 1;
    u16 => U16, 2;
    i16 => I16, 2;
    u32 => U32, 4;
    i32 => I32, 4;
    u64 => U64, 8;
    i64 => I64, 8;
    f32 => F32, 4;
    f64 => F64, 8;
}

impl WireType for String {
    const MIN_LEN: usize = 8;
    fn schema() -> Schema {
        Schema::Text
    }
    fn read_value<D: Decoder>(decoder: &mut D) -> Result<Self, DecodeError> {
        let len = read_count(decoder, 1)?;
        let bytes = u8::read_items(decoder, len)?;
        Self::from_utf8(bytes).map_err(|e| DecodeError::Utf8 { inner: e.utf8_error() })
    }
    type View<'a> = &'a str;
    fn view_value<'a, D: BorrowDecoder<'a>>(decoder: &mut D) -> Result<&'a str, DecodeError> {
        let len = read_count(decoder, 1)?;
        let bytes = decoder.borrow_reader().take_bytes(len)?;
        std::str::from_utf8(bytes).map_err(|inner| DecodeError::Utf8 { inner })
    }
}

impl<T: WireType> WireType for Vec<T> {
    const MIN_LEN: usize = {
        assert!(T::MIN_LEN > 0, "a list of values without bytes has no length that can be checked");
        8
    };
    fn schema() -> Schema {
        Schema::List(Box::new(T::schema()))
    }
    fn read_value<D: Decoder>(decoder: &mut D) -> Result<Self, DecodeError> {
        let count = read_count(decoder, T::MIN_LEN)?;
        T::read_items(decoder, count)
    }
    type View<'a> = Vec<T::View<'a>>;
    fn view_value<'a, D: BorrowDecoder<'a>>(
        decoder: &mut D,
    ) -> Result<Self::View<'a>, DecodeError> {
        let count = read_count(decoder, T::MIN_LEN)?;
        view_items::<T, D>(decoder, count)
    }
}

impl<T: WireType> WireType for Option<T> {
    const MIN_LEN: usize = {
        // Named so that a type that contains itself through an option does not compile either.
        let _ = T::MIN_LEN;
        1
    };
    fn schema() -> Schema {
        Schema::Option(Box::new(T::schema()))
    }
    fn read_value<D: Decoder>(decoder: &mut D) -> Result<Self, DecodeError> {
        if bool::decode(decoder)? { T::read_value(decoder).map(Some) } else { Ok(None) }
    }
    type View<'a> = Option<T::View<'a>>;
    fn view_value<'a, D: BorrowDecoder<'a>>(
        decoder: &mut D,
    ) -> Result<Self::View<'a>, DecodeError> {
        if bool::decode(decoder)? { T::view_value(decoder).map(Some) } else { Ok(None) }
    }
}

impl<T: WireType, const N: usize> WireType for [T; N] {
    const MIN_LEN: usize = {
        assert!(T::MIN_LEN > 0, "an array of values without bytes carries nothing");
        assert!(N >= 1 && N <= MAX_FIXED_COUNT, "an array has 1 to 65536 items; use a list");
        N * T::MIN_LEN
    };
    fn schema() -> Schema {
        Schema::Fixed(Box::new(T::schema()), N)
    }
    fn read_value<D: Decoder>(decoder: &mut D) -> Result<Self, DecodeError> {
        if decoder.reader().peek_read(Self::MIN_LEN).is_none() {
            return Err(DecodeError::UnexpectedEnd { additional: Self::MIN_LEN });
        }
        T::read_array(decoder)
    }
    type View<'a> = [T::View<'a>; N];
    fn view_value<'a, D: BorrowDecoder<'a>>(
        decoder: &mut D,
    ) -> Result<Self::View<'a>, DecodeError> {
        let items = view_items::<T, D>(decoder, N)?;
        items.try_into().map_err(|_| DecodeError::Other("an array of another length"))
    }
}

impl<T: WireType> WireType for Box<T> {
    const MIN_LEN: usize = T::MIN_LEN;
    fn schema() -> Schema {
        T::schema()
    }
    fn read_value<D: Decoder>(decoder: &mut D) -> Result<Self, DecodeError> {
        T::read_value(decoder).map(Self::new)
    }
    type View<'a> = T::View<'a>;
    fn view_value<'a, D: BorrowDecoder<'a>>(
        decoder: &mut D,
    ) -> Result<Self::View<'a>, DecodeError> {
        T::view_value(decoder)
    }
}
