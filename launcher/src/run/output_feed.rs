//! Output of a process that arrives in pieces, as a stream that the log reads.

use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::io::{AsyncRead, ReadBuf};
use tokio::sync::mpsc;

/// Pieces that wait for the log; one has up to some KiB.
const MAX_PIECES: usize = 256;

/// Takes the pieces.
#[derive(Debug)]
pub struct OutputFeed(mpsc::Sender<Vec<u8>>);

/// Gives them to the log; ends when the feed is dropped.
#[derive(Debug)]
pub struct FedOutput {
    pieces: mpsc::Receiver<Vec<u8>>,
    rest: Vec<u8>,
}

/// Makes both ends.
pub fn open_feed() -> (OutputFeed, FedOutput) {
    let (sender, pieces) = mpsc::channel(MAX_PIECES);
    (OutputFeed(sender), FedOutput { pieces, rest: Vec::new() })
}

impl OutputFeed {
    /// Adds a piece when there is room for it.
    pub async fn add(&self, piece: Vec<u8>) {
        // The log reads to the end.
        let _ = self.0.send(piece).await;
    }

    /// Adds a piece, unless too many wait; returns whether it was added.
    pub fn push(&self, piece: Vec<u8>) -> bool {
        self.0.try_send(piece).is_ok()
    }
}

impl AsyncRead for FedOutput {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<std::io::Result<()>> {
        while self.rest.is_empty() {
            match self.pieces.poll_recv(context) {
                Poll::Ready(Some(piece)) => self.rest = piece,
                Poll::Ready(None) => return Poll::Ready(Ok(())),
                Poll::Pending => return Poll::Pending,
            }
        }
        let len = self.rest.len().min(buffer.remaining());
        buffer.put_slice(&self.rest[..len]);
        self.rest.drain(..len);
        Poll::Ready(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::AsyncReadExt;

    use super::*;

    #[test]
    fn all_pieces_are_read_in_order_and_then_the_end() {
        let (feed, mut output) = open_feed();
        for piece in ["one ", "", "two"] {
            assert!(feed.push(piece.into()));
        }
        drop(feed);
        let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
        let mut read = String::new();
        let len = runtime.block_on(output.read_to_string(&mut read)).expect("it cannot fail");
        assert_eq!((len, read.as_str()), (7, "one two"));
    }

    #[test]
    fn what_nothing_reads_costs_bounded_memory() {
        let (feed, _output) = open_feed();
        let pushed = (0..2 * MAX_PIECES).filter(|_| feed.push(vec![0; 9])).count();
        assert_eq!(pushed, MAX_PIECES);
    }
}
