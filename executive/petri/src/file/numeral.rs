//! The numbers in files: whole numbers of tokens, and times with up to nine decimals.

use super::NetFault;
use std::time::Duration;

/// Parses a whole number of tokens.
pub(super) fn parse_tokens(text: &str) -> Result<u32, NetFault> {
    parse_scaled_tokens(text, 1)
}

/// Parses a whole number of tokens and multiplies it by `factor`.
pub(super) fn parse_scaled_tokens(text: &str, factor: u64) -> Result<u32, NetFault> {
    if text.is_empty() || !text.bytes().all(|byte| byte.is_ascii_digit()) {
        return Err(NetFault::Number(shorten(text)));
    }
    let number = text.parse::<u32>().ok().map(u64::from).and_then(|n| n.checked_mul(factor));
    number.and_then(|n| u32::try_from(n).ok()).ok_or_else(|| NetFault::TooMany(shorten(text)))
}

/// Parses the weight of an arc.
pub(super) fn parse_weight(text: &str) -> Result<u32, NetFault> {
    match parse_tokens(text)? {
        0 => Err(NetFault::ZeroWeight),
        weight => Ok(weight),
    }
}

/// Parses a time in seconds, exact to the nanosecond.
pub(super) fn parse_seconds(text: &str) -> Result<Duration, NetFault> {
    let wrong = || NetFault::Time(shorten(text));
    let (whole, part) = text.split_once('.').unwrap_or((text, ""));
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let part = part.trim_end_matches('0');
    if whole.is_empty() || !digits(whole) || !digits(part) || part.len() > 9 {
        return Err(wrong());
    }
    let whole: u64 = whole.parse().map_err(|_| wrong())?;
    let nanoseconds: u32 = format!("{part:0<9}").parse().map_err(|_| wrong())?;
    Ok(Duration::new(whole, nanoseconds))
}

/// Returns a time as text that [`seconds`] parses back.
pub(super) fn write_seconds(time: Duration) -> String {
    let text = format!("{}.{:09}", time.as_secs(), time.subsec_nanos());
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Returns the beginning of a text, for an error message.
pub(super) fn shorten(text: &str) -> String {
    const SHOWN: usize = 40;
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_and_parsed_back_exactly() {
        for text in ["0", "4", "0.5", "12.000000001", "18446744073709551615"] {
            assert_eq!(write_seconds(parse_seconds(text).unwrap()), text);
        }
        assert_eq!(parse_seconds("4.0").unwrap(), Duration::from_secs(4));
        for wrong in ["", ".5", "-1", "1e3", "0.0000000001", "99999999999999999999"] {
            assert!(parse_seconds(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn more_tokens_than_a_place_can_hold_are_refused() {
        assert_eq!(parse_tokens("4294967295"), Ok(u32::MAX));
        assert_eq!(parse_tokens("4294967296"), Err(NetFault::TooMany("4294967296".into())));
        assert_eq!(parse_scaled_tokens("5", 1_000_000_000), Err(NetFault::TooMany("5".into())));
        assert_eq!(parse_weight("0"), Err(NetFault::ZeroWeight));
        assert_eq!(parse_tokens("-1"), Err(NetFault::Number("-1".into())));
    }
}
