//! The part of an address after `?`: a few numbers and words.

use crate::failure::WebFailure;

/// The parameters of a request.
pub(crate) struct Query<'a>(Vec<(&'a str, &'a str)>);

impl<'a> Query<'a> {
    /// Reads the query of an address; each of its names must be one of `known`.
    pub(crate) fn read(text: Option<&'a str>, known: &[&str]) -> Result<Self, WebFailure> {
        let parts = text.unwrap_or_default().split('&').filter(|part| !part.is_empty());
        let pairs: Vec<_> = parts.map(|part| part.split_once('=').unwrap_or((part, ""))).collect();
        match pairs.iter().find(|(name, _)| !known.contains(name)) {
            None => Ok(Self(pairs)),
            Some((name, _)) => Err(WebFailure::bad(
                format!("there is no parameter `{name}` here"),
                "the query of the address",
                match known {
                    [] => "leave it out".to_owned(),
                    _ => format!("use {}, or leave it out", known.join(", ")),
                },
            )),
        }
    }

    fn find(&self, name: &str) -> Option<&'a str> {
        self.0.iter().find(|(other, _)| *other == name).map(|(_, value)| *value)
    }

    /// Returns a number between `least` and `most`, or `default` if it is not given.
    pub(crate) fn number(
        &self,
        name: &str,
        default: f64,
        least: f64,
        most: f64,
    ) -> Result<f64, WebFailure> {
        let Some(text) = self.find(name) else { return Ok(default) };
        let number = text.parse::<f64>().ok();
        number.filter(|number| (least..=most).contains(number)).ok_or_else(|| {
            WebFailure::bad(
                format!("`{name}` is no number from {least} to {most}"),
                "the query of the address",
                format!("write {name}={default}"),
            )
        })
    }

    /// Returns whether a switch is on: given alone, or as `true`.
    pub(crate) fn switch(&self, name: &str) -> Result<bool, WebFailure> {
        match self.find(name) {
            None | Some("false") => Ok(false),
            Some("" | "true") => Ok(true),
            Some(_) => Err(WebFailure::bad(
                format!("`{name}` is neither true nor false"),
                "the query of the address",
                format!("write {name}=true, or leave it out"),
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_switches_are_read_and_everything_else_is_refused() {
        let query = Query::read(Some("max_hz=2.5&take"), &["max_hz", "take", "wait"]).unwrap();
        assert_eq!(query.number("max_hz", 10.0, 0.1, 100.0).unwrap(), 2.5);
        assert_eq!(query.number("wait", 2.0, 0.0, 10.0).unwrap(), 2.0);
        assert!(query.switch("take").unwrap());
        for text in ["max_hz=NaN", "max_hz=1e9", "max_hz=", "max_hz=%32"] {
            let query = Query::read(Some(text), &["max_hz"]).unwrap();
            assert!(query.number("max_hz", 10.0, 0.1, 100.0).is_err(), "{text}");
        }
        assert!(Query::read(Some("x=1"), &["max_hz"]).is_err());
        assert!(Query::read(Some("take=maybe"), &["take"]).unwrap().switch("take").is_err());
    }
}
