//! From CDR, or the bytes of ROS 1, back to Armor's bytes.

use super::bytes::{ByteReader, ENCAPSULATION, LayoutError};
use super::shape::{ConstantType, FieldContent, RosField, Shape, StructShape};
use super::time::from_ros_time;

pub(super) fn decode_message(
    shape: &Shape,
    bytes: &[u8],
    stamps_s: &[f64],
) -> Result<Vec<u8>, LayoutError> {
    let mut reader = ByteReader::new(bytes);
    // The second half of the header is for options that no reader needs.
    if reader.take(ENCAPSULATION.len())?[..2] != ENCAPSULATION[..2] {
        return Err(LayoutError { problem: "it is not little-endian CDR of version 1", at: 0 });
    }
    let mut decoder = Decoder { reader, stamps_s: stamps_s.iter(), inner_s: None };
    let mut out = Vec::with_capacity(bytes.len());
    decoder.take(shape, &mut out)?;
    Ok(out)
}

/// Reads a message of ROS 1: the same fields without gaps, with a counter in each header.
pub(super) fn decode_ros1_message(shape: &Shape, bytes: &[u8]) -> Result<Vec<u8>, LayoutError> {
    let reader = ByteReader::packed(bytes);
    let mut decoder = Decoder { reader, stamps_s: [].iter(), inner_s: None };
    let mut out = Vec::with_capacity(bytes.len());
    decoder.take(shape, &mut out)?;
    if decoder.reader.left() > 0 {
        return Err(decoder.reader.error("bytes are left over"));
    }
    Ok(out)
}

struct Decoder<'a> {
    reader: ByteReader<'a>,
    stamps_s: std::slice::Iter<'a, f64>,
    /// The stamp of the first message in the one that is being read.
    inner_s: Option<f64>,
}

