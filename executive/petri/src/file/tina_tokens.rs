//! The words of a `.net` text.

use super::numeral::shorten;
use super::{FileError, NetFault, fault_at};

/// A word and where it begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct TinaToken {
    pub word: TinaWord,
    pub at: usize,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum TinaWord {
    /// A name, or a number, or a keyword, written plainly.
    Plain(String),
    /// A name in braces: never a keyword.
    Braced(String),
    /// `->`
    Arrow,
    /// One of `: ( ) [ ] , * < >`, `?` and `!` for test arcs, `i` for `?-`, `j` for `!-`.
    Sign(char),
}

impl TinaWord {
    /// The word as an error shows it.
    pub fn shown(&self) -> String {
        match self {
            Self::Plain(name) | Self::Braced(name) => format!("`{}`", shorten(name)),
            Self::Arrow => "`->`".into(),
            Self::Sign('i') => "`?-`".into(),
            Self::Sign('j') => "`!-`".into(),
            Self::Sign(sign) => format!("`{sign}`"),
        }
    }
}

/// All words of `text`; lines that begin with `#` are comments.
pub(super) fn split_into_tokens(text: &str) -> Result<Vec<TinaToken>, FileError> {
    let mut tokens = Vec::new();
    let (mut rest, mut line_begins) = (text, true);
    while let Some(first) = rest.chars().next() {
        let at = text.len() - rest.len();
        if first.is_whitespace() {
            line_begins |= first == '\n';
            rest = &rest[first.len_utf8()..];
        } else if first == '#' && line_begins {
            rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
        } else {
            let (word, length) =
                read_word(rest, first).map_err(|fault| fault_at(text, at, fault))?;
            tokens.push(TinaToken { word, at });
            rest = &rest[length..];
            line_begins = false;
        }
    }
    Ok(tokens)
}

/// The word that `rest` begins with, and how long it is.
fn read_word(rest: &str, first: char) -> Result<(TinaWord, usize), NetFault> {
    Ok(match first {
        '{' => {
            let (name, length) = read_braced_name(rest)?;
            (TinaWord::Braced(name), length)
        }
        '-' if rest.starts_with("->") => (TinaWord::Arrow, 2),
        '?' if rest.starts_with("?-") => (TinaWord::Sign('i'), 2),
        '!' if rest.starts_with("!-") => (TinaWord::Sign('j'), 2),
        ':' | '(' | ')' | '[' | ']' | ',' | '*' | '<' | '>' | '?' | '!' => {
            (TinaWord::Sign(first), 1)
        }
        _ => {
            let length = plain_length(rest);
            if length == 0 {
                let found = format!("`{first}`; names with other characters stand in {{braces}}");
                return Err(NetFault::Wanted { wanted: "a name", found });
            }
            (TinaWord::Plain(rest[..length].to_owned()), length)
        }
    })
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

/// The name in the braces that `text` begins with, and how long all of it is. Notes have several
/// lines.
fn read_braced_name(text: &str) -> Result<(String, usize), NetFault> {
    let mut name = String::new();
    let mut characters = text.char_indices().skip(1);
    while let Some((at, c)) = characters.next() {
        match c {
            '}' => return Ok((name, at + 1)),
            '\\' => name.extend(characters.next().map(|(_, c)| c)),
            c => name.push(c),
        }
    }
    Err(NetFault::Wanted { wanted: "}", found: "the end of the file".into() })
}
