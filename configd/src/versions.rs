//! The version of the file that is in force, and the answers that follow from it: configd without
//! sockets, disk or clock.

mod listing;
mod requests;
mod roles;
pub(crate) mod rules;
mod setting;

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::path::PathBuf;

use armor_robotfile::model::System;
use armor_robotfile::{Configuration, Findings, Manifests, NeededPath, Reading};
use armor_socket::FaultTable;
use armor_wire::acting::Preface;
use armor_wire::config::{ChangeRecord, ConfigReply, ConfigRequest, ConfigurationState};
use armor_wire::peer::PeerId;
use armor_wire::registry::DataReader;

use crate::history::{KeptVersion, VersionHistory};
use roles::Roles;
pub use rules::VersionRules;
use setting::SettingQueue;

/// An event of configd.
#[derive(Debug)]
pub enum ConfigdEvent {
    /// About a connection.
    Peer(armor_wire::peer::PeerEvent<ConfigRequest>),
    /// The file was read again, because it is not what it was.
    Read(Box<Reading>),
    /// There are other kinds of components than before.
    Kinds(Manifests),
    /// The last [`ConfigdAction::Write`] is done, with the warnings about what it names, or why it is
    /// not.
    Written(Result<Findings, String>),
}

/// An action of configd.
#[derive(Debug)]
pub enum ConfigdAction {
    /// About a connection.
    Peer(armor_wire::peer::PeerAction<ConfigReply>),
    /// Passes a notice to the caller.
    Tell(Notice),
    /// Writes a file; [`ConfigdEvent::Written`] reports the result. One at a time.
    Write(Write),
    /// Keeps a version on the disk.
    Keep(KeptVersion),
}

/// A file to be written.
#[derive(Clone, Debug)]
pub struct Write {
    /// The text that every file must have for the write to happen.
    pub expected: Vec<(PathBuf, String)>,
    /// Which of them is written.
    pub file: PathBuf,
    /// Its new text.
    pub text: String,
    /// The files that the new value names, which are looked for.
    pub needs: Vec<NeededPath>,
}

/// A notice for the program that runs configd, which may log it.
#[derive(Clone, Debug)]
pub enum Notice {
    /// Components can connect.
    Ready {
        /// Where.
        address: SocketAddr,
    },
    /// A new version of the file is in force.
    Taken {
        /// Its number; the first one is 1.
        version: u64,
        /// Warnings and notes about it that the version before it did not have.
        findings: Findings,
        /// What changed with it, and when that takes effect; empty for the first.
        changes: Vec<ChangeRecord>,
    },
    /// The file is not valid; what was in force stays so.
    Refused {
        /// The version that stays in force; none if there is none yet.
        kept: Option<u64>,
        /// What is wrong.
        findings: Findings,
    },
    /// The file has not changed, but is not valid with the kinds that there are now. What is in force
    /// stays so.
    Outdated {
        /// The version in force.
        version: u64,
        /// What is wrong.
        findings: Findings,
    },
    /// The file is again what is in force, after it was refused.
    Restored {
        /// The version in force.
        version: u64,
    },
    /// What each component reads by the version in force and the kinds, for the registry.
    Readers(Vec<DataReader>),
    /// The state after any of the four; its stamp is not set.
    State(Box<ConfigurationState>),
}

/// configd's state: the version in force, those before it, and the connections.
pub struct Versions {
    /// This process start.
    instance: u64,
    rules: VersionRules,
    number: u64,
    in_force: Configuration,
    /// Warnings and notes about the version in force.
    warnings: Findings,
    /// What changed with the version in force, and how much more.
    changes: (Vec<ChangeRecord>, u32),
    /// The client that has set the parameter with which the version in force came; empty if the file
    /// was edited.
    set_by: String,
    /// What is wrong with the file, as last read, if it was refused.
    refused: Option<Findings>,
    /// It, as it was read.
    refused_reading: Option<Reading>,
    history: VersionHistory,
    roles: Roles,
    clients: BTreeMap<PeerId, ConfigdClient>,
    settings: SettingQueue,
    /// Holders of keys for whom a refusal was logged.
    role_faults: FaultTable<String>,
}