impl Decoder<'_> {
    fn take(&mut self, shape: &Shape, out: &mut Vec<u8>) -> Result<(), LayoutError> {
        match shape {
            Shape::Plain { len, name } => {
                self.reader.align(*len)?;
                let bytes = self.reader.take(*len)?;
                if *name == "bool" && bytes[0] > 1 {
                    return Err(self.reader.error("a flag is neither 0 nor 1"));
                }
                out.extend_from_slice(bytes);
            }
            Shape::Text => self.take_text(out)?,
            Shape::Option(item) => {
                let count = self.take_one_or_none()?;
                out.push(u8::from(count));
                if count {
                    self.take(item, out)?;
                }
            }
            Shape::List(item) => {
                let count = self.reader.take_ros_count(usize::from(ros_min_len(item) > 0))?;
                out.extend_from_slice(&(count as u64).to_le_bytes());
                self.take_items(item, count, out)?;
            }
            Shape::Fixed(item, count) => self.take_items(item, *count, out)?,
            Shape::Struct(shape) => self.take_struct(shape, out)?,
            Shape::Index { variants } => {
                let index = self.take_index(variants.len())?;
                out.extend_from_slice(&index.to_le_bytes());
            }
            Shape::SmallIndex { variants, first, .. } => {
                let number = self.reader.take_array::<1>()?[0] as i8;
                let index = u32::from(number.wrapping_sub(*first) as u8);
                if index as usize >= *variants {
                    return Err(self.reader.error("an enum has no such variant"));
                }
                out.extend_from_slice(&index.to_le_bytes());
            }
            Shape::Enum { variants, .. } => {
                let index = self.take_index(variants.len())?;
                out.extend_from_slice(&index.to_le_bytes());
                for (at, (_, shape)) in variants.iter().enumerate() {
                    let is_there = self.take_one_or_none()?;
                    if is_there != (at == index as usize) {
                        return Err(self.reader.error("an enum has values of another variant"));
                    }
                    if is_there {
                        self.take_struct(shape, out)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn take_items(
        &mut self,
        item: &Shape,
        count: usize,
        out: &mut Vec<u8>,
    ) -> Result<(), LayoutError> {
        match item {
            Shape::Plain { len, name } if *name != "bool" => {
                if count > 0 {
                    self.reader.align(*len)?;
                }
                out.extend_from_slice(self.reader.take(len.saturating_mul(count))?);
                Ok(())
            }
            _ => (0..count).try_for_each(|_| self.take(item, out)),
        }
    }

    fn take_struct(&mut self, shape: &StructShape, out: &mut Vec<u8>) -> Result<(), LayoutError> {
        if shape.is_sequential {
            for field in &shape.fields {
                self.take_field(field, shape, &mut |_, bytes| out.extend_from_slice(bytes))?;
            }
            return Ok(());
        }
        let mut parts = vec![Vec::new(); shape.parts.len()];
        let exact_s = shape.inner_stamp.and_then(|_| self.stamps_s.next().copied());
        let around = self.inner_s.take();
        for field in &shape.fields {
            self.take_field(field, shape, &mut |part, bytes| {
                parts[part].extend_from_slice(bytes);
            })?;
        }
        if let Some(part) = shape.inner_stamp {
            let stamp_s = exact_s.or(self.inner_s).unwrap_or_default();
            parts[part] = stamp_s.to_le_bytes().to_vec();
            self.inner_s = around;
        } else {
            self.inner_s = around.or(self.inner_s);
        }
        parts.iter().for_each(|part| out.extend_from_slice(part));
        Ok(())
    }

    fn take_field(
        &mut self,
        field: &RosField,
        shape: &StructShape,
        put: &mut impl FnMut(usize, &[u8]),
    ) -> Result<(), LayoutError> {
        let mut value = Vec::new();
        match &field.content {
            FieldContent::Part(part) => {
                self.take(&shape.parts[*part], &mut value)?;
                put(*part, &value);
            }
            FieldContent::Header { stamp, frame } => {
                self.skip_counter()?;
                put(*stamp, &self.take_stamp()?.to_le_bytes());
                self.take_text(&mut value)?;
                put(*frame, &value);
            }
            FieldContent::InnerHeader { frame } => {
                self.skip_counter()?;
                let stamp_s = self.take_time()?;
                self.inner_s.get_or_insert(stamp_s);
                self.take_text(&mut value)?;
                put(*frame, &value);
            }
            FieldContent::Time(part) => put(*part, &self.take_stamp()?.to_le_bytes()),
            FieldContent::Constant(constant) => match constant {
                ConstantType::Byte => self.reader.take(1).map(|_| ())?,
                ConstantType::Floats => {
                    let count = self.reader.take_ros_count(4)?;
                    self.reader.take(count.saturating_mul(4)).map(|_| ())?;
                }
                ConstantType::Text => self.take_text(&mut value)?,
            },
            FieldContent::Group { fields, .. } => {
                for field in fields {
                    self.take_field(field, shape, put)?;
                }
            }
        }
        Ok(())
    }

    /// Passes over the counter with which a header begins in ROS 1.
    fn skip_counter(&mut self) -> Result<(), LayoutError> {
        let len = if self.reader.is_packed() { size_of::<u32>() } else { 0 };
        self.reader.take(len).map(|_| ())
    }

    fn take_stamp(&mut self) -> Result<f64, LayoutError> {
        let rounded_s = self.take_time()?;
        Ok(self.stamps_s.next().copied().unwrap_or(rounded_s))
    }

    fn take_time(&mut self) -> Result<f64, LayoutError> {
        let seconds = i32::from_le_bytes(self.reader.take_aligned()?);
        let nanoseconds = u32::from_le_bytes(self.reader.take_aligned()?);
        Ok(from_ros_time((seconds, nanoseconds)))
    }

    fn take_text(&mut self, out: &mut Vec<u8>) -> Result<(), LayoutError> {
        let len = self.reader.take_ros_count(1)?;
        let bytes = self.reader.take(len)?;
        // Without the zero at its end, which some writers leave out of an empty text.
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        if std::str::from_utf8(text).is_err() {
            return Err(self.reader.error("a text is not UTF-8"));
        }
        out.extend_from_slice(&(text.len() as u64).to_le_bytes());
        out.extend_from_slice(text);
        Ok(())
    }

    fn take_one_or_none(&mut self) -> Result<bool, LayoutError> {
        match self.reader.take_ros_count(0)? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(self.reader.error("a value that is there or not is there several times")),
        }
    }

    fn take_index(&mut self, variants: usize) -> Result<u32, LayoutError> {
        let index = u32::from_le_bytes(self.reader.take_aligned()?);
        if index as usize >= variants {
            return Err(self.reader.error("an enum has no such variant"));
        }
        Ok(index)
    }
}

/// The fewest bytes of a value in CDR: 0 only if it has none at all.
fn ros_min_len(shape: &Shape) -> usize {
    match shape {
        Shape::Fixed(item, count) => ros_min_len(item).saturating_mul(*count),
        _ => 1,
    }
}
