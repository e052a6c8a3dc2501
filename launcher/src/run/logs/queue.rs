//! Lines queued for a sink: bounded in bytes, and pushing never waits.

use std::sync::Arc;

use parking_lot::{Condvar, Mutex};

use super::LogLine;

/// How much may wait for a slow terminal or disk, in bytes.
const MAX_BYTES: usize = 8 << 20;

/// From any thread to the one of the sink.
#[derive(Default)]
pub struct LineQueue {
    waiting: Mutex<WaitingLines>,
    changed: Condvar,
}

#[derive(Default)]
struct WaitingLines {
    lines: Vec<Arc<LogLine>>,
    bytes: usize,
    left_out: u64,
    closed: bool,
}

impl LineQueue {
    /// Adds a line, or counts it if there is no room.
    pub fn push(&self, line: Arc<LogLine>) {
        let mut waiting = self.waiting.lock();
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
    pub fn take_lines(&self) -> Option<(Vec<Arc<LogLine>>, u64)> {
        let mut waiting = self.waiting.lock();
        while waiting.lines.is_empty() {
            if waiting.closed {
                return None;
            }
            self.changed.wait(&mut waiting);
        }
        waiting.bytes = 0;
        let left_out = std::mem::take(&mut waiting.left_out);
        Some((std::mem::take(&mut waiting.lines), left_out))
    }

    /// Nothing more comes.
    pub fn close(&self) {
        self.waiting.lock().closed = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::logs::LogStream;

    #[test]
    fn a_sink_that_takes_nothing_costs_bounded_memory_and_loses_nothing_silently() {
        let queue = LineQueue::default();
        let line = Arc::new(LogLine::read(0.0, "x".into(), LogStream::Out, &[b'x'; 8000]));
        for _ in 0..10_000 {
            queue.push(line.clone());
        }
        let (lines, left_out) = queue.take_lines().expect("lines wait");
        assert!(lines.len() * line.size() <= MAX_BYTES && lines.len() > 500);
        assert_eq!(lines.len() as u64 + left_out, 10_000);
        queue.push(line);
        queue.close();
        assert!(queue.take_lines().is_some(), "what came before the end is still given");
        assert!(queue.take_lines().is_none());
    }
}
