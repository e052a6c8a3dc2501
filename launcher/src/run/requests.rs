//! The launcher's socket: requests to restart or stop a component, each answered with one line.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_inspect::run_control::{MAX_LINE_LEN, RunReply, RunRequest, socket_path};
use armor_socket::{AcceptLog, check_unix};
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::{Semaphore, mpsc, oneshot};

use super::logs::RunLog;
use super::plan::LAUNCHER;
use super::supervisor::LogLevel;

/// Connections served in parallel; the others wait.
const AT_ONCE: usize = 8;
/// Time within which a client must send its request, and take the reply.
const CLIENT_WITHIN: Duration = Duration::from_secs(2);
/// Rest after a connection that could not be accepted, such as for want of descriptors.
const ACCEPT_REST: Duration = Duration::from_millis(100);

/// A request, and where its reply goes.
#[derive(Debug)]
pub struct ReceivedRequest {
    /// The request.
    pub request: RunRequest,
    /// Takes the reply.
    pub reply: oneshot::Sender<RunReply>,
}

/// The socket; removed when this is dropped.
#[derive(Debug)]
pub struct RequestSocket(PathBuf);

impl RequestSocket {
    /// Listens, and sends every request to `requests`. `log` gets when no request can be received.
    ///
    /// # Errors
    /// If the socket cannot be made.
    pub fn listen(
        system: &str,
        requests: mpsc::Sender<ReceivedRequest>,
        log: RunLog,
    ) -> Result<Self> {
        let path = socket_path(system, std::process::id())?;
        // Left behind by a launcher that had the same process id and was killed.
        let _ = std::fs::remove_file(&path);
        let listener = UnixListener::bind(&path)
            .with_context(|| format!("the socket {} cannot be made", path.display()))?;
        tokio::spawn(accept_clients(listener, requests, log));
        Ok(Self(path))
    }
}

impl Drop for RequestSocket {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

async fn accept_clients(
    listener: UnixListener,
    requests: mpsc::Sender<ReceivedRequest>,
    log: RunLog,
) {
    let seats = Arc::new(Semaphore::new(AT_ONCE));
    let mut accepting = AcceptLog::default();
    while let Ok(seat) = seats.clone().acquire_owned().await {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(error) => {
                if accepting.note_failure(Instant::now()) {
                    let text = format!("armor restart and stop get no answer: {error}");
                    log.report(LAUNCHER, LogLevel::Warn, text);
                }
                tokio::time::sleep(ACCEPT_REST).await;
                continue;
            }
        };
        if accepting.note_success() {
            log.report(LAUNCHER, LogLevel::Info, "armor restart and stop work again");
        }
        if check_unix(&stream).is_ok() {
            let requests = requests.clone();
            tokio::spawn(async move {
                // A client that leaves or sends no request gets no reply.
                let serving = serve_client(stream, requests);
                let _ = tokio::time::timeout(CLIENT_WITHIN, serving).await;
                drop(seat);
            });
        }
    }
}

async fn serve_client(
    stream: UnixStream,
    requests: mpsc::Sender<ReceivedRequest>,
) -> std::io::Result<()> {
    let (reader, mut writer) = stream.into_split();
    let mut line = String::new();
    BufReader::new(reader.take(MAX_LINE_LEN as u64)).read_line(&mut line).await?;
    let answer = match serde_json::from_str(&line) {
        Ok(request) => {
            let (reply, replied) = oneshot::channel();
            let _ = requests.send(ReceivedRequest { request, reply }).await;
            replied.await.unwrap_or_else(|_| refusal("the system is ending".into()))
        }
        Err(error) => refusal(format!("this is no request: {error}")),
    };
    writer.write_all(format!("{}\n", serde_json::to_string(&answer)?).as_bytes()).await
}

/// A reply that refuses.
pub fn refusal(text: String) -> RunReply {
    RunReply {
        accepted: false,
        text,
        absent: Vec::new(),
        hosts: Vec::new(),
        has_executive: None,
        history: None,
    }
}
