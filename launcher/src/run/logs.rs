//! The output of all processes in one stream: read line by line, bounded, printed with time, name
//! and colour, and written to a file per process and one for all.
//!
//! Nothing here can hold up the supervision: the readers never wait for the printers, a full queue
//! counts what it leaves out, and a process that floods is cut to a rate of its own.

mod budget;
mod files;
mod line;
mod queue;
mod render;
mod splitter;

use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use tokio::io::{AsyncRead, AsyncReadExt};

use super::supervisor::Level;
use crate::arguments::Format;
use budget::Budget;
pub use line::{Line, Stream};
use queue::Queue;
use render::Renderer;
use splitter::Splitter;

/// How long the end of a run waits for a terminal that does not take its lines.
const CLOSE_WITHIN: Duration = Duration::from_secs(2);
/// Rest after reading a pipe whose lines are left out, so that a flood costs little.
const FLOOD_REST: Duration = Duration::from_millis(1);

/// Takes lines from everywhere. Clones share the sinks.
#[derive(Clone)]
pub struct Log {
    start: Instant,
    console: Arc<Queue>,
    files: Arc<Queue>,
}

/// The threads that print and write.
pub struct Sinks {
    log: Log,
    console: thread::JoinHandle<()>,
    files: thread::JoinHandle<()>,
}

impl Log {
    /// Opens `directory` for the files and starts printing; `names` is everybody who will speak.
    ///
    /// # Errors
    /// If the folder or the file for all cannot be made.
    pub fn start(directory: &Path, names: &[&str], format: Format) -> Result<(Self, Sinks)> {
        let log = Self {
            start: Instant::now(),
            console: Arc::new(Queue::default()),
            files: Arc::new(Queue::default()),
        };
        let files = files::Files::create(directory)?;
        let renderer = Renderer::for_stdout(names, format);
        let console = spawn("log-console", {
            let queue = log.console.clone();
            move || print(&queue, &renderer)
        })?;
        let files = spawn("log-files", {
            let log = log.clone();
            move || files.write_all(&log)
        })?;
        Ok((log.clone(), Sinks { log, console, files }))
    }

    /// Seconds since the start of the run.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Says something in the launcher's own name, or about the process `name`.
    pub fn say(&self, name: &str, level: Level, text: impl Into<String>) {
        self.push(Line::said(self.elapsed().as_secs_f64(), name, level, text.into()));
    }

    fn push(&self, line: Line) {
        let line = Arc::new(line);
        self.files.push(line.clone());
        self.console.push(line);
    }

    /// Reads `source` to its end. Never waits for the sinks.
    pub async fn read(self, name: Arc<str>, stream: Stream, mut source: impl AsyncRead + Unpin) {
        let mut splitter = Splitter::default();
        let mut budget = Budget::new(self.elapsed());
        let mut bytes = vec![0; 16 << 10];
        loop {
            let read = source.read(&mut bytes).await.unwrap_or(0);
            let now = self.elapsed();
            let mut flood = false;
            let mut take = |text: &[u8]| {
                if budget.take(now, text.len()) {
                    self.push(Line::read(now.as_secs_f64(), name.clone(), stream, text));
                } else {
                    flood = true;
                }
            };
            match read {
                0 => splitter.finish(&mut take),
                read => splitter.feed(&bytes[..read], &mut take),
            }
            if let Some(left_out) = budget.confession(now, read == 0) {
                self.say(&name, Level::Warn, format!("{left_out} lines were left out: too many"));
            }
            if read == 0 {
                return;
            }
            if flood {
                tokio::time::sleep(FLOOD_REST).await;
            }
        }
    }
}

impl Sinks {
    /// Prints and writes what is there, then ends; a stuck terminal is given up.
    pub fn close(self) {
        self.log.console.close();
        self.log.files.close();
        let deadline = Instant::now() + CLOSE_WITHIN;
        for thread in [self.console, self.files] {
            while !thread.is_finished() && Instant::now() < deadline {
                thread::sleep(Duration::from_millis(5));
            }
        }
    }
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<thread::JoinHandle<()>> {
    thread::Builder::new().name(name.into()).spawn(work).context("starting a thread for the log")
}

fn print(queue: &Queue, renderer: &Renderer) {
    let mut stdout = std::io::stdout();
    let mut text = String::new();
    while let Some((lines, left_out)) = queue.take() {
        text.clear();
        for line in &lines {
            renderer.render(line, &mut text);
        }
        if left_out > 0 {
            renderer.left_out(left_out, &mut text);
        }
        if stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).is_err() {
            // Nobody reads any more; the files go on.
            queue.close();
        }
    }
}
