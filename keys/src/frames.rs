//! One frame at a time on a stream whose next bytes may belong to another conversation: nothing is
//! read beyond the frame.

use std::io;

use armor_wire::codec;
use armor_wire::frame::{self, FrameKind, FrameReader, PREFIX_LEN};
use armor_wire::message::WireType;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

/// Longest body of a frame between a gate and its client, in bytes.
pub(crate) const MAX_BODY_LEN: usize = 16 << 10;

/// Sends one control frame.
pub(crate) async fn write_control<T: WireType>(
    stream: &mut (impl AsyncWrite + Unpin),
    value: &T,
) -> io::Result<()> {
    let bytes = frame::to_bytes(FrameKind::Control, value).map_err(io::Error::other)?;
    stream.write_all(&bytes).await?;
    stream.flush().await
}

/// Reads one control frame, and skips beats before it.
pub(crate) async fn read_control<T: WireType>(
    stream: &mut (impl AsyncRead + Unpin),
) -> io::Result<T> {
    loop {
        let (kind, body) = read_frame(stream).await?;
        match kind {
            FrameKind::Beat => {}
            FrameKind::Control => return codec::decode_control(&body).map_err(invalid),
            kind => return Err(invalid(format!("a {kind:?} frame where control is expected"))),
        }
    }
}

/// Reads one frame.
pub(crate) async fn read_frame(
    stream: &mut (impl AsyncRead + Unpin),
) -> io::Result<(FrameKind, Vec<u8>)> {
    let mut reader = FrameReader::with_limit(MAX_BODY_LEN);
    let mut prefix = [0; PREFIX_LEN];
    stream.read_exact(&mut prefix).await?;
    let mut arrived = prefix.as_slice();
    let mut body;
    loop {
        let space = reader.space();
        let len = arrived.len().min(space.len());
        space[..len].copy_from_slice(&arrived[..len]);
        reader.filled(len);
        arrived = &arrived[len..];
        if !arrived.is_empty() {
            continue;
        }
        if let Some(frame) = reader.next_frame().map_err(invalid)? {
            return Ok((frame.kind, frame.body.to_vec()));
        }
        // The reader has accepted the prefix, so the length is within its limit.
        let [a, b, c, d, ..] = prefix;
        body = vec![0; u32::from_le_bytes([a, b, c, d]) as usize];
        stream.read_exact(&mut body).await?;
        arrived = &body;
    }
}

fn invalid(error: impl ToString) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, error.to_string())
}

#[cfg(test)]
mod tests {
    use armor_wire::gate::GateRequest;

    use super::*;

    fn read(bytes: &[u8]) -> (io::Result<GateRequest>, usize) {
        let mut rest = bytes;
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        let result = runtime.block_on(read_control(&mut rest));
        (result, rest.len())
    }

    #[test]
    fn nothing_is_read_beyond_the_frame() {
        let request = GateRequest::Connect { address: "127.0.0.1:7411".into(), acts_for: None };
        let mut bytes = frame::signal(FrameKind::Beat).to_vec();
        bytes.extend(frame::to_bytes(FrameKind::Control, &request).unwrap());
        bytes.extend(b"the next conversation");
        let (read, left) = read(&bytes);
        assert_eq!((read.unwrap(), left), (request, 21));
    }

    #[test]
    fn garbage_and_what_is_cut_is_an_error() {
        let request = GateRequest::Connect { address: "x".repeat(MAX_BODY_LEN), acts_for: None };
        let long = frame::to_bytes(FrameKind::Control, &request).unwrap();
        let watch = frame::to_bytes(FrameKind::Control, &GateRequest::Watch).unwrap();
        let hello = frame::signal(FrameKind::Pause);
        for bytes in [&b""[..], b"GET / HTTP/1.1\r\n\r\n", &long, &watch[..10], &hello, &[0xff; 99]]
        {
            assert!(read(bytes).0.is_err(), "{bytes:?}");
        }
        assert_eq!(read(&watch).0.unwrap(), GateRequest::Watch);
    }
}
