//! A component whose three functions are methods of a Python object.

use std::ffi::OsString;
use std::sync::atomic::{AtomicBool, Ordering};

use armor_sdk::foreign::{self, ForeignArmor, ForeignComponent, KindDeclaration};
use armor_sdk::wire::manifest::ParameterManifest;
use armor_sdk::{AnyMessage, Data, Fault, Value};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::any::PythonAnyMessage;
use crate::declaration::{ClassDeclaration, declared_reports};
use crate::decode::MessageReader;
use crate::fault::{ArmorError, explain_exception, in_python_words};
use crate::handle::Handle;
use crate::header::Sources;
use crate::outcome::{CallsInPython, DeclaredReports};
use crate::values::{default_value, value_in_python};

/// See the module.
pub struct PythonComponent {
    handle: Py<Handle>,
    data_received: Py<PyAny>,
    parameter_received: Py<PyAny>,
    /// `None` if its class does not define it.
    exec: Option<Py<PyAny>>,
    calls: CallsInPython,
    parameters: Vec<ParameterManifest>,
    reports: DeclaredReports,
    sources: Sources,
}

impl PythonComponent {
    /// Requests the parameters, then calls `constructor` with the handle and their values; it returns
    /// the component's instance.
    ///
    /// # Errors
    /// What the constructor raises, or a parameter without a value.
    pub fn construct(
        py: Python<'_>,
        kind: &KindDeclaration,
        constructor: &Py<PyAny>,
        armor: ForeignArmor,
    ) -> Result<Self, Fault> {
        for parameter in &kind.parameters {
            armor.get_parameter(&parameter.name)?;
        }
        py.detach(|| armor.synchronize())?;
        let values = PyDict::new(py);
        for parameter in &kind.parameters {
            let arrived = armor.find_arrived(&parameter.name);
            if let Some(value) = arrived.or_else(|| default_value(parameter)) {
                // Refused again, and reported, in `parameter_received`.
                let Ok(value) = value_in_python(py, parameter, &value) else { continue };
                values.set_item(&parameter.name, value)?;
            }
        }
        let handle = Py::new(py, Handle::new(armor))?;
        let construct = || -> PyResult<_> {
            let instance = constructor.bind(py).call1((&handle, values))?;
            // For --describe, what is printed must not come after the manifest.
            PyModule::import(py, "sys")?.getattr("stdout")?.call_method0("flush")?;
            let method = |name: &str| instance.getattr(name).map(Bound::unbind);
            let exec = instance.getattr("exec")?;
            let exec = (!is_inherited(&exec, "exec")?).then(|| exec.unbind());
            Ok((method("data_received")?, method("_take_parameter")?, exec))
        };
        let (data_received, parameter_received, exec) =
            construct().map_err(|error| explain_exception(py, &error))?;
        Ok(Self {
            handle,
            data_received,
            parameter_received,
            exec,
            calls: CallsInPython::find(py).map_err(|error| explain_exception(py, &error))?,
            parameters: kind.parameters.clone(),
            reports: declared_reports(kind),
            sources: Sources::default(),
        })
    }

    /// Its handle.
    pub fn handle(&self) -> &Py<Handle> {
        &self.handle
    }

    fn receive(
        &mut self,
        py: Python<'_>,
        header: &armor_sdk::Header<'_>,
        data: &Data<'_>,
    ) -> Result<(), Fault> {
        let mut receive = || -> PyResult<()> {
            let handle = self.handle.get();
            let source = self.sources.find(py, header, || {
                let layout = handle.find_input(py, header.id());
                layout.ok_or_else(|| ArmorError::new_err("an unknown input"))
            })?;
            let message = if source.layout().is_any() {
                let message = AnyMessage::received(header, data);
                let message = message.map_err(|error| ArmorError::new_err(error.to_string()))?;
                Bound::new(py, PythonAnyMessage::new(message))?.into_any()
            } else {
                let keep = || data.keep();
                MessageReader::new(py, data.bytes(), &keep).read_all(source.layout())?
            };
            let in_python = source.wrap(py, header)?;
            handle.histories().add_message(header, data, &in_python, py);
            self.data_received.bind(py).call1((in_python, message))?;
            Ok(())
        };
        let received = receive();
        self.handle.get().histories().end_message();
        end_fork(py, "data_received", &received)?;
        received.map_err(|error| explain_exception(py, &error))
    }

    fn execute(&self, py: Python<'_>, call: armor_sdk::Call) -> Result<armor_sdk::Outcome, Fault> {
        let Some(exec) = &self.exec else { return Ok(armor_sdk::Outcome::CarryOn) };
        let returned = exec.bind(py).call1((self.calls.bind(py, call),));
        end_fork(py, "exec", &returned)?;
        let outcome = returned.and_then(|returned| self.reports.read_outcome(&returned));
        outcome.map_err(|error| explain_exception(py, &error))
    }
}

