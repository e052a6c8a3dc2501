//! Structs of C to bytes and back, by the steps of their layout. A bulk array is not copied: it is sent
//! from where it is, and received where it has arrived, unless it is not aligned there.

use std::cell::Cell;

use armor_sdk::foreign::KeptMessage;

use crate::failure::{ArmorError, Failure};
use crate::layout::{Layout, Step, WORD};

/// Lists of numbers from this length in bytes on are pieces of their own.
const PIECE_LEN: usize = 1024;
/// A larger buffer is not kept for the next message.
const MAX_KEPT_LEN: usize = 64 << 10;
/// More memory than a message takes on the wire, times this, is no message.
const MAX_LISTS: usize = 1 << 30;

/// The memory of C, as far as a struct in it points.
pub(crate) trait ForeignMemory<'a> {
    /// The bytes there; at least one.
    fn bytes(&self, address: usize, len: usize) -> &'a [u8];
}

thread_local! {
    /// The buffer of the last message of this thread.
    static BUFFER: Cell<Vec<u8>> = const { Cell::new(Vec::new()) };
}

/// An encoded message: parts of its own buffer, and arrays where they are.
pub(crate) struct EncodedMessage<'a> {
    own: Vec<u8>,
    /// Arrays, each with the length that the own buffer had.
    arrays: Vec<(usize, &'a [u8])>,
}

impl<'a> EncodedMessage<'a> {
    pub fn of_struct<M: ForeignMemory<'a>>(
        layout: &Layout,
        content: &'a [u8],
        memory: &M,
    ) -> Result<Self, Failure> {
        let mut message = Self { own: BUFFER.take(), arrays: Vec::new() };
        message.own.clear();
        message.append_steps(&layout.steps, content, memory)?;
        Ok(message)
    }

    /// Uses its bytes, in pieces.
    pub fn with_pieces<T>(&self, work: impl FnOnce(&[&[u8]]) -> T) -> T {
        match self.arrays.as_slice() {
            [] => work(&[&self.own]),
            [(end, array)] => work(&[&self.own[..*end], array, &self.own[*end..]]),
            arrays => {
                let mut pieces = Vec::with_capacity(2 * arrays.len() + 1);
                let mut begin = 0;
                for (end, array) in arrays {
                    pieces.push(&self.own[begin..*end]);
                    pieces.push(*array);
                    begin = *end;
                }
                pieces.push(&self.own[begin..]);
                work(&pieces)
            }
        }
    }

    fn append_steps<M: ForeignMemory<'a>>(
        &mut self,
        steps: &[Step],
        content: &'a [u8],
        memory: &M,
    ) -> Result<(), Failure> {
        for step in steps {
            self.append_step(step, content, memory)?;
        }
        Ok(())
    }

    fn append_step<M: ForeignMemory<'a>>(
        &mut self,
        step: &Step,
        content: &'a [u8],
        memory: &M,
    ) -> Result<(), Failure> {
        match step {
            Step::Copy { offset, len } => {
                self.own.extend_from_slice(&content[*offset..*offset + *len]);
            }
            Step::Bool { offset } => self.own.push(u8::from(content[*offset] != 0)),
            Step::Enum { offset, variants } => {
                let bytes = &content[*offset..*offset + 4];
                let number = u32::from_le_bytes(bytes.try_into().unwrap_or_default());
                if number >= *variants {
                    let why = format!("{number} is no value of an enum with {variants} values");
                    return Err(Failure::new(ArmorError::Malformed, why));
                }
                self.own.extend_from_slice(bytes);
            }
            Step::Text { offset } => {
                let text = read_list(content, *offset, 1, memory)?;
                if std::str::from_utf8(text).is_err() {
                    let shown = String::from_utf8_lossy(text);
                    let why = format!("the text {shown:?} is not UTF-8");
                    return Err(Failure::new(ArmorError::NotUtf8, why));
                }
                self.own.extend_from_slice(&(text.len() as u64).to_le_bytes());
                self.own.extend_from_slice(text);
            }
            Step::Bulk { offset, item_len } => {
                let array = read_list(content, *offset, *item_len, memory)?;
                let count = array.len() / item_len;
                self.own.extend_from_slice(&(count as u64).to_le_bytes());
                if array.len() < PIECE_LEN {
                    self.own.extend_from_slice(array);
                } else {
                    self.arrays.push((self.own.len(), array));
                }
            }
            Step::List { offset, item } => {
                let items = read_list(content, *offset, item.size, memory)?;
                self.own.extend_from_slice(&((items.len() / item.size) as u64).to_le_bytes());
                for content in items.chunks_exact(item.size) {
                    self.append_steps(&item.steps, content, memory)?;
                }
            }
            Step::Fixed { offset, count, item } => {
                let items = &content[*offset..*offset + *count * item.size];
                for content in items.chunks_exact(item.size) {
                    self.append_steps(&item.steps, content, memory)?;
                }
            }
            Step::Optional { presence, steps } => {
                let is_present = content[*presence] != 0;
                self.own.push(u8::from(is_present));
                if is_present {
                    self.append_steps(steps, content, memory)?;
                }
            }
        }
        Ok(())
    }
}

