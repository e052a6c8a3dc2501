//! Copies bytes between two streams in both directions. A connection that is idle holds no buffer: a link
//! between hosts sends little, and a gate has hundreds of them.

use std::cell::RefCell;
use std::future::poll_fn;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// Bytes that are passed on at a time: eight records of TLS. A call to the kernel for each record would
/// take as long as its cipher.
const COPY_LEN: usize = 128 << 10;

thread_local! {
    /// What is read goes through this buffer. Only what cannot be written immediately is kept.
    static SCRATCH: RefCell<Vec<u8>> = RefCell::new(vec![0; COPY_LEN]);
}

/// One direction.
#[derive(Default)]
struct CopiedWay {
    /// What was read and is not written yet, from `written` on; without memory while there is nothing.
    kept: Vec<u8>,
    written: usize,
    must_flush: bool,
    /// The reader has ended.
    has_ended: bool,
    /// Why the reader has failed after what was read before; reported once that is written.
    failure: Option<io::Error>,
    /// And the writer, too.
    is_done: bool,
}

/// Copies until both directions have ended, each of which is passed on.
///
/// # Errors
/// That of the first operation that fails.
pub(crate) async fn copy_both(
    one: &mut (impl AsyncRead + AsyncWrite + Unpin),
    other: &mut (impl AsyncRead + AsyncWrite + Unpin),
) -> io::Result<()> {
    let (mut there, mut back) = (CopiedWay::default(), CopiedWay::default());
    poll_fn(|context| {
        let there = there.poll_copy(context, Pin::new(&mut *one), Pin::new(&mut *other))?;
        let back = back.poll_copy(context, Pin::new(&mut *other), Pin::new(&mut *one))?;
        match (there, back) {
            (Poll::Ready(()), Poll::Ready(())) => Poll::Ready(Ok(())),
            _ => Poll::Pending,
        }
    })
    .await
}

impl CopiedWay {
    fn poll_copy(
        &mut self,
        context: &mut Context<'_>,
        mut reader: Pin<&mut impl AsyncRead>,
        mut writer: Pin<&mut impl AsyncWrite>,
    ) -> Poll<io::Result<()>> {
        if self.is_done {
            return Poll::Ready(Ok(()));
        }
        loop {
            while self.written < self.kept.len() {
                let rest = &self.kept[self.written..];
                self.written += count_written(ready!(writer.as_mut().poll_write(context, rest))?)?;
                self.must_flush = true;
            }
            (self.kept, self.written) = (Vec::new(), 0);
            if let Some(failure) = self.failure.take() {
                return Poll::Ready(Err(failure));
            }
            if self.has_ended {
                ready!(writer.as_mut().poll_shutdown(context))?;
                self.is_done = true;
                return Poll::Ready(Ok(()));
            }
            if self.poll_pass(context, reader.as_mut(), writer.as_mut())?.is_pending() {
                if self.must_flush {
                    ready!(writer.as_mut().poll_flush(context))?;
                    self.must_flush = false;
                }
                return Poll::Pending;
            }
        }
    }

    /// Reads what is there, a buffer at most, and writes what can be written of that; the rest is kept.
    fn poll_pass(
        &mut self,
        context: &mut Context<'_>,
        mut reader: Pin<&mut impl AsyncRead>,
        writer: Pin<&mut impl AsyncWrite>,
    ) -> Poll<io::Result<()>> {
        SCRATCH.with_borrow_mut(|scratch| {
            let mut buffer = ReadBuf::new(scratch);
            // TLS gives one record at a time, and a writer takes many as well as one.
            while buffer.remaining() > 0 && !self.has_ended {
                let before = buffer.filled().len();
                match reader.as_mut().poll_read(context, &mut buffer) {
                    Poll::Ready(Ok(())) => self.has_ended = buffer.filled().len() == before,
                    Poll::Ready(Err(error)) => {
                        self.failure = Some(error);
                        break;
                    }
                    Poll::Pending if before == 0 => return Poll::Pending,
                    Poll::Pending => break,
                }
            }
            let read = buffer.filled();
            if read.is_empty() {
                return Poll::Ready(Ok(()));
            }
            let written = match writer.poll_write(context, read)? {
                Poll::Ready(written) => count_written(written)?,
                Poll::Pending => 0,
            };
            self.must_flush |= written > 0;
            self.kept = read[written..].to_vec();
            Poll::Ready(Ok(()))
        })
    }
}

