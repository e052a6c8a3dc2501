//! Values to bytes and back: bincode's fixed-width little-endian layout (`docs/protocol.md`,
//! "Values"), always with a limit, and never with bytes left over.

use bincode::config;
use bincode::de::read::{BorrowReader, Reader};
use bincode::de::{Decoder, DecoderImpl};
use bincode::enc::write::{SizeWriter, Writer};
use bincode::enc::{Encode, Encoder};
use thiserror::Error;

pub use crate::limits::{MAX_CONTROL_LEN, MAX_DATA_LEN, MAX_HELLO_LEN, MAX_PREFACE_LEN};
use crate::message::WireType;

/// Why bytes are not a value of the wanted type.
#[derive(Debug, Error)]
pub enum DecodeError {
    /// The bytes break the layout, or a length in them exceeds the limit.
    #[error("the bytes do not fit the type: {0}")]
    Layout(bincode::error::DecodeError),
    /// The value ended before the bytes did.
    #[error("{0} bytes are left over after the value")]
    LeftOver(usize),
}

/// Why a value cannot be sent.
#[derive(Debug, Error)]
pub enum EncodeError {
    /// It is larger than [`MAX_DATA_LEN`].
    #[error("the value takes {len} bytes; a message has at most {MAX_DATA_LEN}")]
    TooLarge {
        /// The bytes it takes.
        len: usize,
    },
    /// What the writer refused.
    #[error("the value cannot be written: {0}")]
    Refused(bincode::error::EncodeError),
}

/// What can be written as the payload of a message: a value of a wire type, or one that is encoded
/// already ([`EncodedPieces`]).
pub trait Encodable: Encode {
    /// Checks at compile time that a value of the type can be read again.
    #[doc(hidden)]
    const IS_READABLE: () = ();
}

impl<T: WireType> Encodable for T {
    const IS_READABLE: () = {
        let _ = T::MIN_LEN;
    };
}

/// An encoded value, in the pieces in which it lies in memory: a bulk array is a piece of its own, so
/// that it is written from where it is.
#[derive(Clone, Copy, Debug)]
pub struct EncodedPieces<'a>(pub &'a [&'a [u8]]);

impl Encode for EncodedPieces<'_> {
    fn encode<E: Encoder>(&self, encoder: &mut E) -> Result<(), bincode::error::EncodeError> {
        self.0.iter().try_for_each(|piece| encoder.writer().write(piece))
    }
}

impl Encodable for EncodedPieces<'_> {}

/// Appends `value` to `bytes`.
///
/// # Errors
/// If the value is larger than [`MAX_DATA_LEN`]; `bytes` is then as before.
pub fn encode_into<T: Encodable>(value: &T, bytes: &mut Vec<u8>) -> Result<(), EncodeError> {
    let start = bytes.len();
    let most = start.saturating_add(MAX_DATA_LEN);
    write(value, &mut Append { bytes, most }).map_err(|error| {
        bytes.truncate(start);
        encoded_len(value).err().unwrap_or(error)
    })
}

/// The bytes of `value`.
///
/// # Errors
/// As [`encode_into`].
pub fn encode<T: Encodable>(value: &T) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    encode_into(value, &mut bytes)?;
    Ok(bytes)
}

/// Hands the bytes of `value` to `writer` piece by piece; a bulk array arrives as one piece.
///
/// # Errors
/// What the writer refuses.
pub fn write<T: Encodable, W: Writer>(value: &T, writer: &mut W) -> Result<(), EncodeError> {
    const { T::IS_READABLE };
    bincode::encode_into_writer(value, writer, config::legacy()).map_err(EncodeError::Refused)
}

/// The number of bytes `value` encodes to, without encoding bulk arrays.
///
/// # Errors
/// If the value is larger than [`MAX_DATA_LEN`].
pub fn encoded_len<T: Encodable>(value: &T) -> Result<usize, EncodeError> {
    let mut size = SizeWriter::default();
    write(value, &mut size)?;
    if size.bytes_written > MAX_DATA_LEN {
        return Err(EncodeError::TooLarge { len: size.bytes_written });
    }
    Ok(size.bytes_written)
}

/// Reads a data payload; every byte must belong to the value.
///
/// Takes memory in proportion to the bytes, whatever the counts in them claim; the factor is that
/// between a value in memory and on the wire.
///
/// # Errors
/// [`DecodeError`] if the bytes are not exactly one value of `T`.
pub fn decode<T: WireType>(bytes: &[u8]) -> Result<T, DecodeError> {
    decode_within(bytes, MAX_DATA_LEN)
}

/// Reads a data payload where it is: its arrays and texts are not copied
/// ([`WireType::View`]). Accepts and refuses the same bytes as [`decode`].
///
/// # Errors
/// As [`decode`].
pub fn view<T: WireType>(bytes: &[u8]) -> Result<T::View<'_>, DecodeError> {
    read_within(bytes, MAX_DATA_LEN, T::view_value)
}

/// As [`decode`] for handshakes and control frames: at most [`MAX_CONTROL_LEN`] bytes.
///
/// # Errors
/// As [`decode`].
pub fn decode_control<T: WireType>(bytes: &[u8]) -> Result<T, DecodeError> {
    decode_within(bytes, MAX_CONTROL_LEN)
}

fn decode_within<T: WireType>(bytes: &[u8], limit: usize) -> Result<T, DecodeError> {
    // Evaluates the checks that the type's parts make at compile time.
    let _ = const { T::MIN_LEN };
    read_within(bytes, limit, T::read_value)
}

