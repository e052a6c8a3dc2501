//! Browsers on other hosts: HTTPS with the key of this host, invitations, and sessions that end when
//! they are revoked. Nothing of this exists on a server that listens on loopback.
//!
//! Nothing that a request or STOP needs waits for a disk: a thread of its own reads the folder of keys
//! again when it changes, and ends the connections of sessions that are no longer valid.

pub(crate) mod acceptance;
mod attempts;
pub(crate) mod caller;
pub(crate) mod connection;
mod cookie;
pub(crate) mod login_routes;
pub(crate) mod stream;

use std::net::{IpAddr, SocketAddr};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};
use std::{io, thread};

use armor_keys::expiry::{describe_notice, find_notice, format_time, now_s};
use armor_keys::folder::FolderError;
use armor_keys::invitation_file::{InvitationFile, draw_secret};
use armor_keys::invitations::{AccessFault, CLOCK_REMEDY, Secret, Visitor};
use armor_keys::page_port::note_page_port;
use armor_keys::{HostKeys, SiteName, Strangers};
use armor_socket::FaultTable;
use parking_lot::Mutex;
use thiserror::Error;
use tokio_rustls::rustls::ServerConfig;

use attempts::Attempts;
use connection::RemoteConnection;

/// Time between two looks at the folder of keys. With the time to close a connection it bounds the
/// time from a revocation to the end of its pages.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Connections that have sent no request yet, in total and of one address: a handshake takes a
/// fraction of a second.
const MAX_HANDSHAKES: (usize, usize) = (64, 16);
/// Connections whose client is not logged in: a browser opens six at most.
const MAX_GUESTS: (usize, usize) = (96, 24);
/// Connections of persons who are logged in, in total and of one session: a browser opens six, and the
/// page a WebSocket. With the guests they leave 32 to the user of this host.
const MAX_VISITORS: (usize, usize) = (128, 24);
/// Connections for STOP. Those of persons who are logged in; a newcomer takes the place of the oldest.
const MAX_STOP_SEATS: usize = 128;

/// Why pages cannot be served to other hosts.
#[derive(Debug, Error)]
pub(crate) enum RemoteError {
    #[error("{0}")]
    Keys(String),
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Why a browser was not logged in.
#[derive(Debug)]
pub(crate) enum LoginFault {
    /// Too many wrong secrets came from its address: the time to wait.
    Slowed(Duration),
    Refused(AccessFault),
    /// The file was not read or saved.
    File(FolderError),
}

impl From<FolderError> for LoginFault {
    fn from(error: FolderError) -> Self {
        Self::File(error)
    }
}

impl From<AccessFault> for LoginFault {
    fn from(fault: AccessFault) -> Self {
        Self::Refused(fault)
    }
}

/// What the key of this host is now.
pub(crate) struct HostNow {
    pub(crate) config: Arc<ServerConfig>,
    pub(crate) sites: Vec<SiteName>,
    /// Why no connection is accepted.
    pub(crate) refused: Option<&'static str>,
}

/// See the module.
pub(crate) struct RemoteAccess {
    keys: HostKeys,
    now: Mutex<Arc<HostNow>>,
    invitations: InvitationFile,
    listen: SocketAddr,
    begin: Instant,
    attempts: Mutex<Attempts>,
    connections: Mutex<Vec<Weak<RemoteConnection>>>,
    pub(crate) handshakes: Strangers,
    pub(crate) guests: Strangers,
    pub(crate) visitors: Strangers<Secret>,
    pub(crate) stop_seats: Strangers,
    pub(crate) logins: AtomicU64,
    pub(crate) wrong_secrets: AtomicU64,
    /// What was logged of each address.
    faults: FaultTable<String>,
    /// Which ends of the key were announced.
    notices: FaultTable<(String, i64)>,
}

impl RemoteAccess {
    /// Reads the folder of keys.
    ///
    /// # Errors
    /// If the key of this host cannot be used by browsers.
    pub(crate) fn open(folder: &Path, listen: SocketAddr) -> Result<Self, RemoteError> {
        let keys = HostKeys::read(folder).map_err(|error| RemoteError::Keys(error.to_string()))?;
        let facts = keys.facts();
        let name = &facts.holder.name;
        let renew = format!(
            "where the authority's key is: `armor keys renew {name} --at ADDRESS`; then copy \
             {name}.key to {}",
            folder.display()
        );
        if facts.sites.is_empty() {
            return Err(RemoteError::Keys(format!(
                "the key of {name} has no name or address that a browser could open; {renew}. \
                 ADDRESS is the robot's, such as robot.local or 192.168.0.7, several with --at each"
            )));
        }
        if keys.is_revoked() {
            return Err(RemoteError::Keys(format!("the key of {name} is revoked; {renew}")));
        }
        let now_s = now_s();
        let clock = format_time(now_s);
        if now_s < facts.not_before_s {
            let begin = format_time(facts.not_before_s);
            return Err(RemoteError::Keys(format!(
                "the key of {name} is valid from {begin}, and this host's clock shows {clock}: \
                 {CLOCK_REMEDY}"
            )));
        }
        if facts.not_after_s < now_s {
            let end = format_time(facts.not_after_s);
            return Err(RemoteError::Keys(format!(
                "the key of {name} has expired: it is valid until {end}, and this host's clock shows \
                 {clock}; {renew}. If the clock is wrong, {CLOCK_REMEDY}"
            )));
        }
        let invitations =
            InvitationFile::open(folder).map_err(|error| RemoteError::Keys(error.to_string()))?;
        let now = Mutex::new(Arc::new(look_at_host(&keys)));
        Ok(Self {
            keys,
            now,
            invitations,
            listen,
            begin: Instant::now(),
            attempts: Mutex::default(),
            connections: Mutex::default(),
            handshakes: Strangers::with_places(MAX_HANDSHAKES.0, MAX_HANDSHAKES.1),
            guests: Strangers::with_places(MAX_GUESTS.0, MAX_GUESTS.1),
            visitors: Strangers::with_places(MAX_VISITORS.0, MAX_VISITORS.1),
            stop_seats: Strangers::with_places(MAX_STOP_SEATS, MAX_STOP_SEATS),
            logins: AtomicU64::new(0),
            wrong_secrets: AtomicU64::new(0),
            faults: FaultTable::default(),
            notices: FaultTable::default(),
        })
    }

