//! A component under test in the test's own process: no socket, no thread, time by hand.

use std::time::Duration;

use armor_sdk::testing::{ReportKind, RunState, TestedComponent};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::component::PythonComponent;
use crate::declaration::ClassDeclaration;
use crate::decode::MessageReader;
use crate::encode::EncodedMessage;
use crate::fault::{TestError, in_python_words};
use crate::handle::Handle;
use crate::layout::Layout;
use armor_sdk::foreign::KeptMessage;

/// See the module.
#[pyclass(module = "armor._armor", unsendable)]
pub struct Tested {
    tested: TestedComponent,
    handle: Py<Handle>,
    /// Those of the messages that were sent: what is passed on is read as one of them.
    sent: Vec<Py<Layout>>,
}

fn explain(error: armor_sdk::testing::TestError) -> PyErr {
    TestError::new_err(in_python_words(&error.to_string()))
}

fn duration(seconds: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(seconds)
        .map_err(|_| PyValueError::new_err(format!("{seconds} s cannot pass")))
}

#[pymethods]
impl Tested {
    #[new]
    fn new(
        py: Python<'_>,
        declaration: ClassDeclaration,
        constructor: Py<PyAny>,
        parameters: Vec<(String, String)>,
    ) -> PyResult<Self> {
        let kind = declaration.into_kind()?;
        let given: Vec<_> =
            parameters.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
        let mut handle = None;
        let tested = TestedComponent::build_foreign(&kind, &given, |armor| {
            let component = PythonComponent::construct(py, &kind, &constructor, armor)?;
            handle = Some(component.handle().clone_ref(py));
            Ok(Box::new(component))
        });
        let tested = tested.map_err(explain)?;
        let handle = handle.ok_or_else(|| TestError::new_err("it has no handle"))?;
        Ok(Self { tested, handle, sent: Vec::new() })
    }

    fn execute_on_data(&mut self) {
        self.tested.execute_on_data();
    }

    fn start(&mut self) -> PyResult<()> {
        self.tested.start().map_err(explain)
    }

    fn stop(&mut self) -> PyResult<()> {
        self.tested.stop().map_err(explain)
    }

    fn tick_after(&mut self, seconds: f64) -> PyResult<()> {
        self.tested.tick_after(duration(seconds)?).map_err(explain)
    }

    fn pass_time(&mut self, seconds: f64) -> PyResult<()> {
        self.tested.pass_time(duration(seconds)?);
        Ok(())
    }

    fn timestamp(&self) -> f64 {
        self.tested.timestamp()
    }

    fn link_from(&mut self, input: &str, source: &str) -> PyResult<()> {
        self.tested.link_from(input, source).map_err(explain)
    }

    fn send(
        &mut self,
        layout: Py<Layout>,
        input: &str,
        message: &Bound<'_, PyAny>,
        source: Option<String>,
    ) -> PyResult<()> {
        if !self.sent.iter().any(|known| known.is(&layout)) {
            self.sent.push(layout.clone_ref(message.py()));
        }
        let layout = layout.get();
        let bytes = EncodedMessage::of(layout, message)?.pieces().concat();
        let sent = self.tested.send_encoded(input, source.as_deref(), &layout.port_type, &bytes);
        sent.map_err(explain)
    }

    fn set_parameter(&mut self, name: &str, text: &str) -> PyResult<()> {
        self.tested.set_parameter(name, text).map_err(explain)
    }

    fn outputs<'py>(&self, py: Python<'py>, output: &str) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let (schema, messages) = self.tested.encoded_outputs(output).map_err(explain)?;
        let layout = self.handle.get().find_output(py, output);
        let mut layout = layout.ok_or_else(|| TestError::new_err("an output without a class"))?;
        if layout.get().is_any() {
            let is_it = |sent: &&Py<Layout>| sent.get().port_type.text() == schema;
            // Without a type, nothing can have been published.
            let Some(sent) = self.sent.iter().find(is_it) else { return Ok(Vec::new()) };
            layout = sent.clone_ref(py);
        }
        let read = |bytes: Vec<u8>| {
            let keep = || KeptMessage::copy_of(&bytes);
            MessageReader::new(py, &bytes, &keep).read_all(layout.get())
        };
        messages.into_iter().map(read).collect()
    }

    /// Each report as its kind, its name or reason, and its value.
    fn reports(&self) -> Vec<(&'static str, String, f64)> {
        let tell = |report: &ReportKind| match report {
            ReportKind::Done => ("done", String::new(), 0.0),
            ReportKind::Failed { reason } => ("failed", reason.clone(), 0.0),
            ReportKind::Event { name, value } => ("event", name.clone(), *value),
        };
        self.tested.reports().iter().map(tell).collect()
    }

    fn state(&self) -> &'static str {
        match self.tested.state() {
            RunState::Starting => "starting",
            RunState::Frozen => "frozen",
            RunState::Active => "active",
            RunState::Done => "done",
            RunState::Failed => "failed",
        }
    }
}
