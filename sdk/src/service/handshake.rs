//! New connections, until their purpose is known. A stranger gets two seconds, 64 KiB, and one line
//! in the log.

use std::io::Write;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::{OwnerError, Stream, check_client, is_temporary, own_key};
use armor_wire::acting::{Opening, Preface, Rights};
use armor_wire::codec::MAX_HELLO_LEN;
use armor_wire::control::Role;
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::hello::{
    HandshakeError, Hello, LinkRequest, Purpose, Refusal, RefusalCode, Welcome,
};
use armor_wire::keep::Keep;
use armor_wire::liveness::Liveness;
use armor_wire::run_key::NameKey;
use armor_wire::shared_memory::MemoryUse;
use rustix::event::PollFd;

use super::datagrams::DatagramService;
use super::keep_rights::{KeepRights, MOST_WITHOUT_RIGHT};
use crate::call_trace::CALLS;
use crate::faults::PeerFault;
use crate::link::datagrams_out::LinkDatagrams;
use crate::link::memory_out::suits_memory;
use crate::link::output::OutputPort;
use crate::link::patience::Patience;
use crate::link::queue::LinkQueue;
use crate::link::wire_out::OutgoingLink;
use crate::participant::Participant;
use crate::tap::TOOL_PREFIX;

/// How long a handshake may take.
const LIMIT: Duration = Duration::from_secs(2);
/// Most unfinished handshakes; one more closes the oldest.
const MAX_PENDING: usize = 64;

struct PendingHandshake {
    stream: Stream,
    peer: SocketAddr,
    reader: FrameReader,
    opening: Opening,
    since: Instant,
}

/// A control connection that has been welcomed.
pub(super) struct AdmittedControl {
    pub stream: Stream,
    pub reader: FrameReader,
    pub role: Role,
    pub from: String,
    /// The start of the process that connects.
    pub instance: u64,
    /// On whose behalf it acts, if a gate forwards it.
    pub preface: Option<Preface>,
}

pub(super) struct Handshakes {
    participant: Arc<Participant>,
    pending: Vec<PendingHandshake>,
    keep_rights: KeepRights,
}

enum HandshakeStep {
    Wait,
    Close(PeerFault, String),
    Hello(Box<Hello>),
    Refuse(Refusal),
}

impl Handshakes {
    pub fn new(participant: Arc<Participant>) -> Self {
        Self { participant, pending: Vec::new(), keep_rights: KeepRights::default() }
    }