/// One component's or tool's connection.
struct ConfigdClient {
    component: String,
    /// The parameters it asked for: changes of those that are live are sent to it.
    asked: BTreeSet<String>,
    /// On whose behalf it acts, if a gate forwards it.
    preface: Option<Preface>,
}

impl Versions {
    /// Starts with the file as it is first read; or, after a restart, with the last version that
    /// was `kept`, to which the file is then read as a change.
    ///
    /// # Errors
    /// What is wrong with the file, if nothing is kept.
    pub fn new(
        instance: u64,
        rules: VersionRules,
        first: Reading,
        kept: Vec<KeptVersion>,
    ) -> Result<(Self, Vec<ConfigdAction>), Findings> {
        let mut history = VersionHistory::default();
        let mut roles = Roles::default();
        let (number, in_force, warnings, first) = match rules.newest_good(&kept) {
            Some((number, (configuration, warnings))) => {
                for version in kept.iter().filter(|version| version.number <= number) {
                    let read = version.read_files().configuration;
                    read.iter().for_each(|read| roles.add_roles(read));
                    let sources = read.map(|read| read.sources);
                    history.add_version(version.number, sources.unwrap_or_default());
                }
                (number, configuration, warnings, Some(first))
            }
            None => {
                let (configuration, warnings) = rules.judge_reading(first)?;
                (1, configuration, warnings, None)
            }
        };
        let mut versions = Self {
            warnings,
            history,
            roles,
            ..Self::with_version(instance, rules, number, in_force)
        };
        let is_kept = first.is_some();
        let mut actions = match first {
            Some(first) => {
                versions.changes = versions.changes_of(number);
                versions.take_reading(first)
            }
            None => versions.announce_version(&Findings::default()),
        };
        if actions.is_empty() {
            actions.push(versions.state_notice());
        }
        if is_kept && versions.number == number {
            actions.push(versions.readers_notice());
        }
        Ok((versions, actions))
    }

    /// Starts with no version at all, until the file, in which `findings` were found, is valid: a
    /// configd that is started again must not end a system that runs. `number` is that of the last
    /// version there was.
    pub(crate) fn waiting(
        instance: u64,
        rules: VersionRules,
        number: u64,
        findings: Findings,
    ) -> (Self, Vec<ConfigdAction>) {
        let nothing = Configuration {
            sources: Vec::new(),
            system: System::default(),
            mission: None,
            included: BTreeMap::new(),
        };
        let refused = Some(findings.clone());
        let versions = Self { refused, ..Self::with_version(instance, rules, number, nothing) };
        let refused = Notice::Refused { kept: None, findings };
        let actions = vec![ConfigdAction::Tell(refused), versions.state_notice()];
        (versions, actions)
    }

    fn with_version(
        instance: u64,
        rules: VersionRules,
        number: u64,
        in_force: Configuration,
    ) -> Self {
        Self {
            instance,
            rules,
            number,
            in_force,
            warnings: Findings::default(),
            changes: (Vec::new(), 0),
            set_by: String::new(),
            refused: None,
            refused_reading: None,
            history: VersionHistory::default(),
            roles: Roles::default(),
            clients: BTreeMap::new(),
            settings: SettingQueue::default(),
            role_faults: FaultTable::default(),
        }
    }

    /// The version in force with its bytes; nothing while there is none.
    pub(crate) fn newest_kept(&self) -> Option<KeptVersion> {
        self.history.kept_version(self.number)
    }

    /// Whether there is a version at all.
    fn is_in_force(&self) -> bool {
        !self.in_force.sources.is_empty()
    }

    /// The number of the version in force.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The version in force.
    pub fn in_force(&self) -> &Configuration {
        &self.in_force
    }

