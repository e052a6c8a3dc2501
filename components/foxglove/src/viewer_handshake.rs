//! Which connections are accepted, by the headers of their first request. Pure.
//!
//! The kernel has already named the user of the client. But a browser of that user also runs pages of
//! strangers: one whose host name was given the address 127.0.0.1 is recognised by `Host`, any other
//! by `Origin`, which no page can change.

use armor_socket::is_loopback_name;
use thiserror::Error;

/// The names of the protocol, the newest first. Both have the same messages.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// What Chromium sends for a page that is a file of this host: the desktop programs of viewers.
const FILE_PAGE: &str = "file://";

/// Why a connection is refused.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub(crate) enum HandshakeRefusal {
    #[error(
        "this server is not `{0}`: connect to ws://127.0.0.1:PORT or ws://localhost:PORT, from \
         another host through ssh -L"
    )]
    WrongHost(String),
    #[error(
        "a page of `{0}` may not connect: if you trust it with the robot, add it to the parameter \
         `origins`"
    )]
    ForeignOrigin(String),
    #[error("the client does not offer the protocol foxglove.sdk.v1")]
    UnknownProtocol,
}

/// The headers that decide.
#[derive(Clone, Debug, Default)]
pub(crate) struct HandshakeHeaders {
    /// One value for each header of the name.
    pub(crate) host: Vec<String>,
    pub(crate) origin: Vec<String>,
    pub(crate) protocols: Vec<String>,
}

/// Accepts a connection, with the protocol to use; `origins` are the pages that may connect.
///
/// # Errors
/// Why it is refused.
pub(crate) fn check_handshake(
    headers: &HandshakeHeaders,
    origins: &[String],
) -> Result<&'static str, HandshakeRefusal> {
    let (host, origin) = (headers.host.join(", "), headers.origin.join(", "));
    if !is_loopback_name(&host) {
        return Err(HandshakeRefusal::WrongHost(host.escape_default().to_string()));
    }
    let is_own = origin.strip_prefix("http://") == Some(&*host);
    let is_trusted = origin == FILE_PAGE || is_own || origins.contains(&origin);
    if !headers.origin.is_empty() && !is_trusted {
        return Err(HandshakeRefusal::ForeignOrigin(origin.escape_default().to_string()));
    }
    let offered: Vec<_> =
        headers.protocols.iter().flat_map(|header| header.split(',')).map(str::trim).collect();
    let chosen = PROTOCOLS.into_iter().find(|protocol| offered.contains(protocol));
    chosen.ok_or(HandshakeRefusal::UnknownProtocol)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(host: &[&str], origin: &[&str], protocol: &str) -> Result<&'static str, String> {
        let list = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect();
        let headers = HandshakeHeaders {
            host: list(host),
            origin: list(origin),
            protocols: vec![protocol.to_owned()],
        };
        check_handshake(&headers, &["https://app.foxglove.dev".to_owned()])
            .map_err(|refusal| refusal.to_string())
    }

    #[test]
    fn programs_trusted_pages_and_both_protocols_are_accepted() {
        let host = &["127.0.0.1:8765"];
        assert_eq!(check(host, &[], "foxglove.sdk.v1"), Ok("foxglove.sdk.v1"));
        let both = "foxglove.websocket.v1, foxglove.sdk.v1";
        for origin in ["https://app.foxglove.dev", "file://", "http://127.0.0.1:8765"] {
            assert_eq!(check(host, &[origin], both), Ok("foxglove.sdk.v1"), "{origin}");
        }
        let old = check(&["localhost:8765"], &[], "foxglove.websocket.v1");
        assert_eq!(old, Ok("foxglove.websocket.v1"));
    }

    #[test]
    fn pages_of_strangers_are_refused() {
        let host = &["127.0.0.1:8765"];
        for origin in [
            "https://evil.example",
            "null",
            "",
            "http://127.0.0.1:3000",
            "https://app.foxglove.dev.evil.example",
            "file://evil",
        ] {
            let refused = check(host, &[origin], "foxglove.sdk.v1").expect_err(origin);
            assert!(refused.contains("`origins`"), "{refused}");
        }
        let twice = ["https://app.foxglove.dev", "https://evil.example"];
        assert!(check(host, &twice, "foxglove.sdk.v1").is_err(), "two origins");
    }

    #[test]
    fn other_hosts_and_other_protocols_are_refused() {
        for host in [&["evil.example:8765"][..], &[], &["localhost", "localhost"]] {
            let refused = check(host, &[], "foxglove.sdk.v1").expect_err("refused");
            assert!(refused.contains("ws://127.0.0.1"), "{refused}");
        }
        for protocol in ["", "foxglove.sdk.v2", "foxglove.sdk.v11"] {
            let refused = check(&["localhost:1"], &[], protocol).expect_err(protocol);
            assert!(refused.contains("foxglove.sdk.v1"), "{refused}");
        }
    }
}