    /// Starts the thread that keeps it current until the returned sender is dropped.
    ///
    /// # Errors
    /// If it cannot be started.
    pub(crate) fn keep_current(self: &Arc<Self>) -> io::Result<mpsc::Sender<()>> {
        let (end, ended) = mpsc::channel();
        let remote = Arc::clone(self);
        thread::Builder::new().name("web-access".into()).spawn(move || {
            while ended.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) {
                remote.look();
            }
        })?;
        Ok(end)
    }

    /// Reads what has changed in the folder, and ends the connections of sessions that have ended.
    fn look(&self) {
        if let Some(change) = self.keys.look() {
            if change.renewed {
                tracing::info!("the page has a new key: {}", self.keys.facts().holder);
            }
            for problem in change.problems {
                tracing::warn!(
                    "{problem}; until this is fixed the page uses what it has read before"
                );
            }
            let now = look_at_host(&self.keys);
            if let Some(why) = now.refused {
                tracing::error!("{why}: no browser is served until the folder has another key");
            }
            *self.now.lock() = Arc::new(now);
        }
        self.announce_end();
        let had_invitations = !self.invitations.current().list().is_empty();
        match self.invitations.look_unless_busy() {
            Ok(true) if had_invitations && self.invitations.current().list().is_empty() => {
                let path = self.invitations.path();
                tracing::warn!("{} is gone or empty: all sessions have ended", path.display());
            }
            Ok(_) => {}
            Err(error) => {
                tracing::warn!("{error}; until this is fixed the invitations stay as they were");
            }
        }
        let is_refused = self.host_now().refused.is_some();
        // New connections and STOP need the list, so it is not locked while hashes are compared.
        for connection in self.list_connections() {
            let fault = connection.session().and_then(|secret| self.find_visitor(&secret).err());
            if is_refused || fault.is_some() {
                connection.cut();
            }
        }
    }

    /// Returns the connections that exist and were not ended, and forgets the others.
    fn list_connections(&self) -> Vec<Arc<RemoteConnection>> {
        let mut open = Vec::new();
        self.connections.lock().retain(|connection| {
            let alive = connection.upgrade().filter(|connection| !connection.is_cut());
            let is_open = alive.is_some();
            open.extend(alive);
            is_open
        });
        open
    }

    /// Notes where the page is, for the links of invitations that are made from now on.
    pub(crate) fn note_port(&self, folder: &Path, port: u16) {
        if let Err(error) = note_page_port(folder, port) {
            tracing::warn!(
                "links need the port (`armor keys invite --at ADDRESS:{port}`): {error}"
            );
        }
    }

    /// Logs that the key of this host expires, once for each of the times ahead.
    fn announce_end(&self) {
        let (facts, now_s) = (self.keys.facts(), now_s());
        if let Some(notice) = find_notice(facts.not_after_s, now_s)
            && self.notices.is_new(None, (facts.serial.to_string(), notice))
            && let Some(text) = describe_notice(&facts.holder.name, facts.not_after_s, now_s)
        {
            tracing::warn!("{text}; browsers warn of a page whose certificate has expired");
        }
    }

    /// The key of this host, as last read.
    pub(crate) fn host_now(&self) -> Arc<HostNow> {
        Arc::clone(&self.now.lock())
    }

    /// The name of this host in its key.
    pub(crate) fn host_name(&self) -> &str {
        self.keys.host_name()
    }

