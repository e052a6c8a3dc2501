//! Bulk arrays without a copy: received ones as numpy arrays on the message, and the memory of arrays
//! that are sent. Has the only `unsafe` code of this crate.
//!
//! Both go through `__array_interface__`, numpy's protocol for arrays of others, so that the library
//! needs no numpy to be built or loaded.

use armor_sdk::foreign::KeptMessage;
use armor_sdk::wire::schema::Schema;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyDict, PyTuple};

/// A type of numbers that arrays have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberType {
    /// As in a schema.
    pub name: &'static str,
    /// As in numpy.
    pub typestr: &'static str,
    /// Bytes of a number.
    pub len: usize,
}

impl NumberType {
    const ALL: [Self; 10] = [
        Self { name: "u8", typestr: "|u1", len: 1 },
        Self { name: "i8", typestr: "|i1", len: 1 },
        Self { name: "u16", typestr: "<u2", len: 2 },
        Self { name: "i16", typestr: "<i2", len: 2 },
        Self { name: "u32", typestr: "<u4", len: 4 },
        Self { name: "i32", typestr: "<i4", len: 4 },
        Self { name: "u64", typestr: "<u8", len: 8 },
        Self { name: "i64", typestr: "<i8", len: 8 },
        Self { name: "f32", typestr: "<f4", len: 4 },
        Self { name: "f64", typestr: "<f8", len: 8 },
    ];

    /// The type of bytes.
    pub const U8: Self = Self::ALL[0];

    /// What a value of this type is in Python.
    pub fn python_name(self) -> &'static str {
        match self.name {
            "f32" | "f64" => "float",
            "i64" => "int",
            other => other,
        }
    }

    /// The type of this schema, if it is one of numbers.
    pub fn of_schema(schema: &Schema) -> Option<Self> {
        let name = schema.to_string();
        Self::ALL.into_iter().find(|number| number.name == name)
    }
}

/// Imports numpy, once.
pub fn import_numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    NUMPY
        .get_or_try_init(py, || PyModule::import(py, "numpy").map(Bound::unbind))
        .map(|numpy| numpy.bind(py))
}

/// An array in a received message, for `numpy.asarray`.
#[pyclass(module = "armor._armor", frozen)]
pub struct ReceivedArray {
    message: KeptMessage,
    start: usize,
    count: usize,
    number: NumberType,
}

#[pymethods]
impl ReceivedArray {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = PyDict::new(py);
        let is_read_only = true;
        let address = self.message[self.start..].as_ptr().expose_provenance();
        interface.set_item("data", (address, is_read_only))?;
        interface.set_item("shape", (self.count,))?;
        interface.set_item("typestr", self.number.typestr)?;
        interface.set_item("version", 3)?;
        Ok(interface)
    }
}

/// A read-only numpy array on `count` numbers of the message, from `start` on, which lie within it. The
/// array keeps the message.
pub fn view_array<'py>(
    py: Python<'py>,
    message: KeptMessage,
    start: usize,
    (count, number): (usize, NumberType),
) -> PyResult<Bound<'py, PyAny>> {
    static AS_ARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let as_array =
        AS_ARRAY.get_or_try_init(py, || import_numpy(py)?.getattr("asarray").map(Bound::unbind))?;
    let received = Py::new(py, ReceivedArray { message, start, count, number })?;
    as_array.bind(py).call1((received,))
}

/// Whether numpy has converted numbers that do not fit: whole ones to others, or finite ones to infinity.
fn loses_numbers(
    numpy: &Bound<'_, PyModule>,
    number: NumberType,
    array: &Bound<'_, PyAny>,
    converted: &Bound<'_, PyAny>,
) -> PyResult<bool> {
    if !number.name.starts_with('f') {
        return Ok(!numpy.call_method1("array_equal", (array, converted))?.extract()?);
    }
    let are_equal = numpy.call_method1(
        "array_equal",
        (numpy.call_method1("isinf", (array,))?, numpy.call_method1("isinf", (converted,))?),
    )?;
    Ok(!are_equal.extract()?)
}

