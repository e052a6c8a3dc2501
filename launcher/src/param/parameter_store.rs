//! Where parameters are read and set: in the configd of a running system, or, for a file without
//! one, in the same state machine within this process, so that both give the same results.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use armor_configd::{ConfigdAction, ConfigdEvent, Notice, VersionRules, Versions, write};
use armor_robotfile::{Code, Colours, Findings, Reading};
use armor_sdk::configuration::{
    ConfigdConnection, ConfigdError, Differences, ParameterList, Questions, SetOutcome,
};
use armor_sdk::directory::Directory;
use armor_wire::config::{ConfigReply, ConfigRequest};
use armor_wire::hello::{Hello, Purpose};
use armor_wire::peer::PeerId;

use super::arguments::ParameterSource;
use crate::arguments::{KindFolders, RunningSystem};
use crate::check;
use crate::kinds::Catalogue;
use crate::system;

/// Longest time to wait for the registry and configd.
const FOUND_WITHIN: Duration = Duration::from_secs(3);

/// Where parameters are read and set.
pub enum ParameterStore {
    /// The configd of a running system.
    Running(ConfigdConnection),
    /// A state machine over one file.
    File(Box<FileParameters>),
}

impl ParameterStore {
    /// Opens the one that the arguments select.
    pub fn open(at: &ParameterSource) -> Result<Self> {
        match &at.file {
            Some(file) => Ok(Self::File(Box::new(FileParameters::open(file, &[], &at.kinds)?))),
            None => Self::running(&at.running),
        }
    }

    /// Connects to the configd of a running system.
    pub fn running(running: &RunningSystem) -> Result<Self> {
        let registry = system::find_registry(running)?.to_string();
        let name = format!("param-{}", std::process::id());
        let directory = Directory::observer(&registry, &name);
        Ok(Self::Running(ConfigdConnection::open(&directory, &name, FOUND_WITHIN)?))
    }

    /// Returns the changes from one file to another.
    pub fn between(old: &Path, new: &Path, kinds: &KindFolders) -> Result<Differences> {
        let mut alone = FileParameters::open_copy(old, &[new], kinds)?;
        let reading = armor_robotfile::load_copy(new);
        for action in alone.versions.handle(ConfigdEvent::Read(Box::new(reading))) {
            if let ConfigdAction::Tell(Notice::Refused { findings, .. }) = action {
                return Err(report_invalid(new, &findings));
            }
        }
        let (from, to) = (1, alone.versions.number());
        alone.differences(Some(from), Some(to))
    }

    /// Returns the parameters of all components, or of one.
    pub fn parameters(&mut self, component: Option<&str>) -> Result<ParameterList> {
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

    /// Returns the changes between two versions.
    pub fn differences(&mut self, from: Option<u64>, to: Option<u64>) -> Result<Differences> {
        match self {
            Self::Running(connection) => Ok(connection.differences(from, to)?),
            Self::File(_) => bail!("a file alone has no versions"),
        }
    }
}

/// configd's state machine over a file, with this process as its only peer.
pub struct FileParameters {
    versions: Versions,
}

const OWN_PEER: PeerId = PeerId(1);

impl FileParameters {
    /// Reads the file; `others` are files whose folders may hold kinds too.
    fn open(file: &Path, others: &[&Path], kinds: &KindFolders) -> Result<Self> {
        Self::of_reading(armor_robotfile::load(file), file, others, kinds)
    }

    /// The same of a file that may be a copy under another name.
    fn open_copy(file: &Path, others: &[&Path], kinds: &KindFolders) -> Result<Self> {
        Self::of_reading(armor_robotfile::load_copy(file), file, others, kinds)
    }

    fn of_reading(
        reading: Reading,
        file: &Path,
        others: &[&Path],
        kinds: &KindFolders,
    ) -> Result<Self> {
        let files: Vec<_> =
            reading.files.iter().map(AsRef::as_ref).chain(others.iter().copied()).collect();
        let catalogue = Catalogue::gather(&kinds.directories, files)?;
        let rules = VersionRules {
            manifests: Some(catalogue.manifests()),
            further: Some(check::of_the_mission),
            root: std::env::current_dir().context("the current folder is gone")?,
            ..VersionRules::default()
        };
        let (mut versions, _) = Versions::new(1, rules, reading, Vec::new())
            .map_err(|findings| report_invalid(file, &findings))?;
        let hello = Hello::new("param", 1, Purpose::Config);
        let address = ([127, 0, 0, 1], 0).into();
        let (peer, preface) = (OWN_PEER, None);
        let connected = armor_wire::peer::PeerEvent::Connected { peer, address, hello, preface };
        versions.handle(ConfigdEvent::Peer(connected));
        Ok(Self { versions })
    }
}

impl Questions for FileParameters {
    type Error = anyhow::Error;

    /// Asks, and writes the file if the answer needs it.
    fn ask(&mut self, request: impl FnOnce(u64) -> ConfigRequest) -> Result<ConfigReply> {
        let (arrived, message) = (Duration::ZERO, request(1));
        let asked = armor_wire::peer::PeerEvent::Message { peer: OWN_PEER, arrived, message };
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
                bail!("no answer was received");
            }
            actions = next;
        }
    }
}

fn report_invalid(file: &Path, findings: &Findings) -> anyhow::Error {
    let shown = findings.render(Colours::No);
    match findings.iter().any(|finding| finding.code == Code::Unreadable) {
        true => anyhow!("the file cannot be read:\n{}", shown.trim_end()),
        false => anyhow!("{} is not valid:\n{}", file.display(), shown.trim_end()),
    }
}
