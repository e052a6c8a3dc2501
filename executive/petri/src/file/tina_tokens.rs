//! The words of a `.net` text.

use super::numeral::shortened;
use super::{Fault, FileError, fault_at};

/// A word and where it begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Token {
    pub word: Word,
    pub at: usize,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Word {
    /// A name, or a number, or a keyword, written plainly.
    Plain(String),
    /// A name in braces: never a keyword.
    Braced(String),
    /// `->`
    Arrow,
    /// One of `: ( ) [ ] , * < >`, `?` and `!` for test arcs, `i` for `?-`, `j` for `!-`.
    Sign(char),
}

impl Word {
    /// The word as an error shows it.
    pub fn shown(&self) -> String {
        match self {
            Self::Plain(name) | Self::Braced(name) => format!("`{}`", shortened(name)),
            Self::Arrow => "`->`".into(),
            Self::Sign('i') => "`?-`".into(),
            Self::Sign('j') => "`!-`".into(),
            Self::Sign(sign) => format!("`{sign}`"),
        }
    }
}

/// All words of `text`; lines that begin with `#` are comments.
pub(super) fn tokens(text: &str) -> Result<Vec<Token>, FileError> {
    let mut tokens = Vec::new();
    let mut line_start = 0;
    for line in text.split_inclusive('\n') {
        if !line.trim_start().starts_with('#') {
            words(text, line, line_start, &mut tokens)?;
        }
        line_start += line.len();
    }
    Ok(tokens)
}

fn words(
    text: &str,
    line: &str,
    line_start: usize,
    tokens: &mut Vec<Token>,
) -> Result<(), FileError> {
    let mut rest = line;
    while let Some(first) = rest.chars().next() {
        let start = line.len() - rest.len();
        let at = line_start + start;
        let (word, length) = match first {
            c if c.is_whitespace() => {
                rest = &rest[c.len_utf8()..];
                continue;
            }
            '{' => {
                let (name, length) = braced(rest).map_err(|fault| fault_at(text, at, fault))?;
                (Word::Braced(name), length)
            }
            '-' if rest.starts_with("->") => (Word::Arrow, 2),
            '?' if rest.starts_with("?-") => (Word::Sign('i'), 2),
            '!' if rest.starts_with("!-") => (Word::Sign('j'), 2),
            ':' | '(' | ')' | '[' | ']' | ',' | '*' | '<' | '>' | '?' | '!' => {
                (Word::Sign(first), 1)
            }
            _ => {
                let length = plain_length(rest);
                if length == 0 {
                    let found =
                        format!("`{first}`; names with other characters stand in {{braces}}");
                    let fault = Fault::Wanted { wanted: "a name", found };
                    return Err(fault_at(text, at, fault));
                }
                (Word::Plain(rest[..length].to_owned()), length)
            }
        };
        tokens.push(Token { word, at });
        rest = &rest[length..];
    }
    Ok(())
}

/// Letters, digits, `'` and `_` are the format's own; `.`, `/`, `@` and inner `-` are met in files.
fn plain_length(text: &str) -> usize {
    let mut length = 0;
    for (at, c) in text.char_indices() {
        let inner = c == '-'
            && at > 0
            && text[at + 1..].starts_with(|c: char| c.is_alphanumeric() || c == '_');
        if !(c.is_alphanumeric() || "_'./@$".contains(c) || inner) {
            break;
        }
        length = at + c.len_utf8();
    }
    length
}

/// The name in the braces that `text` begins with, and how long all of it is.
fn braced(text: &str) -> Result<(String, usize), Fault> {
    let mut name = String::new();
    let mut characters = text.char_indices().skip(1);
    while let Some((at, c)) = characters.next() {
        match c {
            '}' => return Ok((name, at + 1)),
            '\\' => name.extend(characters.next().map(|(_, c)| c)),
            c => name.push(c),
        }
    }
    Err(Fault::Wanted { wanted: "}", found: "the end of the line".into() })
}
