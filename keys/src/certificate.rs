//! What this program reads from a certificate: its holder, its serial number, and when it is valid.

use std::fmt;
use std::net::IpAddr;
use std::str::FromStr;

use armor_wire::acting::KeyRole;
use x509_parser::extensions::GeneralName;
use x509_parser::prelude::{FromDer, X509Certificate};

use crate::GATE_NAME;
use crate::identity::{KeyHolder, KeyPurpose};
use crate::site_name::SiteName;

/// Number of bytes of a serial number; enough that two random ones never agree.
pub(crate) const SERIAL_LEN: usize = 16;

/// The number of a certificate, by which it is revoked.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Serial([u8; SERIAL_LEN]);

impl Serial {
    /// A random one.
    pub(crate) fn random() -> Self {
        let mut bytes = [0; SERIAL_LEN];
        let halves = [armor_socket::random_id(), armor_socket::random_id()];
        bytes[..8].copy_from_slice(&halves[0].to_be_bytes());
        bytes[8..].copy_from_slice(&halves[1].to_be_bytes());
        // Positive, and without a leading zero byte, which DER would leave out.
        bytes[0] = bytes[0] & 0x7f | 0x40;
        Self(bytes)
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0
    }
}

impl fmt::Display for Serial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl FromStr for Serial {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("{text} is not a serial number of {} hexadecimal digits", 2 * SERIAL_LEN);
        if text.len() != 2 * SERIAL_LEN || !text.bytes().all(|b| b.is_ascii_hexdigit()) {
            return Err(wrong());
        }
        let mut bytes = [0; SERIAL_LEN];
        for (at, byte) in bytes.iter_mut().enumerate() {
            *byte = u8::from_str_radix(&text[2 * at..2 * at + 2], 16).map_err(|_| wrong())?;
        }
        Ok(Self(bytes))
    }
}

/// What a certificate of this program contains.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CertificateFacts {
    /// Its holder.
    pub holder: KeyHolder,
    /// Its number.
    pub serial: Serial,
    /// From when it is valid, in seconds since 1970.
    pub not_before_s: i64,
    /// Until when it is valid, in seconds since 1970.
    pub not_after_s: i64,
    /// The names and addresses under which browsers open the page of a host.
    pub sites: Vec<SiteName>,
}

impl CertificateFacts {
    /// Reads the certificate of a person or a host.
    ///
    /// # Errors
    /// If it is not a certificate, or not one that `armor keys add` makes.
    pub fn read(der: &[u8]) -> Result<Self, String> {
        let (rest, certificate) =
            X509Certificate::from_der(der).map_err(|_| "it is not a certificate")?;
        if !rest.is_empty() {
            return Err("bytes follow the certificate".into());
        }
        let names = certificate.subject_alternative_name().map_err(|error| error.to_string())?;
        let names = names.map(|names| names.value.general_names.as_slice()).unwrap_or_default();
        let uris: Vec<_> = names
            .iter()
            .filter_map(|name| match name {
                GeneralName::URI(uri) => Some(*uri),
                _ => None,
            })
            .collect();
        let [uri] = uris[..] else {
            return Err("it does not name one holder; `armor keys add` makes those that do".into());
        };
        let holder = KeyHolder::from_uri(uri).ok_or("its holder is none of this program's")?;
        let serial = certificate.raw_serial().try_into().map_err(|_| "its serial is too short")?;
        let validity = certificate.validity();
        Ok(Self {
            holder,
            serial: Serial(serial),
            not_before_s: validity.not_before.timestamp(),
            not_after_s: validity.not_after.timestamp(),
            sites: names.iter().filter_map(read_site).collect(),
        })
    }

    /// The role, if the holder is a person.
    pub fn role(&self) -> Option<KeyRole> {
        match self.holder.purpose {
            KeyPurpose::Person(role) => Some(role),
            KeyPurpose::Host => None,
        }
    }
}

/// Returns the name or address in a certificate under which browsers open a page.
fn read_site(name: &GeneralName<'_>) -> Option<SiteName> {
    match name {
        GeneralName::DNSName(name) if *name != GATE_NAME => name.parse().ok(),
        GeneralName::IPAddress(bytes) => {
            let four = <[u8; 4]>::try_from(*bytes).map(IpAddr::from);
            let address = four.or_else(|_| <[u8; 16]>::try_from(*bytes).map(IpAddr::from));
            address.ok().map(SiteName::Address)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_serial_is_read_back_and_nothing_else_is_one() {
        for _ in 0..100 {
            let serial = Serial::random();
            assert_eq!(serial.to_string().parse(), Ok(serial.clone()));
            assert!((0x40..0x80).contains(&serial.bytes()[0]));
        }
        let long = "0".repeat(33);
        for text in ["", "12", "x".repeat(32).as_str(), "é".repeat(16).as_str(), long.as_str()] {
            assert!(text.parse::<Serial>().is_err(), "{text}");
        }
    }

    #[test]
    fn bytes_that_are_no_certificate_are_an_error() {
        for bytes in [&b""[..], b"0", &[0x30, 0x82, 0xff, 0xff], &[0xff; 300]] {
            assert!(CertificateFacts::read(bytes).is_err());
        }
    }
}
