//! One client of a gate from its request to its end: forwarded to a process of the system, or
//! watching its session.

use std::io;
use std::net::SocketAddr;

use armor_wire::frame::{self, FrameKind};
use armor_wire::gate::{GateReply, GateRequest};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::liveness::{BEAT, SILENCE};
use tokio::io::{
    AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, copy_bidirectional_with_sizes,
};
use tokio::net::TcpStream;
use tokio::time;
use tokio_rustls::server::TlsStream;
use tracing::{debug, info};

use super::dial::dial_process;
use super::limits::{COPY_LEN, LINGER};
use super::sessions::SessionPlace;
use super::{Client, Gate};
use crate::frames::{read_frame, write_control};

impl Gate {
    pub(super) async fn serve_session(&self, mut client: Client, address: SocketAddr) {
        let process = match &client.request {
            GateRequest::Watch => "the gate",
            GateRequest::Connect { address } => address,
        };
        let place = self.sessions.admit(&client.facts, process).and_then(|place| {
            // It may have been revoked after the handshake, and before it had its place.
            let is_revoked = self.keys.lock().revoked.contains(&client.facts.serial);
            if is_revoked { Err("the key is revoked".into()) } else { Ok(place) }
        });
        match place {
            Ok(place) => match client.request.clone() {
                GateRequest::Watch => self.serve_watch(client, place, address).await,
                GateRequest::Connect { address } => self.forward(client, place, address).await,
            },
            Err(text) => {
                self.log_once(address.ip(), &text);
                let refusal = Refusal::new(RefusalCode::Limit, text);
                refuse(&mut client.stream, refusal).await;
            }
        }
    }

    /// Beats, so that both ends notice the loss of the other, until the key is no longer accepted.
    async fn serve_watch(&self, client: Client, mut place: SessionPlace, address: SocketAddr) {
        let Client { mut stream, facts, preface, .. } = client;
        let session = GateReply::Session {
            host: self.keys.lock().host.facts.holder.name.clone(),
            name: preface.name,
            role: preface.role,
            registry: self.registry.to_string(),
        };
        if write_control(&mut stream, &session).await.is_err() {
            return;
        }
        let (holder, from) = (&facts.holder, address.ip());
        info!("{holder} has connected from {from}");
        let why = {
            let (mut reader, mut writer) = tokio::io::split(&mut stream);
            tokio::select! {
                why = place.ended() => Some(why),
                () = beat(&mut writer) => None,
                () = hear_beats(&mut reader) => None,
            }
        };
        match why {
            Some(why) => {
                info!("{holder} at {from} is disconnected: {why}");
                refuse(&mut stream, Refusal::new(RefusalCode::Role, why)).await;
            }
            None => info!("{holder} at {from} has gone"),
        }
    }

    /// Connects the client to a process of the system.
    async fn forward(&self, client: Client, mut place: SessionPlace, address: String) {
        let Client { mut stream, preface, .. } = client;
        let name = preface.name.clone();
        let registry = self.registry;
        let dial = {
            let address = address.clone();
            move || dial_process(registry, &address, &preface)
        };
        let failed = |error: String| Refusal::new(RefusalCode::Limit, error);
        let dialled = match tokio::task::spawn_blocking(dial).await {
            Ok(dialled) => dialled,
            Err(error) => Err(failed(error.to_string())),
        };
        let connected = dialled.and_then(|dialled| {
            dialled.set_nonblocking(true).map_err(|error| failed(error.to_string()))?;
            TcpStream::from_std(dialled).map_err(|error| failed(error.to_string()))
        });
        let mut process = match connected {
            Ok(process) => process,
            Err(refusal) => {
                debug!(%name, %address, %refusal, "refused");
                return refuse(&mut stream, refusal).await;
            }
        };
        if write_control(&mut stream, &GateReply::Connected).await.is_err() {
            return;
        }
        tokio::select! {
            why = place.ended() => debug!(%name, %address, %why, "disconnected"),
            _ = copy_bidirectional_with_sizes(&mut stream, &mut process, COPY_LEN, COPY_LEN) => {}
        }
    }
}

async fn beat(writer: &mut (impl AsyncWrite + Unpin)) {
    let bytes = frame::signal(FrameKind::Beat);
    loop {
        time::sleep(BEAT).await;
        let written = async {
            writer.write_all(&bytes).await?;
            writer.flush().await
        };
        if !matches!(time::timeout(SILENCE, written).await, Ok(Ok(()))) {
            return;
        }
    }
}

async fn hear_beats(reader: &mut (impl AsyncRead + Unpin)) {
    while let Ok(Ok((FrameKind::Beat, _))) = time::timeout(SILENCE, read_frame(reader)).await {}
}

/// Sends a refusal, as far as the client takes it.
async fn refuse(stream: &mut TlsStream<TcpStream>, refusal: Refusal) {
    let refused = async {
        write_control(stream, &GateReply::Refused { refusal }).await?;
        stream.shutdown().await?;
        drain(stream).await;
        io::Result::Ok(())
    };
    let _ = time::timeout(LINGER, refused).await;
}

/// Waits until the client has read the alert: closing a socket that has unread bytes would reset the
/// connection and discard it.
pub(super) async fn drain_and_close(mut stream: TcpStream) {
    let _ = stream.shutdown().await;
    let _ = time::timeout(LINGER, drain(&mut stream)).await;
}

async fn drain(stream: &mut (impl AsyncRead + Unpin)) {
    let mut waste = [0; 4 << 10];
    while matches!(stream.read(&mut waste).await, Ok(len) if len > 0) {}
}
