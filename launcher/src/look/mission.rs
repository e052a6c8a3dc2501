//! `armor mission show`: where the mission stands, from what the executive publishes.

use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_sdk::tap::Tap;
use armor_wire::schema::{Schema, to_json};
use serde_json::Value;

use super::{Observed, printed, say};
use crate::arguments::{Format, Running};
use crate::exit::Ending;

/// What the executive publishes, latched, at every change.
const MARKING: &str = "executive.marking";
/// How long a latched value may take to come.
const FIRST_WITHIN: Duration = Duration::from_secs(3);
/// How often to look whether the link still is; changes come at once.
const LOOK_EVERY: Duration = Duration::from_secs(3600);

/// Prints the marking, and again at every change if it is followed.
///
/// # Errors
/// If no mission runs.
pub fn show(running: &Running, follow: bool, format: Format) -> Result<Ending> {
    let observed = Observed::find(running, "mission")?;
    let tap = observed.tap(MARKING).context("no mission runs in this system")?;
    printed(print(tap, follow, format))
}

fn print(mut tap: Tap, follow: bool, format: Format) -> Result<()> {
    let schema = tap.schema().clone();
    let Some(marking) = next(&mut tap, &schema, FIRST_WITHIN)? else {
        bail!("the executive has not said its marking within {} s", FIRST_WITHIN.as_secs());
    };
    say_marking(&marking, format)?;
    if !follow {
        return Ok(());
    }
    loop {
        if let Some(marking) = next(&mut tap, &schema, LOOK_EVERY)? {
            if format != Format::Json {
                say("")?;
            }
            say_marking(&marking, format)?;
        }
    }
}

fn next(tap: &mut Tap, schema: &Schema, within: Duration) -> Result<Option<Value>> {
    let item = tap.next(within)?;
    let value = item.map(|item| to_json(schema, &item.payload));
    value.transpose().with_context(|| format!("{MARKING} does not fit its own schema"))
}

fn say_marking(marking: &Value, format: Format) -> Result<()> {
    match format {
        Format::Json => say(marking),
        _ => say(in_words(marking).trim_end()),
    }
}

/// One paragraph per field: lists one item a line, everything else beside its name.
fn in_words(marking: &Value) -> String {
    let Value::Object(fields) = marking else { return marking.to_string() };
    let width = fields.keys().map(String::len).max().unwrap_or(0);
    let mut out = String::new();
    for (name, value) in fields {
        let name = name.replace('_', " ");
        let mut lines = match value {
            Value::Array(items) if items.is_empty() => vec!["none".into()],
            Value::Array(items) => items.iter().map(inline).collect(),
            other => vec![inline(other)],
        }
        .into_iter();
        out += &format!("{name:width$}  {}\n", lines.next().unwrap_or_default());
        for line in lines {
            out += &format!("{:width$}  {line}\n", "");
        }
    }
    out
}

fn inline(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "-".into(),
        Value::Array(items) => items.iter().map(inline).collect::<Vec<_>>().join(" "),
        Value::Object(fields) => fields
            .iter()
            .filter(|(_, value)| !value.is_null() && *value != "")
            .map(|(name, value)| format!("{} {}", name.replace('_', " "), inline(value)))
            .collect::<Vec<_>>()
            .join(", "),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn lists_are_written_one_item_a_line() {
        let marking = json!({
            "mission": "survey",
            "places": [{"place": "explore", "tokens": 1}, {"place": "watch", "tokens": 1}],
            "can_fire": [],
        });
        let expected = "can fire  none\nmission   survey\nplaces    place explore, tokens 1\n          \
                        place watch, tokens 1\n";
        assert_eq!(in_words(&marking), expected);
    }
}
