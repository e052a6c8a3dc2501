//! The values of the plotted fields, as they arrive: one link per output, on a thread of its own.

use std::collections::BTreeMap;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Error, Result, anyhow};
use armor_inspect::FollowingTap;
use armor_robotfile::advise_similar;
use armor_wire::name::split_data;
use armor_wire::schema::{FieldPath, Scalar, Schema, ValuePath};

use crate::arguments::{RunningSystem, parse_data_name};
use crate::inspect_cli::describe::fields::list_fields;
use crate::inspect_cli::follow_named;

/// How long to wait for data before looking whether the plot still exists.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Most fields that an error lists.
const MAX_LISTED: usize = 12;

/// One field of one output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlottedField {
    pub data: String,
    /// As `armor echo --field` writes it; empty for the only number of the message.
    pub path: String,
}

impl PlottedField {
    /// Its name in a legend.
    pub fn label(&self) -> String {
        match self.path.as_str() {
            "" => self.data.clone(),
            path => format!("{}.{path}", self.data),
        }
    }
}

/// What a source reports.
pub enum SourceEvent {
    /// The unit of a field is known, empty if it has none.
    Unit { field: usize, unit: String },
    /// A field has a value.
    Value { field: usize, stamp_s: f64, value: f64 },
    /// There are no more values.
    Failed(Error),
}

/// Reads `COMPONENT.OUTPUT.FIELD`.
pub fn parse_field(text: &str) -> Result<PlottedField, String> {
    let mut parts = text.splitn(3, '.');
    let data = [parts.next(), parts.next()].into_iter().flatten().collect::<Vec<_>>().join(".");
    let path = parts.next().unwrap_or_default();
    match split_data(&data) {
        Some(_) => Ok(PlottedField { data, path: path.into() }),
        None => parse_data_name(&data).map(|_| PlottedField { data, path: path.into() }),
    }
}

/// Begins to follow the outputs of the fields. The first answer of each output is awaited, so that a
/// wrong name is an error here.
///
/// # Errors
/// If no system is found, or an output or a field does not exist.
pub fn follow_fields(
    running: &RunningSystem,
    fields: &[PlottedField],
) -> Result<Receiver<SourceEvent>> {
    let mut by_data: BTreeMap<&str, Vec<(usize, String)>> = BTreeMap::new();
    for (number, field) in fields.iter().enumerate() {
        by_data.entry(&field.data).or_default().push((number, field.path.clone()));
    }
    let (events, received) = mpsc::channel();
    for (data, fields) in by_data {
        let (ready, is_ready) = mpsc::channel();
        let (running, data, events) = (running.clone(), data.to_owned(), events.clone());
        thread::Builder::new().name("plot".into()).spawn(move || {
            let following = follow_named(&running, "plot", &data).and_then(|following| {
                let units = find_units(following.schema(), &data, &fields)?;
                Ok((following, units))
            });
            match following {
                Ok((following, units)) => {
                    let _ = ready.send(Ok(()));
                    for (field, unit) in units {
                        let _ = events.send(SourceEvent::Unit { field, unit });
                    }
                    send_values(following, &fields, &events);
                }
                Err(error) => {
                    let _ = ready.send(Err(error));
                }
            }
        })?;
        is_ready.recv().context("the thread that reads the data has ended")??;
    }
    Ok(received)
}

/// Sends values until there are no more, or the plot has ended.
fn send_values(
    mut following: FollowingTap,
    fields: &[(usize, String)],
    events: &Sender<SourceEvent>,
) {
    loop {
        let item = match following.next(LOOK_EVERY) {
            Ok(Some(item)) => item,
            Ok(None) => continue,
            Err(error) => {
                let _ = events.send(SourceEvent::Failed(error.into()));
                return;
            }
        };
        for (field, path) in fields {
            let value = read_value(following.schema(), path, &item.payload);
            let Some(value) = value else { continue };
            let stamp_s = item.header.stamp_s;
            if events.send(SourceEvent::Value { field: *field, stamp_s, value }).is_err() {
                return;
            }
        }
    }
}

/// Returns the value of a field; none if it is absent, beyond the end of its array, or no number.
fn read_value(schema: &Schema, path: &str, payload: &[u8]) -> Option<f64> {
    if path.is_empty() {
        let path = FieldPath::find(schema, &[]).ok()?;
        return match path.read(schema, payload).ok()?? {
            Scalar::Number(number) => Some(number),
            Scalar::Flag(flag) => Some(f64::from(u8::from(flag))),
            Scalar::Text(_) => None,
        };
    }
    ValuePath::find(schema, &bracket_indices(path))?.read(schema, payload).ok()?
}