    /// The fingerprint of the certificate.
    pub(crate) fn fingerprint(&self) -> String {
        self.keys.fingerprint()
    }

    /// The fingerprint of the authority's certificate.
    pub(crate) fn authority_fingerprint(&self) -> String {
        self.keys.authority_fingerprint()
    }

    /// The certificate of the authority, in DER.
    pub(crate) fn authority_certificate(&self) -> Vec<u8> {
        self.keys.authority_certificate()
    }

    /// The addresses under which browsers open the page, the first one for links.
    pub(crate) fn urls(&self, port: u16) -> Vec<String> {
        let sites = self.host_now();
        sites.sites.iter().map(|site| format!("https://{}:{port}/", site.to_host())).collect()
    }

    /// Whether the value of a header `Host` names this server.
    pub(crate) fn is_own_host(&self, host: &str) -> bool {
        let own = self.listen.ip();
        SiteName::from_host(host).is_some_and(|site| {
            let is_listen = !own.is_unspecified() && site == SiteName::Address(own);
            is_listen || self.host_now().sites.contains(&site)
        })
    }

    /// Knows a new connection, so that it can be ended.
    pub(crate) fn add_connection(&self, connection: &Arc<RemoteConnection>) {
        self.connections.lock().push(Arc::downgrade(connection));
    }

    /// Returns who has this session.
    ///
    /// # Errors
    /// Why it is not valid.
    pub(crate) fn find_visitor(&self, session: &Secret) -> Result<Visitor, AccessFault> {
        self.invitations.current().find_visitor(session, now_s())
    }

    /// Exchanges the secret of an invitation for that of a session; one browser sends the same `attempt`
    /// until it has an answer. Waits for the disk.
    ///
    /// # Errors
    /// Why it is not accepted, or that its address must wait.
    pub(crate) fn log_in(
        &self,
        secret: &str,
        attempt: Option<&Secret>,
        address: IpAddr,
    ) -> Result<(Secret, Visitor), LoginFault> {
        let elapsed = self.begin.elapsed();
        self.attempts.lock().check(address, elapsed).map_err(LoginFault::Slowed)?;
        let session = draw_secret()?;
        let redeemed = self.redeem(secret, &session, attempt);
        match &redeemed {
            Ok(visitor) => {
                self.attempts.lock().forget(address);
                self.logins.fetch_add(1, Ordering::Relaxed);
                tracing::info!("{} ({}) has logged in from {address}", visitor.name, visitor.role);
            }
            Err(LoginFault::Refused(AccessFault::Unknown)) => {
                self.wrong_secrets.fetch_add(1, Ordering::Relaxed);
                let count = self.attempts.lock().note_wrong(address, elapsed);
                // At each power of two, so that a flood fills no log.
                if count.is_power_of_two() {
                    tracing::warn!("{count} wrong invitations came from {address}");
                }
            }
            Err(LoginFault::Refused(fault)) => {
                self.log_once(address, format!("an invitation is refused: {fault}"));
            }
            Err(_) => {}
        }
        Ok((session, redeemed?))
    }

    fn redeem(
        &self,
        secret: &str,
        session: &Secret,
        attempt: Option<&Secret>,
    ) -> Result<Visitor, LoginFault> {
        let secret = Secret::from_text(secret).ok_or(AccessFault::Unknown)?;
        // One that was made a moment ago is accepted. A problem is reported by the next look.
        let _ = self.invitations.look();
        // A wrong one needs no lock and no disk.
        self.invitations.current().find_invitation(&secret).ok_or(AccessFault::Unknown)?;
        self.invitations.change(|all| Ok(all.redeem(&secret, session, attempt, now_s())?))
    }

    /// Whether this is the secret of the invitation with this number.
    pub(crate) fn is_secret_of(&self, secret: &str, invitation: u32) -> bool {
        let secret = Secret::from_text(secret);
        let found = secret.and_then(|it| self.invitations.current().find_invitation(&it));
        found == Some(invitation)
    }

    /// Ends a session. Waits for the disk.
    ///
    /// # Errors
    /// If the file is not saved.
    pub(crate) fn log_out(&self, session: &Secret) -> Result<(), FolderError> {
        self.invitations.change(|all| {
            all.log_out(session);
            Ok(())
        })
    }

    /// Logs a refusal, once per address and kind.
    pub(crate) fn log_once(&self, address: IpAddr, why: String) {
        if self.faults.is_new(Some(address), why.clone()) {
            tracing::info!("{address}: {why}; further cases are not logged");
        }
    }

    /// The number of connections of persons who are logged in.
    pub(crate) fn count_visitors(&self) -> usize {
        let open = self.list_connections();
        open.iter().filter(|connection| connection.session().is_some()).count()
    }
}

fn look_at_host(keys: &HostKeys) -> HostNow {
    let refused = keys.is_revoked().then_some("the key of this host is revoked");
    HostNow { config: keys.browser_config(), sites: keys.facts().sites, refused }
}
