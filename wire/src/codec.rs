//! Values to bytes and back: bincode's fixed-width little-endian layout (`docs/protocol.md`,
//! "Values"), always with a limit, and never with bytes left over.

use bincode::config::{self, Configuration, Fixint, Limit, LittleEndian};
use bincode::enc::write::{SizeWriter, Writer};
use thiserror::Error;

use crate::message::WireType;

/// Largest handshake or control body in bytes. It carries at most two schemas and a status.
pub const MAX_CONTROL_LEN: usize = 1 << 20;
/// Largest first frame of a connection in bytes: nothing bigger is read from a stranger.
pub const MAX_HELLO_LEN: usize = 64 << 10;
/// Largest data payload in bytes: an 8 MiB image or a 4096 x 4096 map with room to spare.
pub const MAX_DATA_LEN: usize = 64 << 20;

type Layout<const LIMIT: usize> = Configuration<LittleEndian, Fixint, Limit<LIMIT>>;

fn layout<const LIMIT: usize>() -> Layout<LIMIT> {
    config::legacy().with_limit::<LIMIT>()
}

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
#[error("the value does not fit into {limit} bytes: {reason}")]
pub struct EncodeError {
    limit: usize,
    reason: bincode::error::EncodeError,
}

impl EncodeError {
    fn new(reason: bincode::error::EncodeError) -> Self {
        Self { limit: MAX_DATA_LEN, reason }
    }
}

/// Appends `value` to `bytes`.
///
/// # Errors
/// If the value is larger than [`MAX_DATA_LEN`]; `bytes` is then as before.
pub fn encode_into<T: WireType>(value: &T, bytes: &mut Vec<u8>) -> Result<(), EncodeError> {
    let start = bytes.len();
    let result = write(value, &mut Append(bytes));
    let too_long = bytes.len() - start > MAX_DATA_LEN;
    if result.is_err() || too_long {
        bytes.truncate(start);
    }
    match result {
        Ok(()) if too_long => {
            Err(EncodeError::new(bincode::error::EncodeError::Other("value too large")))
        }
        other => other,
    }
}

/// The bytes of `value`.
///
/// # Errors
/// As [`encode_into`].
pub fn encode<T: WireType>(value: &T) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    encode_into(value, &mut bytes)?;
    Ok(bytes)
}

/// Hands the bytes of `value` to `writer` piece by piece; a bulk array arrives as one piece.
///
/// # Errors
/// What the writer refuses.
pub fn write<T: WireType, W: Writer>(value: &T, writer: &mut W) -> Result<(), EncodeError> {
    bincode::encode_into_writer(value, writer, config::legacy()).map_err(EncodeError::new)
}

/// The number of bytes `value` encodes to, without encoding bulk arrays.
///
/// # Errors
/// If the value is larger than [`MAX_DATA_LEN`].
pub fn encoded_len<T: WireType>(value: &T) -> Result<usize, EncodeError> {
    let mut size = SizeWriter::default();
    write(value, &mut size)?;
    if size.bytes_written > MAX_DATA_LEN {
        return Err(EncodeError::new(bincode::error::EncodeError::Other("value too large")));
    }
    Ok(size.bytes_written)
}

/// Reads a data payload; every byte must belong to the value.
///
/// # Errors
/// [`DecodeError`] if the bytes are not exactly one value of `T`.
pub fn decode<T: WireType>(bytes: &[u8]) -> Result<T, DecodeError> {
    decode_within::<T, MAX_DATA_LEN>(bytes)
}

/// As [`decode`] for what arrives from a peer that is not known yet: allocates at most about
/// [`MAX_CONTROL_LEN`] whatever the lengths in `bytes` claim.
///
/// # Errors
/// As [`decode`].
pub fn decode_control<T: WireType>(bytes: &[u8]) -> Result<T, DecodeError> {
    decode_within::<T, MAX_CONTROL_LEN>(bytes)
}

fn decode_within<T: WireType, const LIMIT: usize>(bytes: &[u8]) -> Result<T, DecodeError> {
    let (value, used) = bincode::decode_from_slice::<T, _>(bytes, layout::<LIMIT>())
        .map_err(DecodeError::Layout)?;
    if used < bytes.len() {
        return Err(DecodeError::LeftOver(bytes.len() - used));
    }
    Ok(value)
}

struct Append<'a>(&'a mut Vec<u8>);

impl Writer for Append<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), bincode::error::EncodeError> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }
}
