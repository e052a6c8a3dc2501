//! The begin of a connection from another host: the TLS handshake, and the first bytes of the first
//! request, by which the thread for STOP knows what to serve itself.
//!
//! All of it runs on the thread for STOP, because what is requested can be read only after the
//! handshake. A handshake takes a fraction of a millisecond of it, and the places for connections that
//! have requested nothing bound how many can be ready at the same time.

use std::io;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_rustls::TlsAcceptor;

use super::RemoteAccess;
use super::connection::RemoteConnection;
use super::stream::RemoteStream;

/// Time for the handshake, also over a slow mobile network.
const HANDSHAKE_WITHIN: Duration = Duration::from_secs(5);
/// Time for the first bytes of the first request: browsers open connections ahead of use.
const FIRST_BYTES_WITHIN: Duration = Duration::from_secs(10);
/// Time for a client that does not speak TLS to receive its hint.
const HINT_WITHIN: Duration = Duration::from_secs(2);
/// Longest request without TLS of which the host is read.
const MAX_PLAIN_LEN: usize = 4 << 10;
/// What a TLS connection begins with: the record type of a handshake.
const TLS_HANDSHAKE: u8 = 22;
/// First bytes that are enough to know what is requested.
const FIRST_LEN: usize = 32;

/// Begins a connection; `None` if it has ended, or was no browser's. `is_stop` returns whether the first
/// bytes ask for STOP, and `None` if more are needed.
pub(crate) async fn begin_connection(
    remote: &Arc<RemoteAccess>,
    mut stream: TcpStream,
    address: IpAddr,
    is_stop: impl Fn(&[u8]) -> Option<bool>,
) -> Option<RemoteStream> {
    let host = remote.host_now();
    if host.refused.is_some() {
        return None;
    }
    let mut byte = [0; 1];
    match timeout(HANDSHAKE_WITHIN, stream.peek(&mut byte)).await {
        Ok(Ok(1)) if byte[0] == TLS_HANDSHAKE => {}
        Ok(Ok(1)) if byte[0].is_ascii_uppercase() => {
            remote.log_once(address, "it has asked for http instead of https".into());
            let _ = timeout(HINT_WITHIN, hint_at_https(remote, &mut stream)).await;
            return None;
        }
        _ => return None,
    }
    let _ = stream.set_nodelay(true);
    let acceptor = TlsAcceptor::from(Arc::clone(&host.config));
    let mut tls = match timeout(HANDSHAKE_WITHIN, acceptor.accept(stream)).await {
        Ok(Ok(tls)) => tls,
        Ok(Err(error)) => {
            remote.log_once(address, format!("no TLS connection: {error}"));
            return None;
        }
        Err(_) => return None,
    };
    let mut first = Vec::new();
    let reading = async {
        let mut bytes = [0; FIRST_LEN];
        while is_stop(&first).is_none() && first.len() < FIRST_LEN {
            let len = tls.read(&mut bytes).await?;
            if len == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            first.extend_from_slice(&bytes[..len]);
        }
        Ok::<_, io::Error>(())
    };
    if !matches!(timeout(FIRST_BYTES_WITHIN, reading).await, Ok(Ok(()))) {
        return None;
    }
    let for_stop = is_stop(&first) == Some(true);
    let connection = Arc::new(RemoteConnection::new(address, for_stop));
    remote.add_connection(&connection);
    Some(RemoteStream::new(tls, first, connection))
}

/// Answers a request without TLS: where the page is.
async fn hint_at_https(remote: &RemoteAccess, stream: &mut TcpStream) -> io::Result<()> {
    let mut request = Vec::new();
    let mut bytes = [0; 1024];
    while request.len() < MAX_PLAIN_LEN && !request.windows(4).any(|it| it == b"\r\n\r\n") {
        let len = stream.read(&mut bytes).await?;
        if len == 0 {
            break;
        }
        request.extend_from_slice(&bytes[..len]);
    }
    let host = find_host(&request).filter(|host| remote.is_own_host(host));
    let text = compose_hint(host, &remote.urls(remote.listen.port()));
    stream.write_all(text.as_bytes()).await?;
    stream.shutdown().await
}

/// Returns the value of the header `Host`.
fn find_host(request: &[u8]) -> Option<&str> {
    let text = std::str::from_utf8(request).ok()?;
    let fields = text.lines().skip(1).filter_map(|line| line.split_once(':'));
    let mut hosts = fields.filter(|(name, _)| name.eq_ignore_ascii_case("host"));
    hosts.next().map(|(_, value)| value.trim())
}

/// Returns the answer: the page under the same host, if that is one of this robot.
fn compose_hint(host: Option<&str>, urls: &[String]) -> String {
    let first = urls.first().map_or("https://", String::as_str);
    let (status, url, location) = match host {
        Some(host) => {
            let url = format!("https://{host}/");
            let location = format!("Location: {url}\r\n");
            ("308 Permanent Redirect", url, location)
        }
        None => ("400 Bad Request", first.to_owned(), String::new()),
    };
    let body = format!("This port speaks HTTPS only. Open {url}\n");
    format!(
        "HTTP/1.1 {status}\r\n{location}Content-Type: text/plain; charset=utf-8\r\n\
         Content-Length: {}\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n{body}",
        body.len()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_without_tls_is_led_to_the_page() {
        let request = b"GET /a HTTP/1.1\r\nAccept: */*\r\nhost: robot:8443\r\n\r\n";
        assert_eq!(find_host(request), Some("robot:8443"));
        for none in [&b"GET / HTTP/1.1\r\n\r\n"[..], b"", b"GET\xff", b"\r\n\r\n"] {
            assert_eq!(find_host(none), None);
        }
        let urls = ["https://robot:8443/".to_owned()];
        let answer = compose_hint(Some("robot:8443"), &urls);
        assert!(answer.contains("Location: https://robot:8443/\r\n"), "{answer}");
        let answer = compose_hint(None, &urls);
        assert!(answer.starts_with("HTTP/1.1 400 "), "{answer}");
        assert!(answer.contains("Open https://robot:8443/\n"), "{answer}");
        assert!(!answer.contains("Location"), "no host of a stranger: {answer}");
    }
}
