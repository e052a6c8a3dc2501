//! What a component's class declares, as the package hands it over.

use armor_sdk::foreign::KindDeclaration;
use armor_sdk::wire::manifest::{
    EventManifest, EventValue, ParameterManifest, ParameterType, PortFrame,
};
use armor_sdk::wire::text_format::TextFormat;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::outcome::DeclaredReports;

/// What a constructor may not do.
const CONSTRUCTOR_RULE: &str = "`__init__` runs for --describe too and opens no hardware or files: do \
                                that in exec at armor.Call.STARTED";

/// A parameter, from the attributes of the package's declaration.
#[derive(FromPyObject)]
struct ParameterDeclaration {
    name: String,
    kind: String,
    unit: String,
    default: Option<String>,
    minimum: Option<f64>,
    maximum: Option<f64>,
    choices: Vec<String>,
    format: Option<String>,
    doc: String,
    live: bool,
    written: bool,
}

/// An event as its class declares it.
#[derive(FromPyObject)]
struct EventDeclaration {
    name: String,
    doc: String,
    value: Option<String>,
    unit: String,
    named_by: String,
}

/// A class of components as it declares itself.
#[derive(FromPyObject)]
pub struct ClassDeclaration {
    kind: String,
    summary: String,
    parameters: Vec<ParameterDeclaration>,
    events: Vec<EventDeclaration>,
    reports_done: bool,
    ends_by_itself: bool,
    needs_rate: bool,
    reads_all: bool,
    needs_one_of: Vec<Vec<String>>,
    stale_after: Vec<(String, String)>,
    frames: Vec<(String, String)>,
}

impl ClassDeclaration {
    /// The declaration of the kind.
    ///
    /// # Errors
    /// `ValueError` if a type or a format is not one of those that exist.
    pub fn into_kind(self) -> PyResult<KindDeclaration> {
        let parameters = self.parameters.into_iter().map(ParameterDeclaration::into_manifest);
        let events = self.events.into_iter().map(EventDeclaration::into_manifest);
        let frames = self.frames.into_iter();
        Ok(KindDeclaration {
            parameters: parameters.collect::<PyResult<_>>()?,
            events: events.collect::<PyResult<_>>()?,
            reports_done: self.reports_done,
            ends_by_itself: self.ends_by_itself,
            needs_rate: self.needs_rate,
            reads_all: self.reads_all,
            needs_one_of: self.needs_one_of,
            stale_after: self.stale_after,
            frames: frames.map(|(port, parameter)| PortFrame { port, parameter }).collect(),
            // Without it, Python makes a state for the thread at each call, and removes it again.
            thread_scope: |work| Python::attach(|py| py.detach(work)),
            constructor_rule: CONSTRUCTOR_RULE,
            ..KindDeclaration::new(&self.kind, &self.summary)
        })
    }
}

/// What `exec` may return, of a kind.
pub fn declared_reports(kind: &KindDeclaration) -> DeclaredReports {
    DeclaredReports {
        events: kind.events.iter().map(|event| event.name.clone()).collect(),
        has_named_events: kind.events.iter().any(|event| !event.named_by.is_empty()),
        reports_done: kind.reports_done,
    }
}

impl ParameterDeclaration {
    fn into_manifest(self) -> PyResult<ParameterManifest> {
        let kind = ParameterType::ALL.into_iter().find(|kind| kind.to_string() == self.kind);
        let kind = kind.ok_or_else(|| {
            PyValueError::new_err(format!("parameter `{}`: no type `{}`", self.name, self.kind))
        })?;
        let format = match &self.format {
            None => None,
            Some(name) => Some(TextFormat::named(name).ok_or_else(|| {
                let known = TextFormat::ALL.map(TextFormat::name).join(", ");
                let why = format!("parameter `{}`: no format `{name}`, only: {known}", self.name);
                PyValueError::new_err(why)
            })?),
        };
        Ok(ParameterManifest {
            name: self.name,
            kind,
            unit: self.unit,
            default: self.default,
            minimum: self.minimum,
            maximum: self.maximum,
            choices: self.choices,
            format,
            doc: self.doc,
            live: self.live,
            written: self.written,
        })
    }
}

impl EventDeclaration {
    fn into_manifest(self) -> PyResult<EventManifest> {
        let value = match self.value.as_deref() {
            None => None,
            Some("number") => Some(EventValue::Number),
            Some("integer") => Some(EventValue::Integer),
            Some(other) => {
                let why = format!("event `{}`: its value is float or int, not {other}", self.name);
                return Err(PyValueError::new_err(why));
            }
        };
        let Self { name, doc, unit, named_by, .. } = self;
        Ok(EventManifest { name, doc, value, unit, named_by })
    }
}
