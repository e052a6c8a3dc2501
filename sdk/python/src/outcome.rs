//! Why `exec` is called, and what it returns.

use armor_sdk::Fault;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Why `exec` is called.
#[pyclass(name = "Call", module = "armor", frozen, eq, eq_int, hash, skip_from_py_object)]
#[derive(Clone, Copy, Debug, Hash, PartialEq, Eq)]
pub enum PythonCall {
    /// The component has been activated.
    #[pyo3(name = "STARTED")]
    Started,
    /// Its period is over.
    #[pyo3(name = "TICK")]
    Tick,
    /// It has received data, and the file gives it no rate.
    #[pyo3(name = "DATA")]
    Data,
    /// The last call before it is frozen or ended: bring actuators to rest.
    #[pyo3(name = "STOPPING")]
    Stopping,
}

/// The members of `armor.Call`, found once.
pub struct CallsInPython([Py<PyAny>; 4]);

impl CallsInPython {
    /// Finds them.
    pub fn find(py: Python<'_>) -> PyResult<Self> {
        let class = py.get_type::<PythonCall>();
        let member = |name: &str| class.getattr(name).map(Bound::unbind);
        Ok(Self([member("STARTED")?, member("TICK")?, member("DATA")?, member("STOPPING")?]))
    }

    /// The one for a call.
    pub fn bind<'py>(&self, py: Python<'py>, call: armor_sdk::Call) -> &Bound<'py, PyAny> {
        let Self([started, tick, data, stopping]) = self;
        let member = match call {
            armor_sdk::Call::Started => started,
            armor_sdk::Call::Tick => tick,
            armor_sdk::Call::Data => data,
            armor_sdk::Call::Stopping => stopping,
        };
        member.bind(py)
    }
}

/// What `exec` returns: `armor.CARRY_ON`, `armor.DONE`, `armor.failed("why")` or
/// `armor.event("name", value)`. `None` is `armor.CARRY_ON`.
#[pyclass(name = "Outcome", module = "armor", frozen, eq, skip_from_py_object)]
#[derive(Clone, Debug, PartialEq)]
pub struct PythonOutcome(armor_sdk::Outcome);

#[pymethods]
impl PythonOutcome {
    /// Nothing to report.
    #[staticmethod]
    fn carry_on() -> Self {
        Self(armor_sdk::Outcome::CarryOn)
    }

    /// The task is over; no more calls in this activation, except `Call.STOPPING`.
    #[staticmethod]
    fn done() -> Self {
        Self(armor_sdk::Outcome::Done)
    }

    /// The task cannot be done, and why.
    #[staticmethod]
    fn failed(reason: String) -> Self {
        Self(armor_sdk::Outcome::Failed(reason))
    }

    /// Something happened that the mission may wait for.
    #[staticmethod]
    #[pyo3(signature = (name, value=1.0))]
    fn event(name: String, value: f64) -> Self {
        Self(armor_sdk::Outcome::Event { name, value })
    }

    fn __repr__(&self) -> String {
        match &self.0 {
            armor_sdk::Outcome::CarryOn => "armor.CARRY_ON".into(),
            armor_sdk::Outcome::Done => "armor.DONE".into(),
            armor_sdk::Outcome::Failed(reason) => format!("armor.failed({reason:?})"),
            armor_sdk::Outcome::Event { name, value } => format!("armor.event({name:?}, {value})"),
        }
    }
}

/// What a component declares about its reports.
#[derive(Clone, Debug, Default)]
pub struct DeclaredReports {
    /// The names of its events.
    pub events: Vec<String>,
    /// A text parameter names further ones.
    pub has_named_events: bool,
    /// It may report that it is done.
    pub reports_done: bool,
}

impl DeclaredReports {
    /// Reads what `exec` has returned.
    ///
    /// # Errors
    /// If it is no outcome, or one that the component does not declare.
    pub fn read_outcome(&self, returned: &Bound<'_, PyAny>) -> PyResult<armor_sdk::Outcome> {
        if returned.is_none() {
            return Ok(armor_sdk::Outcome::CarryOn);
        }
        let Ok(outcome) = returned.cast::<PythonOutcome>() else {
            let given = returned.get_type().name()?;
            return Err(PyValueError::new_err(format!(
                "exec returned a value of type {given}; return None, armor.CARRY_ON, armor.DONE, \
                 armor.failed(\"why\") or armor.event(\"name\", value)"
            )));
        };
        let outcome = outcome.get().0.clone();
        self.check(&outcome).map_err(|why| PyValueError::new_err(why.to_string()))?;
        Ok(outcome)
    }

    fn check(&self, outcome: &armor_sdk::Outcome) -> Result<(), Fault> {
        match outcome {
            armor_sdk::Outcome::Done if !self.reports_done => {
                Err("it is done, but its class has `reports_done = False`; remove that line".into())
            }
            armor_sdk::Outcome::Event { name, .. }
                if !self.has_named_events && !self.events.contains(name) =>
            {
                let declared = match self.events.as_slice() {
                    [] => "its class declares none".into(),
                    events => format!("only: {}", events.join(", ")),
                };
                Err(format!(
                    "the event `{name}` is not declared, {declared}; add \
                     armor.DeclaredEvent(\"{name}\") to `events` of the class"
                )
                .into())
            }
            _ => Ok(()),
        }
    }
}
