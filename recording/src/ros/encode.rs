//! From Armor's bytes to CDR.

use super::bytes::{ByteReader, LayoutError, RosWriter};
use super::shape::{ConstantType, FieldContent, RosField, Shape, StructShape};
use super::time::{is_exact, to_ros_time};

/// A message in CDR.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RosBytes {
    /// With its encapsulation header.
    pub bytes: Vec<u8>,
    /// The stamps of the message in seconds, in the order of its bytes, if a time in nanoseconds
    /// cannot express one of them; otherwise empty.
    pub stamps_s: Vec<f64>,
}

/// Encodes into `out`, whose memory is used again: a message of 100 kB in memory of its own costs the
/// kernel more than its copy.
pub(super) fn encode_message(
    shape: &Shape,
    payload: &[u8],
    out: &mut RosBytes,
) -> Result<(), LayoutError> {
    let RosBytes { bytes, mut stamps_s } = std::mem::take(out);
    stamps_s.clear();
    let mut encoder = Encoder {
        writer: RosWriter::reuse(bytes, payload.len() + payload.len() / 8 + 64),
        stamps_s,
        outer_s: 0.0,
        is_outer_written: true,
        needs_stamps: false,
    };
    let mut reader = ByteReader::new(payload);
    encoder.put(shape, &mut reader)?;
    if reader.left() > 0 {
        return Err(reader.error("bytes are left over"));
    }
    if !encoder.needs_stamps && encoder.stamps_s.iter().all(|stamp| is_exact(*stamp)) {
        encoder.stamps_s.clear();
    }
    *out = RosBytes { bytes: encoder.writer.bytes, stamps_s: encoder.stamps_s };
    Ok(())
}

/// Encodes for ROS 1: the same fields without gaps, with a counter in each header.
pub(super) fn encode_ros1_message(shape: &Shape, payload: &[u8]) -> Result<Vec<u8>, LayoutError> {
    let mut encoder = Encoder {
        writer: RosWriter::packed(payload.len() + 64),
        stamps_s: Vec::new(),
        outer_s: 0.0,
        is_outer_written: true,
        needs_stamps: false,
    };
    let mut reader = ByteReader::new(payload);
    encoder.put(shape, &mut reader)?;
    if reader.left() > 0 {
        return Err(reader.error("bytes are left over"));
    }
    Ok(encoder.writer.bytes)
}

struct Encoder {
    writer: RosWriter,
    stamps_s: Vec<f64>,
    /// The stamp of the message around, and whether a message in it has it in its header.
    outer_s: f64,
    is_outer_written: bool,
    /// A stamp is not in the bytes.
    needs_stamps: bool,
}