    /// Handles an event and returns the resulting actions.
    pub fn handle(&mut self, event: ConfigdEvent) -> Vec<ConfigdAction> {
        use armor_wire::peer::PeerEvent::{Beat, Closed, Connected, Message};
        match event {
            ConfigdEvent::Peer(Connected { peer, address, hello, preface }) => {
                vec![self.welcome_client(peer, address, &hello, preface)]
            }
            ConfigdEvent::Peer(Message { peer, message, .. }) => self.answer_request(peer, message),
            ConfigdEvent::Peer(Closed { peer, .. }) => {
                self.clients.remove(&peer);
                Vec::new()
            }
            ConfigdEvent::Peer(Beat { .. }) => Vec::new(),
            ConfigdEvent::Read(reading) => self.take_reading(*reading),
            ConfigdEvent::Kinds(manifests) => self.take_kinds(manifests),
            ConfigdEvent::Written(result) => self.finish_write(result),
        }
    }

    /// Checks by other kinds from now on; a refused file may be valid by them, and the one in force
    /// invalid. That one stays in force, because the running components were started by the earlier
    /// kinds.
    fn take_kinds(&mut self, manifests: Manifests) -> Vec<ConfigdAction> {
        let before = self.list_readers();
        self.rules.manifests = Some(manifests);
        let mut actions = self.judge_by_kinds();
        if self.list_readers() != before {
            actions.push(self.readers_notice());
        }
        actions
    }

    fn judge_by_kinds(&mut self) -> Vec<ConfigdAction> {
        if let Some(reading) = self.refused_reading.take() {
            return self.take_reading(reading);
        }
        let Some(reading) = self.newest_kept().map(|kept| kept.read_files()) else {
            return Vec::new();
        };
        let Err(findings) = self.rules.judge_reading(reading.clone()) else { return Vec::new() };
        self.refused_reading = Some(reading);
        self.refused = Some(findings.clone());
        let outdated = Notice::Outdated { version: self.number, findings };
        vec![ConfigdAction::Tell(outdated), self.state_notice()]
    }

    fn take_reading(&mut self, reading: Reading) -> Vec<ConfigdAction> {
        self.refused_reading = None;
        let (configuration, findings) = match self.rules.judge_reading(reading.clone()) {
            Ok(valid) => valid,
            Err(findings) => {
                self.refused_reading = Some(reading);
                self.refused = Some(findings.clone());
                let kept = self.is_in_force().then_some(self.number);
                let refused = Notice::Refused { kept, findings };
                return vec![ConfigdAction::Tell(refused), self.state_notice()];
            }
        };
        if rules::is_same(&configuration, &self.in_force) {
            if self.refused.take().is_none() {
                return Vec::new();
            }
            let restored = Notice::Restored { version: self.number };
            return vec![ConfigdAction::Tell(restored), self.state_notice()];
        }
        self.take_version(configuration, findings, String::new())
    }

    /// Puts a valid version in force. `set_by` has set the parameter that it changes.
    fn take_version(
        &mut self,
        configuration: Configuration,
        warnings: Findings,
        set_by: String,
    ) -> Vec<ConfigdAction> {
        self.number += 1;
        self.set_by = set_by;
        self.refused = None;
        self.refused_reading = None;
        let known = std::mem::replace(&mut self.warnings, warnings);
        let before = std::mem::replace(&mut self.in_force, configuration);
        let mut actions = self.announce_version(&known);
        actions.extend(self.changes_of_live_parameters(&before));
        actions
    }

    /// Returns the actions that announce the version in force; `known` are the warnings of the
    /// version before it.
    fn announce_version(&mut self, known: &Findings) -> Vec<ConfigdAction> {
        let version = self.number;
        self.roles.add_roles(&self.in_force);
        self.history.add_version(version, self.in_force.sources.clone());
        self.changes = self.changes_of(version);
        let findings = self.warnings.without_known(known);
        let changes = self.changes.0.clone();
        let mut actions = vec![ConfigdAction::Tell(Notice::Taken { version, findings, changes })];
        actions.push(self.readers_notice());
        actions.extend(self.history.kept_version(version).map(ConfigdAction::Keep));
        actions.push(self.state_notice());
        actions
    }
}

fn send_reply(peer: PeerId, message: ConfigReply) -> ConfigdAction {
    ConfigdAction::Peer(armor_wire::peer::PeerAction::Send { peer, message })
}

#[cfg(test)]
mod tests;
