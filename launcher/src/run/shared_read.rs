//! Reads the output of processes through one buffer for all of them: most of them are silent, and a
//! launcher or an agent has two streams, each read twice, for every component.

use std::cell::RefCell;
use std::future::poll_fn;
use std::io;
use std::pin::Pin;
use std::task::{Poll, ready};

use tokio::io::{AsyncRead, ReadBuf};

/// What is read at a time, in bytes: a full pipe.
const READ_LEN: usize = 64 << 10;

thread_local! {
    /// Between two reads nothing of it is kept.
    static BUFFER: RefCell<Vec<u8>> = RefCell::new(vec![0; READ_LEN]);
}

/// Reads once, at most `most` bytes, and returns what `take` makes of them; at the end of the source it
/// gets none. `take` must not read itself.
///
/// # Errors
/// That of the source.
pub async fn read_once<T>(
    source: &mut (impl AsyncRead + Unpin),
    most: usize,
    mut take: impl FnMut(&[u8]) -> T,
) -> io::Result<T> {
    poll_fn(|context| {
        BUFFER.with_borrow_mut(|buffer| {
            let most = most.min(buffer.len());
            let mut buffer = ReadBuf::new(&mut buffer[..most]);
            ready!(Pin::new(&mut *source).poll_read(context, &mut buffer))?;
            Poll::Ready(Ok(take(buffer.filled())))
        })
    })
    .await
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncWriteExt, duplex};

    use super::*;

    #[tokio::test]
    async fn two_streams_share_the_buffer_and_get_their_own_bytes() {
        let (mut to_one, mut one) = duplex(100);
        let (mut to_other, mut other) = duplex(100);
        let waiting = tokio::spawn(async move {
            let mut read = Vec::new();
            while read_once(&mut one, 3, |bytes| read.extend_from_slice(bytes)).await.is_ok() {
                if read.len() >= 7 {
                    break;
                }
            }
            read
        });
        to_other.write_all(b"other").await.expect("it is taken");
        let read = read_once(&mut other, 100, <[u8]>::to_vec).await.expect("it is open");
        assert_eq!(read, b"other");
        to_one.write_all(b"the one").await.expect("it is taken");
        assert_eq!(waiting.await.expect("it ends"), b"the one");
        drop(to_other);
        assert_eq!(read_once(&mut other, 100, <[u8]>::len).await.expect("its end"), 0);
    }
}
