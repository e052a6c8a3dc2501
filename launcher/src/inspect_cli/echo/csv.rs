//! Messages as comma-separated values (RFC 4180), one row each.

use anyhow::{Result, bail};
use serde_json::Value;

use super::fields::{find_field, list_single_values};

/// The columns, chosen by the first message.
#[derive(Debug)]
pub struct CsvTable {
    paths: Vec<String>,
}

impl CsvTable {
    /// Takes the named fields, or all single values of `first`. A field that is a struct becomes a
    /// column for each of its values; one that is an array becomes a single cell of JSON.
    ///
    /// # Errors
    /// If a field does not exist, or there is none.
    pub fn new(first: &Value, fields: &[String]) -> Result<Self> {
        let mut paths = Vec::new();
        for field in fields {
            match find_field(first, field)? {
                value @ Value::Object(_) => list_single_values(value, field, &mut paths),
                _ => paths.push(field.clone()),
            }
        }
        if fields.is_empty() {
            list_single_values(first, "", &mut paths);
        }
        if paths.is_empty() {
            bail!(
                "all values of this message are in arrays; name some with --field, as in ranges.0"
            );
        }
        Ok(Self { paths })
    }

    /// Returns the first line.
    pub fn heading(&self) -> String {
        let names =
            ["stamp_s", "sequence"].into_iter().chain(self.paths.iter().map(String::as_str));
        names.map(quote_cell).collect::<Vec<_>>().join(",")
    }

    /// Returns the line of a message.
    pub fn row(&self, stamp_s: f64, sequence: u64, value: &Value) -> String {
        let mut cells = vec![stamp_s.to_string(), sequence.to_string()];
        // A variant of an enum may lack a field of the first one.
        cells.extend(self.paths.iter().map(|path| match find_field(value, path) {
            Ok(Value::Null) | Err(_) => String::new(),
            Ok(Value::String(text)) => quote_cell(text),
            Ok(other) => quote_cell(&other.to_string()),
        }));
        cells.join(",")
    }
}

fn quote_cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_message_is_a_row_and_texts_are_quoted() {
        let first = json!({"pose": {"x": 1.5, "y": -2}, "name": "a, \"b\"", "ranges": [1, 2]});
        let table = CsvTable::new(&first, &[]).expect("columns");
        assert_eq!(table.heading(), "stamp_s,sequence,name,pose.x,pose.y");
        assert_eq!(table.row(0.5, 7, &first), "0.5,7,\"a, \"\"b\"\"\",1.5,-2");
        assert_eq!(table.row(0.5, 8, &json!({"pose": {"x": null}})), "0.5,8,,,");
        let chosen = CsvTable::new(&first, &["ranges".into(), "pose".into(), "ranges.1".into()]);
        let chosen = chosen.expect("columns");
        assert_eq!(chosen.heading(), "stamp_s,sequence,ranges,pose.x,pose.y,ranges.1");
        assert_eq!(chosen.row(0.0, 1, &first), "0,1,\"[1,2]\",1.5,-2,2");
        assert!(CsvTable::new(&json!({"ranges": [1]}), &[]).is_err());
        assert!(CsvTable::new(&first, &["nothing".into()]).is_err());
    }
}
