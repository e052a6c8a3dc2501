//! The names and addresses under which browsers open the page of a robot, as its certificate has them.

use std::fmt;
use std::net::{IpAddr, Ipv6Addr};
use std::str::FromStr;

/// Most names in a certificate.
pub const MAX_SITES: usize = 16;
/// Longest name of a host, by RFC 1035.
const MAX_NAME_LEN: usize = 253;
/// Longest part of a name between two dots.
const MAX_LABEL_LEN: usize = 63;

/// A name or an address of a robot.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SiteName {
    /// A name, such as `robot.local`, in lower case.
    Name(String),
    /// An address.
    Address(IpAddr),
}

impl SiteName {
    /// Returns the one that the value of a header `Host` names, with or without a port.
    pub fn from_host(host: &str) -> Option<Self> {
        let (name, port) = match host.strip_prefix('[') {
            Some(rest) => {
                let (address, rest) = rest.split_once(']')?;
                address.parse::<Ipv6Addr>().ok()?;
                (address, rest.strip_prefix(':').or_else(|| rest.is_empty().then_some("0"))?)
            }
            None => host.split_once(':').unwrap_or((host, "0")),
        };
        let is_port = port.bytes().all(|byte| byte.is_ascii_digit());
        if !is_port || port.parse::<u16>().is_err() {
            return None;
        }
        name.parse().ok()
    }

    /// Returns it as a link has it.
    pub fn to_host(&self) -> String {
        match self {
            Self::Address(IpAddr::V6(address)) => format!("[{address}]"),
            other => other.to_string(),
        }
    }
}

impl fmt::Display for SiteName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::Address(address) => address.fmt(f),
        }
    }
}

impl FromStr for SiteName {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let bare = text.strip_prefix('[').and_then(|it| it.strip_suffix(']')).unwrap_or(text);
        if let Ok(address) = bare.parse::<IpAddr>() {
            return match address.is_unspecified() {
                true => Err(format!("{text} is no address of one host: write the robot's own")),
                false => Ok(Self::Address(address)),
            };
        }
        let name = text.to_ascii_lowercase();
        let is_label = |label: &str| {
            let is_inner = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-';
            (1..=MAX_LABEL_LEN).contains(&label.len())
                && label.bytes().all(is_inner)
                && !label.starts_with('-')
                && !label.ends_with('-')
        };
        // A browser reads a name whose last part is a number as an address.
        let is_number = name.rsplit('.').next().is_some_and(|last| last.parse::<u64>().is_ok());
        if name.len() > MAX_NAME_LEN || is_number || !name.split('.').all(is_label) {
            return Err(format!(
                "{text} is neither a host name (robot.local) nor an address (192.168.0.7); leave \
                 out https:// and the port"
            ));
        }
        Ok(Self::Name(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_addresses_are_read_back() {
        for (text, written) in [
            ("robot.local", "robot.local"),
            ("Robot", "robot"),
            ("192.168.0.7", "192.168.0.7"),
            ("fd00::7", "[fd00::7]"),
            ("[fd00::7]", "[fd00::7]"),
        ] {
            let site: SiteName = text.parse().expect(text);
            assert_eq!(site.to_host(), written);
            assert_eq!(site.to_string().parse(), Ok(site.clone()), "{text}");
            for host in [written.to_owned(), format!("{written}:8443")] {
                assert_eq!(SiteName::from_host(&host), Some(site.clone()), "{host}");
            }
        }
    }

    #[test]
    fn what_is_no_host_is_refused() {
        let long = "a".repeat(64);
        let longer = ["abc"; 64].join(".");
        for text in [
            "",
            "https://robot",
            "robot:8443",
            "-robot",
            "robot.",
            "ro bot",
            "robot_1",
            "röbot",
            "1.2.3",
            "0.0.0.0",
            "::",
            "[robot]",
            &long,
            &longer,
        ] {
            assert!(text.parse::<SiteName>().is_err(), "{text}");
        }
        for host in [
            "",
            ":8443",
            "robot:",
            "robot:99999",
            "robot:+1",
            "robot:80:80",
            "robot@evil",
            "[::1",
            "[::1]80",
            "[robot]:80",
            "fd00::7",
        ] {
            assert_eq!(SiteName::from_host(host), None, "{host}");
        }
    }
}
