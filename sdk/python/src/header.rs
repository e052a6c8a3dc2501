//! Where data come from, as `data_received` gets it.

use std::borrow::Cow;

use armor_sdk::tap::TapData;
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::layout::Layout;

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

/// A source of an input: both names, also as Python texts, and the layout of its messages.
pub struct Source {
    names: (String, String),
    in_python: (Py<PyString>, Py<PyString>),
    layout: Py<Layout>,
}

impl Source {
    fn of(py: Python<'_>, header: &armor_sdk::Header<'_>, layout: Py<Layout>) -> Self {
        let text = |name: &str| PyString::new(py, name).unbind();
        let in_python = (text(header.id()), text(header.data()));
        Self { names: (header.id().into(), header.data().into()), in_python, layout }
    }

    /// The layout of its messages.
    pub fn layout(&self) -> &Layout {
        self.layout.get()
    }

    /// The header as a Python object.
    pub fn wrap(
        &self,
        py: Python<'_>,
        header: &armor_sdk::Header<'_>,
    ) -> PyResult<Py<PythonHeader>> {
        let (id, data) = &self.in_python;
        let in_python = PythonHeader {
            id: id.clone_ref(py),
            data: data.clone_ref(py),
            sequence: header.sequence,
            stamp_s: header.stamp_s,
            instance: header.instance,
            lost: header.lost,
        };
        Py::new(py, in_python)
    }
}

/// The sources from which messages have come, found once for each.
#[derive(Default)]
pub struct Sources(Vec<Source>);

impl Sources {
    /// Most sources that are kept; another one replaces the last of them.
    const MOST: usize = 256;

    /// The source of a message, whose layout `find_layout` finds.
    pub fn find(
        &mut self,
        py: Python<'_>,
        header: &armor_sdk::Header<'_>,
        find_layout: impl FnOnce() -> PyResult<Py<Layout>>,
    ) -> PyResult<&Source> {
        let is_it = |known: &Source| known.names.0 == header.id() && known.names.1 == header.data();
        let at = match self.0.iter().position(is_it) {
            Some(at) => at,
            None => {
                self.0.truncate(Self::MOST - 1);
                self.0.push(Source::of(py, header, find_layout()?));
                self.0.len() - 1
            }
        };
        Ok(&self.0[at])
    }
}