    pub fn add_poll_fds<'a>(&'a self, fds: &mut Vec<PollFd<'a>>) {
        fds.extend(self.pending.iter().map(|pending| super::watched(&pending.stream, false)));
    }

    pub fn add_connection(&mut self, stream: Stream) {
        // A peer that has gone already needs no answer.
        let Ok(peer) = stream.peer_address() else { return };
        match check_client(&stream) {
            Ok(()) => {}
            Err(OwnerError::Closed) => return,
            Err(error) => {
                let refusal = Refusal::new(RefusalCode::OtherUser, error.to_string());
                return self.send_refusal(&stream, peer, &refusal);
            }
        }
        if self.pending.len() >= MAX_PENDING {
            // The oldest has had its chance.
            let oldest = self.pending.remove(0);
            self.log_fault(oldest.peer, PeerFault::Crowded, "too many unfinished handshakes");
        }
        if stream.set_nonblocking(true).is_ok() {
            let reader = FrameReader::with_limit(MAX_HELLO_LEN);
            let (opening, since) = (Opening::default(), Instant::now());
            self.pending.push(PendingHandshake { stream, peer, reader, opening, since });
        }
    }

    /// Reads what has arrived; links are added to their outputs, control connections returned.
    pub fn serve_pending(&mut self, datagrams: &mut DatagramService) -> Vec<AdmittedControl> {
        let mut admitted = Vec::new();
        for mut pending in std::mem::take(&mut self.pending) {
            match pending.read_hello() {
                HandshakeStep::Wait => self.pending.push(pending),
                HandshakeStep::Close(fault, reason) => self.log_fault(pending.peer, fault, &reason),
                HandshakeStep::Refuse(refusal) => {
                    self.send_refusal(&pending.stream, pending.peer, &refusal);
                }
                HandshakeStep::Hello(hello) => match self.admit_peer(*hello, &pending, datagrams) {
                    Ok(Some((role, from, instance))) => {
                        let PendingHandshake { stream, mut reader, peer, opening, .. } = pending;
                        let preface = opening.into_preface();
                        reader.lift_limit();
                        let from = if peer.ip().is_loopback() {
                            from
                        } else {
                            format!("{from} at {}", peer.ip())
                        };
                        admitted.push(AdmittedControl {
                            stream,
                            reader,
                            role,
                            from,
                            instance,
                            preface,
                        });
                    }
                    Ok(None) => {}
                    Err(refusal) => self.send_refusal(&pending.stream, pending.peer, &refusal),
                },
            }
        }
        admitted
    }

    fn admit_peer(
        &self,
        hello: Hello,
        pending: &PendingHandshake,
        datagrams: &mut DatagramService,
    ) -> Result<Option<(Role, String, u64)>, Refusal> {
        let stream = &pending.stream;
        let identity = &self.participant.identity;
        check_role(&hello, &identity.name)?;
        let preface = pending.opening.preface();
        let readable = check_reader(&hello, preface, own_key(&identity.name), identity.instance);
        let from = match preface {
            Some(preface) if preface.role().is_some() => name_remote_tool(&hello.from, preface),
            // A process of this host, or of another host of the system.
            _ => hello.from,
        };
        match hello.purpose {
            Purpose::Link { link } => {
                self.check_instance(&link)?;
                readable?;
                self.admit_link(&link, (&from, hello.instance), stream, datagrams).map(|()| None)
            }
            Purpose::Control { role } => {
                self.send_welcome(stream, String::new(), false)?;
                Ok(Some((role, from, hello.instance)))
            }
            Purpose::Registry { .. } | Purpose::Config => {
                let text = format!(
                    "this is the component `{}`, which serves links and control",
                    self.participant.identity.name
                );
                Err(Refusal::new(RefusalCode::WrongPurpose, text))
            }
        }
    }

    fn check_instance(&self, link: &LinkRequest) -> Result<(), Refusal> {
        let ours = self.participant.identity.instance;
        if link.instance != 0 && link.instance != ours {
            let text = format!(
                "this is `{}`, but not the process start that was meant",
                self.participant.identity.name
            );
            return Err(Refusal::new(RefusalCode::WrongInstance, text));
        }
        Ok(())
    }

    fn admit_link(
        &self,
        link: &LinkRequest,
        (from, instance): (&str, u64),
        stream: &Stream,
        datagrams: &mut DatagramService,
    ) -> Result<(), Refusal> {
        let outputs = self.participant.ports.served_outputs();
        let is_it =
            |output: &&Arc<OutputPort>| output.entry.data == link.data && !output.lacks_type();
        let output = outputs.iter().find(is_it).ok_or_else(|| {
            let text = format!(
                "component `{}` does not provide `{}`",
                self.participant.identity.name, link.data
            );
            Refusal::new(RefusalCode::UnknownData, text)
        })?;
        output.check_request(link, from)?;
        let copy =
            stream.try_clone().map_err(|e| Refusal::new(RefusalCode::Limit, e.to_string()))?;
        let keep = match self.keep_rights.grant(link.keep, from, instance) {
            // This thread publishes them, and must not wait.
            Keep::All { .. } if output.id == CALLS => Keep::Last { count: MOST_WITHOUT_RIGHT },
            keep => keep,
        };
        let link_stream = Arc::new(copy);
        let added = OutgoingLink {
            stream: Arc::clone(&link_stream),
            to: from.into(),
            faults: Arc::clone(&self.participant.faults),
            keep,
            history: link.history,
            queue: LinkQueue::new(keep),
            // A subscriber sends only beats, pause and resume, which have no body.
            reader: FrameReader::with_limit(0),
            liveness: Liveness::new(self.participant.clock.monotonic()),
            paused: link.paused,
            fresh: true,
            last_call: 0,
            sent: 0,
            dropped: 0,
            patience: Patience::of(keep),
            last_sequence: None,
            memory_use: match stream {
                Stream::Unix(_) if suits_memory(keep) => link.memory,
                Stream::Unix(_) | Stream::Tcp(_) => MemoryUse::Never,
            },
            memory: None,
            datagrams: match stream {
                Stream::Tcp(_) if link.datagrams => datagrams
                    .open_socket()
                    .and_then(|socket| LinkDatagrams::open(keep, output.entry.latched, socket))
                    .map(Box::new),
                Stream::Tcp(_) | Stream::Unix(_) => None,
            },
            broken: false,
        };
        output.add_link(added, || self.send_welcome(stream, output.entry.schema.clone(), true))?;
        if keep.is_all() {
            self.keep_rights.examine(&self.participant, from, instance, link_stream);
        }
        Ok(())
    }

    fn send_welcome(
        &self,
        mut stream: &Stream,
        schema: String,
        is_link: bool,
    ) -> Result<(), Refusal> {
        let failed = |text: String| Refusal::new(RefusalCode::Limit, text);
        let welcome = Welcome {
            name: self.participant.identity.name.clone(),
            instance: self.participant.identity.instance,
            schema,
        };
        let bytes =
            frame::to_bytes(FrameKind::Welcome, &welcome).map_err(|e| failed(e.to_string()))?;
        // A blocking socket from here on; every later write has its own flag not to wait.
        stream.set_nonblocking(false).map_err(|e| failed(e.to_string()))?;
        armor_socket::tune(stream).map_err(|e| failed(e.to_string()))?;
        if is_link {
            armor_socket::enlarge_send_buffer(stream).map_err(|e| failed(e.to_string()))?;
        }
        stream.write_all(&bytes).map_err(|e| failed(e.to_string()))
    }

    /// Sends the reason, as far as that is possible without waiting.
    fn send_refusal(&self, stream: &Stream, peer: SocketAddr, refusal: &Refusal) {
        self.log_refusal(peer, refusal);
        if let Ok(bytes) = frame::to_bytes(FrameKind::Refusal, refusal) {
            let _ = stream.try_send(&bytes);
        }
    }

    fn log_refusal(&self, peer: SocketAddr, refusal: &Refusal) {
        if refusal.code == RefusalCode::Role {
            self.participant.faults.log_role_once(refusal);
        } else {
            self.log_fault(peer, refusal.code.into(), &refusal.text);
        }
    }

    fn log_fault(&self, peer: SocketAddr, fault: PeerFault, why: &str) {
        self.participant.faults.log_once(Some(peer.ip()), fault, why);
    }
}

