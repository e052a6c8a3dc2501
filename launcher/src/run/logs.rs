//! The output of all processes in one stream: read line by line, bounded, printed with time, name
//! and colour, and written to a file per process and one for all.
//!
//! Nothing here can delay the supervision: the readers never wait for the printers, a full queue
//! counts the lines that it leaves out, and a process that floods is limited to a rate of its own.

mod budget;
mod files;
mod line;
mod panics;
mod queue;
mod render;
mod splitter;

use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use tokio::io::AsyncRead;

use super::shared_read::read_once;
use super::status::StatusLine;
use super::supervisor::LogLevel;
use crate::arguments::OutputFormat;
use budget::LineBudget;
pub use files::EarlierLogs;
pub use line::{LogLine, LogStream};
use panics::LastPanics;
use queue::LineQueue;
use render::Renderer;
use splitter::Splitter;

/// Longest time that the end of a run waits for a blocked terminal.
const CLOSE_WITHIN: Duration = Duration::from_secs(2);
/// Rest while the lines of a pipe are left out, so that a flood costs little.
const FLOOD_REST: Duration = Duration::from_millis(1);
/// What is read of a flood between two rests, in bytes: 100 MB are read within a second or two, so
/// that the process that writes them is hardly delayed.
const READ_PER_REST: usize = 256 << 10;

/// Takes lines from everywhere. Clones share the sinks.
#[derive(Clone)]
pub struct RunLog {
    start: Instant,
    console: Arc<LineQueue>,
    files: Arc<LineQueue>,
    panics: LastPanics,
}

/// The threads that print and write.
pub struct Sinks {
    log: RunLog,
    console: thread::JoinHandle<()>,
    files: thread::JoinHandle<()>,
}

impl RunLog {
    /// Opens `directory` for the files and starts printing; `names` are the processes that will
    /// write.
    ///
    /// # Errors
    /// If the folder or the file for all cannot be made.
    pub fn start(
        directory: &Path,
        earlier: EarlierLogs,
        names: &[&str],
        format: OutputFormat,
        status: StatusLine,
    ) -> Result<(Self, Sinks)> {
        let log = Self {
            start: Instant::now(),
            console: Arc::new(LineQueue::default()),
            files: Arc::new(LineQueue::default()),
            panics: LastPanics::default(),
        };
        let files = files::LogFiles::create(directory, earlier)?;
        let renderer = Renderer::for_stdout(names, format);
        let console = spawn_thread("log-console", {
            let queue = log.console.clone();
            move || print_lines(&queue, &renderer, &status)
        })?;
        let files = spawn_thread("log-files", {
            let log = log.clone();
            move || files.write_all(&log)
        })?;
        Ok((log.clone(), Sinks { log, console, files }))
    }

    /// Returns the start of the run.
    pub fn start_time(&self) -> Instant {
        self.start
    }

    /// Returns the time since the start of the run.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Logs a message of the launcher, or about the process `name`.
    pub fn report(&self, name: &str, level: LogLevel, text: impl Into<String>) {
        self.push(LogLine::of_launcher(self.elapsed().as_secs_f64(), name, level, text.into()));
    }

    /// Takes the panic that a process has printed last.
    pub fn take_panic(&self, name: &str) -> Option<String> {
        self.panics.take(name)
    }

    fn push(&self, line: LogLine) {
        let line = Arc::new(line);
        self.files.push(line.clone());
        self.console.push(line);
    }

    /// Reads `source` to its end. Never waits for the sinks.
    pub async fn read(self, name: Arc<str>, stream: LogStream, mut source: impl AsyncRead + Unpin) {
        let mut splitter = Splitter::default();
        let mut budget = LineBudget::new(self.elapsed());
        let mut since_rest = 0;
        loop {
            let mut flood = false;
            let mut handle = |bytes: &[u8]| {
                let now = self.elapsed();
                let mut take = |text: &[u8]| {
                    if budget.spend_line(now, text.len()) {
                        let line = LogLine::read(now.as_secs_f64(), name.clone(), stream, text);
                        if stream == LogStream::Err {
                            self.panics.note_line(&name, &line.text);
                        }
                        self.push(line);
                    } else {
                        flood = true;
                    }
                };
                splitter.feed(bytes, &mut take);
                if bytes.is_empty() {
                    splitter.finish(&mut take);
                }
                bytes.len()
            };
            let read = read_once(&mut source, usize::MAX, &mut handle).await;
            // A stream that fails has ended.
            let read = read.unwrap_or_else(|_| handle(&[]));
            let now = self.elapsed();
            if let Some(left_out) = budget.take_left_out(now, read == 0) {
                self.report(
                    &name,
                    LogLevel::Warn,
                    format!("{left_out} lines were left out: too many"),
                );
            }
            if read == 0 {
                return;
            }
            since_rest += read;
            if flood && since_rest >= READ_PER_REST {
                since_rest = 0;
                tokio::time::sleep(FLOOD_REST).await;
            }
        }
    }
}

impl Sinks {
    /// Has the remaining lines printed and written, and does not wait for it.
    pub fn end(self) {
        self.log.console.close();
        self.log.files.close();
    }

    /// Prints and writes the remaining lines, then ends; a blocked terminal is given up.
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

fn spawn_thread(
    name: &str,
    work: impl FnOnce() + Send + 'static,
) -> Result<thread::JoinHandle<()>> {
    thread::Builder::new().name(name.into()).spawn(work).context("starting a thread for the log")
}

fn print_lines(queue: &LineQueue, renderer: &Renderer, status: &StatusLine) {
    let mut stdout = std::io::stdout();
    let mut text = String::new();
    while let Some((lines, left_out)) = queue.take_lines() {
        text.clear();
        for line in &lines {
            renderer.render(line, &mut text);
        }
        if left_out > 0 {
            renderer.left_out(left_out, &mut text);
        }
        let written =
            status.print_above(|| stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()));
        if written.is_err() {
            // stdout is closed; the files are still written.
            queue.close();
        }
    }
}