/// `ranges.0` as `ranges[0]`.
fn bracket_indices(path: &str) -> String {
    let mut out = String::new();
    for part in path.split('.') {
        if part.parse::<usize>().is_ok() {
            out += &format!("[{part}]");
        } else {
            out += if out.is_empty() { "" } else { "." };
            out += part;
        }
    }
    out
}

/// Returns the units of the fields.
///
/// # Errors
/// If the message has no such field, or it is not a number; with those that it has.
fn find_units(
    schema: &Schema,
    data: &str,
    fields: &[(usize, String)],
) -> Result<Vec<(usize, String)>> {
    let listed = list_fields(&schema.to_string());
    let find = |(number, path): &(usize, String)| -> Result<(usize, String)> {
        let names: Vec<&str> = listed.iter().map(|(path, _)| path.as_str()).collect();
        if path.is_empty() {
            let found = FieldPath::find(schema, &[])
                .map_err(|error| anyhow!("{data}: {error}: write {data}.FIELD"))?;
            return Ok((*number, found.unit.unwrap_or_default().to_owned()));
        }
        if ValuePath::find(schema, &bracket_indices(path)).is_none() {
            let advice = advise_similar(path, names.iter().copied());
            let mut shown = names;
            let more = if shown.len() > MAX_LISTED { ", …" } else { "" };
            shown.truncate(MAX_LISTED);
            return Err(anyhow!(
                "{data} has no number at {path}{advice} (its fields: {}{more})",
                shown.join(", ")
            ));
        }
        let general = generalize_indices(path);
        let found = listed.iter().find(|(path, _)| *path == general);
        let unit = found.and_then(|(_, kind)| kind.split_once(" in ")).map(|(_, unit)| unit);
        Ok((*number, unit.unwrap_or_default().to_owned()))
    };
    fields.iter().map(find).collect()
}

/// The path as the list of fields has it: without an index at its end, and with `N` for others.
fn generalize_indices(path: &str) -> String {
    let is_index = |part: &&str| part.parse::<usize>().is_ok();
    let mut parts: Vec<&str> = path.split('.').collect();
    while parts.last().is_some_and(is_index) {
        parts.pop();
    }
    parts.iter().map(|part| if is_index(part) { "N" } else { *part }).collect::<Vec<_>>().join(".")
}

#[cfg(test)]
mod tests {
    use armor_wire::schema::parse;

    use super::*;

    #[test]
    fn data_and_field_are_told_apart() {
        let field = parse_field("arm.pose.pose.x").expect("a field");
        assert_eq!((field.data.as_str(), field.path.as_str()), ("arm.pose", "pose.x"));
        assert_eq!(field.label(), "arm.pose.pose.x");
        assert_eq!(parse_field("arm.angle").expect("no field").label(), "arm.angle");
        assert!(parse_field("arm").expect_err("one part").contains("COMPONENT.OUTPUT"));
    }

    #[test]
    fn a_value_is_read_by_its_path_and_has_a_unit() {
        let schema = parse("Scan{stamp:f64(s),ranges:[f32](m),name:string}").expect("a schema");
        let payload = [
            &1.0_f64.to_le_bytes()[..],
            &2_u64.to_le_bytes(),
            &3.5_f32.to_le_bytes(),
            &4.5_f32.to_le_bytes(),
            &0_u64.to_le_bytes(),
        ]
        .concat();
        assert_eq!(read_value(&schema, "ranges.1", &payload), Some(4.5));
        assert_eq!(read_value(&schema, "ranges.7", &payload), None);
        let units = |path: &str| find_units(&schema, "eye.scan", &[(0, path.into())]);
        assert_eq!(units("ranges.1").expect("a number"), [(0, "m".to_owned())]);
        assert_eq!(units("stamp").expect("a number"), [(0, "s".to_owned())]);
        let refused = units("rnges").expect_err("unknown").to_string();
        assert!(refused.contains("did you mean ranges?"), "{refused}");
        assert!(units("").expect_err("several").to_string().contains("eye.scan.FIELD"));
        let single = parse("Angle{stamp:f64(s),data:f64(rad)}").expect("a schema");
        let payload = [1.0_f64.to_le_bytes(), 0.5_f64.to_le_bytes()].concat();
        assert_eq!(read_value(&single, "", &payload), Some(0.5));
    }
}
