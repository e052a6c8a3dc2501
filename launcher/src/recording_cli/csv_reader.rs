//! Reads comma-separated values (RFC 4180) as messages of a type: a row is a message, and a column a
//! field by its path, as `convert` writes them.

use std::io::{BufRead, Read};
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use armor_inspect::MessageDraft;
use armor_wire::codec::MAX_DATA_LEN;
use armor_wire::schema::Schema;

const STAMP: &str = "stamp_s";
const SEQUENCE: &str = "sequence";

/// A table whose heading has been read.
pub struct CsvMessages<R> {
    source: R,
    schema: Schema,
    columns: Vec<String>,
    stamp_at: usize,
    sequence_at: Option<usize>,
    /// The line that was read last, from 1.
    line: u64,
    messages: u64,
}

/// A row.
#[derive(Clone, Debug, PartialEq)]
pub struct CsvMessage {
    pub stamp_s: f64,
    pub sequence: u64,
    pub payload: Vec<u8>,
}

impl<R: BufRead> CsvMessages<R> {
    /// Reads the heading.
    ///
    /// # Errors
    /// If there is none, or it does not have the time of the rows.
    pub fn begin(source: R, schema: Schema, path: &Path) -> Result<Self> {
        let (columns, stamp_at) = (Vec::new(), 0);
        let (sequence_at, line, messages) = (None, 0, 0);
        let mut table = Self { source, schema, columns, stamp_at, sequence_at, line, messages };
        let shown = path.display();
        table.columns = table
            .read_cells()
            .with_context(|| shown.to_string())?
            .with_context(|| format!("{shown} is empty"))?;
        let find = |name: &str| table.columns.iter().position(|column| column == name);
        table.sequence_at = find(SEQUENCE);
        table.stamp_at = find(STAMP).ok_or_else(|| {
            anyhow!(
                "{shown} has no column {STAMP}, the system time of each row in seconds; it has {}",
                table.columns.join(", ")
            )
        })?;
        Ok(table)
    }

    /// Returns the next row; `None` at the end. An empty cell is a field that is not given: 0, empty or
    /// absent.
    ///
    /// # Errors
    /// With the line, if a cell is no value of its field.
    pub fn next_message(&mut self) -> Result<Option<CsvMessage>> {
        let begun = self.line + 1;
        let at_line = || format!("line {begun}");
        let Some(cells) = self.read_cells().with_context(at_line)? else { return Ok(None) };
        if cells.len() != self.columns.len() {
            let count = self.columns.len();
            bail!("line {begun}: it has {} cells, and the heading has {count}", cells.len());
        }
        let stamp_s: f64 = cells[self.stamp_at].trim().parse().map_err(|_| {
            anyhow!("line {begun}: {STAMP}: `{}` is not a number", cells[self.stamp_at])
        })?;
        let sequence = match self.sequence_at.map(|at| cells[at].trim()).filter(|it| !it.is_empty())
        {
            None => self.messages,
            Some(text) => text
                .parse()
                .map_err(|_| anyhow!("line {begun}: {SEQUENCE}: `{text}` is not a whole number"))?,
        };
        let fields = self.columns.iter().zip(&cells).enumerate().filter(|(at, (_, cell))| {
            *at != self.stamp_at && Some(*at) != self.sequence_at && !cell.is_empty()
        });
        let fields: Vec<_> = fields.map(|(_, (path, cell))| format!("{path}={cell}")).collect();
        let payload = MessageDraft::parse(&self.schema, &fields)
            .and_then(|draft| draft.encode(stamp_s))
            .map_err(|faults| {
                let faults: Vec<_> = faults.iter().map(ToString::to_string).collect();
                anyhow!("line {begun}: {}", faults.join("; "))
            })?;
        self.messages += 1;
        Ok(Some(CsvMessage { stamp_s, sequence, payload }))
    }

