//! JSON for a terminal: indented where a line would be too long, long arrays and texts shortened.

use serde_json::Value;

/// An array with more elements is shortened.
pub const MAX_ITEMS: usize = 8;
/// Number of elements that a shortened array keeps.
const KEPT_ITEMS: usize = 4;
/// A text with more characters is shortened.
const MAX_TEXT_LEN: usize = 160;
/// Number of characters that a shortened text keeps.
const KEPT_TEXT_LEN: usize = 40;
/// Columns per level.
const INDENT: usize = 2;

/// Returns `value` as JSON of about `width` columns; with `full`, nothing is shortened.
pub fn format_pretty(value: &Value, width: usize, full: bool) -> String {
    let mut out = String::new();
    PrettyPrinter { width, full }.push(value, 0, 0, &mut out);
    out
}

struct PrettyPrinter {
    width: usize,
    full: bool,
}

impl PrettyPrinter {
    /// Appends `value`, which begins at column `used` of a line with this depth.
    fn push(&self, value: &Value, depth: usize, used: usize, out: &mut String) {
        let line = self.inline(value);
        // One column for the comma.
        if used + line.chars().count() < self.width {
            *out += &line;
            return;
        }
        match value {
            Value::Object(fields) if !fields.is_empty() => {
                out.push('{');
                for (index, (name, field)) in fields.iter().enumerate() {
                    let name = Value::from(name.as_str());
                    self.begin_line(index, depth + 1, out);
                    *out += &format!("{name}: ");
                    let used = INDENT * (depth + 1) + name.to_string().chars().count() + 2;
                    self.push(field, depth + 1, used, out);
                }
                out.push('\n');
                *out += &" ".repeat(INDENT * depth);
                out.push('}');
            }
            Value::Array(items) if items.iter().any(|item| item.is_object() || item.is_array()) => {
                out.push('[');
                let (kept, rest) = self.kept(items);
                for (index, item) in kept.iter().enumerate() {
                    self.begin_line(index, depth + 1, out);
                    self.push(item, depth + 1, INDENT * (depth + 1), out);
                }
                if let Some(rest) = rest {
                    self.begin_line(1, depth + 1, out);
                    *out += &rest;
                }
                out.push('\n');
                *out += &" ".repeat(INDENT * depth);
                out.push(']');
            }
            Value::Array(items) if items.len() > 1 => self.push_wrapped(items, depth, out),
            _ => *out += &line,
        }
    }

    /// Appends an array of single values over as many lines as it needs.
    fn push_wrapped(&self, items: &[Value], depth: usize, out: &mut String) {
        let indent = INDENT * (depth + 1);
        let (kept, rest) = self.kept(items);
        let items: Vec<_> = kept.iter().map(|item| self.inline(item)).chain(rest).collect();
        out.push('[');
        let mut used = self.width;
        for (index, item) in items.iter().enumerate() {
            let columns = item.chars().count();
            // A space before the item, and a comma behind it.
            if used + columns + 2 > self.width {
                self.begin_line(index, depth + 1, out);
                used = indent + columns;
            } else {
                *out += ", ";
                used += columns + 2;
            }
            *out += item;
        }
        out.push('\n');
        *out += &" ".repeat(INDENT * depth);
        out.push(']');
    }

    fn begin_line(&self, index: usize, depth: usize, out: &mut String) {
        *out += if index == 0 { "\n" } else { ",\n" };
        *out += &" ".repeat(INDENT * depth);
    }

    /// The elements that are shown, and what is shown in place of the others.
    fn kept<'a>(&self, items: &'a [Value]) -> (&'a [Value], Option<String>) {
        if self.full || items.len() <= MAX_ITEMS {
            (items, None)
        } else {
            (&items[..KEPT_ITEMS], Some(format!("… {} elements in all", items.len())))
        }
    }

    fn inline(&self, value: &Value) -> String {
        match value {
            Value::Object(fields) => {
                let fields = fields.iter().map(|(name, field)| {
                    format!("{}: {}", Value::from(name.as_str()), self.inline(field))
                });
                format!("{{{}}}", fields.collect::<Vec<_>>().join(", "))
            }
            Value::Array(items) => {
                let (kept, rest) = self.kept(items);
                let items = kept.iter().map(|item| self.inline(item)).chain(rest);
                format!("[{}]", items.collect::<Vec<_>>().join(", "))
            }
            Value::String(text) if !self.full && text.chars().count() > MAX_TEXT_LEN => {
                let kept: String = text.chars().take(KEPT_TEXT_LEN).collect();
                let count = text.chars().count();
                format!("{} … {count} characters in all", Value::from(kept))
            }
            single => single.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_fits_a_line_is_one_line_and_the_rest_is_indented() {
        let value = json!({"pose": {"x": 1.5, "y": 2.0}, "stamp": 3.25});
        assert_eq!(
            format_pretty(&value, 80, false),
            r#"{"pose": {"x": 1.5, "y": 2.0}, "stamp": 3.25}"#
        );
        assert_eq!(
            format_pretty(&value, 40, false),
            "{\n  \"pose\": {\"x\": 1.5, \"y\": 2.0},\n  \"stamp\": 3.25\n}"
        );
        let whole: Value = serde_json::from_str(&format_pretty(&value, 1, true)).expect("JSON");
        assert_eq!(whole, value);
    }

    #[test]
    fn long_arrays_and_texts_are_shortened_unless_all_is_wanted() {
        let value = json!({"ranges": vec![1; 361], "png": "A".repeat(5000)});
        let short = format_pretty(&value, 80, false);
        assert!(short.contains("\"ranges\": [1, 1, 1, 1, … 361 elements in all]"), "{short}");
        assert!(short.contains("… 5000 characters in all") && short.len() < 200, "{short}");
        let points = json!({"points": vec![json!({"x": 1.0, "y": 2.0}); 100]});
        let short = format_pretty(&points, 60, false);
        assert_eq!(short.lines().count(), 9, "{short}");
        assert!(short.contains("    … 100 elements in all\n"), "{short}");
        let full = format_pretty(&value, 80, true);
        assert_eq!(serde_json::from_str::<Value>(&full).expect("JSON"), value);
    }

    #[test]
    fn an_array_longer_than_a_line_is_wrapped() {
        let value = json!({"covariance": vec![0.000_106_103_505_938_992_8; 36]});
        let short = format_pretty(&value, 80, false);
        let item = "0.0001061035059389928";
        let expected = format!(
            "{{\n  \"covariance\": [\n    {item}, {item}, {item},\n    {item}, … 36 elements in \
             all\n  ]\n}}"
        );
        assert_eq!(short, expected);
        for width in [1, 30, 31, 80] {
            let full = format_pretty(&value, width, true);
            assert!(full.lines().all(|line| line.len() <= width.max(26)), "{full}");
            assert_eq!(serde_json::from_str::<Value>(&full).expect("JSON"), value);
        }
    }
}
