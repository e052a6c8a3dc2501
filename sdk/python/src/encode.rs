//! Messages to bytes, by the layout of their class. Bulk arrays stay where they are.

use std::fmt::Display;

use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyList, PyString, PyTuple};

use crate::array::{ContiguousArray, NumberType};
use crate::fault::MessageError;
use crate::layout::{FieldLayout, Layout, Parts, ValueLayout};

/// An array from this length on, in bytes, is a piece of its own; a shorter one is copied to the bytes
/// around it.
const LARGE_LEN: usize = 2 << 10;

/// An encoded message.
#[derive(Default)]
pub struct EncodedMessage<'py> {
    bytes: Vec<u8>,
    /// Arrays, and where in `bytes` each of them belongs.
    arrays: Vec<(usize, ContiguousArray<'py>)>,
}

/// Why a value cannot be encoded, and the attributes that lead to it.
struct ValueProblem {
    path: Vec<String>,
    error: PyErr,
}

impl From<PyErr> for ValueProblem {
    fn from(error: PyErr) -> Self {
        Self { path: Vec::new(), error }
    }
}

impl ValueProblem {
    fn within(mut self, part: impl Display) -> Self {
        self.path.insert(0, part.to_string());
        self
    }

    fn explain(self, py: Python<'_>, name: &str) -> PyErr {
        let path = self.path.iter().fold(name.to_owned(), |path, part| match part.as_bytes() {
            [b'[', ..] => path + part,
            _ => path + "." + part,
        });
        let text = self.error.value(py).to_string();
        let explained = MessageError::new_err(format!("{path}: {text}"));
        explained.set_cause(py, Some(self.error));
        explained
    }
}

impl<'py> EncodedMessage<'py> {
    /// Encodes `message`, an instance of the class of `layout`.
    ///
    /// # Errors
    /// `MessageError`, which names the attribute whose value does not fit.
    pub fn of(layout: &Layout, message: &Bound<'py, PyAny>) -> PyResult<Self> {
        let mut encoded = Self { bytes: Vec::with_capacity(128), arrays: Vec::new() };
        let result = encoded.write_message(layout, message);
        result.map_err(|problem| problem.explain(message.py(), layout.port_type.name()))?;
        Ok(encoded)
    }

    /// Calls `send` with its bytes, in the pieces in which they lie in memory.
    pub fn send_pieces<T>(&self, send: impl FnOnce(&[&[u8]]) -> T) -> T {
        if self.arrays.is_empty() { send(&[&self.bytes]) } else { send(&self.pieces()) }
    }

    /// How many bytes it has.
    pub fn count_bytes(&self) -> usize {
        self.bytes.len() + self.arrays.iter().map(|(_, array)| array.bytes().len()).sum::<usize>()
    }

    /// Its bytes, in the pieces in which they lie in memory.
    pub fn pieces(&self) -> Vec<&[u8]> {
        let mut pieces = Vec::with_capacity(2 * self.arrays.len() + 1);
        let mut start = 0;
        for (at, array) in &self.arrays {
            pieces.push(&self.bytes[start..*at]);
            pieces.push(array.bytes());
            start = *at;
        }
        pieces.push(&self.bytes[start..]);
        pieces
    }

    fn write_message(
        &mut self,
        layout: &Layout,
        message: &Bound<'py, PyAny>,
    ) -> Result<(), ValueProblem> {
        match &layout.parts {
            Parts::Fields(fields) => {
                if !layout.is_of_class(message)? {
                    return Err(wrong_type(layout.port_type.name(), message));
                }
                for field in fields {
                    self.write_field(field, message).map_err(|it| it.within(&field.name))?;
                }
            }
            Parts::Members(members) => {
                let index = members.iter().position(|member| member.is(message));
                let index = index.ok_or_else(|| wrong_type(layout.port_type.name(), message))?;
                self.bytes.extend_from_slice(&(index as u32).to_le_bytes());
            }
            Parts::Any => {
                let why =
                    "a message of any type is passed on with send_data, and is no field of another";
                return Err(PyTypeError::new_err(why).into());
            }
        }
        Ok(())
    }

    fn write_field(
        &mut self,
        field: &FieldLayout,
        message: &Bound<'py, PyAny>,
    ) -> Result<(), ValueProblem> {
        let value = message.getattr(field.attribute.bind(message.py()))?;
        self.write_value(&field.value, &value)
    }

    fn write_value(
        &mut self,
        layout: &ValueLayout,
        value: &Bound<'py, PyAny>,
    ) -> Result<(), ValueProblem> {
        match layout {
            ValueLayout::Flag => {
                let flag: bool = value.extract().map_err(|_| wrong_type("bool", value))?;
                self.bytes.push(u8::from(flag));
            }
            ValueLayout::Number(number) => self.write_number(*number, value)?,
            ValueLayout::Text => {
                let text = value.cast::<PyString>().map_err(|_| wrong_type("str", value))?;
                let text = text.to_cow()?;
                self.write_count(text.len());
                self.bytes.extend_from_slice(text.as_bytes());
            }
            ValueLayout::Bytes => self.write_array(NumberType::U8, value)?,
            ValueLayout::Array(number) => self.write_array(*number, value)?,
            ValueLayout::List(item) => {
                let items = list_items(value)?;
                self.write_count(items.len());
                self.write_items(item, &items)?;
            }
            ValueLayout::Fixed(item, count) => {
                let items = list_items(value)?;
                if items.len() != *count {
                    let why = format!("it has {} values; {count} are needed", items.len());
                    return Err(PyTypeError::new_err(why).into());
                }
                self.write_items(item, &items)?;
            }
            ValueLayout::Optional(item) => {
                self.bytes.push(u8::from(!value.is_none()));
                if !value.is_none() {
                    self.write_value(item, value)?;
                }
            }
            ValueLayout::Message(layout) => self.write_message(layout.get(), value)?,
        }
        Ok(())
    }

