//! The examples in the pages of `docs/errors`: a file that gives the finding, and its fixed form.
//!
//! The `xml` blocks before the heading `## What to do` are the faulty example, those after it the
//! fixed one. A block is `robot.xml` unless the line before it names another file. A `--set` in an
//! `sh` block is an argument of the check.

use crate::code::Code;

/// The file that `armor check` is given.
const MAIN_FILE: &str = "robot.xml";
/// Separates the faulty example from the fixed one.
const REMEDY_HEADING: &str = "\n## What to do\n";
/// Stands in a page for the control character U+0007, which would not be visible there.
const CONTROL_CHARACTER: &str = "\u{b7}";
/// Stands in a page, which is UTF-8, for a byte that is not.
const INVALID_BYTE: char = '\u{fffd}';
/// The letter `ü` in Latin-1.
const LATIN_1_BYTE: u8 = 0xfc;

/// An example of a page: files, and arguments for the check of the one called `robot.xml`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageExample {
    /// The files, each with its name. The one called `robot.xml` comes first.
    pub files: Vec<(String, Vec<u8>)>,
    /// The values of `--set`.
    pub overrides: Vec<String>,
}

impl PageExample {
    /// Returns the bytes of the file called `name`.
    pub fn file(&self, name: &str) -> Option<&[u8]> {
        self.files.iter().find(|(own, _)| own == name).map(|(_, bytes)| bytes.as_slice())
    }

    /// Reads the blocks of a part of a page.
    fn read(part: &str) -> Self {
        let mut example = Self { files: Vec::new(), overrides: Vec::new() };
        let mut name = None;
        let mut lines = part.lines();
        while let Some(line) = lines.next() {
            if let Some(fence) = line.strip_prefix("```") {
                let block: Vec<_> = lines.by_ref().take_while(|line| *line != "```").collect();
                match fence {
                    "xml" => {
                        let name = name.take().unwrap_or(MAIN_FILE).to_owned();
                        example.files.push((name, file_bytes(&block)));
                    }
                    "sh" => {
                        let values = block.iter().filter_map(|line| line.split_once(" --set "));
                        example.overrides.extend(values.map(|(_, value)| value.to_owned()));
                    }
                    _ => {}
                }
            } else if !line.is_empty() {
                name = line.strip_prefix('`').and_then(|line| line.strip_suffix("`:"));
            }
        }
        example
    }
}

impl Code {
    /// Returns the example of the code's page that gives the finding, if the page has one.
    pub fn faulty_example(self) -> Option<PageExample> {
        let part = self.page().split(REMEDY_HEADING).next()?;
        Some(PageExample::read(part)).filter(|example| example.file(MAIN_FILE).is_some())
    }

    /// Returns the fixed example of the code's page, if the page has one. A file that the fix does
    /// not change is only in the faulty example, and is taken from there.
    pub fn fixed_example(self) -> Option<PageExample> {
        let (faulty, fixed) = self.page().split_once(REMEDY_HEADING)?;
        let mut fixed = PageExample::read(fixed);
        fixed.file(MAIN_FILE)?;
        for (name, bytes) in PageExample::read(faulty).files {
            if fixed.file(&name).is_none() {
                fixed.files.push((name, bytes));
            }
        }
        Some(fixed)
    }
}

/// Returns the bytes of the file whose lines a page shows.
fn file_bytes(lines: &[&str]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for line in lines {
        for (index, text) in
            line.replace(CONTROL_CHARACTER, "\u{7}").split(INVALID_BYTE).enumerate()
        {
            if index > 0 {
                bytes.push(LATIN_1_BYTE);
            }
            bytes.extend_from_slice(text.as_bytes());
        }
        bytes.push(b'\n');
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_a_page_have_the_names_that_precede_them() {
        let part = "text\n```xml\n<a>\u{b7}\u{fffd}</a>\n```\n\n`b.xml`:\n\n```xml\n<b/>\n```\n\
                    ```sh\narmor check robot.xml --set a.b=c d\n```\n```sh\nls\n```\n";
        let example = PageExample::read(part);
        let files = [
            ("robot.xml".to_owned(), b"<a>\x07\xfc</a>\n".to_vec()),
            ("b.xml".to_owned(), b"<b/>\n".to_vec()),
        ];
        assert_eq!(example.files, files);
        assert_eq!(example.overrides, ["a.b=c d"]);
    }

    #[test]
    fn an_unchanged_file_belongs_to_both_examples() {
        let fixed = Code::IncludeMissing.fixed_example().expect("an example");
        assert!(fixed.file("rover.xml").is_some());
        assert!(Code::NotProven.faulty_example().is_none());
    }
}
