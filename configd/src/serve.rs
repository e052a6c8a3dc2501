//! The state machine on a socket, and over the file.

use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use armor_missions::{Colours, Feature, Findings, Manifests, Override};
use armor_net::{Limits, ListenError, Server, listen, random_id};
use armor_wire::config::{Reply, Request};
use thiserror::Error;
use tracing::info;

use crate::files::Files;
use crate::versions::{Action, Event, Notice, Rules, Versions};
use crate::watch::watch;

/// How configd is run.
#[derive(Clone, Debug)]
pub struct Options {
    /// The file of the mission, or of the system if there is no mission.
    pub file: PathBuf,
    /// Where it listens: a loopback address; port 0 for any free one.
    pub listen: SocketAddr,
    /// What its peers may take of it.
    pub limits: Limits,
    /// Values that go over those of every version of the file.
    pub overrides: Vec<Override>,
    /// The kinds of components there are; without them only the file itself is checked.
    pub manifests: Option<Manifests>,
    /// What of the format is played; without it nothing is refused for not being played.
    pub played: Option<Vec<Feature>>,
}

impl Options {
    /// Serves `file` on a free port, with nothing over it.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        Self {
            file: file.into(),
            listen: (Ipv4Addr::LOCALHOST, 0).into(),
            limits: Limits::default(),
            overrides: Vec::new(),
            manifests: None,
            played: None,
        }
    }
}

/// Why configd cannot serve.
#[derive(Debug, Error)]
pub enum ServeError {
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

/// Serves until the future is dropped, which closes everything. `tell` hears of the address and
/// of each version of the file.
///
/// # Errors
/// [`ServeError`] if it cannot start; once ready it goes on whatever its peers and the file do.
pub async fn serve(
    options: Options,
    mut tell: impl FnMut(Notice),
) -> Result<Infallible, ServeError> {
    let rules = Rules {
        overrides: options.overrides,
        manifests: options.manifests,
        played: options.played,
        root: std::env::current_dir()?,
    };
    let mut files = Files::new(options.file);
    let first = files.reread().ok_or_else(|| std::io::Error::other("the file was not read"))?;
    let instance = random_id();
    let (mut versions, findings) =
        Versions::new(instance, rules, first).map_err(ServeError::Refused)?;
    let listener = listen(options.listen).await?;
    let address = listener.local_addr()?;
    let mut server = Server::<Request, Reply>::new(listener, options.limits);
    let mut readings = watch(files);
    info!(%address, instance, "configd listens");
    tell(Notice::Ready { address });
    tell(Notice::Taken { version: versions.number(), findings });
    loop {
        let event = tokio::select! {
            event = server.event() => Event::Peer(event),
            Some(reading) = readings.recv() => Event::Read(Box::new(reading)),
        };
        for action in versions.handle(event) {
            match action {
                Action::Peer(action) => server.act(action),
                Action::Tell(notice) => tell(notice),
            }
        }
    }
}