    fn write_count(&mut self, count: usize) {
        self.bytes.extend_from_slice(&(count as u64).to_le_bytes());
    }

    fn write_items(
        &mut self,
        item: &ValueLayout,
        items: &[Bound<'py, PyAny>],
    ) -> Result<(), ValueProblem> {
        for (index, value) in items.iter().enumerate() {
            self.write_value(item, value).map_err(|it| it.within(format_args!("[{index}]")))?;
        }
        Ok(())
    }

    fn write_number(
        &mut self,
        number: NumberType,
        value: &Bound<'py, PyAny>,
    ) -> Result<(), ValueProblem> {
        // `True` is an int of Python, and what was meant is another field.
        if value.is_instance_of::<PyBool>() {
            return Err(wrong_type(number.python_name(), value));
        }
        let bytes = &mut self.bytes;
        match number.name {
            "f64" => bytes.extend_from_slice(&read_number::<f64>("float", value)?.to_le_bytes()),
            "f32" => {
                let wide = read_number::<f64>("float", value)?;
                let narrow = wide as f32;
                if narrow.is_infinite() && wide.is_finite() {
                    return Err(out_of_range("f32", value));
                }
                bytes.extend_from_slice(&narrow.to_le_bytes());
            }
            "u8" => bytes.extend_from_slice(&read_number::<u8>("u8", value)?.to_le_bytes()),
            "i8" => bytes.extend_from_slice(&read_number::<i8>("i8", value)?.to_le_bytes()),
            "u16" => bytes.extend_from_slice(&read_number::<u16>("u16", value)?.to_le_bytes()),
            "i16" => bytes.extend_from_slice(&read_number::<i16>("i16", value)?.to_le_bytes()),
            "u32" => bytes.extend_from_slice(&read_number::<u32>("u32", value)?.to_le_bytes()),
            "i32" => bytes.extend_from_slice(&read_number::<i32>("i32", value)?.to_le_bytes()),
            "u64" => bytes.extend_from_slice(&read_number::<u64>("u64", value)?.to_le_bytes()),
            _ => bytes.extend_from_slice(&read_number::<i64>("int", value)?.to_le_bytes()),
        }
        Ok(())
    }

    /// Numbers of any count: of `bytes`, of a list, or of an array.
    fn write_array(
        &mut self,
        number: NumberType,
        value: &Bound<'py, PyAny>,
    ) -> Result<(), ValueProblem> {
        // Bytes are the most frequent, and small ones are copied without a look at their memory.
        if number.len == 1
            && let Ok(bytes) = value.cast::<PyBytes>()
            && bytes.as_bytes().len() < LARGE_LEN
        {
            let bytes = bytes.as_bytes();
            self.write_count(bytes.len());
            self.bytes.extend_from_slice(bytes);
            return Ok(());
        }
        let expected = if number.name == "u8" { "bytes, or an array of u8" } else { "an array" };
        let is_list = value.cast::<PyList>().is_ok() || value.cast::<PyTuple>().is_ok();
        if is_list {
            let items = list_items(value)?;
            self.write_count(items.len());
            return self.write_items(&ValueLayout::Number(number), &items);
        }
        let array = match value.cast::<PyBytes>() {
            Ok(bytes) if number.len == 1 => ContiguousArray::of_bytes(bytes),
            _ if value.is_none() || value.cast::<PyString>().is_ok() => {
                return Err(wrong_type(expected, value));
            }
            _ => ContiguousArray::of_array(value, number)?,
        };
        let len = array.bytes().len();
        self.write_count(len / number.len);
        if len < LARGE_LEN {
            self.bytes.extend_from_slice(array.bytes());
        } else {
            self.arrays.push((self.bytes.len(), array));
        }
        Ok(())
    }
}

fn read_number<'py, T: FromPyObjectOwned<'py>>(
    expected: &str,
    value: &Bound<'py, PyAny>,
) -> Result<T, ValueProblem> {
    value.extract::<T>().map_err(|error| {
        let error: PyErr = error.into();
        if error.is_instance_of::<PyOverflowError>(value.py()) {
            return out_of_range(expected, value);
        }
        wrong_type(expected, value)
    })
}

fn out_of_range(expected: &str, value: &Bound<'_, PyAny>) -> ValueProblem {
    PyTypeError::new_err(format!("{value} is out of range for {expected}")).into()
}

fn list_items<'py>(value: &Bound<'py, PyAny>) -> Result<Vec<Bound<'py, PyAny>>, ValueProblem> {
    if value.cast::<PyString>().is_ok() {
        return Err(wrong_type("a list", value));
    }
    let items = value.try_iter().map_err(|_| wrong_type("a list", value))?;
    Ok(items.collect::<PyResult<_>>()?)
}

fn wrong_type(expected: &str, value: &Bound<'_, PyAny>) -> ValueProblem {
    let given = value.get_type().name().map_or_else(|_| "another type".into(), |it| it.to_string());
    let article = if ["a ", "an ", "bytes,"].iter().any(|word| expected.starts_with(word)) {
        ""
    } else {
        "a value of type "
    };
    PyTypeError::new_err(format!("{article}{expected} is needed, not one of type {given}")).into()
}
