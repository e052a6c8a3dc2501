//! Lines on their way to a sink: bounded in bytes, never waited for by who fills it.

use std::sync::{Arc, Condvar, Mutex, PoisonError};

use super::Line;

/// How much may wait for a slow terminal or disk, in bytes.
const MAX_BYTES: usize = 8 << 20;

/// From any thread to the one of the sink.
#[derive(Default)]
pub struct Queue {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

#[derive(Default)]
struct Waiting {
    lines: Vec<Arc<Line>>,
    bytes: usize,
    left_out: u64,
    closed: bool,
}

impl Queue {
    /// Adds a line, or counts it if there is no room.
    pub fn push(&self, line: Arc<Line>) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        if waiting.closed {
            return;
        }
        if waiting.bytes + line.size() > MAX_BYTES {
            waiting.left_out += 1;
            return;
        }
        waiting.bytes += line.size();
        waiting.lines.push(line);
        self.changed.notify_one();
    }

    /// Everything that waits and the number of lines left out; waits for the first. Nothing after
    /// the end.
    pub fn take(&self) -> Option<(Vec<Arc<Line>>, u64)> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        while waiting.lines.is_empty() {
            if waiting.closed {
                return None;
            }
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
        waiting.bytes = 0;
        let left_out = std::mem::take(&mut waiting.left_out);
        Some((std::mem::take(&mut waiting.lines), left_out))
    }

    /// Nothing more comes.
    pub fn close(&self) {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner).closed = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::logs::Stream;

    #[test]
    fn a_sink_that_takes_nothing_costs_bounded_memory_and_loses_nothing_silently() {
        let queue = Queue::default();
        let line = Arc::new(Line::read(0.0, "x".into(), Stream::Out, &[b'x'; 8000]));
        for _ in 0..10_000 {
            queue.push(line.clone());
        }
        let (lines, left_out) = queue.take().expect("lines wait");
        assert!(lines.len() * line.size() <= MAX_BYTES && lines.len() > 500);
        assert_eq!(lines.len() as u64 + left_out, 10_000);
        queue.push(line);
        queue.close();
        assert!(queue.take().is_some(), "what came before the end is still given");
        assert!(queue.take().is_none());
    }
}
