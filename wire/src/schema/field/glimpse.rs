//! The first values of a message as lines, and any single value by its path, from the schema alone:
//! for tools that show and plot messages of types that they do not know.

use super::{Cursor, PayloadError, Scalar, without_options};
use crate::schema::layout::Schema;

/// Values of a list that are shown.
const SHOWN_ITEMS: usize = 3;

/// One value of a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Glimpse {
    /// Its path, such as `pose.position.x` or `ranges[0]`; empty if it is the whole message.
    pub path: String,
    /// The value.
    pub seen: GlimpsedValue,
    /// The unit of its number.
    pub unit: Option<String>,
}

/// The value at a path of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum GlimpsedValue {
    /// A value.
    Value(Scalar),
    /// A list of this many values; glimpses of the first ones follow.
    Many(usize),
    /// An optional value that is absent.
    Nothing,
}

/// Returns the first `lines` values of a message; of a list its length and its first few values.
///
/// # Errors
/// [`PayloadError`] if the payload, as far as it was read, is not one of the schema.
pub fn glimpse_message(
    schema: &Schema,
    payload: &[u8],
    lines: usize,
) -> Result<Vec<Glimpse>, PayloadError> {
    let mut reader = GlimpseReader { cursor: Cursor { payload, at: 0 }, seen: Vec::new(), lines };
    reader.walk_value(schema, "", None)?;
    Ok(reader.seen)
}

struct GlimpseReader<'a> {
    cursor: Cursor<'a>,
    seen: Vec<Glimpse>,
    lines: usize,
}

impl GlimpseReader<'_> {
    fn is_full(&self) -> bool {
        self.seen.len() >= self.lines
    }

    fn push_glimpse(&mut self, path: &str, seen: GlimpsedValue, unit: Option<&str>) {
        if !self.is_full() {
            self.seen.push(Glimpse { path: path.into(), seen, unit: unit.map(Into::into) });
        }
    }

    /// Adds the value and those within it while there is room. Returns early without reading the
    /// rest.
    fn walk_value(
        &mut self,
        schema: &Schema,
        path: &str,
        unit: Option<&str>,
    ) -> Result<(), PayloadError> {
        if self.is_full() {
            return Ok(());
        }
        match schema {
            Schema::Option(item) => {
                if self.cursor.read_flag()? {
                    self.walk_value(item, path, unit)?;
                } else {
                    self.push_glimpse(path, GlimpsedValue::Nothing, unit);
                }
            }
            Schema::List(item) => {
                let count = self.cursor.read_count()?;
                self.walk_items(item, count, path, unit)?;
            }
            Schema::Fixed(item, count) => self.walk_items(item, *count, path, unit)?,
            Schema::Struct { fields, .. } => {
                for field in fields {
                    self.walk_value(
                        &field.schema,
                        &join_path(path, &field.name),
                        field.unit.as_deref(),
                    )?;
                }
            }
            Schema::Enum { variants, .. } => {
                let index = u32::from_le_bytes(self.cursor.take_array()?) as usize;
                let variant =
                    variants.get(index).ok_or(self.cursor.error_here("an unknown variant"))?;
                self.push_glimpse(
                    path,
                    GlimpsedValue::Value(Scalar::Text(variant.name.clone())),
                    None,
                );
                for field in &variant.fields {
                    self.walk_value(
                        &field.schema,
                        &join_path(path, &field.name),
                        field.unit.as_deref(),
                    )?;
                }
            }
            _ => {
                let value = self.cursor.read_scalar(schema)?;
                self.push_glimpse(path, GlimpsedValue::Value(value), unit);
            }
        }
        Ok(())
    }

    fn walk_items(
        &mut self,
        item: &Schema,
        count: usize,
        path: &str,
        unit: Option<&str>,
    ) -> Result<(), PayloadError> {
        self.push_glimpse(path, GlimpsedValue::Many(count), unit);
        for index in 0..count {
            if self.is_full() {
                return Ok(());
            }
            if index < SHOWN_ITEMS {
                self.walk_value(item, &format!("{path}[{index}]"), unit)?;
            } else {
                return self.cursor.skip_items(item, count - index);
            }
        }
        Ok(())
    }
}

fn join_path(path: &str, name: &str) -> String {
    if path.is_empty() { name.into() } else { format!("{path}.{name}") }
}

/// The path to one value in the messages of a schema.
#[derive(Clone, Debug, PartialEq)]
pub struct ValuePath {
    steps: Vec<usize>,
}

impl ValuePath {
    /// Resolves a path of the form of [`Glimpse::path`]; `None` if it does not lead to a number or
    /// `bool`.
    pub fn find(schema: &Schema, path: &str) -> Option<Self> {
        let (mut schema, mut steps) = (without_options(schema), Vec::new());
        for part in path.split(['.', '[']).filter(|part| !part.is_empty()) {
            match (schema, part.strip_suffix(']')) {
                (Schema::Struct { fields, .. }, None) => {
                    let step = fields.iter().position(|field| field.name == part)?;
                    steps.push(step);
                    schema = without_options(&fields[step].schema);
                }
                (Schema::List(item), Some(index)) => {
                    steps.push(index.parse().ok()?);
                    schema = without_options(item);
                }
                (Schema::Fixed(item, count), Some(index)) => {
                    steps.push(index.parse().ok().filter(|index| index < count)?);
                    schema = without_options(item);
                }
                _ => return None,
            }
        }
        let is_plain = !matches!(
            schema,
            Schema::Text
                | Schema::List(_)
                | Schema::Fixed(..)
                | Schema::Struct { .. }
                | Schema::Enum { .. }
        );
        is_plain.then_some(Self { steps })
    }