/// Whether a method of an instance is that of `armor.Component`.
fn is_inherited(method: &Bound<'_, PyAny>, name: &str) -> PyResult<bool> {
    let base = PyModule::import(method.py(), "armor._component")?.getattr("Component")?;
    // A function that is set on the instance is no method.
    Ok(method
        .getattr_opt("__func__")?
        .is_some_and(|it| base.getattr(name).is_ok_and(|own| it.is(&own))))
}

impl ForeignComponent for PythonComponent {
    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Python::attach(|py| {
            let declared = self.parameters.iter().find(|parameter| parameter.name == name);
            let declared = declared.ok_or_else(|| format!("there is no parameter `{name}`"))?;
            let value = value_in_python(py, declared, value)?;
            let taken = self.parameter_received.bind(py).call1((name, value));
            end_fork(py, "parameter_received", &taken)?;
            taken.map(|_| ()).map_err(|error| explain_exception(py, &error))
        })
    }

    fn data_received(
        &mut self,
        header: &armor_sdk::Header<'_>,
        data: &Data<'_>,
    ) -> Result<(), Fault> {
        Python::attach(|py| self.receive(py, header, data))
    }

    fn exec(&mut self, call: armor_sdk::Call) -> Result<armor_sdk::Outcome, Fault> {
        if call == armor_sdk::Call::Started {
            self.handle.get().histories().clear();
        }
        if self.exec.is_none() {
            return Ok(armor_sdk::Outcome::CarryOn);
        }
        Python::attach(|py| self.execute(py, call))
    }

    fn data_received_then_exec(
        &mut self,
        header: &armor_sdk::Header<'_>,
        data: &Data<'_>,
        enter_exec: &dyn Fn(),
    ) -> Result<armor_sdk::Outcome, Fault> {
        Python::attach(|py| {
            self.receive(py, header, data)?;
            enter_exec();
            self.execute(py, armor_sdk::Call::Data)
        })
    }
}

/// Whether this process is a fork of the component's: it has the connections of the component, but not its
/// threads.
static IS_FORK: AtomicBool = AtomicBool::new(false);

/// Notes that this process is a fork of the component's.
#[pyfunction]
pub fn mark_fork() {
    IS_FORK.store(true, Ordering::Relaxed);
}

/// Ends this process if it is a fork of the component's that comes back from the component's code: it must
/// not continue as the component, which the process that it is from is.
fn end_fork<T>(py: Python<'_>, function: &str, returned: &PyResult<T>) -> PyResult<()> {
    if IS_FORK.load(Ordering::Relaxed) {
        let error = returned.as_ref().err().map(|error| error.value(py));
        PyModule::import(py, "armor._component")?.call_method1("_end_fork", (function, error))?;
    }
    Ok(())
}

/// Runs a component as this process. Returns the exit code of the process.
#[pyfunction]
pub fn run(
    py: Python<'_>,
    declaration: ClassDeclaration,
    constructor: Py<PyAny>,
    arguments: Vec<OsString>,
) -> PyResult<u8> {
    let kind = declaration.into_kind()?;
    Ok(py.detach(|| {
        foreign::run(&kind, arguments, |armor| {
            Python::attach(|py| {
                let component = PythonComponent::construct(py, &kind, &constructor, armor)?;
                Ok(Box::new(component) as Box<dyn ForeignComponent>)
            })
        })
    }))
}

/// The manifest of a component, as JSON.
#[pyfunction]
pub fn manifest(
    py: Python<'_>,
    declaration: ClassDeclaration,
    constructor: Py<PyAny>,
) -> PyResult<String> {
    let kind = declaration.into_kind()?;
    let manifest = foreign::manifest_of(&kind, |armor| {
        let component = PythonComponent::construct(py, &kind, &constructor, armor)?;
        Ok(Box::new(component))
    });
    let text = manifest.and_then(|manifest| Ok(serde_json::to_string_pretty(&manifest)?));
    text.map_err(|fault| ArmorError::new_err(in_python_words(&fault.to_string())))
}

/// Writes a line to the log of the process; `level` as in `logging`.
#[pyfunction]
pub fn log(level: u32, text: &str) {
    match level {
        40.. => tracing::error!(target: "python", "{text}"),
        30..40 => tracing::warn!(target: "python", "{text}"),
        20..30 => tracing::info!(target: "python", "{text}"),
        10..20 => tracing::debug!(target: "python", "{text}"),
        _ => tracing::trace!(target: "python", "{text}"),
    }
}
