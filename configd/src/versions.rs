//! Which version of the file is in force, and who is told what: configd without sockets, disk or
//! clock.

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::path::PathBuf;

use armor_missions::{Configuration, Feature, Findings, Manifests, Override, Reading, check};
use armor_net::PeerId;
use armor_wire::config::{Reply, Request};
use armor_wire::hello::{Hello, Purpose, Refusal, RefusalCode, Welcome};

use crate::answers;

/// What happens to configd.
#[derive(Debug)]
pub enum Event {
    /// Something on a connection.
    Peer(armor_net::Event<Request>),
    /// The file was read again, because it is not what it was.
    Read(Box<Reading>),
}

/// What configd does.
#[derive(Debug)]
pub enum Action {
    /// Something on a connection.
    Peer(armor_net::Action<Reply>),
    /// Tells whoever runs it.
    Tell(Notice),
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
    },
    /// The file is not valid; what was in force stays so.
    Refused {
        /// The version that stays in force.
        kept: u64,
        /// What is wrong.
        findings: Findings,
    },
    /// The file is again what is in force, after it was refused.
    Restored {
        /// The version in force.
        version: u64,
    },
}

/// What a version of the file is judged by. It stays the same while configd runs.
#[derive(Clone, Debug, Default)]
pub struct Rules {
    /// Values that go over those of every version.
    pub overrides: Vec<Override>,
    /// The kinds of components there are; without them only the file itself is checked.
    pub manifests: Option<Manifests>,
    /// What of the format is played; without it nothing is refused for not being played.
    pub played: Option<Vec<Feature>>,
    /// The absolute folder that relative paths of files start from.
    pub root: PathBuf,
}

/// configd's state: the version in force, and the connections.
pub struct Versions {
    /// This process start.
    instance: u64,
    rules: Rules,
    number: u64,
    in_force: Configuration,
    /// Whether the file, as last read, was refused.
    refused: bool,
    clients: BTreeMap<PeerId, Client>,
}

/// One component's connection.
struct Client {
    component: String,
    /// The live parameters it asked for: their changes are sent to it.
    live: BTreeSet<String>,
}

impl Versions {
    /// Starts with a first version.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn new(
        instance: u64,
        rules: Rules,
        reading: Reading,
    ) -> Result<(Self, Findings), Findings> {
        let (in_force, findings) = judge(&rules, reading)?;
        let clients = BTreeMap::new();
        Ok((Self { instance, rules, number: 1, in_force, refused: false, clients }, findings))
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
        use armor_net::Event::{Beat, Closed, Connected, Message};
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
        }
    }

    fn connected(&mut self, peer: PeerId, address: SocketAddr, hello: &Hello) -> Action {
        if !matches!(hello.purpose, Purpose::Config) {
            tracing::warn!(%address, from = %hello.from, "refused: it did not come for configuration");
            let text = "this is configd; it serves configuration and nothing else";
            let refusal = Refusal::new(RefusalCode::WrongPurpose, text);
            return Action::Peer(armor_net::Action::Refuse { peer, refusal });
        }
        // A component that the file does not hold yet may be there in its next version.
        self.clients.insert(peer, Client { component: hello.from.clone(), live: BTreeSet::new() });
        let welcome =
            Welcome { name: "configd".into(), instance: self.instance, schema: String::new() };
        Action::Peer(armor_net::Action::Welcome { peer, welcome })
    }

    fn request(&mut self, peer: PeerId, message: Request) -> Vec<Action> {
        let Some(client) = self.clients.get_mut(&peer) else { return Vec::new() };
        let name = &client.component;
        let (request, parameter) = match message {
            Request::Settings { request } => (request, None),
            Request::Parameter { request, name } => (request, Some(name)),
            _ => return Vec::new(),
        };
        let component = self.in_force.system.component(name);
        let message = match (component, parameter) {
            (None, _) => {
                Reply::Refused { request, refusal: answers::no_component(name, &self.in_force) }
            }
            (Some(component), None) => {
                let settings = answers::settings(component, &self.in_force, self.number);
                Reply::Settings { request, settings }
            }
            (Some(component), Some(parameter)) => {
                let assigned = answers::assigned(component, &parameter, &self.rules.root);
                if is_live(&self.rules, &component.kind.value, &parameter) {
                    client.live.insert(parameter.clone());
                }
                Reply::Parameter { request, name: parameter, assigned }
            }
        };
        vec![send(peer, message)]
    }

    fn read(&mut self, reading: Reading) -> Vec<Action> {
        let (configuration, findings) = match judge(&self.rules, reading) {
            Ok(valid) => valid,
            Err(findings) => {
                self.refused = true;
                return vec![Action::Tell(Notice::Refused { kept: self.number, findings })];
            }
        };
        if same(&configuration, &self.in_force) {
            let restored = std::mem::take(&mut self.refused);
            let notice = Notice::Restored { version: self.number };
            return if restored { vec![Action::Tell(notice)] } else { Vec::new() };
        }
        self.refused = false;
        self.number += 1;
        let before = std::mem::replace(&mut self.in_force, configuration);
        let mut actions = vec![Action::Tell(Notice::Taken { version: self.number, findings })];
        actions.extend(self.changes_of_live_parameters(&before));
        actions
    }

    /// Sends each live parameter that a component asked for and that is another one now.
    fn changes_of_live_parameters(&self, before: &Configuration) -> Vec<Action> {
        let mut actions = Vec::new();
        for (peer, client) in &self.clients {
            let component = |of: &Configuration| of.system.component(&client.component).cloned();
            let (Some(old), Some(new)) = (component(before), component(&self.in_force)) else {
                continue;
            };
            for name in
                client.live.iter().filter(|name| is_live(&self.rules, &new.kind.value, name))
            {
                let was = answers::assigned(&old, name, &self.rules.root);
                let is = answers::assigned(&new, name, &self.rules.root);
                let value = |assigned: &Option<armor_wire::config::Assigned>| {
                    assigned.as_ref().map(|assigned| (assigned.text.clone(), assigned.base.clone()))
                };
                if value(&was) != value(&is) {
                    let message = Reply::Parameter { request: 0, name: name.clone(), assigned: is };
                    actions.push(send(*peer, message));
                }
            }
        }
        actions
    }
}

fn send(peer: PeerId, message: Reply) -> Action {
    Action::Peer(armor_net::Action::Send { peer, message })
}

/// The configuration with its warnings if all of it is valid, else what is wrong.
fn judge(rules: &Rules, reading: Reading) -> Result<(Configuration, Findings), Findings> {
    let mut reading = check(reading, &rules.overrides, rules.manifests.as_ref());
    if let (Some(played), Some(configuration)) = (&rules.played, &reading.configuration) {
        configuration.refuse_unplayed(played, &mut reading.findings);
    }
    match reading.configuration {
        Some(configuration) if !reading.findings.has_errors() => {
            Ok((configuration, reading.findings))
        }
        _ => Err(reading.findings),
    }
}

fn is_live(rules: &Rules, kind: &str, parameter: &str) -> bool {
    let manifest = rules.manifests.as_ref().and_then(|manifests| manifests.get(kind));
    let mut parameters = manifest.iter().flat_map(|manifest| &manifest.parameters);
    parameters.any(|known| known.name == parameter && known.live)
}

/// Whether two versions were read from the same bytes.
fn same(a: &Configuration, b: &Configuration) -> bool {
    let texts = |of: &Configuration| -> Vec<_> {
        of.sources
            .iter()
            .map(|source| (source.path().to_path_buf(), source.text().to_owned()))
            .collect()
    };
    texts(a) == texts(b)
}

#[cfg(test)]
mod tests;