/// Reads one value, which must take all bytes.
fn read_within<'a, V>(
    bytes: &'a [u8],
    limit: usize,
    read: impl FnOnce(
        &mut DecoderImpl<Payload<'a>, Layout, ()>,
    ) -> Result<V, bincode::error::DecodeError>,
) -> Result<V, DecodeError> {
    if bytes.len() > limit {
        return Err(DecodeError::Layout(bincode::error::DecodeError::LimitExceeded));
    }
    let mut decoder = DecoderImpl::new(Payload(bytes), config::legacy(), ());
    let value = read(&mut decoder).map_err(DecodeError::Layout)?;
    match decoder.reader().0.len() {
        0 => Ok(value),
        left => Err(DecodeError::LeftOver(left)),
    }
}

/// What `config::legacy()` is.
type Layout = config::Configuration<config::LittleEndian, config::Fixint, config::NoLimit>;

/// The bytes not yet read.
struct Payload<'a>(&'a [u8]);

impl Reader for Payload<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<(), bincode::error::DecodeError> {
        let Some((taken, rest)) = self.0.split_at_checked(bytes.len()) else {
            let additional = bytes.len() - self.0.len();
            return Err(bincode::error::DecodeError::UnexpectedEnd { additional });
        };
        bytes.copy_from_slice(taken);
        self.0 = rest;
        Ok(())
    }

    fn peek_read(&mut self, len: usize) -> Option<&[u8]> {
        self.0.get(..len)
    }

    fn consume(&mut self, len: usize) {
        self.0 = self.0.get(len..).unwrap_or_default();
    }
}

impl<'a> BorrowReader<'a> for Payload<'a> {
    fn take_bytes(&mut self, len: usize) -> Result<&'a [u8], bincode::error::DecodeError> {
        let Some((taken, rest)) = self.0.split_at_checked(len) else {
            let additional = len - self.0.len();
            return Err(bincode::error::DecodeError::UnexpectedEnd { additional });
        };
        self.0 = rest;
        Ok(taken)
    }
}

/// Appends, up to a length, so that a value that is far too large is not first written whole.
struct Append<'a> {
    bytes: &'a mut Vec<u8>,
    most: usize,
}

impl Writer for Append<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), bincode::error::EncodeError> {
        if bytes.len() > self.most - self.bytes.len() {
            return Err(bincode::error::EncodeError::Other("it is larger"));
        }
        self.bytes.extend_from_slice(bytes);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Array;

    fn check_refused<T: WireType + std::fmt::Debug>(bytes: &[u8], why: &str) {
        let error = decode::<T>(bytes).expect_err(why).to_string();
        assert!(error.contains(why), "{error}");
    }

    #[test]
    fn a_count_is_believed_only_as_far_as_the_bytes_go() {
        let lies = [9_u64, 1 << 20, 1 << 40, u64::MAX / 8 + 1, u64::MAX];
        for count in lies {
            let bytes = [&count.to_le_bytes()[..], &[1; 8]].concat();
            let why = if count >= u64::MAX / 8 { "" } else { "UnexpectedEnd" };
            check_refused::<String>(&bytes, why);
            check_refused::<Vec<u8>>(&bytes, why);
            check_refused::<Array<f64>>(&bytes, why);
            check_refused::<Vec<Vec<Vec<bool>>>>(&bytes, why);
            check_refused::<Vec<Option<[f64; 36]>>>(&bytes, why);
        }
    }

    #[test]
    fn what_is_not_a_value_is_refused() {
        check_refused::<bool>(&[2], "InvalidBooleanValue");
        check_refused::<Option<u8>>(&[2, 0], "InvalidBooleanValue");
        check_refused::<[u16; 2]>(&[0; 3], "UnexpectedEnd");
        check_refused::<String>(&[1, 0, 0, 0, 0, 0, 0, 0, 255], "Utf8");
        check_refused::<u8>(&[1, 2, 3], "2 bytes are left over");
        let long = vec![0; MAX_CONTROL_LEN + 1];
        assert!(decode_control::<Array<u8>>(&long).is_err());
    }

    #[test]
    fn a_value_that_is_too_large_is_not_written() {
        let most = Array::from(vec![7_u8; MAX_DATA_LEN - 8]);
        let mut bytes = vec![1];
        encode_into(&most, &mut bytes).expect("just fits");
        assert_eq!(bytes.len(), 1 + MAX_DATA_LEN);
        assert_eq!(encoded_len(&most).expect("just fits"), MAX_DATA_LEN);
        let more = (0..2).map(|_| vec![7_u8; MAX_DATA_LEN / 2]).collect::<Vec<_>>();
        let mut bytes = vec![1];
        let error = encode_into(&more, &mut bytes).expect_err("too large").to_string();
        assert_eq!(error, "the value takes 67108888 bytes; a message has at most 67108864");
        assert_eq!(bytes, [1]);
        assert!(encoded_len(&more).is_err());
    }

    #[test]
    fn a_bulk_array_is_written_in_one_piece() {
        struct Pieces(Vec<usize>);
        impl Writer for Pieces {
            fn write(&mut self, bytes: &[u8]) -> Result<(), bincode::error::EncodeError> {
                self.0.push(bytes.len());
                Ok(())
            }
        }
        let mut pieces = Pieces(Vec::new());
        write(&Array::from(vec![0.5_f32; 1000]), &mut pieces).expect("no limit");
        assert_eq!(pieces.0, [8, 4000]);
    }
}
