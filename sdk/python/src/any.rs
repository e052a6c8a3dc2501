//! Messages of any type, which a component passes on and does not read.

use armor_sdk::AnyMessage;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// A message as it has arrived: `send_data` passes it on with its bytes and its stamp unchanged.
#[pyclass(name = "AnyMessage", module = "armor", frozen)]
pub struct PythonAnyMessage(AnyMessage);

impl PythonAnyMessage {
    /// The message in Python.
    pub fn new(message: AnyMessage) -> Self {
        Self(message)
    }

    /// The message.
    pub fn message(&self) -> &AnyMessage {
        &self.0
    }
}

#[pymethods]
impl PythonAnyMessage {
    /// The name of its type.
    #[getter]
    fn type_name(&self) -> &str {
        self.0.type_name()
    }

    /// The schema of its type, as `armor.schema_of` returns it.
    #[getter]
    fn schema(&self) -> &str {
        self.0.schema()
    }

    /// When it was created: system time in seconds.
    #[getter]
    fn stamp_s(&self) -> f64 {
        self.0.stamp_s()
    }

    /// A copy of its bytes, for `armor.decode`.
    fn __bytes__<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.0.bytes())
    }

    fn __len__(&self) -> usize {
        self.0.bytes().len()
    }

    fn __repr__(&self) -> String {
        let (type_name, len) = (self.0.type_name(), self.0.bytes().len());
        format!("AnyMessage(type_name={type_name}, {len} bytes, stamp_s={})", self.0.stamp_s())
    }
}
