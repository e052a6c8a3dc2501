//! Bulk arrays of numbers: the bytes of a `Vec`, moved by `memcpy` instead of one by one.

use std::ops::{Deref, DerefMut};

use bincode::de::read::BorrowReader;
use bincode::de::{BorrowDecoder, Decoder};
use bincode::enc::write::Writer;
use bincode::enc::{Encode, Encoder};
use bincode::error::{DecodeError, EncodeError};
use bytemuck::Pod;

use crate::array_view::ArrayView;
use crate::message::{WireType, read_count};
use crate::schema::Schema;

/// A growable array of plain numbers that is sent as one little-endian blob.
///
/// On the wire it is the same as a `Vec<T>`: a `u64` count, then the elements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Array<T>(Vec<T>);

/// A number that may be the element of an [`Array`]. All are plain old data.
pub trait ArrayElement: Pod + WireType {}
impl ArrayElement for u8 {}
impl ArrayElement for i8 {}
impl ArrayElement for u16 {}
impl ArrayElement for i16 {}
impl ArrayElement for u32 {}
impl ArrayElement for i32 {}
impl ArrayElement for u64 {}
impl ArrayElement for i64 {}
impl ArrayElement for f32 {}
impl ArrayElement for f64 {}

// The blob is the memory of the array; a big-endian host would have to swap each element.
const _: () = assert!(cfg!(target_endian = "little"), "Armor's arrays need a little-endian host");

impl<T> From<Vec<T>> for Array<T> {
    fn from(items: Vec<T>) -> Self {
        Self(items)
    }
}

impl<T> From<Array<T>> for Vec<T> {
    fn from(array: Array<T>) -> Self {
        array.0
    }
}

impl<T> FromIterator<T> for Array<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        Self(items.into_iter().collect())
    }
}

impl<T> Deref for Array<T> {
    type Target = Vec<T>;
    fn deref(&self) -> &Vec<T> {
        &self.0
    }
}

impl<T> DerefMut for Array<T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        &mut self.0
    }
}

impl<T: ArrayElement> Encode for Array<T> {
    fn encode<E: Encoder>(&self, encoder: &mut E) -> Result<(), EncodeError> {
        (self.0.len() as u64).encode(encoder)?;
        encoder.writer().write(bytemuck::cast_slice(&self.0))
    }
}

impl<T: ArrayElement> WireType for Array<T> {
    const MIN_LEN: usize = 8;
    fn schema() -> Schema {
        Schema::List(Box::new(T::schema()))
    }
    fn read_value<D: Decoder>(decoder: &mut D) -> Result<Self, DecodeError> {
        Vec::read_value(decoder).map(Self)
    }
    type View<'a> = ArrayView<'a, T>;
    fn view_value<'a, D: BorrowDecoder<'a>>(
        decoder: &mut D,
    ) -> Result<ArrayView<'a, T>, DecodeError> {
        let count = read_count(decoder, size_of::<T>())?;
        decoder.borrow_reader().take_bytes(count * size_of::<T>()).map(ArrayView::of)
    }
}
