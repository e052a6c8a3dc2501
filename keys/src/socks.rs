//! The server's half of SOCKS5 (RFC 1928), as far as the tools of this user need it: connecting,
//! without a password.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr};

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

const VERSION: u8 = 5;
const WITHOUT_PASSWORD: u8 = 0;
const NO_METHOD: u8 = 0xff;
const CONNECT: u8 = 1;
const BY_IPV4: u8 = 1;
const BY_NAME: u8 = 3;
const BY_IPV6: u8 = 4;

/// The answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SocksAnswer {
    Connected = 0,
    Forbidden = 2,
    Unreachable = 4,
    ConnectionRefused = 5,
    OtherCommand = 7,
    OtherAddress = 8,
}

/// Reads the greeting and the request; returns the address, `host:port`.
pub(crate) async fn read_request(
    stream: &mut (impl AsyncRead + AsyncWrite + Unpin),
) -> io::Result<String> {
    let [version, methods] = read_bytes(stream).await?;
    if version != VERSION {
        return Err(io::ErrorKind::InvalidData.into());
    }
    let mut offered = vec![0; methods.into()];
    stream.read_exact(&mut offered).await?;
    if !offered.contains(&WITHOUT_PASSWORD) {
        stream.write_all(&[VERSION, NO_METHOD]).await?;
        return Err(io::ErrorKind::InvalidData.into());
    }
    stream.write_all(&[VERSION, WITHOUT_PASSWORD]).await?;
    let [version, command, _, kind] = read_bytes(stream).await?;
    if version != VERSION {
        return Err(io::ErrorKind::InvalidData.into());
    }
    let host = match kind {
        BY_IPV4 => Ipv4Addr::from(read_bytes::<4>(stream).await?).to_string(),
        BY_IPV6 => format!("[{}]", Ipv6Addr::from(read_bytes::<16>(stream).await?)),
        BY_NAME => {
            let [len] = read_bytes(stream).await?;
            let mut name = vec![0; len.into()];
            stream.read_exact(&mut name).await?;
            let name = String::from_utf8(name).map_err(io::Error::other)?;
            if name.contains(':') { format!("[{name}]") } else { name }
        }
        _ => {
            answer(stream, SocksAnswer::OtherAddress).await?;
            return Err(io::ErrorKind::InvalidData.into());
        }
    };
    let port = u16::from_be_bytes(read_bytes(stream).await?);
    if command != CONNECT {
        answer(stream, SocksAnswer::OtherCommand).await?;
        return Err(io::ErrorKind::InvalidData.into());
    }
    Ok(format!("{host}:{port}"))
}

/// Greets a proxy, and reads its answer: whether one is there.
pub(crate) async fn greet(stream: &mut (impl AsyncRead + AsyncWrite + Unpin)) -> io::Result<()> {
    stream.write_all(&[VERSION, 1, WITHOUT_PASSWORD]).await?;
    match read_bytes(stream).await? {
        [VERSION, WITHOUT_PASSWORD] => Ok(()),
        _ => Err(io::ErrorKind::InvalidData.into()),
    }
}

/// Answers a request. The address from which the gate connects is not sent: no tool needs it.
pub(crate) async fn answer(
    stream: &mut (impl AsyncWrite + Unpin),
    answer: SocksAnswer,
) -> io::Result<()> {
    stream.write_all(&[VERSION, answer as u8, 0, BY_IPV4, 0, 0, 0, 0, 0, 0]).await
}

async fn read_bytes<const N: usize>(stream: &mut (impl AsyncRead + Unpin)) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    stream.read_exact(&mut bytes).await?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The address that a client asks for, and the answers to it.
    fn read(request: &[u8]) -> (io::Result<String>, Vec<u8>) {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        runtime.block_on(async {
            let (mut near, mut far) = tokio::io::duplex(1 << 10);
            far.write_all(request).await.unwrap();
            far.shutdown().await.unwrap();
            let result = read_request(&mut near).await;
            drop(near);
            let mut answers = Vec::new();
            far.read_to_end(&mut answers).await.unwrap();
            (result, answers)
        })
    }

    #[test]
    fn an_address_is_read_in_each_of_its_forms() {
        for (request, address) in [
            (&b"\x05\x01\x00\x05\x01\x00\x03\x09127.0.0.1\x1c\xf3"[..], "127.0.0.1:7411"),
            (b"\x05\x02\x02\x00\x05\x01\x00\x01\x7f\x00\x00\x01\x00\x50", "127.0.0.1:80"),
            (b"\x05\x01\x00\x05\x01\x00\x03\x03::1\x00\x02", "[::1]:2"),
            (b"\x05\x01\x00\x05\x01\x00\x04\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x01\x00\x02", "[::1]:2"),
        ] {
            let (read, answers) = read(request);
            assert_eq!((read.unwrap().as_str(), answers.as_slice()), (address, &[5, 0][..]));
        }
    }

    #[test]
    fn anything_else_is_refused() {
        for (request, answers) in [
            (&b""[..], &b""[..]),
            (b"GET / HTTP/1.1\r\n\r\n", b""),
            (b"\x04\x01\x00\x50\x7f\x00\x00\x01", b""),
            (b"\x05\x01\x02", b"\x05\xff"),
            (b"\x05\x01\x00\x05\x02\x00\x03\x01x\x00\x02", b"\x05\0\x05\x07\0\x01\0\0\0\0\0\0"),
            (b"\x05\x01\x00\x05\x01\x00\x09", b"\x05\0\x05\x08\0\x01\0\0\0\0\0\0"),
            (b"\x05\x01\x00\x05\x01\x00\x03\xffx", b"\x05\0"),
        ] {
            let (read, answered) = read(request);
            assert!(read.is_err() && answered == answers, "{request:?}: {answered:?}");
        }
    }
}
