//! One client of a gate from its request to its end: forwarded to a process of the system, or
//! watching its session.

use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;

use armor_wire::acting::Preface;
use armor_wire::frame::{self, FrameKind};
use armor_wire::gate::{GateReply, GateRequest, HostExamination};
use armor_wire::hello::{Refusal, RefusalCode, VERSION};
use armor_wire::liveness::{BEAT, SILENCE};
use armor_wire::remote_process::RemoteStart;
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time;
use tokio_rustls::server::TlsStream;
use tracing::{debug, info};

use super::RunOrder;
use super::sessions::SessionPlace;
use super::{Client, Gate};
use crate::connect::now_us;
use crate::copying::copy_both;
use crate::dial::dial_process;
use crate::frames::{read_frame, write_control};
use crate::identity::KeyHolder;
use crate::reach::Target;
use crate::run_channel::RunChannel;
use crate::seal::{DatagramSeal, SealEnd};
use crate::streams::refuse;

/// Answers with the time of this host.
async fn answer_time(mut client: Client) {
    // A client that has gone needs no answer.
    if write_control(&mut client.stream, &GateReply::Clock { time_us: now_us() }).await.is_ok() {
        let _ = client.stream.shutdown().await;
    }
}

impl Gate {
    pub(super) async fn serve_session(&self, mut client: Client, address: SocketAddr) {
        let process = match &client.request {
            GateRequest::Watch => "the gate",
            GateRequest::Clock => "the clock",
            GateRequest::Examine => "the examination",
            GateRequest::Connect { address, .. } => address,
            GateRequest::Run { start } => &start.component,
        };
        let place = self.sessions.admit(&client.facts, process).and_then(|place| {
            // It may have been revoked after the handshake, and before it had its place.
            let is_revoked = self.keys.lock().revoked.contains(&client.facts.serial);
            if is_revoked { Err("the key is revoked".into()) } else { Ok(place) }
        });
        match place {
            Ok(place) => match client.request.clone() {
                GateRequest::Watch => self.serve_watch(client, place, address).await,
                GateRequest::Connect { address, acts_for } => {
                    self.forward(client, place, address, acts_for).await;
                }
                GateRequest::Run { start } => self.run(client, place, start, address).await,
                GateRequest::Clock => answer_time(client).await,
                GateRequest::Examine => self.examine_host(client, place, address).await,
            },
            Err(text) => {
                self.log_once(address.ip(), &text);
                let refusal = Refusal::new(RefusalCode::Limit, text);
                refuse(&mut client.stream, refusal).await;
            }
        }
    }

    /// Answers with what is found of this host.
    async fn examine_host(&self, client: Client, mut place: SessionPlace, address: SocketAddr) {
        let Client { mut stream, facts, .. } = client;
        if facts.role().is_some() {
            let text = format!("only a host may examine this one, not {}", facts.holder.name);
            self.log_once(address.ip(), &text);
            return refuse(&mut stream, Refusal::new(RefusalCode::Role, text)).await;
        }
        let examine = async {
            let _one_at_a_time = self.examining.lock().await;
            let examiner = Arc::clone(&self.examiner);
            tokio::task::spawn_blocking(move || examiner()).await
        };
        let examined = tokio::select! {
            _ = place.ended() => return,
            examined = examine => examined,
        };
        let findings = match examined {
            Ok(findings) => findings,
            Err(error) => {
                return refuse(&mut stream, Refusal::new(RefusalCode::Limit, error.to_string()))
                    .await;
            }
        };
        let examination = HostExamination {
            release: env!("CARGO_PKG_VERSION").into(),
            protocol: VERSION,
            key_ends_s: self.keys.facts().not_after_s,
            findings,
        };
        if write_control(&mut stream, &GateReply::Examined { examination }).await.is_ok() {
            let _ = stream.shutdown().await;
        }
    }

