//! Values of parameters as Python has them.

use armor_sdk::wire::manifest::{ParameterManifest, ParameterType};
use armor_sdk::wire::text_format::{self, TextFormat};
use armor_sdk::{Fault, Value};
use pyo3::prelude::*;

/// The value in Python: `float` (in SI; of a ratio in its unit), `int`, `bool`, `pathlib.Path`, or
/// `str`; of a text with a format a list of points, numbers or names.
pub fn value_in_python<'py>(
    py: Python<'py>,
    declared: &ParameterManifest,
    value: &Value,
) -> Result<Bound<'py, PyAny>, Fault> {
    let object = match (declared.kind, declared.format) {
        (ParameterType::Number, _) => value.number()?.into_pyobject(py)?.into_any(),
        (ParameterType::Integer, _) => value.integer()?.into_pyobject(py)?.into_any(),
        (ParameterType::Flag, _) => value.flag()?.into_pyobject(py)?.to_owned().into_any(),
        (ParameterType::Path, _) => value.path()?.into_pyobject(py)?.into_any(),
        (_, Some(TextFormat::Points)) => {
            let points = read_list(value, text_format::parse_points)?;
            let points: Vec<(f64, f64)> = points.into_iter().map(|[x, y]| (x, y)).collect();
            points.into_pyobject(py)?.into_any()
        }
        (_, Some(TextFormat::Numbers)) => {
            read_list(value, text_format::parse_numbers)?.into_pyobject(py)?.into_any()
        }
        (_, Some(TextFormat::Names)) => {
            read_list(value, text_format::parse_names)?.into_pyobject(py)?.into_any()
        }
        _ => value.text()?.into_pyobject(py)?.into_any(),
    };
    Ok(object)
}

/// The declared default; `None` if there is none, or it is malformed, as the manifest reports.
pub fn default_value(declared: &ParameterManifest) -> Option<Value> {
    let parsed = declared.parse(declared.default.as_ref()?).ok()?;
    Some(Value::new(parsed, "".as_ref()))
}

fn read_list<T, E: std::error::Error + Send + Sync + 'static>(
    value: &Value,
    parse: fn(&str) -> Result<Vec<T>, E>,
) -> Result<Vec<T>, Fault> {
    let text = value.text()?;
    if text.is_empty() { Ok(Vec::new()) } else { Ok(parse(text)?) }
}
