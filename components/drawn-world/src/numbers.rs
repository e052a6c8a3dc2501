//! Numbers as SVG writes them in lists: `1,2 3-4.5.5e-1` is 1, 2, 3, −4.5, 0.5e-1.

/// Reads numbers and letters off the front of an attribute value.
pub(super) struct Numbers<'a> {
    rest: &'a str,
}

impl<'a> Numbers<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { rest: text }
    }

    /// What has not been read yet, separators skipped.
    pub(super) fn rest(&mut self) -> &'a str {
        self.rest = self.rest.trim_start_matches(|c: char| c.is_ascii_whitespace() || c == ',');
        self.rest
    }

    /// Takes the next number, or leaves everything as it is when none follows.
    pub(super) fn number(&mut self) -> Option<f64> {
        let text = self.rest();
        let length = number_length(text.as_bytes());
        let value: f64 = text[..length].parse().ok()?;
        self.rest = &text[length..];
        value.is_finite().then_some(value)
    }

    /// Takes the next letter, or leaves everything as it is when none follows.
    pub(super) fn read_letter(&mut self) -> Option<char> {
        let letter = self.rest().chars().next().filter(char::is_ascii_alphabetic)?;
        self.rest = &self.rest[1..];
        Some(letter)
    }
}

/// Parses a value that is one plain number and nothing else.
pub(super) fn lone_number(text: &str) -> Option<f64> {
    let text = text.trim();
    if number_length(text.as_bytes()) != text.len() {
        return None;
    }
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

/// How many bytes at the front make one number (0: none).
fn number_length(bytes: &[u8]) -> usize {
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut end = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits(end);
    end += whole;
    let mut fraction = 0;
    if bytes.get(end) == Some(&b'.') {
        fraction = digits(end + 1);
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return 0;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits((end + 1 + sign).min(bytes.len()));
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<f64> {
        let mut numbers = Numbers::new(text);
        std::iter::from_fn(|| numbers.number()).collect()
    }

    #[test]
    fn lists_are_split_as_svg_splits_them() {
        assert_eq!(all(" 1,2 3-4.5.5e-1 +6. "), [1.0, 2.0, 3.0, -4.5, 0.05, 6.0]);
        assert_eq!(all("1e2 2E+1 3e"), [100.0, 20.0, 3.0]);
        assert!(all("- . e5 x").is_empty());
    }

    #[test]
    fn a_lone_number_has_no_unit() {
        assert_eq!(lone_number(" 1.5 "), Some(1.5));
        for text in ["1.5m", "10px", "50%", "", "inf", "NaN", "1 2", "1e999"] {
            assert_eq!(lone_number(text), None, "{text}");
        }
    }
}