/// Refuses an array of which some numbers are masked: the memory has numbers there that are not meant.
fn refuse_masked(value: &Bound<'_, PyAny>) -> PyResult<()> {
    if value.get_type().name()? != "MaskedArray" {
        return Ok(());
    }
    let numpy = import_numpy(value.py())?;
    let mask = numpy.getattr("ma")?.call_method1("getmaskarray", (value,))?;
    if mask.call_method0("any")?.extract()? {
        let why = "some numbers of the array are masked; give them a value: array.filled(0)";
        return Err(PyTypeError::new_err(why));
    }
    Ok(())
}

/// The memory of an array that is sent.
pub struct ContiguousArray<'py> {
    /// Keeps the memory.
    _owner: Bound<'py, PyAny>,
    address: usize,
    len: usize,
}

impl<'py> ContiguousArray<'py> {
    /// The memory of `bytes`.
    pub fn of_bytes(bytes: &Bound<'py, PyBytes>) -> Self {
        let memory = bytes.as_bytes();
        let (address, len) = (memory.as_ptr().expose_provenance(), memory.len());
        Self { _owner: bytes.clone().into_any(), address, len }
    }

    /// The memory of an array of these numbers, of any shape, in the order of C; a copy if `value` has
    /// another order, or another type from which numpy converts without losing whole numbers.
    ///
    /// # Errors
    /// `TypeError` if it is no array of such numbers.
    pub fn of_array(value: &Bound<'py, PyAny>, number: NumberType) -> PyResult<Self> {
        let py = value.py();
        refuse_masked(value)?;
        if let Some(same) = Self::of_interface(value, number)? {
            return Ok(same);
        }
        let numpy = import_numpy(py)?;
        let array = numpy.call_method1("asarray", (value,))?;
        let options = PyDict::new(py);
        options.set_item("order", "C")?;
        options.set_item("casting", "same_kind")?;
        let refuse = |of: &Bound<'py, PyAny>| {
            let dtype = of.getattr("dtype").map(|dtype| dtype.to_string());
            let (dtype, name) = (dtype.unwrap_or_default(), number.name);
            let why = format!("an array of {dtype} is no array of {name}; convert it with astype");
            PyTypeError::new_err(why)
        };
        let converted = array.call_method("astype", (number.typestr,), Some(&options));
        let converted = converted.map_err(|_| refuse(&array))?;
        if loses_numbers(numpy, number, &array, &converted)? {
            let name = number.name;
            return Err(PyTypeError::new_err(format!(
                "a number of the array is out of range for {name}"
            )));
        }
        let converted = Self::of_interface(&converted, number)?;
        converted.ok_or_else(|| PyTypeError::new_err("an array without memory of its own"))
    }

    /// The memory of `value`, if it is an array of exactly this type and order.
    fn of_interface(value: &Bound<'py, PyAny>, number: NumberType) -> PyResult<Option<Self>> {
        let Some(interface) = value.getattr_opt("__array_interface__")? else { return Ok(None) };
        let typestr: String = interface.get_item("typestr")?.extract()?;
        let strides = interface.get_item("strides").ok().filter(|strides| !strides.is_none());
        if typestr != number.typestr || strides.is_some() {
            return Ok(None);
        }
        let shape = interface.get_item("shape")?.cast_into::<PyTuple>()?;
        let mut count = 1_usize;
        for size in &shape {
            let size: usize = size.extract()?;
            count = count.checked_mul(size).ok_or_else(|| PyTypeError::new_err("its shape"))?;
        }
        let len = count.checked_mul(number.len);
        let len = len.ok_or_else(|| PyTypeError::new_err("an array that exceeds the memory"))?;
        let (address, _): (usize, bool) = interface.get_item("data")?.extract()?;
        Ok(Some(Self { _owner: value.clone(), address, len }))
    }

    /// The bytes of its numbers.
    pub fn bytes(&self) -> &[u8] {
        if self.len == 0 {
            return &[];
        }
        // SAFETY: `address` is where `_owner` has its data: `len` initialised bytes that exist for as
        // long as it does, and it exists for as long as the borrow of `self`. `bytes` of Python never
        // change. An array of numpy is neither moved nor resized while it is referred to (numpy refuses
        // `resize` then). The documentation of `send_data` requires that no other thread writes to an
        // array while it is sent; one that does sends a mixture of both contents.
        #[allow(unsafe_code)]
        unsafe {
            std::slice::from_raw_parts(std::ptr::with_exposed_provenance(self.address), self.len)
        }
    }
}
