//! Errors in both directions: what the SDK refuses as Python exceptions, and exceptions of a component
//! as reports.

use armor_sdk::Fault;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::types::PyTraceback;

create_exception!(_armor, ArmorError, PyException, "What Armor refuses, and why.");
create_exception!(_armor, DeclareError, ArmorError, "A port that cannot be declared.");
create_exception!(_armor, SendError, ArmorError, "Data that were not published.");
create_exception!(_armor, MessageError, ArmorError, "A message or its class that is malformed.");
create_exception!(_armor, EndedError, ArmorError, "The end of what was observed, and why.");
create_exception!(_armor, TestError, ArmorError, "What a test cannot do, or why a step failed.");

/// Replaces what only a reader of Rust understands in a text of the SDK.
pub fn in_python_words(text: &str) -> String {
    let words = [
        ("`new`", "`__init__`"),
        ("Call::Stopping", "Call.STOPPING"),
        ("Call::Started", "Call.STARTED"),
        ("drop the value", "leave it out"),
        ("Outcome::Done or Outcome::Failed", "armor.DONE or armor.failed(…)"),
        (
            "print on stderr (eprintln!), or log with tracing",
            "print with file=sys.stderr, or use `logging`",
        ),
        ("call get_parameter(", "declare it as armor.parameter("),
    ];
    words.iter().fold(text.to_owned(), |text, (rust, python)| text.replace(rust, python))
}

/// An exception of a component as the reason of a failure: its type, its text, and the innermost line
/// of the component's own code. The traceback goes to the log.
pub fn explain_exception(py: Python<'_>, error: &PyErr) -> Fault {
    print_traceback(py, error);
    let name = error.get_type(py).name().map_or_else(|_| "an exception".into(), |n| n.to_string());
    let text = error.value(py).str().map(|text| text.to_string()).unwrap_or_default();
    let place = error.traceback(py).and_then(|traceback| find_place(&traceback).ok().flatten());
    let place = place.map(|place| format!(" ({place})")).unwrap_or_default();
    if text.is_empty() {
        format!("{name}{place}").into()
    } else {
        format!("{name}: {text}{place}").into()
    }
}

/// Writes the exception with its traceback to `sys.stderr`, which is the component's log.
fn print_traceback(py: Python<'_>, error: &PyErr) {
    let print = || -> PyResult<()> {
        let traceback = PyModule::import(py, "traceback")?;
        let value = error.value(py);
        traceback
            .call_method1("print_exception", (value.get_type(), value, error.traceback(py)))?;
        PyModule::import(py, "sys")?.getattr("stderr")?.call_method0("flush")?;
        Ok(())
    };
    // A closed stderr must not hide the exception itself.
    let _ = print();
}

/// The last line of the traceback outside the package, `file.py, line 12, in exec`: the component's own.
fn find_place(traceback: &Bound<'_, PyTraceback>) -> PyResult<Option<String>> {
    let py = traceback.py();
    let package: Vec<String> = PyModule::import(py, "armor")?.getattr("__path__")?.extract()?;
    let is_package =
        |file: &str| package.iter().any(|folder| file.starts_with(&format!("{folder}/")));
    let (mut place, mut own) = (None, None);
    let mut current = Some(traceback.clone().into_any());
    while let Some(at) = current {
        let code = at.getattr("tb_frame")?.getattr("f_code")?;
        let path: String = code.getattr("co_filename")?.extract()?;
        let file = path.rsplit('/').next().unwrap_or_default();
        let (line, function) = (at.getattr("tb_lineno")?, code.getattr("co_name")?);
        place = Some(format!("{file}, line {line}, in {function}"));
        if !is_package(&path) {
            own.clone_from(&place);
        }
        let next = at.getattr("tb_next")?;
        current = (!next.is_none()).then_some(next);
    }
    Ok(own.or(place))
}