impl Drop for EncodedMessage<'_> {
    fn drop(&mut self) {
        if self.own.capacity() <= MAX_KEPT_LEN {
            BUFFER.set(std::mem::take(&mut self.own));
        }
    }
}

/// Reads a pointer and a length, and what they lead to.
fn read_list<'a>(
    content: &[u8],
    offset: usize,
    item_len: usize,
    memory: &impl ForeignMemory<'a>,
) -> Result<&'a [u8], Failure> {
    let word =
        |at: usize| usize::from_le_bytes(content[at..at + WORD].try_into().unwrap_or_default());
    let (address, count) = (word(offset), word(offset + WORD));
    if count == 0 {
        return Ok(&[]);
    }
    if address == 0 {
        return Err(Failure::null(&format!("a pointer with the length {count} in a message")));
    }
    let len = count.checked_mul(item_len).filter(|len| *len <= MAX_LISTS);
    let len = len.ok_or_else(|| {
        let why = format!("a list of {count} items of {item_len} bytes");
        Failure::new(ArmorError::TooLarge, why)
    })?;
    Ok(memory.bytes(address, len))
}

/// What decoded structs point to, if it is not in the message itself.
#[derive(Debug, Default)]
pub(crate) struct Arena(Vec<Vec<u64>>);

impl Arena {
    /// Keeps memory, aligned to a word, and returns its address.
    fn keep(&mut self, words: Vec<u64>) -> usize {
        self.0.push(words);
        self.0.last().map_or(0, |words| words.as_ptr().expose_provenance())
    }

    fn copy(&mut self, bytes: &[u8], spare: usize) -> usize {
        let mut words = vec![0_u64; (bytes.len() + spare).div_ceil(size_of::<u64>())];
        bytemuck::cast_slice_mut::<_, u8>(&mut words)[..bytes.len()].copy_from_slice(bytes);
        self.keep(words)
    }
}

/// Decodes a message into the memory of a struct, which is all zeros.
pub(crate) fn decode_struct(
    layout: &Layout,
    bytes: &[u8],
    content: &mut [u8],
    arena: &mut Arena,
) -> Result<(), Failure> {
    let mut reader = Reader(bytes);
    reader.decode_steps(&layout.steps, content, arena)?;
    match reader.0.len() {
        0 => Ok(()),
        left => Err(malformed(format!("{left} bytes are left over after the message"))),
    }
}

fn malformed(why: String) -> Failure {
    Failure::new(ArmorError::Malformed, why)
}

struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, len: usize) -> Result<&'a [u8], Failure> {
        let (taken, rest) = self.0.split_at_checked(len).ok_or_else(|| {
            malformed(format!("the message ends where {len} more bytes are expected"))
        })?;
        self.0 = rest;
        Ok(taken)
    }

    fn take_count(&mut self, min_len: usize) -> Result<usize, Failure> {
        let count = self.take(8)?.try_into().unwrap_or_default();
        let count = usize::try_from(u64::from_le_bytes(count)).unwrap_or(usize::MAX);
        match count <= self.0.len() / min_len.max(1) {
            true => Ok(count),
            false => Err(malformed(format!("a list of {count} items, which are not there"))),
        }
    }

    fn take_flag(&mut self) -> Result<bool, Failure> {
        match self.take(1)? {
            [0] => Ok(false),
            [1] => Ok(true),
            other => Err(malformed(format!("{other:?} is neither true nor false"))),
        }
    }

    fn decode_steps(
        &mut self,
        steps: &[Step],
        content: &mut [u8],
        arena: &mut Arena,
    ) -> Result<(), Failure> {
        for step in steps {
            self.decode_step(step, content, arena)?;
        }
        Ok(())
    }

    fn decode_step(
        &mut self,
        step: &Step,
        content: &mut [u8],
        arena: &mut Arena,
    ) -> Result<(), Failure> {
        match step {
            Step::Copy { offset, len } => {
                content[*offset..*offset + *len].copy_from_slice(self.take(*len)?);
            }
            Step::Bool { offset } => content[*offset] = u8::from(self.take_flag()?),
            Step::Enum { offset, variants } => {
                let bytes = self.take(4)?;
                let number = u32::from_le_bytes(bytes.try_into().unwrap_or_default());
                if number >= *variants {
                    return Err(malformed(format!("{number} is no value of an enum")));
                }
                content[*offset..*offset + 4].copy_from_slice(bytes);
            }
            Step::Text { offset } => {
                let count = self.take_count(1)?;
                let text = self.take(count)?;
                std::str::from_utf8(text).map_err(|_| malformed("a text is not UTF-8".into()))?;
                write_list(content, *offset, arena.copy(text, 1), count);
            }
            Step::Bulk { offset, item_len } => {
                let count = self.take_count(*item_len)?;
                let array = self.take(count * item_len)?;
                let address = array.as_ptr().expose_provenance();
                let is_aligned = address.is_multiple_of(*item_len);
                let address = if is_aligned { address } else { arena.copy(array, 0) };
                write_list(content, *offset, address, count);
            }
            Step::List { offset, item } => {
                let count = self.take_count(item.schema.min_len())?;
                let len = count.checked_mul(item.size).filter(|len| *len <= MAX_LISTS);
                let len = len.ok_or_else(|| malformed(format!("a list of {count} items")))?;
                let mut words = vec![0_u64; len.div_ceil(size_of::<u64>())];
                let items = &mut bytemuck::cast_slice_mut(&mut words)[..len];
                for content in items.chunks_exact_mut(item.size) {
                    self.decode_steps(&item.steps, content, arena)?;
                }
                write_list(content, *offset, arena.keep(words), count);
            }
            Step::Fixed { offset, count, item } => {
                let items = &mut content[*offset..*offset + *count * item.size];
                for content in items.chunks_exact_mut(item.size) {
                    self.decode_steps(&item.steps, content, arena)?;
                }
            }
            Step::Optional { presence, steps } => {
                content[*presence] = u8::from(self.take_flag()?);
                if content[*presence] == 1 {
                    self.decode_steps(steps, content, arena)?;
                }
            }
        }
        Ok(())
    }
}

fn write_list(content: &mut [u8], offset: usize, address: usize, count: usize) {
    content[offset..offset + WORD].copy_from_slice(&address.to_le_bytes());
    content[offset + WORD..offset + 2 * WORD].copy_from_slice(&count.to_le_bytes());
}

/// A received message that is kept, with what has been decoded of it.
#[derive(Debug)]
pub(crate) struct KeptBytes {
    pub message: KeptMessage,
    pub arena: Arena,
}
