//! Where data come from, as `data_received` gets it.

use std::borrow::Cow;

use armor_sdk::tap::TapData;
use pyo3::prelude::*;
use pyo3::types::PyString;

/// Where data come from, when they were created, and what is missing before them.
#[pyclass(name = "Header", module = "armor", frozen)]
pub struct PythonHeader {
    /// Local name of the input.
    #[pyo3(get)]
    id: Py<PyString>,
    /// System-wide name of the data, `component.output`.
    #[pyo3(get)]
    data: Py<PyString>,
    /// Counts what the output has published, from 0.
    #[pyo3(get)]
    sequence: u64,
    /// When the data were created: system time in seconds.
    #[pyo3(get)]
    stamp_s: f64,
    /// Process start that published them.
    #[pyo3(get)]
    instance: u64,
    /// The number of messages that were lost immediately before them.
    #[pyo3(get)]
    lost: u64,
}

impl PythonHeader {
    /// The header of a message that a tool has received from `data`.
    pub fn of_tap(py: Python<'_>, data: &str, message: &TapData) -> PyResult<Py<Self>> {
        let header = &message.header;
        let name = PyString::new(py, data).unbind();
        let of_message = Self {
            id: name.clone_ref(py),
            data: name,
            sequence: header.sequence,
            stamp_s: header.stamp_s,
            instance: header.instance,
            lost: message.lost,
        };
        Py::new(py, of_message)
    }
}

impl PythonHeader {
    /// The local name of the input, and the system-wide name of the data.
    pub fn names<'a>(&'a self, py: Python<'a>) -> PyResult<(Cow<'a, str>, Cow<'a, str>)> {
        Ok((self.id.to_cow(py)?, self.data.to_cow(py)?))
    }
}

#[pymethods]
impl PythonHeader {
    fn __repr__(&self) -> String {
        let Self { id, data, sequence, stamp_s, lost, .. } = self;
        format!("Header(id={id}, data={data}, sequence={sequence}, stamp_s={stamp_s}, lost={lost})")
    }
}

/// The names of the inputs and of their data as Python texts, made once for each.
#[derive(Default)]
pub struct HeaderNames(Vec<(String, String, Py<PyString>, Py<PyString>)>);

impl HeaderNames {
    /// Most sources whose names are kept; an input with more makes them again.
    const MOST: usize = 256;

    /// The header as a Python object.
    pub fn wrap(
        &mut self,
        py: Python<'_>,
        header: &armor_sdk::Header<'_>,
    ) -> PyResult<Py<PythonHeader>> {
        let is_it = |known: &&(String, String, Py<PyString>, Py<PyString>)| {
            known.0 == header.id() && known.1 == header.data()
        };
        let (id, data) = match self.0.iter().find(is_it) {
            Some((_, _, id, data)) => (id.clone_ref(py), data.clone_ref(py)),
            None => {
                let (id, data) = (PyString::new(py, header.id()), PyString::new(py, header.data()));
                let (id, data) = (id.unbind(), data.unbind());
                if self.0.len() < Self::MOST {
                    let kept = (id.clone_ref(py), data.clone_ref(py));
                    self.0.push((header.id().into(), header.data().into(), kept.0, kept.1));
                }
                (id, data)
            }
        };
        Py::new(
            py,
            PythonHeader {
                id,
                data,
                sequence: header.sequence,
                stamp_s: header.stamp_s,
                instance: header.instance,
                lost: header.lost,
            },
        )
    }
}