    /// Beats, so that both ends notice the loss of the other, until the key is no longer accepted.
    async fn serve_watch(&self, client: Client, mut place: SessionPlace, address: SocketAddr) {
        let Client { mut stream, facts, .. } = client;
        let (Some(role), Some(registry)) = (facts.role(), self.reach.registry()) else {
            let text = if facts.role().is_none() {
                format!("{} is the key of a host, and not of a person", facts.holder.name)
            } else {
                "this is an agent, which runs components of a system on another host; connect to \
                 the gate there"
                    .into()
            };
            return refuse(&mut stream, Refusal::new(RefusalCode::WrongPurpose, text)).await;
        };
        let session = GateReply::Session {
            host: self.keys.host_name().to_owned(),
            name: facts.holder.name.clone(),
            role,
            registry: registry.to_string(),
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
    async fn forward(
        &self,
        client: Client,
        mut place: SessionPlace,
        address: String,
        acts_for: Option<Preface>,
    ) {
        let Client { mut stream, facts, .. } = client;
        let name = facts.holder.name.clone();
        let dialled = self.dial_target(facts.holder, &address, acts_for).await;
        let refusal = match dialled {
            Ok(DialledTarget::Process(mut process)) => {
                let datagrams = self.carry_datagrams(&stream, &process);
                let copying = self.copy(stream, &mut process, place, &name, &address);
                return tokio::select! {
                    () = copying => {}
                    () = datagrams => {}
                };
            }
            Ok(DialledTarget::Gate(mut gate, revoked)) => {
                let copying = self.copy(stream, &mut *gate, place, &name, &address);
                return tokio::select! {
                    () = copying => {}
                    why = revoked => debug!(%name, %address, %why, "disconnected"),
                };
            }
            Err(refusal) => refusal,
        };
        debug!(%name, %address, %refusal, "refused");
        tokio::select! {
            _ = place.ended() => {}
            () = refuse(&mut stream, refusal) => {}
        }
    }

    /// Carries the datagrams of the connection, if it has any; never returns.
    fn carry_datagrams(
        &self,
        stream: &TlsStream<TcpStream>,
        process: &TcpStream,
    ) -> impl Future<Output = ()> + Send + 'static {
        let seal = DatagramSeal::of_session(stream.get_ref().1, SealEnd::Gate);
        let way = seal.zip(self.datagrams.as_ref()).map(|(seal, port)| {
            let way = port.open_way(seal.id());
            (seal, way)
        });
        let process = process.peer_addr();
        async move {
            if let (Some((seal, way)), Ok(process)) = (way, process) {
                way.carry_to_process(seal, process).await;
            }
            std::future::pending::<()>().await;
        }
    }

    async fn dial_target(
        &self,
        holder: KeyHolder,
        address: &str,
        acts_for: Option<Preface>,
    ) -> Result<DialledTarget, Refusal> {
        let failed = |error: String| Refusal::new(RefusalCode::Limit, error);
        let reach = Arc::clone(&self.reach);
        let wanted = address.to_owned();
        let find_and_dial = move || match reach.find_target(&holder, &wanted, acts_for.as_ref())? {
            Target::Process { address, preface } => {
                Ok((Some(dial_process(address, &preface)?), None))
            }
            Target::Host { host, address, preface } => Ok((None, Some((host, address, preface)))),
        };
        let found = tokio::task::spawn_blocking(find_and_dial).await;
        match found.map_err(|error| failed(error.to_string()))?? {
            (Some(dialled), _) => {
                dialled.set_nonblocking(true).map_err(|error| failed(error.to_string()))?;
                let process = TcpStream::from_std(dialled);
                process.map(DialledTarget::Process).map_err(|error| failed(error.to_string()))
            }
            (None, Some((host, address, preface))) => {
                let gate = self.reach.find_gate(&host).ok_or_else(|| {
                    let text = format!("the way to the host {host} is not known any more");
                    Refusal::new(RefusalCode::UnknownData, text)
                })?;
                let request = GateRequest::Connect { address, acts_for: Some(preface) };
                match gate.request(request).await {
                    Ok((stream, GateReply::Connected)) => {
                        let revoked = Box::pin(gate.wait_for_revocation(&stream));
                        Ok(DialledTarget::Gate(Box::new(stream), revoked))
                    }
                    Ok((_, GateReply::Refused { refusal })) => Err(refusal),
                    Ok((_, _)) => {
                        Err(failed(format!("the gate of {host} answers another request")))
                    }
                    Err(error) => {
                        Err(Refusal::new(RefusalCode::UnknownData, format!("{host}: {error}")))
                    }
                }
            }
            (None, None) => Err(failed("there is no target".into())),
        }
    }

    async fn copy(
        &self,
        mut stream: TlsStream<TcpStream>,
        target: &mut (impl AsyncRead + AsyncWrite + Unpin),
        mut place: SessionPlace,
        name: &str,
        address: &str,
    ) {
        if write_control(&mut stream, &GateReply::Connected).await.is_err() {
            return;
        }
        tokio::select! {
            why = place.ended() => debug!(%name, %address, %why, "disconnected"),
            _ = copy_both(&mut stream, target) => {}
        }
    }

    /// Hands a request to run a component to the agent.
    async fn run(
        &self,
        client: Client,
        place: SessionPlace,
        start: RemoteStart,
        address: SocketAddr,
    ) {
        let Client { mut stream, facts, .. } = client;
        let text = match &self.runs {
            None => "this is the gate of a system; `armor host` runs components for another".into(),
            Some(_) if facts.role().is_some() => {
                format!("only a host may run components here, not {}", facts.holder.name)
            }
            Some(runs) => {
                let launcher = facts.holder.name;
                let mut place = place;
                let channel = RunChannel::new(stream, async move { place.ended().await });
                let order = RunOrder { start, launcher, address, channel };
                // An agent that ends takes none.
                let _ = runs.send(order).await;
                return;
            }
        };
        self.log_once(address.ip(), &text);
        refuse(&mut stream, Refusal::new(RefusalCode::Role, text)).await;
    }
}

/// The other end of a forwarded connection.
enum DialledTarget {
    Process(TcpStream),
    /// With what returns when its key is revoked.
    Gate(
        Box<tokio_rustls::client::TlsStream<TcpStream>>,
        Pin<Box<dyn Future<Output = String> + Send>>,
    ),
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
