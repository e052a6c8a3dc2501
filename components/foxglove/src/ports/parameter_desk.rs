//! The parameters of all components, as viewers see and set them. Those that are paths are neither
//! shown nor set. Blocking: configd answers within seconds.

use std::time::Duration;

use armor_sdk::configuration::{ConfigdConnection, Questions, SetOutcome};
use armor_sdk::directory::Directory;
use armor_wire::config::ListedParameter;
use armor_wire::manifest::ParameterType;
use serde_json::{Value, json};

use crate::viewer_protocol::ParameterChange;

/// Time within which the registry and configd must answer.
const FOUND_WITHIN: Duration = Duration::from_secs(3);
/// How this process names itself to configd.
const FROM: &str = "foxglove";

/// Lists all parameters but paths.
///
/// # Errors
/// In words, if configd does not answer.
pub(super) fn list_parameters(directory: &Directory) -> Result<Vec<ListedParameter>, String> {
    let list = connect(directory)?.parameters(None).map_err(|error| error.to_string())?;
    let mut parameters = list.parameters;
    parameters.retain(|parameter| parameter.kind.0 != Some(ParameterType::Path));
    Ok(parameters)
}

/// Sets parameters, one after the other.
///
/// # Errors
/// In words, what was not set.
pub(super) fn set_parameters(
    directory: &Directory,
    changes: &[ParameterChange],
) -> Result<(), String> {
    let listed = list_parameters(directory)?;
    let mut configd = connect(directory)?;
    let mut faults = Vec::new();
    for change in changes {
        if let Err(fault) = set_parameter(&mut configd, &listed, change) {
            faults.push(format!("{}: {fault}", change.name.escape_default()));
        }
    }
    if faults.is_empty() { Ok(()) } else { Err(faults.join("; ")) }
}

fn connect(directory: &Directory) -> Result<ConfigdConnection, String> {
    let from = format!("{FROM}-{}", std::process::id());
    ConfigdConnection::open(directory, &from, FOUND_WITHIN).map_err(|error| error.to_string())
}

fn set_parameter(
    configd: &mut ConfigdConnection,
    listed: &[ListedParameter],
    change: &ParameterChange,
) -> Result<(), String> {
    let known = listed.iter().find(|listed| name_parameter(listed) == change.name);
    let known = known.ok_or(
        "there is no such parameter, or it is a path, which is set in the file only: write \
         COMPONENT.PARAMETER",
    )?;
    let text = change.value.as_ref().filter(|value| !value.is_null());
    let text = text.map(|value| write_value(known, value)).transpose()?;
    let set = configd.set(&known.component, &known.name, text.as_deref());
    match set.map_err(|error| error.to_string())? {
        SetOutcome::Set { .. } => Ok(()),
        SetOutcome::Rejected { text, findings, .. } => {
            let found = findings.first().map(|it| format!(": {} {}", it.message, it.remedy));
            Err(text + &found.unwrap_or_default())
        }
    }
}

/// Returns the name of a parameter for viewers.
pub(super) fn name_parameter(parameter: &ListedParameter) -> String {
    format!("{}.{}", parameter.component, parameter.name)
}

/// Returns a parameter as viewers read it: a number is in its unit.
pub(super) fn describe_parameter(parameter: &ListedParameter) -> Value {
    let name = name_parameter(parameter);
    let text = parameter.value.as_str();
    match parameter.kind.0 {
        Some(ParameterType::Number) => {
            let bare = text.strip_suffix(parameter.unit.as_str()).unwrap_or(text).trim_end();
            match bare.parse::<f64>().ok().filter(|number| number.is_finite()) {
                Some(number) => json!({"name": name, "value": number, "type": "float64"}),
                // Written in another unit: shown as it is written.
                None => json!({"name": name, "value": text}),
            }
        }
        Some(ParameterType::Integer) => match text.parse::<i64>() {
            Ok(number) => json!({"name": name, "value": number}),
            Err(_) => json!({"name": name, "value": text}),
        },
        Some(ParameterType::Flag) => json!({"name": name, "value": text == "true"}),
        _ => json!({"name": name, "value": text}),
    }
}

/// Returns a value as the file has it.
fn write_value(parameter: &ListedParameter, value: &Value) -> Result<String, String> {
    match value {
        Value::Bool(flag) => Ok(flag.to_string()),
        Value::String(text) => Ok(text.clone()),
        Value::Number(number) if parameter.kind.0 == Some(ParameterType::Integer) => {
            // Some viewers write every number with a fraction.
            let whole = number.as_f64().filter(|number| number.fract() == 0.0);
            whole.map(|whole| format!("{whole:.0}")).ok_or_else(|| format!("{number} is not whole"))
        }
        Value::Number(number) => Ok(format!("{number}{}", parameter.unit)),
        Value::Null | Value::Array(_) | Value::Object(_) => {
            Err("a value is a number, a text, true or false".into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_wire::config::ListedType;

    fn parameter(kind: ParameterType, value: &str, unit: &str) -> ListedParameter {
        ListedParameter {
            component: "driver".into(),
            name: "speed".into(),
            kind: ListedType(Some(kind)),
            value: value.into(),
            unit: unit.into(),
            ..ListedParameter::default()
        }
    }

    #[test]
    fn numbers_are_shown_in_their_unit_and_written_with_it() {
        let show = |kind, value, unit| describe_parameter(&parameter(kind, value, unit));
        let speed = show(ParameterType::Number, "0.9m/s", "m/s");
        assert_eq!(speed, json!({"name": "driver.speed", "value": 0.9, "type": "float64"}));
        assert_eq!(show(ParameterType::Number, "3", "m/s")["value"], 3.0);
        assert_eq!(show(ParameterType::Number, "90cm/s", "m/s")["value"], "90cm/s");
        assert_eq!(show(ParameterType::Integer, "-5", "")["value"], -5);
        assert_eq!(show(ParameterType::Flag, "true", "")["value"], true);
        assert_eq!(show(ParameterType::Choice, "fast", "")["value"], "fast");
        let speed = parameter(ParameterType::Number, "", "m/s");
        assert_eq!(write_value(&speed, &json!(0.5)), Ok("0.5m/s".into()));
        assert_eq!(write_value(&speed, &json!("50cm/s")), Ok("50cm/s".into()));
        let count = parameter(ParameterType::Integer, "", "");
        assert_eq!(write_value(&count, &json!(4.0)), Ok("4".into()));
        assert!(write_value(&count, &json!(4.5)).is_err());
        assert!(write_value(&speed, &json!([1])).is_err());
    }
}