    /// Reads a row, which a text in quotes may continue on the next line.
    fn read_cells(&mut self) -> Result<Option<Vec<String>>> {
        let (mut row, mut is_open) = (String::new(), false);
        loop {
            let before = row.len();
            // No message is longer; a file without an end of line is not read whole.
            let mut limited = (&mut self.source).take(MAX_DATA_LEN as u64 + 1);
            let read = limited.read_line(&mut row)?;
            self.line += 1;
            if row.len() > MAX_DATA_LEN {
                bail!("it is longer than a message can be");
            }
            is_open ^= row[before..].matches('"').count() % 2 == 1;
            match (read, is_open) {
                (0, true) => bail!("a text in quotes does not end"),
                (0, false) if row.is_empty() => return Ok(None),
                (_, true) => {}
                (_, false) if row.trim().is_empty() => row.clear(),
                (_, false) => return Ok(Some(split_cells(row.trim_end_matches(['\r', '\n'])))),
            }
        }
    }
}

/// The cells of a row.
fn split_cells(row: &str) -> Vec<String> {
    let (mut cells, mut cell, mut is_quoted) = (Vec::new(), String::new(), false);
    let mut letters = row.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.peek() == Some(&'"') => {
                letters.next();
                cell.push('"');
            }
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(std::mem::take(&mut cell)),
            other => cell.push(other),
        }
    }
    cells.push(cell);
    cells
}

#[cfg(test)]
mod tests {
    use armor_wire::schema::{parse, to_json};
    use serde_json::json;

    use super::*;

    const SCHEMA: &str = "Goal{stamp:f64(s),pose:Pose{x:f64(m),y:f64(m)},name:string,level:?u8}";

    fn begin(text: &str) -> Result<CsvMessages<&[u8]>> {
        CsvMessages::begin(text.as_bytes(), parse(SCHEMA).expect("a schema"), Path::new("a.csv"))
    }

    #[test]
    fn a_row_is_a_message_and_an_empty_cell_is_not_given() {
        let text = "stamp_s,sequence,name,pose.x,stamp,level\r\n\
                    1.5,7,\"a, \"\"b\"\"\nc\",2.5,1.25,3\r\n\n2,8,,,,\n";
        let mut table = begin(text).expect("a heading");
        let schema = table.schema.clone();
        let mut next = || {
            let message = table.next_message().expect("a row")?;
            let value = to_json(&schema, &message.payload).expect("a message");
            Some((message.stamp_s, message.sequence, value))
        };
        let first =
            json!({"stamp": 1.25, "pose": {"x": 2.5, "y": 0.0}, "name": "a, \"b\"\nc", "level": 3});
        assert_eq!(next(), Some((1.5, 7, first)));
        let second = json!({"stamp": 2.0, "pose": {"x": 0.0, "y": 0.0}, "name": "", "level": null});
        assert_eq!(next(), Some((2.0, 8, second)));
        assert_eq!(next(), None);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let fail = |text: &str| {
            let mut table = match begin(text) {
                Ok(table) => table,
                Err(error) => return format!("{error:#}"),
            };
            loop {
                match table.next_message() {
                    Ok(Some(_)) => {}
                    Ok(None) => return "nothing".into(),
                    Err(error) => return format!("{error:#}"),
                }
            }
        };
        for (text, expected) in [
            ("", "a.csv is empty"),
            ("time,pose.x\n1,2\n", "has no column stamp_s"),
            ("stamp_s,pose.x\n1,2\n3\n", "line 3: it has 1 cells, and the heading has 2"),
            ("stamp_s,pose.x\n1,fast\n", "line 2: pose.x: `fast` is not a number"),
            ("stamp_s,pose.z\n1,2\n", "line 2: pose.z: `z` is not a field there; there are: x, y"),
            ("stamp_s,name\nsoon,a\n", "line 2: stamp_s: `soon` is not a number"),
            ("stamp_s,name\n1,\"a\n", "line 2: a text in quotes does not end"),
        ] {
            let found = fail(text);
            assert!(found.contains(expected), "{text:?}: {found}");
        }
    }
}
