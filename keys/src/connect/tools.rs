//! A SOCKS5 proxy on loopback, which carries each connection of this user's tools over TLS to the gate.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::AcceptLog;
use tokio::net::{TcpListener, TcpStream};
use tokio::time;

use super::{GateClient, GateError, LIMIT};
use crate::streams::own_stream;

/// Rest after a connection of a tool that could not be accepted, such as for want of descriptors.
const ACCEPT_REST: Duration = Duration::from_millis(200);

/// What [`GateClient::serve_tools`] reports.
#[derive(Debug)]
pub enum ToolNotice {
    /// A tool's connection was not carried to the gate.
    NotCarried(GateError),
    /// No tool's connection can be accepted; it is tried again.
    NotAccepting(io::Error),
    /// Connections are accepted again.
    AcceptsAgain,
}

impl GateClient {
    /// Serves the tools of this user: each of their connections is carried to the gate. `report` gets
    /// what prevents that.
    pub async fn serve_tools(
        self: Arc<Self>,
        listener: TcpListener,
        report: impl Fn(ToolNotice) + Clone + Send + 'static,
    ) {
        let mut log = AcceptLog::default();
        loop {
            let stream = match listener.accept().await {
                Ok((stream, _)) => stream,
                Err(error) => {
                    if log.note_failure(Instant::now()) {
                        report(ToolNotice::NotAccepting(error));
                    }
                    time::sleep(ACCEPT_REST).await;
                    continue;
                }
            };
            if log.note_success() {
                report(ToolNotice::AcceptsAgain);
            }
            let (client, report) = (Arc::clone(&self), report.clone());
            tokio::spawn(async move {
                if let Err(error) = client.serve_tool(stream).await {
                    report(ToolNotice::NotCarried(error));
                }
            });
        }
    }

    async fn serve_tool(&self, stream: TcpStream) -> Result<(), GateError> {
        // Other users of this computer do not act with this key.
        let Ok(mut tool) = own_stream(stream) else { return Ok(()) };
        let Ok(Ok(address)) = time::timeout(LIMIT, crate::socks::read_request(&mut tool)).await
        else {
            return Ok(());
        };
        // Tools do not ask for datagrams.
        self.carry(tool, address, None).await
    }
}
