//! The names of this host that no stranger can give an address.

const LOOPBACK_NAMES: [&str; 3] = ["127.0.0.1", "localhost", "[::1]"];

/// Returns whether the value of a header `Host` is such a name, with or without a port. A page whose
/// host name was given the address 127.0.0.1 (DNS rebinding) has another one.
pub fn is_loopback_name(host: &str) -> bool {
    LOOPBACK_NAMES.iter().any(|name| {
        host.strip_prefix(name).is_some_and(|rest| {
            let port = rest.strip_prefix(':');
            rest.is_empty() || port.is_some_and(|port| port.parse::<u16>().is_ok())
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_loopback_count() {
        for host in ["127.0.0.1", "127.0.0.1:8080", "localhost:1", "[::1]:8080", "localhost"] {
            assert!(is_loopback_name(host), "{host}");
        }
        for host in ["", "evil.example", "localhost.evil.example:80", "127.0.0.1:", "localhost:x"] {
            assert!(!is_loopback_name(host), "{host}");
        }
    }
}
