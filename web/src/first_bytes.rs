//! What the first bytes of a connection ask for: STOP, which a thread of its own serves, or anything
//! else.

use std::io;
use std::time::Duration;

use tokio::net::TcpStream;
use tokio::time::sleep;

/// Time between two looks at a first line that has arrived in part.
const LOOK_AGAIN: Duration = Duration::from_millis(5);
/// What the path of every request for STOP begins with.
const STOP_PATH: &[u8] = b"/api/stop";

/// Looks at the first bytes of a connection without taking them.
pub(crate) async fn asks_for_stop(stream: &TcpStream) -> io::Result<bool> {
    let mut bytes = [0; 32];
    loop {
        let len = stream.peek(&mut bytes).await?;
        if len == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        if let Some(answer) = is_stop_request(&bytes[..len]) {
            return Ok(answer);
        }
        // Bytes that have been looked at stay ready, so the rest of the line cannot be waited for.
        sleep(LOOK_AGAIN).await;
    }
}

/// Returns whether a request that begins with these bytes asks for STOP; `None` if more are needed.
pub(crate) fn is_stop_request(bytes: &[u8]) -> Option<bool> {
    /// Longest method of HTTP.
    const METHOD_LEN: usize = 7;
    let Some(space) = bytes.iter().position(|byte| *byte == b' ') else {
        return (bytes.len() > METHOD_LEN).then_some(false);
    };
    let path = &bytes[space + 1..];
    let common = path.len().min(STOP_PATH.len());
    if path[..common] != STOP_PATH[..common] {
        return Some(false);
    }
    (path.len() >= STOP_PATH.len()).then_some(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bytes_decide_which_thread_serves_a_connection() {
        for (bytes, expected) in [
            ("POST /api/stop HTTP/1.1", Some(true)),
            ("GET /api/stop/live HTTP/1.1", Some(true)),
            ("GET /api/system HTTP/1.1", Some(false)),
            ("GET / HTTP/1.1", Some(false)),
            ("GET /api/s", None),
            ("GET", None),
            ("DELETE /api/stop", Some(true)),
            ("BREWINGS", Some(false)),
            ("\u{16}\u{3}\u{1}\u{2}\u{0}\u{1}\u{0}\u{1}", Some(false)),
        ] {
            assert_eq!(is_stop_request(bytes.as_bytes()), expected, "{bytes:?}");
        }
    }
}