impl PendingHandshake {
    fn read_hello(&mut self) -> HandshakeStep {
        match self.stream.try_receive(self.reader.space()) {
            Ok(0) => {
                return HandshakeStep::Close(
                    PeerFault::Left,
                    "it left during the handshake".into(),
                );
            }
            Ok(len) => self.reader.filled(len),
            Err(error) if is_temporary(&error) => {}
            Err(error) => return HandshakeStep::Close(PeerFault::Left, error.to_string()),
        }
        loop {
            let frame = match self.reader.next_frame() {
                Ok(Some(frame)) => frame,
                Ok(None) if self.since.elapsed() >= LIMIT => {
                    return HandshakeStep::Close(
                        PeerFault::Slow,
                        format!("no handshake within {LIMIT:?}"),
                    );
                }
                Ok(None) => return HandshakeStep::Wait,
                Err(error) => {
                    return HandshakeStep::Close(PeerFault::from(&error), error.to_string());
                }
            };
            match self.opening.read_frame(&frame) {
                Ok(Some(hello)) => return HandshakeStep::Hello(Box::new(hello)),
                // A new socket has room for it.
                Ok(None) => drop(self.stream.try_send(&frame::signal(FrameKind::Beat))),
                Err(HandshakeError::Refused(refusal)) => return HandshakeStep::Refuse(refusal),
                Err(error) => {
                    return HandshakeStep::Close(PeerFault::from(&error), error.to_string());
                }
            }
        }
    }
}

