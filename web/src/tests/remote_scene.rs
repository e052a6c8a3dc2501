//! A server for other hosts with its keys, and browsers that use it.

use std::fs;
use std::os::unix::fs::PermissionsExt;

use armor_keys::authority_certificate::read_authority_certificate;
use armor_keys::expiry::now_s;
use armor_keys::folder::FolderError;
use armor_keys::invitation_file::{InvitationFile, draw_secret};
use armor_keys::invitations::InvitationOrder;
use armor_keys::{KeyHolder, KeyPurpose, KeysFolder, NewKey};
use armor_wire::acting::KeyRole;
use tempfile::TempDir;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};

use super::*;

/// A name in the certificate of the server.
pub(super) const HOST: &str = "robot.test";

pub(super) type Tls = StreamOwned<ClientConnection, TcpStream>;

pub(super) struct RemoteScene {
    pub(super) server: WebServer,
    pub(super) robot: Arc<NotingRobot>,
    pub(super) keys: TempDir,
    registry: BackgroundRegistry,
    config: Arc<ClientConfig>,
}

impl RemoteScene {
    pub(super) fn begin() -> Self {
        let keys = tempfile::tempdir().unwrap();
        fs::set_permissions(keys.path(), fs::Permissions::from_mode(0o700)).unwrap();
        let folder = KeysFolder::create(keys.path(), now_s()).unwrap();
        let holder = KeyHolder { name: "robot".into(), purpose: KeyPurpose::Host };
        let sites = vec![HOST.parse().unwrap(), "127.0.0.1".parse().unwrap()];
        folder.add_key(NewKey { holder, sites }, 10, now_s()).unwrap();
        drop(folder);
        let listen = "127.0.0.1:0".parse().unwrap();
        let options = RegistryOptions { listen, ..RegistryOptions::default() };
        let registry = BackgroundRegistry::start(options).unwrap();
        let robot = Arc::new(NotingRobot::default());
        let server = start_server(&keys, &registry, &robot);
        let authority = read_authority_certificate(keys.path()).unwrap();
        let mut roots = RootCertStore::empty();
        roots.add(CertificateDer::from(authority.der)).unwrap();
        let ring = tokio_rustls::rustls::crypto::ring::default_provider();
        let config = ClientConfig::builder_with_provider(Arc::new(ring))
            .with_safe_default_protocol_versions()
            .unwrap()
            .with_root_certificates(roots)
            .with_no_client_auth();
        Self { server, robot, keys, registry, config: Arc::new(config) }
    }

    /// Starts another server in place of this one, as after a crash.
    pub(super) fn restart(&mut self) {
        self.server = start_server(&self.keys, &self.registry, &self.robot);
    }

    pub(super) fn file(&self) -> InvitationFile {
        InvitationFile::open(self.keys.path()).unwrap()
    }

    /// The secret of a new invitation, valid for an hour.
    pub(super) fn invite(&self, name: &str, role: KeyRole, devices: u32) -> String {
        let secret = draw_secret().unwrap();
        let order = InvitationOrder { name: name.into(), role, for_s: 3600, devices };
        let invite = |all: &mut armor_keys::invitations::Invitations| {
            all.invite(&order, &secret, now_s()).map(drop).map_err(FolderError::Refused)
        };
        self.file().change(invite).unwrap();
        secret.to_text()
    }

    pub(super) fn revoke(&self, name: &str) {
        let revoked =
            self.file().change(|all| Ok::<_, FolderError>(all.revoke(name, now_s()))).unwrap();
        assert!(revoked > 0);
    }

    pub(super) fn port(&self) -> u16 {
        self.server.address().port()
    }

    /// The header `Host` of a browser.
    pub(super) fn host(&self) -> String {
        format!("{HOST}:{}", self.port())
    }

