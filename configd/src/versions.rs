//! Which version of the file is in force, and who is told what: configd without sockets, disk or
//! clock.

mod roles;
mod rules;
mod setting;
mod tools;

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::path::PathBuf;

use armor_robotfile::model::System;
use armor_robotfile::{Configuration, Findings, Manifests, Reading};
use armor_socket::PeerId;
use armor_wire::config::{Assigned, Change, ConfigurationState, Reply, Request};
use armor_wire::hello::{Hello, Purpose, Refusal, RefusalCode, Welcome};

use crate::history::{History, Kept};
use crate::{answers, told};
use roles::Roles;
pub use rules::Rules;
use setting::Settings;

/// What happens to configd.
#[derive(Debug)]
pub enum Event {
    /// Something on a connection.
    Peer(armor_socket::Event<Request>),
    /// The file was read again, because it is not what it was.
    Read(Box<Reading>),
    /// There are other kinds of components than before.
    Kinds(Manifests),
    /// The last [`Action::Write`] is done, or why it is not.
    Written(Result<(), String>),
}

/// What configd does.
#[derive(Debug)]
pub enum Action {
    /// Something on a connection.
    Peer(armor_socket::Action<Reply>),
    /// Tells whoever runs it.
    Tell(Notice),
    /// Writes into a file, and says in [`Event::Written`] what came of it. One at a time.
    Write(Write),
    /// Keeps a version on the disk.
    Keep(Kept),
}

/// A file to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Write {
    /// What all the files must hold for it to be written.
    pub expected: Vec<(PathBuf, String)>,
    /// Which of them is written.
    pub file: PathBuf,
    /// What it will hold.
    pub text: String,
}

/// What whoever runs configd is told; it is for them to log it.
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
        /// Warnings and notes about it.
        findings: Findings,
        /// What changed with it, and when that takes effect; empty for the first.
        changes: Vec<Change>,
    },
    /// The file is not valid; what was in force stays so.
    Refused {
        /// The version that stays in force; none if there is none yet.
        kept: Option<u64>,
        /// What is wrong.
        findings: Findings,
    },
    /// The file is again what is in force, after it was refused.
    Restored {
        /// The version in force.
        version: u64,
    },
    /// How things stand, after any of the three; its stamp is left open.
    State(Box<ConfigurationState>),
}

/// configd's state: the version in force, those before it, and the connections.
pub struct Versions {
    /// This process start.
    instance: u64,
    rules: Rules,
    number: u64,
    in_force: Configuration,
    /// Warnings and notes about the version in force.
    warnings: Findings,
    /// What changed with the version in force, and how much more.
    changes: (Vec<Change>, u32),
    /// What is wrong with the file, as last read, if it was refused.
    refused: Option<Findings>,
    /// It, as it was read.
    refused_reading: Option<Reading>,
    history: History,
    roles: Roles,
    clients: BTreeMap<PeerId, Client>,
    settings: Settings,
}

/// One component's or tool's connection.
struct Client {
    component: String,
    /// The live parameters it asked for: their changes are sent to it.
    live: BTreeSet<String>,
}

impl Versions {
    /// Starts with the file as it is first read; or, after a restart, with the last version that was
    /// `kept`, to which the file is then read as a change.
    ///
    /// # Errors
    /// What is wrong with the file, if nothing is kept.
    pub fn new(
        instance: u64,
        rules: Rules,
        first: Reading,
        kept: Vec<Kept>,
    ) -> Result<(Self, Vec<Action>), Findings> {
        let mut history = History::default();
        let mut roles = Roles::default();
        let (number, in_force, warnings, first) = match rules.newest_good(&kept) {
            Some((number, (configuration, warnings))) => {
                for version in kept.iter().filter(|version| version.number <= number) {
                    let read = version.reading().configuration;
                    read.iter().for_each(|read| roles.add(read));
                    let sources = read.map(|read| read.sources);
                    history.add(version.number, sources.unwrap_or_default());
                }
                (number, configuration, warnings, Some(first))
            }
            None => {
                let (configuration, warnings) = rules.judge(first)?;
                (1, configuration, warnings, None)
            }
        };
        let mut versions =
            Self { warnings, history, roles, ..Self::with(instance, rules, number, in_force) };
        let mut actions = match first {
            Some(first) => {
                versions.changes = versions.changes_of(number);
                versions.read(first)
            }
            None => versions.took(),
        };
        if actions.is_empty() {
            actions.push(versions.state());
        }
        Ok((versions, actions))
    }

