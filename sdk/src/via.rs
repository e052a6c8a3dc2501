//! The way to a system on another host while everything listens on loopback: a SOCKS5 proxy (RFC
//! 1928), as `ssh -D` opens it, at whose far end the addresses mean what they mean there.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// `host:port` of the proxy through which this process reaches everybody.
const PROXY_VARIABLE: &str = "ARMOR_VIA";
/// The one port this process listens on, so that it can be led back here (`ssh -R`).
const PORT_VARIABLE: &str = "ARMOR_PORT";

const VERSION: u8 = 5;
const WITHOUT_PASSWORD: u8 = 0;
const CONNECT: u8 = 1;
const BY_NAME: u8 = 3;

/// The proxy, if this process was told of one.
pub(crate) fn proxy() -> Option<String> {
    std::env::var(PROXY_VARIABLE).ok().filter(|proxy| !proxy.is_empty())
}

/// The port to listen on, if this process was told one.
///
/// # Errors
/// If what it was told is no port.
pub(crate) fn port() -> io::Result<Option<u16>> {
    let Some(text) = std::env::var(PORT_VARIABLE).ok().filter(|port| !port.is_empty()) else {
        return Ok(None);
    };
    match text.parse() {
        Ok(port) if port > 0 => Ok(Some(port)),
        _ => Err(io::Error::other(format!(
            "{PORT_VARIABLE} is `{text}`; it takes a port, 1 … 65535"
        ))),
    }
}

/// Asks the proxy at the other end of `stream` to lead on to `address`, within `limit` for each of
/// its answers. Afterwards the stream is one to that address.
pub(crate) fn lead_on(stream: &TcpStream, address: &str, limit: Duration) -> io::Result<()> {
    stream.set_read_timeout(Some(limit))?;
    stream.set_write_timeout(Some(limit))?;
    ask(stream, address)?;
    stream.set_write_timeout(None)
}

fn ask(mut stream: impl Read + Write, address: &str) -> io::Result<()> {
    let request = request(address)?;
    stream.write_all(&[VERSION, 1, WITHOUT_PASSWORD])?;
    let mut method = [0; 2];
    stream.read_exact(&mut method)?;
    if method != [VERSION, WITHOUT_PASSWORD] {
        return Err(refused("it is no SOCKS5 proxy, or wants a password"));
    }
    stream.write_all(&request)?;
    // Version, verdict, reserved, kind of the address that follows.
    let mut answer = [0; 4];
    stream.read_exact(&mut answer)?;
    let length = match answer[3] {
        1 => 4,
        4 => 16,
        BY_NAME => {
            let mut length = [0];
            stream.read_exact(&mut length)?;
            usize::from(length[0])
        }
        _ => return Err(refused("its answer is not one of SOCKS5")),
    };
    // From where the proxy connects and the port of that: of no interest, but they are sent.
    let mut bound = [0; 255 + 2];
    stream.read_exact(&mut bound[..length + 2])?;
    match answer[1] {
        0 => Ok(()),
        1 => Err(refused("it cannot")),
        2 => Err(refused("it may not")),
        3 | 4 => Err(refused("there is no way there from its end")),
        5 => Err(io::ErrorKind::ConnectionRefused.into()),
        6 => Err(io::ErrorKind::TimedOut.into()),
        code => Err(refused(&format!("it says no (code {code})"))),
    }
}

/// By name, also where that is a number: it is the far end that looks it up.
fn request(address: &str) -> io::Result<Vec<u8>> {
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

/// The proxy itself cannot be reached.
pub(crate) fn not_there(error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("the proxy ({PROXY_VARIABLE}): {error}"))
}

fn refused(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::ConnectionRefused, format!("the proxy ({PROXY_VARIABLE}): {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a proxy says, and what is said to it.
    struct Talk {
        answers: io::Cursor<Vec<u8>>,
        said: Vec<u8>,
    }

    impl Read for Talk {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.answers.read(buffer)
        }
    }

    impl Write for Talk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.said.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn talk(answers: &[u8]) -> (io::Result<()>, Talk) {
        let mut talk = Talk { answers: io::Cursor::new(answers.to_vec()), said: Vec::new() };
        let result = ask(&mut talk, "127.0.0.1:7411");
        (result, talk)
    }

    #[test]
    fn the_far_end_is_asked_for_by_name() {
        let (result, talk) = talk(&[5, 0, 5, 0, 0, 1, 127, 0, 0, 1, 0, 80, b'!']);
        result.unwrap();
        assert_eq!(talk.said, b"\x05\x01\x00\x05\x01\x00\x03\x09127.0.0.1\x1c\xf3");
        assert_eq!(talk.answers.position(), 12, "what follows is the peer's");
    }

    #[test]
    fn what_a_proxy_refuses_is_said_in_words() {
        for (answer, words) in [
            (&b"HTTP/1.1 400 Bad Request"[..], "no SOCKS5 proxy"),
            (&[5, 0xff], "wants a password"),
            (&[5, 0, 5, 5, 0, 1, 0, 0, 0, 0, 0, 0], "refused"),
            (&[5, 0, 5, 2, 0, 3, 1, b'x', 0, 0], "may not"),
            (&[5, 0, 5, 0, 0, 9], "not one of SOCKS5"),
            (&[5, 0, 5], "fill whole buffer"),
        ] {
            let error = talk(answer).0.unwrap_err().to_string();
            assert!(error.contains(words), "{error} for {answer:?}");
        }
    }

    #[test]
    fn an_address_needs_host_and_port() {
        for bad in ["robot", ":80", "robot:", "robot:99999", &format!("{}:1", "x".repeat(300))] {
            assert!(request(bad).is_err(), "{bad}");
        }
        assert_eq!(request("[::1]:2").unwrap(), b"\x05\x01\x00\x03\x03::1\x00\x02");
    }
}
