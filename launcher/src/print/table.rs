//! Tables that fit a terminal: columns without news are left out, long cells continue on the next
//! line.

/// Spaces between two columns.
const GAP: usize = 2;
/// A column of text is made no narrower than this.
const MIN_TEXT_WIDTH: usize = 8;
/// Where a word is divided if it is too long for its column; after these characters.
const SEAMS: [char; 5] = ['.', '/', '_', '-', ','];
/// Longest name of a row in a text of two columns.
const ROW_NAME_LEN: usize = 20;

/// Rows under headings; numbers stand to the right.
#[derive(Clone, Debug)]
pub struct Table<'a> {
    headings: &'a [&'a str],
    rows: Vec<Vec<String>>,
    /// Headings of the columns that a narrow terminal can do without, the least important first.
    dispensable: &'a [&'a str],
}

impl<'a> Table<'a> {
    /// Makes a table; every row has a cell per heading. A cell is one line: see [`flatten_text`].
    pub fn new(headings: &'a [&'a str], mut rows: Vec<Vec<String>>) -> Self {
        for cell in rows.iter_mut().flatten() {
            *cell = flatten_text(cell);
        }
        Self { headings, rows, dispensable: &[] }
    }

    /// Names the columns that a narrow terminal can do without, the least important first.
    pub fn dispensable(self, headings: &'a [&'a str]) -> Self {
        Self { dispensable: headings, ..self }
    }

    /// Returns the table as lines of at most `width` columns, if there is a width and the table can
    /// be made as narrow.
    pub fn format(&self, width: Option<usize>) -> String {
        let all = 0..self.headings.len();
        let mut columns: Vec<usize> = all.filter(|column| self.longest_cell(*column) > 0).collect();
        let width = width.unwrap_or(usize::MAX);
        let mut left_out = Vec::new();
        for heading in self.dispensable {
            let natural = columns.iter().map(|column| self.longest_cell(*column));
            if natural.sum::<usize>() + gaps(columns.len()) <= width {
                break;
            }
            columns.retain(|column| self.headings[*column] != *heading);
            left_out.push(*heading);
        }
        let widths = self.fit_widths(&columns, width);
        let mut out = String::new();
        let headings: Vec<String> = self.headings.iter().map(ToString::to_string).collect();
        for row in std::iter::once(&headings).chain(&self.rows) {
            self.push_row(row, &columns, &widths, &mut out);
        }
        if !left_out.is_empty() {
            left_out.sort_by_key(|heading| self.headings.iter().position(|it| it == heading));
            let note = format!("(a wider terminal shows {} too)", left_out.join(", "));
            out += &(wrap_text(&note, width).join("\n") + "\n");
        }
        out
    }

    fn longest_cell(&self, column: usize) -> usize {
        let cells = self.rows.iter().filter_map(|row| row.get(column)).map(String::as_str);
        cells.chain([self.headings[column]]).map(count_columns).max().unwrap_or(0)
    }

    /// The longest piece of a column's cells that has no seam.
    fn longest_piece(&self, column: usize) -> usize {
        let cells = self.rows.iter().filter_map(|row| row.get(column));
        let words = cells.flat_map(|cell| cell.split(' '));
        let pieces = words.flat_map(|word| word.split_inclusive(SEAMS));
        pieces.map(count_columns).max().unwrap_or(0)
    }

    fn is_numeric(&self, column: usize) -> bool {
        let mut cells = self.rows.iter().filter_map(|row| row.get(column)).peekable();
        cells.peek().is_some() && cells.all(|cell| is_number(cell))
    }

    /// Takes columns away from the widest column of text until the table fits.
    fn fit_widths(&self, columns: &[usize], width: usize) -> Vec<usize> {
        let mut widths: Vec<usize> =
            columns.iter().map(|column| self.longest_cell(*column)).collect();
        let natural = widths.clone();
        let least = |is_whole: bool| {
            let of_column = |(column, natural): (&usize, &usize)| {
                let heading = count_columns(self.headings[*column]);
                let words = if is_whole { self.longest_piece(*column) } else { 0 };
                match self.is_numeric(*column) {
                    true => *natural,
                    false => (*natural).min(heading.max(MIN_TEXT_WIDTH).max(words)),
                }
            };
            columns.iter().zip(&natural).map(of_column).collect::<Vec<usize>>()
        };
        // Words are divided only where the table does not fit otherwise.
        for least in [least(true), least(false)] {
            while widths.iter().sum::<usize>() + gaps(columns.len()) > width {
                let shrinkable = (0..widths.len()).filter(|index| widths[*index] > least[*index]);
                let Some(widest) = shrinkable.max_by_key(|index| widths[*index]) else { break };
                widths[widest] -= 1;
            }
        }
        widths
    }

    fn push_row(&self, row: &[String], columns: &[usize], widths: &[usize], out: &mut String) {
        let cells: Vec<Vec<String>> = columns
            .iter()
            .zip(widths)
            .map(|(column, width)| wrap_text(row.get(*column).map_or("", String::as_str), *width))
            .collect();
        let height = cells.iter().map(Vec::len).max().unwrap_or(0);
        for index in 0..height {
            let mut line = String::new();
            for ((cell, column), width) in cells.iter().zip(columns).zip(widths) {
                let text = cell.get(index).map_or("", String::as_str);
                let room = " ".repeat(width.saturating_sub(count_columns(text)));
                if self.is_numeric(*column) {
                    line += &room;
                    line += text;
                } else {
                    line += text;
                    line += &room;
                }
                line += "  ";
            }
            out.push_str(line.trim_end());
            out.push('\n');
        }
    }
}

