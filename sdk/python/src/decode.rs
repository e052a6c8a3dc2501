//! Bytes to messages, by the layout of their class. Bulk arrays stay where they are.

use std::cell::OnceCell;

use armor_sdk::foreign::KeptMessage;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyFloat, PyList, PyString};

use crate::array::{NumberType, view_array};
use crate::fault::MessageError;
use crate::layout::{Layout, Parts, ValueLayout};

/// Reads one message.
pub struct MessageReader<'a, 'py> {
    py: Python<'py>,
    bytes: &'a [u8],
    at: usize,
    /// Keeps the message for its arrays; only if there is one.
    keep: &'a dyn Fn() -> KeptMessage,
    kept: OnceCell<KeptMessage>,
}

impl<'a, 'py> MessageReader<'a, 'py> {
    /// A reader of `bytes`, which `keep` keeps.
    pub fn new(py: Python<'py>, bytes: &'a [u8], keep: &'a dyn Fn() -> KeptMessage) -> Self {
        Self { py, bytes, at: 0, keep, kept: OnceCell::new() }
    }

    /// The message; every byte belongs to it.
    ///
    /// # Errors
    /// `MessageError` if the bytes are not one message of this layout.
    pub fn read_all(&mut self, layout: &Layout) -> PyResult<Bound<'py, PyAny>> {
        let message = self.read_message(layout)?;
        if self.at < self.bytes.len() {
            return Err(self.error_here("bytes are left over"));
        }
        Ok(message)
    }

    fn error_here(&self, problem: &str) -> PyErr {
        MessageError::new_err(format!("the bytes do not fit the type: {problem} at {}", self.at))
    }

    fn take_bytes(&mut self, len: usize) -> PyResult<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        let taken = rest.get(..len).ok_or_else(|| self.error_here("they end too early"))?;
        self.at += len;
        Ok(taken)
    }

    fn take_array<const N: usize>(&mut self) -> PyResult<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take_bytes(N)?);
        Ok(array)
    }

    /// A count of values that take at least `least` bytes each.
    fn read_count(&mut self, least: usize) -> PyResult<usize> {
        let count = u64::from_le_bytes(self.take_array()?);
        let left = self.bytes.len() - self.at;
        let count = usize::try_from(count).ok();
        let fits = |count: &usize| count.checked_mul(least).is_some_and(|len| len <= left);
        count.filter(fits).ok_or_else(|| self.error_here("a count exceeds them"))
    }

    fn read_flag(&mut self) -> PyResult<bool> {
        match self.take_array()? {
            [0] => Ok(false),
            [1] => Ok(true),
            _ => Err(self.error_here("a flag is neither 0 nor 1")),
        }
    }

    fn read_message(&mut self, layout: &Layout) -> PyResult<Bound<'py, PyAny>> {
        let py = self.py;
        match &layout.parts {
            Parts::Fields(fields) => {
                let message = layout.create_message(py)?;
                for field in fields {
                    let value = self.read_value(&field.value)?;
                    message.setattr(field.attribute.bind(py), value)?;
                }
                Ok(message)
            }
            Parts::Members(members) => {
                let index = u32::from_le_bytes(self.take_array()?) as usize;
                let member = members.get(index);
                let member = member.ok_or_else(|| self.error_here("an unknown member"))?;
                Ok(member.bind(py).clone())
            }
            Parts::Any => Err(MessageError::new_err("a message of any type has no fields")),
        }
    }

    fn read_value(&mut self, layout: &ValueLayout) -> PyResult<Bound<'py, PyAny>> {
        let py = self.py;
        Ok(match layout {
            ValueLayout::Flag => PyBool::new(py, self.read_flag()?).to_owned().into_any(),
            ValueLayout::Number(number) => self.read_number(*number)?,
            ValueLayout::Text => {
                let len = self.read_count(1)?;
                let text = std::str::from_utf8(self.take_bytes(len)?);
                let text = text.map_err(|_| self.error_here("a text is not UTF-8"))?;
                PyString::new(py, text).into_any()
            }
            ValueLayout::Bytes => {
                let len = self.read_count(1)?;
                PyBytes::new(py, self.take_bytes(len)?).into_any()
            }
            ValueLayout::Array(number) => {
                let count = self.read_count(number.len)?;
                let start = self.at;
                self.take_bytes(count * number.len)?;
                let message = self.kept.get_or_init(self.keep).clone();
                view_array(py, message, start, (count, *number))?
            }
            ValueLayout::List(item) => {
                let count = self.read_count(1)?;
                self.read_items(item, count)?
            }
            ValueLayout::Fixed(item, count) => self.read_items(item, *count)?,
            ValueLayout::Optional(item) => {
                if self.read_flag()? {
                    self.read_value(item)?
                } else {
                    py.None().into_bound(py)
                }
            }
            ValueLayout::Message(layout) => self.read_message(layout.get())?,
        })
    }

    fn read_items(&mut self, item: &ValueLayout, count: usize) -> PyResult<Bound<'py, PyAny>> {
        let items = PyList::empty(self.py);
        for _ in 0..count {
            items.append(self.read_value(item)?)?;
        }
        Ok(items.into_any())
    }

    fn read_number(&mut self, number: NumberType) -> PyResult<Bound<'py, PyAny>> {
        let py = self.py;
        let float = |number: f64| Ok(PyFloat::new(py, number).into_any());
        let whole = |number: i64| Ok(number.into_pyobject(py)?.into_any());
        match number.name {
            "f64" => float(f64::from_le_bytes(self.take_array()?)),
            "f32" => float(f64::from(f32::from_le_bytes(self.take_array()?))),
            "u8" => whole(i64::from(u8::from_le_bytes(self.take_array()?))),
            "i8" => whole(i64::from(i8::from_le_bytes(self.take_array()?))),
            "u16" => whole(i64::from(u16::from_le_bytes(self.take_array()?))),
            "i16" => whole(i64::from(i16::from_le_bytes(self.take_array()?))),
            "u32" => whole(i64::from(u32::from_le_bytes(self.take_array()?))),
            "i32" => whole(i64::from(i32::from_le_bytes(self.take_array()?))),
            "u64" => Ok(u64::from_le_bytes(self.take_array()?).into_pyobject(py)?.into_any()),
            _ => whole(i64::from_le_bytes(self.take_array()?)),
        }
    }
}
