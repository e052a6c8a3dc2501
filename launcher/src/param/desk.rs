//! Who answers about parameters: the configd of a running system; or, for a file alone, the same
//! state machine in this process, so that both judge and say the same.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use armor_configd::{ConfigdAction, ConfigdEvent, Notice, VersionRules, Versions, write};
use armor_plan::PLAYED;
use armor_robotfile::{Colours, Findings};
use armor_sdk::configuration::{
    ConfigdConnection, ConfigdError, Differences, Parameters, Questions, SetOutcome,
};
use armor_sdk::directory::Directory;
use armor_wire::config::{ConfigReply, ConfigRequest};
use armor_wire::hello::{Hello, Purpose};
use armor_wire::peer::PeerId;

use super::arguments::Where;
use crate::arguments::{Kinds, Running};
use crate::check;
use crate::kinds::Catalogue;
use crate::system;

/// How long the registry and configd have to answer.
const FOUND_WITHIN: Duration = Duration::from_secs(3);

/// Who answers.
pub enum Desk {
    /// The configd of a running system.
    Running(ConfigdConnection),
    /// A state machine over one file.
    File(Box<Alone>),
}

impl Desk {
    /// The one that is meant.
    pub fn open(at: &Where) -> Result<Self> {
        match &at.file {
            Some(file) => Ok(Self::File(Box::new(Alone::open(file, &[], &at.kinds)?))),
            None => Self::running(&at.running),
        }
    }

    /// The configd of a running system.
    pub fn running(running: &Running) -> Result<Self> {
        let registry = system::registry(running)?.to_string();
        let name = format!("param-{}", std::process::id());
        let directory = Directory::observer(&registry, &name);
        Ok(Self::Running(ConfigdConnection::open(&directory, &name, FOUND_WITHIN)?))
    }

    /// What changed from one file to another.
    pub fn between(old: &Path, new: &Path, kinds: &Kinds) -> Result<Differences> {
        let mut alone = Alone::open(old, &[new], kinds)?;
        let reading = armor_robotfile::load(new);
        for action in alone.versions.handle(ConfigdEvent::Read(Box::new(reading))) {
            if let ConfigdAction::Tell(Notice::Refused { findings, .. }) = action {
                return Err(invalid(new, &findings));
            }
        }
        let (from, to) = (1, alone.versions.number());
        alone.differences(Some(from), Some(to))
    }

    /// The parameters of all components, or of one.
    pub fn parameters(&mut self, component: Option<&str>) -> Result<Parameters> {
        match self {
            Self::Running(connection) => Ok(connection.parameters(component)?),
            Self::File(alone) => alone.parameters(component),
        }
    }

    /// Sets a parameter in the file.
    pub fn set(
        &mut self,
        component: &str,
        parameter: &str,
        value: Option<&str>,
    ) -> Result<SetOutcome> {
        match self {
            Self::Running(connection) => {
                let done = connection.set(component, parameter, value);
                done.map_err(|error| match error {
                    ConfigdError::Ended(_) => anyhow!(
                        "{error}; it is unknown whether the value was written: check with `armor param get`"
                    ),
                    error => error.into(),
                })
            }
            Self::File(alone) => alone.set(component, parameter, value),
        }
    }

    /// What changed between two versions.
    pub fn differences(&mut self, from: Option<u64>, to: Option<u64>) -> Result<Differences> {
        match self {
            Self::Running(connection) => Ok(connection.differences(from, to)?),
            Self::File(_) => bail!("a file alone has no versions"),
        }
    }
}

/// configd's state machine over a file, with this process as its only peer.
pub struct Alone {
    versions: Versions,
}

const US: PeerId = PeerId(1);

impl Alone {
    /// Reads the file; `others` are files whose folders may hold kinds too.
    fn open(file: &Path, others: &[&Path], kinds: &Kinds) -> Result<Self> {
        let reading = armor_robotfile::load(file);
        let files: Vec<_> =
            reading.files.iter().map(AsRef::as_ref).chain(others.iter().copied()).collect();
        let catalogue = Catalogue::gather(&kinds.directories, files)?;
        let rules = VersionRules {
            manifests: Some(catalogue.manifests()),
            played: Some(PLAYED.to_vec()),
            further: Some(check::of_the_mission),
            root: std::env::current_dir().context("the current folder is gone")?,
            ..VersionRules::default()
        };
        let (mut versions, _) = Versions::new(1, rules, reading, Vec::new())
            .map_err(|findings| invalid(file, &findings))?;
        let hello = Hello::new("param", 1, Purpose::Config);
        let address = ([127, 0, 0, 1], 0).into();
        let connected = armor_wire::peer::PeerEvent::Connected { peer: US, address, hello };
        versions.handle(ConfigdEvent::Peer(connected));
        Ok(Self { versions })
    }
}

impl Questions for Alone {
    type Error = anyhow::Error;

    /// Asks, and writes what is to be written.
    fn ask(&mut self, request: impl FnOnce(u64) -> ConfigRequest) -> Result<ConfigReply> {
        let (arrived, message) = (Duration::ZERO, request(1));
        let asked = armor_wire::peer::PeerEvent::Message { peer: US, arrived, message };
        let mut actions = self.versions.handle(ConfigdEvent::Peer(asked));
        loop {
            let mut next = Vec::new();
            for action in actions {
                match action {
                    ConfigdAction::Peer(armor_wire::peer::PeerAction::Send { message, .. }) => {
                        return match message {
                            ConfigReply::Refused { refusal, .. } => {
                                Err(anyhow!("{}", refusal.text))
                            }
                            reply => Ok(reply),
                        };
                    }
                    ConfigdAction::Write(wanted) => {
                        next = self.versions.handle(ConfigdEvent::Written(write(&wanted)));
                    }
                    _ => {}
                }
            }
            if next.is_empty() {
                bail!("there is no answer");
            }
            actions = next;
        }
    }
}

fn invalid(file: &Path, findings: &Findings) -> anyhow::Error {
    anyhow!("{} is not valid:\n{}", file.display(), findings.render(Colours::No).trim_end())
}