fn gaps(columns: usize) -> usize {
    columns.saturating_sub(1) * GAP
}

pub(super) fn count_columns(text: &str) -> usize {
    text.chars().count()
}

/// Returns `text` as one line: line breaks and control characters, which would break a table or
/// steer the terminal, become spaces.
pub fn flatten_text(text: &str) -> String {
    let breaks = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    text.replace("\r\n", " ").replace(breaks, " ")
}

/// Divides `text` into lines of at most `width` columns: between words, and inside a word that is
/// longer than a line.
pub fn wrap_text(text: &str, width: usize) -> Vec<String> {
    let width = width.max(1);
    if count_columns(text) <= width {
        return vec![text.to_owned()];
    }
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let mut rest: Vec<char> = word.chars().collect();
        let used = lines.last().map_or(0, |line| count_columns(line));
        if used > 0 && used + 1 + rest.len() <= width {
            if let Some(line) = lines.last_mut() {
                line.push(' ');
                line.extend(rest);
            }
            continue;
        }
        if used > 0 {
            lines.push(String::new());
        }
        while rest.len() > width {
            let seam = rest[..width].iter().rposition(|c| SEAMS.contains(c));
            let part: String = rest.drain(..seam.map_or(width, |seam| seam + 1)).collect();
            if let Some(line) = lines.last_mut() {
                *line = part;
            }
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            line.extend(rest);
        }
    }
    lines
}