/// Refuses the roles that only the executive and the launcher of this run have.
fn check_role(hello: &Hello, own_name: &str) -> Result<(), Refusal> {
    let Purpose::Control { role: role @ (Role::Executive | Role::Launcher) } = hello.purpose else {
        return Ok(());
    };
    match own_key(own_name) {
        Some(key) if !key.verify(hello) => {
            let text = format!(
                "a control connection as {role:?} is only for the executive and the launcher of the \
                 run that has started `{own_name}`, not for `{}`; order it through the mission \
                 (armor mission) or the launcher (armor stop, armor restart)",
                hello.from
            );
            Err(Refusal::new(RefusalCode::Role, text))
        }
        // It was started by hand.
        None | Some(_) => Ok(()),
    }
}

/// Refuses a link of another host for which the registry has given it no key: the file leads the data to no
/// component there.
fn check_reader(
    hello: &Hello,
    preface: Option<&Preface>,
    own_key: Option<NameKey>,
    own_instance: u64,
) -> Result<(), Refusal> {
    let Some(Preface { name: host, rights: Rights::Host { .. } }) = preface else { return Ok(()) };
    let Purpose::Link { link } = &hello.purpose else { return Ok(()) };
    match own_key {
        Some(key) if !key.key_of_link(host, &link.data, own_instance).verify(hello) => {
            let text = format!(
                "reading `{}` is not for the host {host}: the registry has not granted it, since no link \
                 of the file leads it to a component there",
                link.data
            );
            Err(Refusal::new(RefusalCode::Role, text))
        }
        // It was started by hand.
        None | Some(_) => Ok(()),
    }
}

/// The name of a tool whose connection a gate forwards: no component's, whatever it claims, and with
/// the holder of the key in it.
fn name_remote_tool(from: &str, preface: &Preface) -> String {
    let prefix = if from.starts_with(TOOL_PREFIX) { "" } else { TOOL_PREFIX };
    format!("{prefix}{from} of {}", preface.name)
}

#[cfg(test)]
mod tests {
    use armor_wire::acting::KeyRole;
    use armor_wire::keep::{Keep, Wake};
    use armor_wire::run_key::{KEY_LEN, RunSecret};

    use super::*;

    #[test]
    fn another_host_reads_what_the_registry_has_granted_and_no_more() {
        let key = RunSecret::new([5; KEY_LEN]).key_of("laser");
        let link = LinkRequest {
            data: "laser.scan".into(),
            instance: 9,
            schema: String::new(),
            schema_hash: 0,
            keep: Keep::Latest,
            wake: Wake::Sleep,
            paused: false,
            history: 1,
            memory: MemoryUse::Never,
            datagrams: false,
        };
        let plain = Hello::new("gripper", 3, Purpose::Link { link });
        let mut proven = plain.clone();
        key.key_of_link("arm", "laser.scan", 9).prove(&mut proven);
        let host = |name: &str| {
            let rights = Rights::Host { components: vec!["gripper".into()] };
            Preface { name: name.into(), rights }
        };
        let check = |hello, preface: Option<&Preface>, key| check_reader(hello, preface, key, 9);
        assert_eq!(check(&proven, Some(&host("arm")), Some(key)), Ok(()));
        for (hello, preface) in [(&plain, host("arm")), (&proven, host("base"))] {
            let refusal = check(hello, Some(&preface), Some(key)).expect_err("it is refused");
            assert_eq!(refusal.code, RefusalCode::Role);
            let text = format!("reading `laser.scan` is not for the host {}: ", preface.name);
            assert!(refusal.text.starts_with(&text), "{refusal}");
        }
        assert!(check_reader(&proven, Some(&host("arm")), Some(key), 8).is_err(), "another start");
        // A process of this host, a person, the launcher's host; and a provider started by hand.
        let launcher = Preface { name: "robot".into(), rights: Rights::Launcher };
        for preface in [None, Some(Preface::of_person("alice", KeyRole::Observer)), Some(launcher)]
        {
            assert_eq!(check(&plain, preface.as_ref(), Some(key)), Ok(()));
        }
        assert_eq!(check(&plain, Some(&host("arm")), None), Ok(()));
    }

    #[test]
    fn a_remote_tool_cannot_pass_for_a_component() {
        let preface = Preface::of_person("alice", KeyRole::Observer);
        assert_eq!(name_remote_tool("tool-7", &preface), "tool-7 of alice");
        assert_eq!(name_remote_tool("driver", &preface), "tool-driver of alice");
    }
}