fn count_written(written: usize) -> io::Result<usize> {
    if written == 0 { Err(io::ErrorKind::WriteZero.into()) } else { Ok(written) }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};

    use super::*;

    #[tokio::test]
    async fn all_bytes_pass_in_both_directions_also_to_a_slow_reader() {
        let (mut near, mut near_end) = duplex(1000);
        let (mut far_end, mut far) = duplex(7);
        let copying =
            tokio::spawn(async move { copy_both(&mut near_end, &mut far_end).await.map(drop) });
        let sent: Vec<u8> = (0..200_000_u32).map(|number| number as u8).collect();
        let (there, back) = (sent.clone(), sent.clone());
        let sender = tokio::spawn(async move {
            near.write_all(&there).await.expect("it is taken");
            near.shutdown().await.expect("it is taken");
            let mut received = Vec::new();
            near.read_to_end(&mut received).await.expect("it ends");
            received
        });
        let mut received = Vec::new();
        // The end of this direction is passed on while the other one is still open.
        far.read_to_end(&mut received).await.expect("it ends");
        assert!(received == sent);
        far.write_all(&back).await.expect("it is taken");
        drop(far);
        assert!(sender.await.expect("no panic") == sent);
        assert!(copying.await.expect("no panic").is_ok());
    }

    #[tokio::test]
    async fn nothing_is_kept_while_nothing_waits() {
        let (mut near, mut near_end) = duplex(1 << 20);
        let (mut far_end, mut far) = duplex(100);
        let mut way = CopiedWay::default();
        near.write_all(&[7; 5000]).await.expect("it has room");
        let mut poll = |way: &mut CopiedWay| {
            let (near_end, far_end) = (Pin::new(&mut near_end), Pin::new(&mut far_end));
            let mut context = Context::from_waker(std::task::Waker::noop());
            assert!(way.poll_copy(&mut context, near_end, far_end).is_pending());
        };
        poll(&mut way);
        assert_eq!(way.kept.len() - way.written, 4900, "the far end takes 100 bytes at a time");
        let mut left = 5000;
        while left > 0 {
            let mut piece = [0; 100];
            left -= far.read(&mut piece).await.expect("there is more");
            poll(&mut way);
        }
        assert_eq!(way.kept.capacity(), 0);
    }

    /// A stream that gives some bytes, then fails once and ends, as a connection that is reset does.
    struct Reset(Vec<u8>, bool);

    impl AsyncRead for Reset {
        fn poll_read(
            mut self: Pin<&mut Self>,
            _: &mut Context<'_>,
            buffer: &mut ReadBuf<'_>,
        ) -> Poll<io::Result<()>> {
            if self.0.is_empty() {
                let is_reported = std::mem::replace(&mut self.1, true);
                let failure = (!is_reported).then(|| io::ErrorKind::ConnectionReset.into());
                return Poll::Ready(failure.map_or(Ok(()), Err));
            }
            buffer.put_slice(&std::mem::take(&mut self.0));
            Poll::Ready(Ok(()))
        }
    }

    impl AsyncWrite for Reset {
        fn poll_write(
            self: Pin<&mut Self>,
            _: &mut Context<'_>,
            bytes: &[u8],
        ) -> Poll<io::Result<usize>> {
            Poll::Ready(Ok(bytes.len()))
        }

        fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }

        fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }
    }

    #[tokio::test]
    async fn a_reset_ends_both_directions_after_what_came_before_it() {
        let (mut far_end, mut far) = duplex(1000);
        let mut near_end = Reset(b"the last words".to_vec(), false);
        let error = copy_both(&mut near_end, &mut far_end).await.expect_err("it is reset");
        assert_eq!(error.kind(), io::ErrorKind::ConnectionReset);
        drop(far_end);
        let mut received = Vec::new();
        far.read_to_end(&mut received).await.expect("it ends");
        assert_eq!(received, b"the last words");
    }

    /// A stream that gives a record of TLS at a time, and notes how much is written at a time.
    #[derive(Default)]
    struct Records {
        left: usize,
        written: Vec<usize>,
    }

    impl AsyncRead for Records {
        fn poll_read(
            mut self: Pin<&mut Self>,
            _: &mut Context<'_>,
            buffer: &mut ReadBuf<'_>,
        ) -> Poll<io::Result<()>> {
            let len = buffer.remaining().min(16 << 10).min(self.left);
            buffer.put_slice(&vec![7; len]);
            self.left -= len;
            Poll::Ready(Ok(()))
        }
    }

    impl AsyncWrite for Records {
        fn poll_write(
            mut self: Pin<&mut Self>,
            _: &mut Context<'_>,
            bytes: &[u8],
        ) -> Poll<io::Result<usize>> {
            self.written.push(bytes.len());
            Poll::Ready(Ok(bytes.len()))
        }

        fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }

        fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }
    }

    #[tokio::test]
    async fn records_that_are_there_are_passed_on_together() {
        let mut from = Records { left: 300_000, ..Records::default() };
        let mut to = Records::default();
        copy_both(&mut from, &mut to).await.expect("it ends");
        assert_eq!(to.written, [COPY_LEN, COPY_LEN, 300_000 - 2 * COPY_LEN]);
    }

    #[tokio::test]
    async fn a_writer_that_is_gone_ends_both_directions() {
        let (mut near, mut near_end) = duplex(1000);
        let (mut far_end, far) = duplex(1000);
        drop(far);
        near.write_all(b"for no one").await.expect("it has room");
        let error = copy_both(&mut near_end, &mut far_end).await.expect_err("no one is there");
        assert_eq!(error.kind(), io::ErrorKind::BrokenPipe);
    }

    #[tokio::test]
    async fn a_reader_that_takes_nothing_stops_the_sender_at_a_bound() {
        let (mut near, mut near_end) = duplex(1 << 20);
        let (mut far_end, _far) = duplex(100);
        let mut way = CopiedWay::default();
        near.write_all(&vec![7; 1 << 20]).await.expect("it has room");
        let mut context = Context::from_waker(std::task::Waker::noop());
        for _ in 0..10 {
            let ends = (Pin::new(&mut near_end), Pin::new(&mut far_end));
            assert!(way.poll_copy(&mut context, ends.0, ends.1).is_pending());
        }
        assert_eq!(way.kept.len(), COPY_LEN - 100);
        for taken in [Poll::Ready(COPY_LEN), Poll::Pending] {
            let sent = Pin::new(&mut near).poll_write(&mut context, &[7; COPY_LEN]);
            assert_eq!(sent.map(|sent| sent.expect("it is open")), taken);
        }
    }
}
