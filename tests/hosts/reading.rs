//! What the processes of a host may read: what the file leads to its components, and nothing else.

use std::fs;

use armor_keys::HostKeys;
use armor_keys::connect::GateClient;
use armor_wire::codec;
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::gate::{GateReply, GateRequest};
use armor_wire::hello::{HandshakeError, Hello, LinkRequest, Purpose, RefusalCode, read_answer};
use armor_wire::keep::{Keep, Wake};
use armor_wire::registry::{ComponentEntry, RegistryReply, RegistryRequest};
use armor_wire::remote_process::HostAddress;
use armor_wire::run_key::LinkKey;
use armor_wire::shared_memory::MemoryUse;
use rustix::process::Signal;
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use super::Hosts;
use crate::fixture::{Run, send_signal, wait_for};

/// The link that the test removes and adds, to what is one line of the file.
const LINK: &str = r#"    <link from="near.presence" to="far.other1"/>
"#;

/// A process on the host arm, which has its key and asks whom it likes.
struct ForeignProcess {
    gate: GateClient,
    runtime: tokio::runtime::Runtime,
}

/// The provider of data, and the key of a link to it.
type Granted = (ComponentEntry, Option<LinkKey>);

impl ForeignProcess {
    fn new(hosts: &Hosts) -> Self {
        let keys = HostKeys::read(&hosts.folder.path().join("arm")).expect("its keys");
        let addresses = vec![format!("127.0.0.1:{}", hosts.gate)];
        let gate = GateClient::of_host(&HostAddress { host: "robot".into(), addresses }, keys);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        Self { gate, runtime: runtime.expect("an event loop") }
    }

    /// Asks the registry for data; the refusal in words.
    fn look_up(&self, data: &str) -> Result<Granted, String> {
        let hello = Hello::new("far", 1, Purpose::Registry { entry: None });
        let (request, schema) = (1, String::new());
        let lookup = RegistryRequest::Lookup { request, data: data.into(), schema, wait: true };
        let reply =
            self.ask("robot:0", &hello, Some(&lookup)).map_err(|error| error.to_string())?;
        match reply {
            Some(RegistryReply::Found { provider, key, .. }) => {
                Ok((provider, key.map(LinkKey::new)))
            }
            Some(RegistryReply::Refused { refusal, .. }) => {
                assert_eq!(refusal.code, RefusalCode::Role, "{refusal}");
                Err(refusal.text)
            }
            other => panic!("{other:?}"),
        }
    }

    /// Asks a provider for a link, with a key or without.
    fn link(
        &self,
        provider: &ComponentEntry,
        data: &str,
        key: Option<LinkKey>,
    ) -> Result<(), HandshakeError> {
        let link = LinkRequest {
            data: data.into(),
            instance: provider.instance,
            schema: String::new(),
            schema_hash: 0,
            keep: Keep::Latest,
            wake: Wake::Sleep,
            paused: false,
            history: 1,
            memory: MemoryUse::Never,
            datagrams: false,
        };
        let mut hello = Hello::new("far", 1, Purpose::Link { link });
        key.iter().for_each(|key| key.prove(&mut hello));
        self.ask(&provider.endpoint, &hello, None).map(drop)
    }

    /// Connects to a process, and returns its reply to a request after the hello.
    fn ask(
        &self,
        address: &str,
        hello: &Hello,
        request: Option<&RegistryRequest>,
    ) -> Result<Option<RegistryReply>, HandshakeError> {
        self.runtime.block_on(async {
            let connect = GateRequest::Connect { address: address.into(), acts_for: None };
            let (mut stream, reply) = self.gate.request(connect).await.expect("the gate answers");
            assert!(matches!(reply, GateReply::Connected), "{reply:?}");
            let hello = frame::to_bytes(FrameKind::Hello, hello).expect("it is short");
            let request = request.map(|request| frame::to_bytes(FrameKind::Control, request));
            let request = request.transpose().expect("it is short");
            stream.write_all(&hello).await.expect("it is sent");
            stream.write_all(request.as_deref().unwrap_or_default()).await.expect("it is sent");
            stream.flush().await.expect("it is sent");
            let (mut reader, mut is_welcome) = (FrameReader::new(), false);
            loop {
                match reader.next_frame().expect("it is well-formed") {
                    Some(frame) if frame.kind == FrameKind::Beat => {}
                    Some(frame) if !is_welcome => {
                        read_answer(&frame)?;
                        is_welcome = true;
                        if request.is_none() {
                            return Ok(None);
                        }
                    }
                    Some(frame) => return Ok(Some(codec::decode_control(frame.body)?)),
                    None => {
                        let len = stream.read(reader.space()).await.expect("an answer");
                        assert!(len > 0, "it was closed without an answer");
                        reader.filled(len);
                    }
                }
            }
        })
    }
}

/// Kills the registry, and waits for the next one.
fn replace_registry(run: &Run) {
    send_signal(run.daemon("registry").expect("it runs"), Signal::KILL);
    run.wait_for_log("the registry listens", 2);
}

#[test]
fn a_host_reads_what_the_file_leads_to_its_components_and_nothing_else() {
    let hosts = Hosts::new("hosts-reading", "");
    let _agent = hosts.start_agent("robot");
    let run = hosts.run(&[]);
    let far = hosts.wait_for_far(&run, &[]);
    hosts.wait_for_data(&run, "near.presence");
    let process = ForeignProcess::new(&hosts);
    // A link of the file, and what the mission does.
    for data in ["near.presence", "executive.marking"] {
        let (provider, key) = process.look_up(data).expect("it is granted");
        process.link(&provider, data, key).expect("it is welcome");
    }
    // Its own data need no gate.
    assert!(process.look_up("far.odometry").is_ok());
    // What no link leads there is refused by the registry, and by the provider that is asked past it,
    // also with the key of other data.
    let refused = "reading `near.odometry` is not for the host arm: no link of the file leads it to a \
                   component there (far)";
    let granted_none = "the registry has not granted it";
    let (near, key) = process.look_up("near.presence").expect("it is granted");
    for key in [None, key, None] {
        let reason = process.look_up("near.odometry").expect_err("no link leads it there");
        assert!(reason.contains(refused), "{reason}");
        match process.link(&near, "near.odometry", key) {
            Err(HandshakeError::Refused(refusal)) if refusal.code == RefusalCode::Role => {
                assert!(refusal.text.contains(granted_none), "{refusal}");
            }
            other => panic!("{other:?}"),
        }
    }
    for text in [refused, granted_none] {
        run.wait_for_log(text, 1);
        assert_eq!(run.log().matches(text).count(), 1, "{text}\n{}", run.log());
    }
    // The next registry learns the links from configd, and the links of a new process are granted.
    replace_registry(&run);
    send_signal(far, Signal::KILL);
    hosts.wait_for_far(&run, &[far]);
    hosts.wait_for_data(&run, "near.presence");
    assert!(process.look_up("near.odometry").expect_err("no link").contains(refused));
    // The file changes while the system runs. The component keeps its links until it is started again.
    let file = hosts.folder.path().join("robots.xml");
    let text = fs::read_to_string(&file).expect("it is ours");
    assert!(text.contains(LINK), "{text}");
    fs::write(&file, text.replace(LINK, "")).expect("it is ours");
    wait_for("the link to be refused", || process.look_up("near.presence").err());
    hosts.wait_for_data(&run, "near.presence");
    fs::write(&file, text).expect("it is ours");
    wait_for("the link to be granted again", || process.look_up("near.presence").ok());
}
