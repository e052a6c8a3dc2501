//! Connections to a system on another host while everything listens on loopback: a SOCKS5 proxy
//! (RFC 1928), such as `ssh -D` opens. The host at its far end resolves the addresses.

use std::io::{self, Read, Write};
use std::time::Duration;

use crate::stream::Stream;

/// `host:port` of the proxy through which this process makes every connection.
const PROXY_VARIABLE: &str = "ARMOR_VIA";
/// The one port this process listens on, so that connections can be forwarded to it (`ssh -R`).
const PORT_VARIABLE: &str = "ARMOR_PORT";

const VERSION: u8 = 5;
const WITHOUT_PASSWORD: u8 = 0;
const CONNECT: u8 = 1;
const BY_IPV4: u8 = 1;
const BY_NAME: u8 = 3;
const BY_IPV6: u8 = 4;

/// Returns the proxy's address, if the environment sets one.
pub(crate) fn proxy_address() -> Option<String> {
    std::env::var(PROXY_VARIABLE).ok().filter(|proxy| !proxy.is_empty())
}

/// Returns whether this process reaches the other ones through a proxy: the system is then on
/// another host, even if an address of it is also one of this host.
pub fn has_proxy() -> bool {
    proxy_address().is_some()
}

/// Returns the port to listen on, if the environment sets one.
///
/// # Errors
/// If the variable's value is not a port.
pub(crate) fn fixed_port() -> io::Result<Option<u16>> {
    let Some(text) = std::env::var(PORT_VARIABLE).ok().filter(|port| !port.is_empty()) else {
        return Ok(None);
    };
    match text.parse() {
        Ok(port) if port > 0 => Ok(Some(port)),
        _ => Err(io::Error::other(format!(
            "{PORT_VARIABLE} is `{text}`, which is not a port (1 … 65535)"
        ))),
    }
}

/// Asks the proxy at the other end of `stream` to connect to `address`, within `limit` for each of
/// its answers. Afterwards the stream is a connection to that address.
pub(crate) fn connect_through(stream: &Stream, address: &str, limit: Duration) -> io::Result<()> {
    stream.set_read_timeout(Some(limit))?;
    stream.set_write_timeout(Some(limit))?;
    request_connection(stream, address)?;
    stream.set_write_timeout(None)
}

/// A plain `ConnectionRefused` or `TimedOut` is that of the far end.
fn request_connection(mut stream: impl Read + Write, address: &str) -> io::Result<()> {
    let request = connect_request(address)?;
    stream.write_all(&[VERSION, 1, WITHOUT_PASSWORD])?;
    let mut method = [0; 2];
    stream.read_exact(&mut method)?;
    if method != [VERSION, WITHOUT_PASSWORD] {
        return Err(refuse("it is not a SOCKS5 proxy, or requires a password"));
    }
    stream.write_all(&request)?;
    // Version, verdict, reserved, kind of the address that follows.
    let mut answer = [0; 4];
    stream.read_exact(&mut answer)?;
    let length = match answer[3] {
        BY_IPV4 => 4,
        BY_IPV6 => 16,
        BY_NAME => {
            let mut length = [0];
            stream.read_exact(&mut length)?;
            usize::from(length[0])
        }
        _ => return Err(refuse("its answer is not SOCKS5")),
    };
    // The address and port from which the proxy connects are not needed, but they must be read.
    let mut bound = [0; 255 + 2];
    stream.read_exact(&mut bound[..length + 2])?;
    match answer[1] {
        0 => Ok(()),
        1 => Err(refuse("it failed")),
        2 => Err(refuse("its rules forbid the connection")),
        3 | 4 => Err(refuse("it has no route to the address")),
        5 => Err(io::ErrorKind::ConnectionRefused.into()),
        6 => Err(io::ErrorKind::TimedOut.into()),
        code => Err(refuse(&format!("it refuses (code {code})"))),
    }
}

/// The host goes by name even if it is a number: the far end resolves it.
fn connect_request(address: &str) -> io::Result<Vec<u8>> {
    let parts = address.rsplit_once(':').and_then(|(host, port)| {
        let host = host.trim_start_matches('[').trim_end_matches(']');
        Some((host, u8::try_from(host.len()).ok()?, port.parse::<u16>().ok()?))
    });
    let (host, length, port) = parts
        .filter(|parts| parts.1 > 0)
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "an address is HOST:PORT"))?;
    let mut bytes = vec![VERSION, CONNECT, 0, BY_NAME, length];
    bytes.extend(host.as_bytes());
    bytes.extend(port.to_be_bytes());
    Ok(bytes)
}

/// What the proxy of the environment is called in errors.
pub(crate) const PROXY: &str = "the proxy (ARMOR_VIA)";
/// What the router to other hosts is called in errors.
pub(crate) const ROUTER: &str = "the way to the other host";

/// Adds to an error that it comes from the proxy, or from the way to it.
pub(crate) fn name_source(error: &io::Error, source: &str) -> io::Error {
    io::Error::new(error.kind(), format!("{source}: {error}"))
}

fn refuse(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::ConnectionRefused, why)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A proxy's answers, and what it receives.
    struct FakeProxy {
        answers: io::Cursor<Vec<u8>>,
        received: Vec<u8>,
    }

    impl Read for FakeProxy {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.answers.read(buffer)
        }
    }

    impl Write for FakeProxy {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.received.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn connect_with(answers: &[u8]) -> (io::Result<()>, FakeProxy) {
        let answers = io::Cursor::new(answers.to_vec());
        let mut proxy = FakeProxy { answers, received: Vec::new() };
        let result = request_connection(&mut proxy, "127.0.0.1:7411");
        (result, proxy)
    }

    #[test]
    fn the_target_is_requested_by_name() {
        let (result, proxy) = connect_with(&[5, 0, 5, 0, 0, 1, 127, 0, 0, 1, 0, 80, b'!']);
        result.unwrap();
        assert_eq!(proxy.received, b"\x05\x01\x00\x05\x01\x00\x03\x09127.0.0.1\x1c\xf3");
        assert_eq!(proxy.answers.position(), 12, "the bytes that follow are the peer's");
    }

    #[test]
    fn a_refusal_of_the_proxy_is_explained() {
        for (answer, words) in [
            (&b"HTTP/1.1 400 Bad Request"[..], "not a SOCKS5 proxy"),
            (&[5, 0xff], "requires a password"),
            (&[5, 0, 5, 5, 0, 1, 0, 0, 0, 0, 0, 0], "refused"),
            (&[5, 0, 5, 2, 0, 3, 1, b'x', 0, 0], "rules forbid"),
            (&[5, 0, 5, 0, 0, 9], "not SOCKS5"),
            (&[5, 0, 5], "fill whole buffer"),
        ] {
            let error = connect_with(answer).0.unwrap_err().to_string();
            assert!(error.contains(words), "{error} for {answer:?}");
        }
    }

    #[test]
    fn an_address_needs_host_and_port() {
        for bad in ["robot", ":80", "robot:", "robot:99999", &format!("{}:1", "x".repeat(300))] {
            assert!(connect_request(bad).is_err(), "{bad}");
        }
        assert_eq!(connect_request("[::1]:2").unwrap(), b"\x05\x01\x00\x03\x03::1\x00\x02");
    }
}