    pub(super) fn connect_plain(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port())).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        stream.set_write_timeout(Some(DEADLINE)).unwrap();
        stream
    }

    pub(super) fn connect(&self) -> Tls {
        let name = ServerName::try_from(HOST).unwrap();
        let client = ClientConnection::new(Arc::clone(&self.config), name).unwrap();
        StreamOwned::new(client, self.connect_plain())
    }

    /// Sends a request as it is, and returns the status and the whole response; 0 without one.
    pub(super) fn send(&self, request: &str) -> (u16, String) {
        let mut stream = self.connect();
        let _ = stream.write_all(request.as_bytes());
        let mut response = Vec::new();
        let _ = stream.read_to_end(&mut response);
        let response = String::from_utf8_lossy(&response).into_owned();
        let status = response.split(' ').nth(1).and_then(|status| status.parse().ok());
        (status.unwrap_or(0), response)
    }

    /// A browser that is not logged in.
    pub(super) fn browser(&self) -> Browser<'_> {
        Browser { scene: self, cookie: String::new() }
    }

    /// A browser of a person who has logged in.
    pub(super) fn browser_of(&self, name: &str, role: KeyRole) -> Browser<'_> {
        let mut browser = self.browser();
        let (status, response) = browser.log_in(&self.invite(name, role, 1));
        assert_eq!(status, 200, "{response}");
        browser
    }
}

fn start_server(
    keys: &TempDir,
    registry: &BackgroundRegistry,
    robot: &Arc<NotingRobot>,
) -> WebServer {
    let options = WebOptions {
        listen: "0.0.0.0:0".parse().unwrap(),
        keys: Some(keys.path().into()),
        registry: registry.address().to_string(),
        author: "ruth".into(),
    };
    WebServer::start(&options, Some(Arc::clone(robot) as _)).unwrap()
}

/// What a browser keeps: its cookie.
pub(super) struct Browser<'a> {
    pub(super) scene: &'a RemoteScene,
    pub(super) cookie: String,
}

impl Browser<'_> {
    /// Sends a request as the page does.
    pub(super) fn send(&self, method: &str, path: &str, body: &str) -> (u16, String) {
        let (host, len, cookie) = (self.scene.host(), body.len(), &self.cookie);
        self.scene.send(&format!(
            "{method} {path} HTTP/1.1\r\nHost: {host}\r\nOrigin: https://{host}\r\n{cookie}\
             Sec-Fetch-Site: same-origin\r\nContent-Length: {len}\r\nConnection: close\r\n\r\n{body}"
        ))
    }

    pub(super) fn json(&self, method: &str, path: &str, body: &str) -> (u16, Json) {
        let (status, response) = self.send(method, path, body);
        (status, body_json(&response))
    }

    /// Exchanges an invitation; keeps the cookie.
    pub(super) fn log_in(&mut self, secret: &str) -> (u16, String) {
        let body = format!("{{\"invite\":\"{secret}\"}}");
        let (status, response) = self.send("POST", "/api/login", &body);
        let set = response.lines().find_map(|line| line.strip_prefix("set-cookie: "));
        if let Some(cookie) = set.and_then(|set| set.split(';').next()) {
            self.cookie = format!("Cookie: {cookie}\r\n");
        }
        (status, response)
    }

    /// Opens a WebSocket, or returns the status of the refusal.
    pub(super) fn open(&self, path: &str) -> Result<WebSocket<Tls>, u16> {
        let host = self.scene.host();
        let mut request = tungstenite::handshake::client::Request::builder()
            .uri(format!("wss://{host}{path}"))
            .header("Host", &host)
            .header("Origin", format!("https://{host}"))
            .header("Connection", "Upgrade")
            .header("Upgrade", "websocket")
            .header("Sec-WebSocket-Version", "13")
            .header("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==");
        if let Some(cookie) = self.cookie.strip_prefix("Cookie: ") {
            request = request.header("Cookie", cookie.trim_end());
        }
        let opened = tungstenite::client(request.body(()).unwrap(), self.scene.connect());
        opened.map(|(socket, _)| socket).map_err(|error| match error {
            tungstenite::HandshakeError::Failure(tungstenite::Error::Http(response)) => {
                response.status().as_u16()
            }
            error => panic!("{error}"),
        })
    }
}

/// Returns the next message as JSON.
pub(super) fn read_tls(socket: &mut WebSocket<Tls>) -> Json {
    loop {
        if let tungstenite::Message::Text(text) = socket.read().unwrap() {
            return serde_json::from_str(&text).unwrap();
        }
    }
}

/// Reads until the connection ends.
pub(super) fn wait_for_end(socket: &mut WebSocket<Tls>) {
    let begin = Instant::now();
    while socket.read().is_ok() {
        assert!(begin.elapsed() < DEADLINE, "it is still open");
    }
    assert!(begin.elapsed() < DEADLINE, "it was ended by the deadline of the test alone");
}