/// Wraps each line of `text` that is longer than `width` columns between words. The lines that
/// continue it are indented as its text is: after the leading spaces, the mark of a list, or the
/// name of a row, which two spaces end.
pub fn wrap_lines(text: &str, width: usize) -> String {
    let lines = text.lines().map(|line| {
        if count_columns(line) <= width {
            return line.to_owned();
        }
        let indent = measure_indent(line).min(width / 2);
        let head: String = line.chars().take(indent).collect();
        let rest: String = line.chars().skip(indent).collect();
        let parts = wrap_text(&rest, width - indent);
        head + &parts.join(&format!("\n{}", " ".repeat(indent)))
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns the columns before the text of a line.
fn measure_indent(line: &str) -> usize {
    let spaces = count_columns(line) - count_columns(line.trim_start());
    let text = line.trim_start();
    let is_listed = text.starts_with("- ") || text.starts_with("* ");
    let row_name = text.find("  ").filter(|at| !text[..*at].contains(' ') || *at < ROW_NAME_LEN);
    let row_text = row_name.map(|at| text.len() - text[at..].trim_start().len());
    match row_text {
        _ if is_listed => spaces + 2,
        Some(at) if spaces == 0 => count_columns(&text[..at]),
        _ => spaces,
    }
}

/// Returns whether a cell is a number, with or without a unit, or empty.
fn is_number(cell: &str) -> bool {
    cell == "-" || cell.is_empty() || cell.starts_with(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_continue_below_their_text() {
        let check = |text: &str, expected: &str| assert_eq!(wrap_lines(text, 24), expected);
        check("short\n\nas it is", "short\n\nas it is");
        check("a line that is longer than that", "a line that is longer\nthan that");
        check("- a list with a long entry", "- a list with a long\n  entry");
        check("    code that is too long here", "    code that is too\n    long here");
        check("waits       a report of the arm", "waits       a report of\n            the arm");
        check("            the next row of it", "            the next row\n            of it");
    }

    fn rows(rows: &[&[&str]]) -> Vec<Vec<String>> {
        rows.iter().map(|row| row.iter().map(ToString::to_string).collect()).collect()
    }

    #[test]
    fn a_column_without_heading_and_cells_takes_no_room() {
        let rows = vec![vec!["a".into(), String::new(), "why".into()]];
        assert_eq!(Table::new(&["NAME", "", ""], rows).format(None), "NAME\na     why\n");
    }

    #[test]
    fn a_cell_with_line_breaks_stays_one_row() {
        let rows = rows(&[&["arm", "no power\r\non\nbus\t1\x1b[2J"], &["leg", "\u{85}a\u{2028}b"]]);
        let expected = "NAME  PROBLEM\narm   no power on bus 1 [2J\nleg    a b\n";
        assert_eq!(Table::new(&["NAME", "PROBLEM"], rows).format(None), expected);
    }

    #[test]
    fn columns_line_up_and_numbers_stand_to_the_right() {
        let rows = rows(&[&["laser", "7"], &["größe", "1234"]]);
        let expected = "NAME   PID\nlaser     7\ngröße  1234\n".replace("PID\n", " PID\n");
        assert_eq!(Table::new(&["NAME", "PID"], rows).format(None), expected);
    }

    #[test]
    fn a_narrow_terminal_wraps_text_and_never_numbers() {
        let rows = rows(&[&["simulator.odometry", "123456", "is not connected to anything"]]);
        let table = Table::new(&["FROM", "SENT", "STATE"], rows);
        assert_eq!(
            table.format(Some(34)),
            "FROM            SENT  STATE\n\
             simulator.    123456  is not\n\
             odometry              connected to\n\
             \x20                     anything\n"
        );
        for width in [30, 40, 60] {
            let text = table.format(Some(width));
            assert!(text.lines().all(|line| line.chars().count() <= width), "{width}:\n{text}");
        }
        assert_eq!(table.format(Some(200)), table.format(None));
    }

    #[test]
    fn words_stay_whole_where_the_table_fits_otherwise() {
        let problem = "panicked at src/main.rs:12: no calibration; it starts again in 0.8 s";
        let rows = rows(&[
            &["grid-slam", "grid-slam", "restarting", "4711", problem],
            &["simulator", "simulator", "active", "4712", "its instrumentation has failed"],
        ]);
        let table = Table::new(&["NAME", "KIND", "STATE", "PID", "PROBLEM"], rows);
        for width in [60, 80] {
            let text = table.format(Some(width));
            assert!(text.lines().all(|line| line.chars().count() <= width), "{width}:\n{text}");
            for word in ["restarting", "calibration;", "instrumentation", "simulator"] {
                assert!(text.contains(word), "{width}: {word}\n{text}");
            }
        }
    }

    #[test]
    fn dispensable_columns_leave_first_and_are_named() {
        let rows = rows(&[&["laser.scan", "LaserScan", "latest", "up"]]);
        let headings = ["FROM", "TYPE", "KEEP", "STATE"];
        let table = Table::new(&headings, rows).dispensable(&["KEEP", "TYPE"]);
        let text = table.format(Some(29));
        assert_eq!(
            text,
            "FROM        TYPE       STATE\nlaser.scan  LaserScan  up\n\
             (a wider terminal shows KEEP\ntoo)\n"
        );
        let text = table.format(Some(20));
        assert!(text.ends_with("(a wider terminal\nshows TYPE, KEEP\ntoo)\n"), "{text}");
        assert!(table.format(None).contains("KEEP"), "a pipe gets all of it");
    }

    #[test]
    fn words_longer_than_a_line_are_divided_at_their_seams() {
        assert_eq!(wrap_text("a bb ccc", 4), ["a bb", "ccc"]);
        assert_eq!(wrap_text("simulator.odometry", 12), ["simulator.", "odometry"]);
        assert_eq!(wrap_text("abcdefgh", 3), ["abc", "def", "gh"]);
        assert_eq!(wrap_text("", 3), [""]);
    }
}