    /// Starts with no version at all, until the file, in which `findings` were found, is valid: a
    /// configd that is started again must not end a system that runs. `number` is that of the last
    /// version there was.
    pub(crate) fn waiting(
        instance: u64,
        rules: Rules,
        number: u64,
        findings: Findings,
    ) -> (Self, Vec<Action>) {
        let nothing = Configuration {
            sources: Vec::new(),
            system: System::default(),
            mission: None,
            included: BTreeMap::new(),
        };
        let refused = Some(findings.clone());
        let versions = Self { refused, ..Self::with(instance, rules, number, nothing) };
        let refused = Notice::Refused { kept: None, findings };
        let actions = vec![Action::Tell(refused), versions.state()];
        (versions, actions)
    }

    fn with(instance: u64, rules: Rules, number: u64, in_force: Configuration) -> Self {
        Self {
            instance,
            rules,
            number,
            in_force,
            warnings: Findings::default(),
            changes: (Vec::new(), 0),
            refused: None,
            refused_reading: None,
            history: History::default(),
            roles: Roles::default(),
            clients: BTreeMap::new(),
            settings: Settings::default(),
        }
    }

    /// The version in force with its bytes; nothing while there is none.
    pub(crate) fn kept(&self) -> Option<Kept> {
        self.history.kept(self.number)
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

    /// Takes an event in and says what is to be done.
    pub fn handle(&mut self, event: Event) -> Vec<Action> {
        use armor_socket::Event::{Beat, Closed, Connected, Message};
        match event {
            Event::Peer(Connected { peer, address, hello }) => {
                vec![self.connected(peer, address, &hello)]
            }
            Event::Peer(Message { peer, message, .. }) => self.request(peer, message),
            Event::Peer(Closed { peer, .. }) => {
                self.clients.remove(&peer);
                Vec::new()
            }
            Event::Peer(Beat { .. }) => Vec::new(),
            Event::Read(reading) => self.read(*reading),
            Event::Kinds(manifests) => self.kinds(manifests),
            Event::Written(result) => self.written(result),
        }
    }

    fn connected(&mut self, peer: PeerId, address: SocketAddr, hello: &Hello) -> Action {
        if !matches!(hello.purpose, Purpose::Config) {
            tracing::warn!(%address, from = %hello.from, "refused: it did not come for configuration");
            let text = "this is configd; it serves configuration and nothing else";
            let refusal = Refusal::new(RefusalCode::WrongPurpose, text);
            return Action::Peer(armor_socket::Action::Refuse { peer, refusal });
        }
        // A component that the file does not hold yet may be there in its next version.
        self.clients.insert(peer, Client { component: hello.from.clone(), live: BTreeSet::new() });
        let welcome =
            Welcome { name: "configd".into(), instance: self.instance, schema: String::new() };
        Action::Peer(armor_socket::Action::Welcome { peer, welcome })
    }

    fn request(&mut self, peer: PeerId, message: Request) -> Vec<Action> {
        if !self.is_in_force() {
            if let (Request::Parameter { name, .. }, Some(client)) =
                (&message, self.clients.get_mut(&peer))
            {
                // It may be a live one; who runs already hears of it with the next version.
                client.live.insert(name.clone());
            }
            return self.no_version(&message).map(|reply| send(peer, reply)).into_iter().collect();
        }
        let reply = match message {
            Request::Settings { request } => self.component(peer, request, None),
            Request::Parameter { request, name } => self.component(peer, request, Some(name)),
            Request::List { request, component, from } => {
                Some(self.list(request, component.as_deref(), from))
            }
            Request::Diff { request, from, to } => Some(self.diff(request, from, to)),
            Request::Set { request, component, parameter, value } => {
                let wanted = setting::Wanted { peer, request, component, parameter, value };
                return self.set(wanted);
            }
            Request::Beat => None,
        };
        reply.map(|reply| send(peer, reply)).into_iter().collect()
    }

    /// The answer to whatever is asked while no version is in force.
    fn no_version(&self, message: &Request) -> Option<Reply> {
        let request = match message {
            Request::Settings { request }
            | Request::Parameter { request, .. }
            | Request::List { request, .. }
            | Request::Diff { request, .. }
            | Request::Set { request, .. } => *request,
            Request::Beat => return None,
        };
        let first = self.refused.iter().flatten().next();
        let why = first.map(|finding| format!("; {finding}")).unwrap_or_default();
        let text = format!("there is no valid version of the file: mend it, and ask again{why}");
        Some(match message {
            Request::Set { .. } => {
                let found = self.refused.clone().unwrap_or_default();
                let (findings, left_out) = told::findings(&found);
                Reply::Rejected { request, text, findings, left_out }
            }
            _ => {
                let refusal = Refusal::new(RefusalCode::UnknownData, text);
                Reply::Refused { request, refusal }
            }
        })
    }

    /// What a component asks of itself.
    fn component(
        &mut self,
        peer: PeerId,
        request: u64,
        parameter: Option<String>,
    ) -> Option<Reply> {
        let client = self.clients.get_mut(&peer)?;
        let name = &client.component;
        let Some(component) = self.in_force.system.component(name) else {
            let refusal = answers::no_component(name, &self.in_force);
            return Some(Reply::Refused { request, refusal });
        };
        let Some(parameter) = parameter else {
            let commanded = self.roles.is_commanded(name);
            let settings = answers::settings(component, &self.in_force, commanded, self.number);
            return Some(Reply::Settings { request, settings });
        };
        let manifests = self.rules.manifests.as_ref();
        if let Some(refusal) = answers::no_parameter(component, &parameter, manifests) {
            return Some(Reply::Refused { request, refusal });
        }
        let assigned = answers::assigned(component, &parameter, &self.rules.root);
        if self.rules.is_live(&component.kind.value, &parameter) {
            client.live.insert(parameter.clone());
        }
        Some(Reply::Parameter { request, name: parameter, assigned })
    }

    /// Judges by other kinds from now on; what was refused may be fine by them. What is in force
    /// stays so: the running components are those of then.
    fn kinds(&mut self, manifests: Manifests) -> Vec<Action> {
        self.rules.manifests = Some(manifests);
        let reading = self.refused_reading.take();
        reading.map(|reading| self.read(reading)).unwrap_or_default()
    }

    fn read(&mut self, reading: Reading) -> Vec<Action> {
        self.refused_reading = None;
        let (configuration, findings) = match self.rules.judge(reading.clone()) {
            Ok(valid) => valid,
            Err(findings) => {
                self.refused_reading = Some(reading);
                self.refused = Some(findings.clone());
                let kept = self.is_in_force().then_some(self.number);
                let refused = Notice::Refused { kept, findings };
                return vec![Action::Tell(refused), self.state()];
            }
        };
        if rules::is_same(&configuration, &self.in_force) {
            if self.refused.take().is_none() {
                return Vec::new();
            }
            let restored = Notice::Restored { version: self.number };
            return vec![Action::Tell(restored), self.state()];
        }
        self.take(configuration, findings)
    }

    /// Puts a valid version in force.
    fn take(&mut self, configuration: Configuration, warnings: Findings) -> Vec<Action> {
        self.number += 1;
        self.refused = None;
        self.refused_reading = None;
        self.warnings = warnings;
        let before = std::mem::replace(&mut self.in_force, configuration);
        let mut actions = self.took();
        actions.extend(self.changes_of_live_parameters(&before));
        actions
    }

    /// What follows when the version in force is a new one.
    fn took(&mut self) -> Vec<Action> {
        let version = self.number;
        self.roles.add(&self.in_force);
        self.history.add(version, self.in_force.sources.clone());
        self.changes = self.changes_of(version);
        let (findings, changes) = (self.warnings.clone(), self.changes.0.clone());
        let mut actions = vec![Action::Tell(Notice::Taken { version, findings, changes })];
        actions.extend(self.history.kept(version).map(Action::Keep));
        actions.push(self.state());
        actions
    }

    /// Sends each live parameter that a component asked for and that is another one now.
    fn changes_of_live_parameters(&self, before: &Configuration) -> Vec<Action> {
        let mut actions = Vec::new();
        for (peer, client) in &self.clients {
            let component = |of: &Configuration| of.system.component(&client.component).cloned();
            let (old, Some(new)) = (component(before), component(&self.in_force)) else {
                continue;
            };
            let live = client.live.iter();
            for name in live.filter(|name| self.rules.is_live(&new.kind.value, name)) {
                let was = old.as_ref();
                let was = was.map(|old| answers::assigned(old, name, &self.rules.root));
                let is = answers::assigned(&new, name, &self.rules.root);
                let value = |assigned: &Option<Assigned>| {
                    assigned.as_ref().map(|assigned| (assigned.text.clone(), assigned.base.clone()))
                };
                if was.is_none_or(|was| value(&was) != value(&is)) {
                    let message = Reply::Parameter { request: 0, name: name.clone(), assigned: is };
                    actions.push(send(*peer, message));
                }
            }
        }
        actions
    }
}

fn send(peer: PeerId, message: Reply) -> Action {
    Action::Peer(armor_socket::Action::Send { peer, message })
}

#[cfg(test)]
mod tests;
