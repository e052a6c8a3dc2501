//! The keys that an authority has revoked, by the serial numbers of their certificates.

use std::collections::HashSet;

use parking_lot::RwLock;
use rustls::pki_types::CertificateDer;

use crate::certificate::{CertificateFacts, Serial};

/// Most revoked keys that are read; a file with more is wrong.
const MAX_REVOKED: usize = 100_000;

/// Reads the list: a serial number per line, followed by words for people; `#` begins a comment.
///
/// # Errors
/// The first line that is not one, with its number.
pub fn parse_revoked(text: &str) -> Result<Vec<Serial>, String> {
    let mut serials = Vec::new();
    for (at, line) in text.lines().enumerate() {
        let Some(word) = line.split_whitespace().next().filter(|word| !word.starts_with('#'))
        else {
            continue;
        };
        serials.push(word.parse().map_err(|why| format!("line {}: {why}", at + 1))?);
        if serials.len() > MAX_REVOKED {
            return Err(format!("more than {MAX_REVOKED} keys are revoked"));
        }
    }
    Ok(serials)
}

/// The revoked keys that a gate knows. A key that has been revoked stays so as long as the gate
/// runs, whatever happens to the list: a copy that is being written over it is incomplete at times.
#[derive(Debug, Default)]
pub struct RevokedKeys(RwLock<HashSet<Serial>>);

impl RevokedKeys {
    /// Adds keys; returns how many of them were not known.
    pub fn add_keys(&self, serials: impl IntoIterator<Item = Serial>) -> usize {
        let mut known = self.0.write();
        serials.into_iter().filter(|serial| known.insert(serial.clone())).count()
    }

    /// Whether a key is revoked.
    pub fn contains(&self, serial: &Serial) -> bool {
        self.0.read().contains(serial)
    }

    /// Whether the certificate is one of a revoked key.
    pub(crate) fn contains_certificate(&self, certificate: &CertificateDer<'_>) -> bool {
        CertificateFacts::read(certificate).is_ok_and(|facts| self.contains(&facts.serial))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_has_a_number_per_line_and_comments() {
        let (one, other) = (Serial::random(), Serial::random());
        let text = format!("# revoked\n\n{one} alice\n  {other}  bob, operator\n");
        assert_eq!(parse_revoked(&text), Ok(vec![one, other]));
        assert_eq!(parse_revoked(""), Ok(Vec::new()));
        let error = parse_revoked("# x\nalice\n").unwrap_err();
        assert!(error.starts_with("line 2: alice is not a serial number"), "{error}");
    }

    #[test]
    fn a_revoked_key_stays_revoked() {
        let (one, other) = (Serial::random(), Serial::random());
        let revoked = RevokedKeys::default();
        assert_eq!(revoked.add_keys([one.clone(), one.clone()]), 1);
        assert_eq!(revoked.add_keys([one.clone()]), 0);
        assert!(revoked.contains(&one) && !revoked.contains(&other));
    }
}