impl Encoder {
    fn put(&mut self, shape: &Shape, reader: &mut ByteReader<'_>) -> Result<(), LayoutError> {
        match shape {
            Shape::Plain { len, name } => {
                let bytes = reader.take(*len)?;
                if *name == "bool" && bytes[0] > 1 {
                    return Err(reader.error("a flag is neither 0 nor 1"));
                }
                self.writer.align(*len);
                self.writer.bytes.extend_from_slice(bytes);
            }
            Shape::Text => {
                let text = take_text(reader)?;
                self.writer.put_text(text)?;
            }
            Shape::Option(item) => {
                let is_there = take_flag(reader)?;
                self.writer.put_count(usize::from(is_there))?;
                if is_there {
                    self.put(item, reader)?;
                }
            }
            Shape::List(item) => {
                let count = reader.take_count(item.min_len())?;
                self.writer.put_count(count)?;
                self.put_items(item, count, reader)?;
            }
            Shape::Fixed(item, count) => self.put_items(item, *count, reader)?,
            Shape::Struct(shape) => self.put_struct(shape, reader)?,
            Shape::Index { variants } => {
                let index = take_index(reader, variants.len())?;
                self.writer.put_aligned(index.to_le_bytes());
            }
            Shape::SmallIndex { variants, first, .. } => {
                let index = take_index(reader, *variants)? as u8;
                self.writer.bytes.push(first.wrapping_add_unsigned(index) as u8);
            }
            Shape::Enum { variants, .. } => {
                let index = take_index(reader, variants.len())?;
                self.writer.put_aligned(index.to_le_bytes());
                for (at, (_, shape)) in variants.iter().enumerate() {
                    let is_it = at == index as usize;
                    self.writer.put_count(usize::from(is_it))?;
                    if is_it {
                        self.put_struct(shape, reader)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn put_items(
        &mut self,
        item: &Shape,
        count: usize,
        reader: &mut ByteReader<'_>,
    ) -> Result<(), LayoutError> {
        match item {
            // Both forms have the same bytes, without gaps between the items.
            Shape::Plain { len, name } if *name != "bool" => {
                let bytes = reader.take(len.saturating_mul(count))?;
                if count > 0 {
                    self.writer.align(*len);
                }
                self.writer.bytes.extend_from_slice(bytes);
                Ok(())
            }
            _ => (0..count).try_for_each(|_| self.put(item, reader)),
        }
    }

    fn put_struct(
        &mut self,
        shape: &StructShape,
        reader: &mut ByteReader<'_>,
    ) -> Result<(), LayoutError> {
        if shape.is_sequential {
            for field in &shape.fields {
                self.put_field(field, shape, &|_, reader| reader, reader)?;
            }
            return Ok(());
        }
        let mut begins = Vec::with_capacity(shape.parts.len());
        for part in &shape.parts {
            begins.push(*reader);
            skip(part, reader)?;
        }
        if let Some(part) = shape.inner_stamp {
            self.outer_s = f64::from_le_bytes(begins[part].take_array()?);
            self.stamps_s.push(self.outer_s);
            self.is_outer_written = false;
        }
        for field in &shape.fields {
            let mut passed = *reader;
            self.put_field(field, shape, &|part, _| begins[part], &mut passed)?;
        }
        self.needs_stamps |= shape.inner_stamp.is_some() && !self.is_outer_written;
        Ok(())
    }

    /// Puts one field. `find` returns where a part begins, given the end of the part before.
    fn put_field<'a>(
        &mut self,
        field: &RosField,
        shape: &StructShape,
        find: &impl Fn(usize, ByteReader<'a>) -> ByteReader<'a>,
        reader: &mut ByteReader<'a>,
    ) -> Result<(), LayoutError> {
        match &field.content {
            FieldContent::Part(part) => {
                *reader = find(*part, *reader);
                self.put(&shape.parts[*part], reader)?;
            }
            FieldContent::Header { stamp, frame } => {
                *reader = find(*stamp, *reader);
                let stamp_s = f64::from_le_bytes(reader.take_array()?);
                self.writer.put_counter();
                self.put_stamp(stamp_s);
                *reader = find(*frame, *reader);
                self.writer.put_text(take_text(reader)?)?;
            }
            FieldContent::InnerHeader { frame } => {
                self.writer.put_counter();
                self.put_time(self.outer_s);
                self.is_outer_written = true;
                *reader = find(*frame, *reader);
                self.writer.put_text(take_text(reader)?)?;
            }
            FieldContent::Time(part) => {
                *reader = find(*part, *reader);
                let stamp_s = f64::from_le_bytes(reader.take_array()?);
                self.put_stamp(stamp_s);
            }
            FieldContent::Constant(constant) => match constant {
                ConstantType::Byte => self.writer.bytes.push(0),
                ConstantType::Floats => self.writer.put_count(0)?,
                ConstantType::Text => self.writer.put_text(b"")?,
            },
            FieldContent::Group { fields, .. } => {
                for field in fields {
                    self.put_field(field, shape, find, reader)?;
                }
            }
        }
        Ok(())
    }

    fn put_stamp(&mut self, stamp_s: f64) {
        self.stamps_s.push(stamp_s);
        self.put_time(stamp_s);
    }

    fn put_time(&mut self, stamp_s: f64) {
        let (seconds, nanoseconds) = to_ros_time(stamp_s);
        self.writer.put_aligned(seconds.to_le_bytes());
        self.writer.put_aligned(nanoseconds.to_le_bytes());
    }
}

fn take_text<'a>(reader: &mut ByteReader<'a>) -> Result<&'a [u8], LayoutError> {
    let len = reader.take_count(1)?;
    reader.take(len)
}

fn take_flag(reader: &mut ByteReader<'_>) -> Result<bool, LayoutError> {
    match reader.take_array::<1>()?[0] {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(reader.error("a flag is neither 0 nor 1")),
    }
}

fn take_index(reader: &mut ByteReader<'_>, variants: usize) -> Result<u32, LayoutError> {
    let index = u32::from_le_bytes(reader.take_array()?);
    if index as usize >= variants {
        return Err(reader.error("an enum has no such variant"));
    }
    Ok(index)
}

/// Passes over a value.
fn skip(shape: &Shape, reader: &mut ByteReader<'_>) -> Result<(), LayoutError> {
    match shape {
        Shape::Plain { len, .. } => reader.take(*len).map(|_| ()),
        Shape::Text => take_text(reader).map(|_| ()),
        Shape::Option(item) => {
            if take_flag(reader)? {
                skip(item, reader)?;
            }
            Ok(())
        }
        Shape::List(item) => {
            let count = reader.take_count(item.min_len())?;
            skip_items(item, count, reader)
        }
        Shape::Fixed(item, count) => skip_items(item, *count, reader),
        Shape::Struct(shape) => shape.parts.iter().try_for_each(|part| skip(part, reader)),
        Shape::Index { variants } => take_index(reader, variants.len()).map(|_| ()),
        Shape::SmallIndex { variants, .. } => take_index(reader, *variants).map(|_| ()),
        Shape::Enum { variants, .. } => {
            let index = take_index(reader, variants.len())? as usize;
            variants[index].1.parts.iter().try_for_each(|part| skip(part, reader))
        }
    }
}

fn skip_items(item: &Shape, count: usize, reader: &mut ByteReader<'_>) -> Result<(), LayoutError> {
    match item {
        Shape::Plain { len, .. } => reader.take(len.saturating_mul(count)).map(|_| ()),
        _ => (0..count).try_for_each(|_| skip(item, reader)),
    }
}
