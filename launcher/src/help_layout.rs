//! Lays out the last part of a command's help for a terminal of eighty columns: its examples, each
//! with a note, and its exit codes.

/// The columns of the narrowest terminal that the help is made for.
const COLUMNS: usize = 80;
/// Where the note of a long example begins, on a line of its own.
const NOTE_INDENT: usize = 6;

/// Moves the note of each example that is too wide under it. An example is indented by two spaces;
/// its note comes after two spaces or more.
pub fn lay_out_examples(text: &str) -> String {
    let lines: Vec<String> = text.lines().map(lay_out_line).collect();
    lines.join("\n")
}

fn lay_out_line(line: &str) -> String {
    let is_example = line.starts_with("  ") && line.chars().count() > COLUMNS;
    let parts = line.trim_start().split_once("  ").filter(|_| is_example);
    let Some((example, note)) = parts else { return line.to_owned() };
    format!("  {example}\n{}", wrap_words(note.trim(), NOTE_INDENT))
}

/// Breaks a text into lines, all indented by `indent`.
pub fn wrap_words(text: &str, indent: usize) -> String {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= COLUMNS => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(format!("{:indent$}{word}", "")),
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_that_does_not_fit_is_put_under_its_example() {
        let narrow = "Examples:\n  armor ps    all processes";
        assert_eq!(lay_out_examples(narrow), narrow);
        let wide = format!("Examples:\n  armor data list simulator{}those of one", " ".repeat(46));
        let expected = "Examples:\n  armor data list simulator\n      those of one";
        assert_eq!(lay_out_examples(&wide), expected);
        let prose = "A sentence.  ".repeat(9);
        assert_eq!(lay_out_examples(&prose), prose, "prose is wrapped by the terminal's width");
    }

    #[test]
    fn words_are_wrapped_with_their_indent() {
        let text = wrap_words(&"nine chars ".repeat(20), 6);
        assert!(text.lines().all(|line| line.starts_with("      ") && line.len() <= COLUMNS));
        assert_eq!(text.split_whitespace().count(), 40);
        assert_eq!(text.lines().count(), 4);
    }
}
