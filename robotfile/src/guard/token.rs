//! Splits the text of a guard into its words and signs.

use std::ops::Range;

use armor_wire::quantity::{self, UNITS, Unit};

use crate::guard::node::{GuardError, GuardOperator};
use crate::suggestion::suggest_similar;

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum GuardToken {
    Number(f64, Option<&'static Unit>),
    Text(String),
    /// A variable, or names joined by dots.
    Name(String),
    True,
    False,
    Not,
    Known,
    Operator(GuardOperator),
    Open,
    Close,
    End,
}

/// Returns all tokens with their positions, the last one being the end. `language` is the name of
/// such a text in messages.
pub(crate) fn tokens(
    text: &str,
    language: &'static str,
) -> Result<Vec<(GuardToken, Range<usize>)>, GuardError> {
    let mut lexer = Lexer { text, language, at: 0 };
    let mut out = Vec::new();
    loop {
        let next = lexer.next_token()?;
        let is_end = next.0 == GuardToken::End;
        out.push(next);
        if is_end {
            return Ok(out);
        }
    }
}

/// A word that is probably misspelt, where the token number `next` is not expected: that token itself,
/// where an operator is expected, or the one before it, where that begins something. Returns its
/// position in the text and a remedy that names the right word.
pub(crate) fn find_misspelt(
    tokens: &[(GuardToken, Range<usize>)],
    next: usize,
    operators: &[&'static str],
    prefixes: &[&'static str],
) -> Option<(Range<usize>, String)> {
    let similar = |index: usize, words: &[&'static str]| {
        let (token, at) = tokens.get(index)?;
        let GuardToken::Name(name) = token else { return None };
        if operators.iter().chain(prefixes).any(|word| word == name) {
            return None;
        }
        let in_lower_case = name.to_ascii_lowercase();
        let remedy = suggest_similar(name, words.iter().copied())
            .or_else(|| suggest_similar(&in_lower_case, words.iter().copied()))
            .or_else(|| {
                let is_it = |word: &&&str| **word == in_lower_case;
                words.iter().find(is_it).map(|word| format!("did you mean {word}?"))
            })?;
        Some((at.clone(), remedy))
    };
    let before = next.checked_sub(1)?;
    // Only where something begins can the word before it have been meant to begin it.
    if let (GuardToken::Operator(_) | GuardToken::Close | GuardToken::End, _) = tokens.get(next)? {
        return None;
    }
    let foreign = || {
        let (GuardToken::Name(name), at) = tokens.get(next)? else { return None };
        let name = name.to_ascii_lowercase();
        let (_, sign) = FOREIGN_WORDS.iter().find(|(word, _)| *word == name)?;
        Some((at.clone(), format!("did you mean {sign}?")))
    };
    foreign().or_else(|| similar(next, operators)).or_else(|| similar(before, prefixes))
}

/// Words for comparisons in other languages, with our signs as XML takes them.
const FOREIGN_WORDS: [(&str, &str); 8] = [
    ("lt", "&lt;"),
    ("le", "&lt;="),
    ("gt", "&gt;"),
    ("ge", "&gt;="),
    ("eq", "=="),
    ("is", "=="),
    ("equals", "=="),
    ("ne", "!="),
];

struct Lexer<'a> {
    text: &'a str,
    language: &'static str,
    at: usize,
}

const QUOTES: &str = "put a text between single quotes: 'Charging'";

/// Spellings of other languages, with ours.
const FOREIGN: [(&str, &str); 28] = [
    ("=<", "did you mean &lt;=?"),
    ("=>", "did you mean &gt;=?"),
    ("&&", "write and"),
    ("&", "write and"),
    ("||", "write or"),
    ("|", "write or"),
    ("=", "write == to compare"),
    ("!", "write not"),
    ("\"", QUOTES),
    ("`", QUOTES),
    ("´", QUOTES),
    ("‘", QUOTES),
    ("’", QUOTES),
    ("‚", QUOTES),
    ("“", QUOTES),
    ("”", QUOTES),
    ("„", QUOTES),
    ("«", QUOTES),
    ("»", QUOTES),
    ("‹", QUOTES),
    ("›", QUOTES),
    ("≤", "write <= (in XML: &lt;=)"),
    ("≥", "write >="),
    ("≠", "write !="),
    ("−", "write -"),
    ("–", "write -"),
    ("×", "write *"),
    (".", "write numbers with a digit before the point, and no spaces around the dots of a name"),
];

/// Longer ones first.
const SIGNS: [(&str, GuardToken); 12] = [
    ("<=", GuardToken::Operator(GuardOperator::LessOrEqual)),
    (">=", GuardToken::Operator(GuardOperator::GreaterOrEqual)),
    ("==", GuardToken::Operator(GuardOperator::Equal)),
    ("!=", GuardToken::Operator(GuardOperator::Unequal)),
    ("<", GuardToken::Operator(GuardOperator::Less)),
    (">", GuardToken::Operator(GuardOperator::Greater)),
    ("+", GuardToken::Operator(GuardOperator::Plus)),
    ("-", GuardToken::Operator(GuardOperator::Minus)),
    ("*", GuardToken::Operator(GuardOperator::Times)),
    ("/", GuardToken::Operator(GuardOperator::By)),
    ("(", GuardToken::Open),
    (")", GuardToken::Close),
];

impl<'a> Lexer<'a> {
    fn next_token(&mut self) -> Result<(GuardToken, Range<usize>), GuardError> {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start().len();
        let (start, rest) = (self.at, self.rest());
        let token = match rest.chars().next() {
            None => GuardToken::End,
            Some(c) if c.is_ascii_digit() => self.read_number()?,
            Some(c) if c.is_ascii_alphabetic() => self.read_word(),
            Some('\'') => self.read_quoted()?,
            Some(c) => match SIGNS.iter().find(|(sign, _)| rest.starts_with(sign)) {
                Some((sign, token)) => {
                    self.at += sign.len();
                    token.clone()
                }
                None => return Err(refuse_foreign(rest, start, c, self.language)),
            },
        };
        Ok((token, start..self.at))
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn take_while(&mut self, wanted: impl Fn(char) -> bool) -> &'a str {
        let rest = self.rest();
        let len = rest.find(|c| !wanted(c)).unwrap_or(rest.len());
        self.at += len;
        &rest[..len]
    }

    /// A minus between letters belongs to the name, so that the name of every component can be
    /// written here.
    fn read_word(&mut self) -> GuardToken {
        let word = self.take_while(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.'));
        match word {
            "and" => GuardToken::Operator(GuardOperator::And),
            "or" => GuardToken::Operator(GuardOperator::Or),
            "not" => GuardToken::Not,
            "true" => GuardToken::True,
            "false" => GuardToken::False,
            "known" => GuardToken::Known,
            name => GuardToken::Name(name.to_owned()),
        }
    }

    fn read_quoted(&mut self) -> Result<GuardToken, GuardError> {
        let rest = &self.rest()[1..];
        let Some(len) = rest.find('\'') else {
            return Err(GuardError {
                at: self.at..self.text.len(),
                message: "this text is not closed".into(),
                remedy: "close it with a single quote".into(),
            });
        };
        self.at += len + 2;
        Ok(GuardToken::Text(rest[..len].to_owned()))
    }

    fn read_number(&mut self) -> Result<GuardToken, GuardError> {
        let start = self.at;
        self.take_while(|c| c.is_ascii_digit());
        let digit = |text: &str, at: usize| text.as_bytes().get(at).is_some_and(u8::is_ascii_digit);
        if self.rest().starts_with('.') && digit(self.rest(), 1) {
            self.at += 1;
            self.take_while(|c| c.is_ascii_digit());
        }
        let sign = usize::from(matches!(self.rest().as_bytes().get(1), Some(b'+' | b'-')));
        if self.rest().starts_with(['e', 'E']) && digit(self.rest(), 1 + sign) {
            self.at += 1 + sign;
            self.take_while(|c| c.is_ascii_digit());
        }
        if self.rest().starts_with(',') && digit(self.rest(), 1) {
            return Err(self.refuse_comma(start));
        }
        let value: Option<f64> = self.text[start..self.at].parse().ok();
        let unit = self.read_unit()?;
        let finite = |value: &f64| (value * unit.map_or(1.0, |unit| unit.to_si)).is_finite();
        let value = value.filter(finite).ok_or_else(|| GuardError {
            at: start..self.at,
            message: format!("`{}` is too large", &self.text[start..self.at]),
            remedy: "write a smaller number".into(),
        })?;
        Ok(GuardToken::Number(value, unit))
    }

    /// A number with a decimal comma.
    fn refuse_comma(&mut self, start: usize) -> GuardError {
        self.at += 1;
        self.take_while(|c| c.is_ascii_digit());
        let number = start..self.at;
        let unit = self.read_unit().ok().flatten().map_or("", |unit| unit.name);
        let written = &self.text[number.clone()];
        GuardError {
            message: format!("`{written}` is not a number"),
            remedy: format!("did you mean {}{unit}?", written.replace(',', ".")),
            at: number,
        }
    }

    /// Reads the longest unit that the text continues with. As in attributes, spaces may separate it
    /// from the number.
    fn read_unit(&mut self) -> Result<Option<&'static Unit>, GuardError> {
        let rest = self.rest();
        let continues = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let ends = |unit: &&Unit| {
            rest.strip_prefix(unit.name)
                .is_some_and(|after| unit.name == "%" || !after.starts_with(continues))
        };
        let longest = UNITS.iter().filter(ends).max_by_key(|unit| unit.name.len());
        if let Some(unit) = longest {
            self.at += unit.name.len();
            return Ok(Some(unit));
        }
        if !rest.starts_with(continues) {
            return self.read_unit_apart(continues);
        }
        let start = self.at;
        let word = self.take_while(continues);
        let known = || UNITS.iter().map(|unit| unit.name);
        let list = || format!("known are {}", known().collect::<Vec<_>>().join(" "));
        let remedy = match quantity::find_similar(word, None) {
            Some(meant) => format!("did you mean {}?", meant.name),
            // A single letter is similar to every other one.
            None if word.len() == 1 => list(),
            None => suggest_similar(word, known()).unwrap_or_else(list),
        };
        Err(GuardError { at: start..self.at, message: format!("`{word}` is not a unit"), remedy })
    }

    /// Reads a unit that spaces separate from its number. A number is followed by no other word than
    /// an operator, so a word that is similar to a unit is probably meant to be one.
    fn read_unit_apart(
        &mut self,
        continues: impl Fn(char) -> bool,
    ) -> Result<Option<&'static Unit>, GuardError> {
        let rest = self.rest();
        let word = rest.trim_start();
        let start = self.at + rest.len() - word.len();
        let len = match word.starts_with('%') {
            true => 1,
            false => word.find(|c| !continues(c)).unwrap_or(word.len()),
        };
        let (word, rest) = word.split_at(len);
        // `m/s` and `m/s2` continue after their first word.
        let longest = UNITS.iter().filter(|unit| {
            let after = unit.name.strip_prefix(word).and_then(|end| rest.strip_prefix(end));
            after.is_some_and(|after| unit.name == "%" || !after.starts_with(&continues))
        });
        if let Some(unit) = longest.filter(|_| len > 0).max_by_key(|unit| unit.name.len()) {
            self.at = start + unit.name.len();
            return Ok(Some(unit));
        }
        // Another single letter may be a variable.
        let similar = (word.len() > 1).then(|| quantity::find_similar(word, None)).flatten();
        match similar {
            None => Ok(None),
            Some(meant) => Err(GuardError {
                at: start..start + len,
                message: format!("`{word}` is not a unit"),
                remedy: format!("did you mean {}?", meant.name),
            }),
        }
    }
}

fn refuse_foreign(rest: &str, start: usize, c: char, language: &str) -> GuardError {
    let (len, remedy) = match FOREIGN.iter().find(|(sign, _)| rest.starts_with(sign)) {
        Some((sign @ "=", _)) if language == "value" => {
            (sign.len(), "write the new value alone, such as count + 1")
        }
        Some((sign, remedy)) => (sign.len(), *remedy),
        None if c == ',' => (1, "write and or or between two conditions"),
        None => (c.len_utf8(), "remove it"),
    };
    let at = start..start + len;
    GuardError {
        message: format!("`{}` has no meaning in a {language}", &rest[..len]),
        at,
        remedy: remedy.into(),
    }
}
