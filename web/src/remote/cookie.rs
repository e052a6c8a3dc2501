//! The cookie of a session. Its prefix makes browsers accept it only over HTTPS, from this host alone
//! and for all paths, so that no neighbour of the same domain can set one.

use armor_keys::invitations::Secret;
use axum::http::{HeaderMap, HeaderValue, header};

/// Its name.
const NAME: &str = "__Host-armor";
/// Most headers with cookies that are read.
const MAX_HEADERS: usize = 8;

/// Returns the session that a request names. Of several cookies of this name none is taken.
pub(super) fn read_session(headers: &HeaderMap) -> Option<Secret> {
    let texts = headers.get_all(header::COOKIE).iter().take(MAX_HEADERS);
    let cookies = texts.filter_map(|text| text.to_str().ok()).flat_map(|text| text.split(';'));
    let pairs = cookies.filter_map(|cookie| cookie.trim().split_once('='));
    let mut values = pairs.filter(|(name, _)| *name == NAME).map(|(_, value)| value);
    let first = values.next()?;
    if values.next().is_some() {
        return None;
    }
    Secret::from_text(first)
}

/// Returns the header that gives a browser its session, for `for_s` seconds.
pub(super) fn give_session(session: &Secret, for_s: i64) -> Option<HeaderValue> {
    let value = session.to_text();
    write_cookie(&value, for_s)
}

/// Returns the header that takes the session away.
pub(super) fn take_session() -> Option<HeaderValue> {
    write_cookie("", 0)
}

fn write_cookie(value: &str, for_s: i64) -> Option<HeaderValue> {
    let text =
        format!("{NAME}={value}; Path=/; Max-Age={for_s}; Secure; HttpOnly; SameSite=Strict");
    let mut header = HeaderValue::from_str(&text).ok()?;
    header.set_sensitive(true);
    Some(header)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_cookie_of_the_name_is_the_session() {
        let session = Secret::new([7; 20]);
        let given = give_session(&session, 60).expect("a header");
        let given = given.to_str().expect("text");
        for part in ["__Host-armor=0707", "Path=/", "Secure", "HttpOnly", "SameSite=Strict"] {
            assert!(given.contains(part), "{given}");
        }
        let own = format!("{NAME}={}", session.to_text());
        for (cookies, expected) in [
            (vec![own.clone()], true),
            (vec![format!("a=b; {own}; c")], true),
            (vec!["a=b".into(), own.clone()], true),
            (vec![own.clone(), own.clone()], false),
            (vec![format!("{own}; {own}")], false),
            (vec![format!("x{own}")], false),
            (vec![format!("{own}0")], false),
            (vec![NAME.to_owned()], false),
            (vec![], false),
        ] {
            let mut headers = HeaderMap::new();
            for cookie in &cookies {
                headers.append(header::COOKIE, HeaderValue::from_str(cookie).expect("a value"));
            }
            assert_eq!(read_session(&headers).is_some(), expected, "{cookies:?}");
        }
    }
}
