//! The state machine on a socket, and over the file.

use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use armor_robotfile::{Colours, Configuration, Findings, Manifests, Override};
use armor_socket::{ListenError, Server, ServerLimits, listen, random_id};
use armor_wire::config::{ConfigReply, ConfigRequest};
use thiserror::Error;
use tokio::sync::mpsc;
use tokio::time::{self, MissedTickBehavior};
use tracing::{info, warn};

use crate::files::WatchedFiles;
use crate::history::{KeptVersion, MAX_VERSIONS};
use crate::kinds::KindSource;
use crate::store::VersionStore;
use crate::versions::{ConfigdAction, ConfigdEvent, Notice, VersionRules, Versions};
use crate::watch::{FileEvent, watch};

/// Period with which the kept copy of the version in force is checked.
const LOOK_AT_KEPT: Duration = Duration::from_secs(2);

/// How configd is run.
#[derive(Clone, Debug)]
pub struct ConfigdOptions {
    /// The file of the mission, or of the system if there is no mission.
    pub file: PathBuf,
    /// Where it listens: a loopback address; port 0 for any free one.
    pub listen: SocketAddr,
    /// Limits on what its peers cost.
    pub limits: ServerLimits,
    /// Values that go over those of every version of the file.
    pub overrides: Vec<Override>,
    /// The data that time follows, whatever the file specifies: `component.output`.
    pub clock: Option<String>,
    /// The kinds of components there are; without them only the file itself is checked.
    pub manifests: Option<Manifests>,
    /// Reports when the kinds have changed; without it they stay as they are.
    pub kinds: Option<KindSource>,
    /// What else may be wrong with a file that is valid otherwise.
    pub further: Option<fn(&Configuration) -> Findings>,
    /// Folder in which the accepted versions are kept, from which a restarted configd continues;
    /// without one they are lost with the process.
    pub versions: Option<PathBuf>,
    /// Serves refusals until the file is valid, where there is neither a valid file nor a version
    /// that is kept; else that is an error.
    pub wait: bool,
}

impl ConfigdOptions {
    /// Serves `file` on a free port, with nothing over it.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        Self {
            file: file.into(),
            listen: (Ipv4Addr::LOCALHOST, 0).into(),
            limits: ServerLimits::default(),
            overrides: Vec::new(),
            clock: None,
            manifests: None,
            kinds: None,
            further: None,
            versions: None,
            wait: false,
        }
    }
}

/// Why configd cannot serve.
#[derive(Debug, Error)]
pub enum ConfigdStartError {
    /// It cannot listen where it should.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// The system refuses what every process needs.
    #[error("cannot start configd: {0}")]
    System(#[from] std::io::Error),
    /// The file is not valid, and there is no earlier version to keep.
    #[error("the file is not valid:\n{}", .0.render(Colours::No))]
    Refused(Findings),
}

/// Serves until the future is dropped, which closes everything. `tell` gets the address and
/// a notice of each version of the file.
///
/// # Errors
/// [`ConfigdStartError`] if it cannot start; once ready, neither a peer nor the file can end it.
pub async fn serve(
    options: ConfigdOptions,
    mut tell: impl FnMut(Notice),
) -> Result<Infallible, ConfigdStartError> {
    let rules = VersionRules {
        overrides: options.overrides,
        clock: options.clock,
        manifests: options.manifests,
        further: options.further,
        root: std::env::current_dir()?,
    };
    let store = options.versions.map(VersionStore::new);
    let kept = store.as_ref().map(|store| store.load_versions(&options.file)).unwrap_or_default();
    let mut files = WatchedFiles::new(options.file);
    let (snapshot, first) =
        files.read_if_changed().ok_or_else(|| std::io::Error::other("the file was not read"))?;
    files.set_known(snapshot);
    let instance = random_id();
    let last = kept.last().map_or(0, |kept| kept.number);
    let (mut versions, mut actions) = match Versions::new(instance, rules.clone(), first, kept) {
        Err(findings) if options.wait => Versions::waiting(instance, rules, last, findings),
        started => started.map_err(ConfigdStartError::Refused)?,
    };
    let listener = listen(options.listen)?;
    let address = listener.local_addr()?;
    let mut server = Server::<ConfigRequest, ConfigReply>::new(listener, options.limits)?;
    let mut watching = watch(files, options.kinds);
    let keeping = start_keeping(store, versions.newest_kept());
    info!(%address, instance, "configd listens");
    tell(Notice::Ready { address });
    loop {
        for action in actions {
            match action {
                ConfigdAction::Peer(action) => server.perform(action),
                ConfigdAction::Tell(notice) => tell(notice),
                // There is one at a time, so there is room; and the task lives as long as this.
                ConfigdAction::Write(write) => drop(watching.writes.try_send(write)),
                ConfigdAction::Keep(kept) => drop(keeping.try_send(kept)),
            }
        }
        let event = tokio::select! {
            event = server.next_event() => ConfigdEvent::Peer(event),
            Some(seen) = watching.seen.recv() => match seen {
                FileEvent::Read(reading) => ConfigdEvent::Read(reading),
                FileEvent::Kinds(manifests) => ConfigdEvent::Kinds(manifests),
                FileEvent::Written(result) => ConfigdEvent::Written(result),
            },
        };
        actions = versions.handle(event);
    }
}

/// Starts a task that stores versions on the disk one after the other, and stores the `newest`
/// again if its copy has disappeared. A disk that is slower than changes of the file keeps fewer of
/// them.
fn start_keeping(
    store: Option<VersionStore>,
    mut newest: Option<KeptVersion>,
) -> mpsc::Sender<KeptVersion> {
    let (sender, mut receiver) = mpsc::channel::<KeptVersion>(MAX_VERSIONS);
    tokio::spawn(async move {
        let mut poll = time::interval(LOOK_AT_KEPT);
        poll.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                kept = receiver.recv() => match kept {
                    Some(kept) => newest = Some(kept),
                    None => return,
                },
                _ = poll.tick() => {}
            }
            let (Some(store), Some(kept)) = (store.clone(), newest.clone()) else { continue };
            let number = kept.number;
            let keep =
                move || if store.is_stored(&kept) { Ok(()) } else { store.store_version(&kept) };
            if let Ok(Err(error)) = tokio::task::spawn_blocking(keep).await {
                warn!(number, %error, "a version is not kept for a restart of configd");
            }
        }
    });
    sender
}
