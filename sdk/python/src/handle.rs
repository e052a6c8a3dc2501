//! Nine of the twelve functions, for a component's instance.

use std::sync::{Arc, Mutex, MutexGuard};

use armor_sdk::foreign::ForeignArmor;
use armor_sdk::{DeclareError as RefusedPort, SendError as RefusedData};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::any::PythonAnyMessage;
use crate::encode::EncodedMessage;
use crate::fault::{ArmorError, DeclareError, SendError, in_python_words};
use crate::history::{Histories, PythonHistory};
use crate::layout::Layout;

/// The handle of one component.
#[pyclass(module = "armor._armor", frozen)]
pub struct Handle {
    armor: ForeignArmor,
    outputs: Mutex<Vec<Output>>,
    inputs: Mutex<Vec<(String, Py<Layout>)>>,
    histories: Mutex<Histories>,
}

/// An output, and the text by which the component named it last: mostly the same constant of its code,
/// which is recognised without being read.
struct Output {
    id: Arc<str>,
    named_by: Py<PyString>,
    layout: Py<Layout>,
}

impl Handle {
    /// The handle of a component that declares its ports next.
    pub fn new(armor: ForeignArmor) -> Self {
        let (outputs, inputs) = (Mutex::default(), Mutex::default());
        Self { armor, outputs, inputs, histories: Mutex::default() }
    }

    /// The histories of the inputs.
    pub fn histories(&self) -> MutexGuard<'_, Histories> {
        self.histories.lock().expect("no panic while it is locked")
    }

    /// The layout of what an input receives.
    pub fn find_input(&self, py: Python<'_>, id: &str) -> Option<Py<Layout>> {
        find_layout(&self.inputs, py, id)
    }

    /// The layout of what an output publishes.
    pub fn find_output(&self, py: Python<'_>, id: &str) -> Option<Py<Layout>> {
        let outputs = self.lock_outputs();
        let output = outputs.iter().find(|output| *output.id == *id);
        output.map(|output| output.layout.clone_ref(py))
    }

    fn lock_outputs(&self) -> MutexGuard<'_, Vec<Output>> {
        self.outputs.lock().expect("no panic while it is locked")
    }

    /// The output of this name and its layout.
    fn find_named(&self, id: &Bound<'_, PyString>) -> PyResult<Option<(Arc<str>, Py<Layout>)>> {
        let found = |output: &Output| (Arc::clone(&output.id), output.layout.clone_ref(id.py()));
        let mut outputs = self.lock_outputs();
        if let Some(output) = outputs.iter().find(|output| output.named_by.is(id)) {
            return Ok(Some(found(output)));
        }
        let text = id.to_cow()?;
        let output = outputs.iter_mut().find(|output| *output.id == *text);
        Ok(output.map(|output| {
            output.named_by = id.clone().unbind();
            found(output)
        }))
    }

    fn send_nothing(&self, id: &str) -> PyErr {
        let refused = self.armor.send_data(id, &[]);
        refused_data(refused.map(|_| ()).expect_err("the output does not exist"))
    }
}

fn find_layout(
    ports: &Mutex<Vec<(String, Py<Layout>)>>,
    py: Python<'_>,
    id: &str,
) -> Option<Py<Layout>> {
    let ports = ports.lock().expect("no panic while it is locked");
    ports.iter().find(|(port, _)| port == id).map(|(_, layout)| layout.clone_ref(py))
}

fn refused_port(error: RefusedPort) -> PyErr {
    DeclareError::new_err(in_python_words(&error.to_string()))
}

fn refused_data(error: RefusedData) -> PyErr {
    SendError::new_err(in_python_words(&error.to_string()))
}

#[pymethods]
impl Handle {
    fn provide(
        &self,
        py: Python<'_>,
        id: String,
        layout: Py<Layout>,
        latched: bool,
        doc: &str,
    ) -> PyResult<()> {
        self.armor.provide(&id, &layout.get().port_type, latched).map_err(refused_port)?;
        if !doc.is_empty() {
            self.armor.document_port(&id, doc);
        }
        let named_by = PyString::intern(py, &id).unbind();
        self.lock_outputs().push(Output { id: id.into(), named_by, layout });
        Ok(())
    }

    fn subscribe(
        &self,
        id: String,
        layout: Py<Layout>,
        required: bool,
        many: bool,
        doc: &str,
    ) -> PyResult<()> {
        let declared = self.armor.subscribe(&id, &layout.get().port_type, required, many);
        declared.map_err(refused_port)?;
        if !doc.is_empty() {
            self.armor.document_port(&id, doc);
        }
        self.inputs.lock().expect("no panic while it is locked").push((id, layout));
        Ok(())
    }

    fn provided_data(&self, id: &str) -> Option<String> {
        self.armor.provided_data(id)
    }

    fn subscribed_data(&self, id: &str) -> Option<String> {
        self.armor.subscribed_data(id)
    }

    fn get_parameter(&self, name: &str) -> PyResult<()> {
        self.armor.get_parameter(name).map_err(|fault| ArmorError::new_err(fault.to_string()))
    }

    fn synchronize(&self, py: Python<'_>) -> PyResult<()> {
        let synchronized = py.detach(|| self.armor.synchronize());
        synchronized.map_err(|fault| ArmorError::new_err(fault.to_string()))
    }

    fn send_data(
        &self,
        py: Python<'_>,
        id: &Bound<'_, PyString>,
        data: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let Some((id, layout)) = self.find_named(id)? else {
            return Err(self.send_nothing(&id.to_cow()?));
        };
        let layout = layout.get();
        if !layout.is_of_class(data)? {
            let (declared, given) = (layout.port_type.name(), data.get_type().name()?);
            return Err(PyTypeError::new_err(format!(
                "`{id}` is declared as {declared}, but a {given} is sent: send a {declared}, or \
                 declare it with `self.provide(\"{id}\", {given})` in `__init__`"
            )));
        }
        if layout.is_any() {
            let any = data.cast::<PythonAnyMessage>()?.get().message();
            let sent = py.detach(|| self.armor.send_any(&id, any));
            return sent.map(|_| ()).map_err(refused_data);
        }
        let encoded = EncodedMessage::of(layout, data)?;
        // A small message takes one system call that does not wait, and Python's lock would take as long.
        let may_wait = self.armor.may_wait(&id, encoded.count_bytes());
        let sent = encoded.send_pieces(|pieces| match may_wait {
            true => py.detach(|| self.armor.send_data(&id, pieces)),
            false => self.armor.send_data(&id, pieces),
        });
        sent.map(|_| ()).map_err(refused_data)
    }

    fn history(
        &self,
        py: Python<'_>,
        input: &str,
        source: Option<&str>,
    ) -> PyResult<PythonHistory> {
        let Some(layout) = self.find_input(py, input) else {
            let inputs = self.inputs.lock().expect("no panic while it is locked");
            let mut known: Vec<_> = inputs.iter().map(|(id, _)| id.as_str()).collect();
            if known.is_empty() {
                known.push("none");
            }
            return Err(ArmorError::new_err(format!(
                "there is no input `{input}` whose history could be read (there are: {})",
                known.join(", ")
            )));
        };
        self.histories().open(py, input, source, layout)
    }

    fn timestamp(&self) -> f64 {
        self.armor.timestamp()
    }

    fn set_non_controllable(&self) -> PyResult<()> {
        self.armor.set_non_controllable().map_err(refused_port)
    }

    fn report_thread_failure(&self, reason: String) {
        self.armor.report_thread_failure(reason);
    }
}