    /// Reads the value from one payload of the schema in which it was found, `true` as 1; `None` if
    /// it is, or lies within, an absent value.
    ///
    /// # Errors
    /// [`PayloadError`] if the payload up to the value is not one of the schema.
    pub fn read(&self, schema: &Schema, payload: &[u8]) -> Result<Option<f64>, PayloadError> {
        let mut cursor = Cursor { payload, at: 0 };
        let (mut schema, mut steps) = (schema, self.steps.iter());
        loop {
            while let Schema::Option(item) = schema {
                if !cursor.read_flag()? {
                    return Ok(None);
                }
                schema = item;
            }
            let Some(step) = steps.next() else { break };
            schema = match schema {
                Schema::Struct { fields, .. } => {
                    for field in fields.iter().take(*step) {
                        cursor.skip_value(&field.schema)?;
                    }
                    &fields.get(*step).ok_or(cursor.error_here("another schema"))?.schema
                }
                Schema::List(item) => {
                    if *step >= cursor.read_count()? {
                        return Ok(None);
                    }
                    cursor.skip_items(item, *step)?;
                    item
                }
                Schema::Fixed(item, _) => {
                    cursor.skip_items(item, *step)?;
                    item
                }
                _ => return Err(cursor.error_here("another schema")),
            };
        }
        Ok(match cursor.read_scalar(schema)? {
            Scalar::Number(number) => Some(number),
            Scalar::Flag(flag) => Some(f64::from(u8::from(flag))),
            Scalar::Text(_) => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::WireType;
    use crate::{Message, codec};

    #[derive(Clone, Debug, PartialEq, Message)]
    #[message(wire = "armor_wire")]
    struct Point {
        #[message(unit = "m")]
        x: f64,
        y: f32,
    }

    #[derive(Clone, Debug, PartialEq, Message)]
    #[message(wire = "armor_wire")]
    struct Scan {
        name: String,
        hit: Option<Point>,
        is_good: bool,
        #[message(unit = "m")]
        ranges: Vec<f64>,
        path: Vec<Point>,
        last: u8,
    }

    fn scan(hit: Option<Point>) -> Vec<u8> {
        let scan = Scan {
            name: "front".into(),
            hit,
            is_good: true,
            ranges: (0..100).map(f64::from).collect(),
            path: vec![Point { x: 1.0, y: 2.0 }, Point { x: 3.0, y: 4.5 }],
            last: 9,
        };
        codec::encode(&scan).expect("it fits")
    }

    fn describe(payload: &[u8], lines: usize) -> Vec<String> {
        let seen = glimpse_message(&Scan::schema(), payload, lines).expect("it fits its schema");
        let word = |glimpse: &Glimpse| {
            let unit = glimpse.unit.as_deref().unwrap_or_default();
            match &glimpse.seen {
                GlimpsedValue::Value(Scalar::Number(number)) => {
                    format!("{}={number}{unit}", glimpse.path)
                }
                GlimpsedValue::Value(Scalar::Flag(flag)) => format!("{}={flag}", glimpse.path),
                GlimpsedValue::Value(Scalar::Text(text)) => format!("{}={text}", glimpse.path),
                GlimpsedValue::Many(count) => format!("{}:{count}", glimpse.path),
                GlimpsedValue::Nothing => format!("{} -", glimpse.path),
            }
        };
        seen.iter().map(word).collect()
    }

    #[test]
    fn a_message_is_listed_value_by_value_and_a_list_by_its_first_values() {
        let expected = [
            "name=front",
            "hit -",
            "is_good=true",
            "ranges:100",
            "ranges[0]=0m",
            "ranges[1]=1m",
            "ranges[2]=2m",
            "path:2",
            "path[0].x=1m",
            "path[0].y=2",
            "path[1].x=3m",
            "path[1].y=4.5",
            "last=9",
        ];
        let payload = scan(None);
        assert_eq!(describe(&payload, 100), expected);
        assert_eq!(describe(&payload, 5), expected[..5]);
    }

    #[test]
    fn any_number_is_found_by_its_path() {
        let schema = Scan::schema();
        let read = |path: &str, hit| {
            let pick = ValuePath::find(&schema, path)?;
            pick.read(&schema, &scan(hit)).expect("it fits its schema")
        };
        let hit = || Some(Point { x: 7.0, y: 0.1 });
        assert_eq!(read("hit.x", hit()), Some(7.0));
        assert_eq!(read("hit.y", hit()), Some(0.1));
        assert_eq!(read("hit.x", None), None);
        assert_eq!(read("is_good", None), Some(1.0));
        assert_eq!(read("ranges[42]", hit()), Some(42.0));
        assert_eq!(read("ranges[100]", None), None, "there are a hundred");
        assert_eq!(read("path[1].y", None), Some(4.5));
        assert_eq!(read("last", hit()), Some(9.0));
        for none in ["name", "hit", "ranges", "path[0]", "ranges[x]", "hit.z", "", "last[0]"] {
            assert_eq!(ValuePath::find(&schema, none), None, "{none:?}");
        }
    }

    #[test]
    fn a_truncated_payload_is_an_error_and_no_panic() {
        let (schema, payload) = (Scan::schema(), scan(Some(Point { x: 7.0, y: 0.1 })));
        let pick = ValuePath::find(&schema, "last").expect("it is there");
        for len in 0..payload.len() {
            assert!(glimpse_message(&schema, &payload[..len], 100).is_err(), "{len}");
            assert!(pick.read(&schema, &payload[..len]).is_err(), "{len}");
        }
    }
}
