//! Which processes of this host others may reach through its agent: the components that it runs, for the
//! hosts of their system.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Arc, Weak};

use armor_keys::connect::GateClient;
use armor_keys::reach::{Reach, Target};
use armor_keys::{KeyHolder, KeyPurpose};
use armor_socket::port_holder::find_holder;
use armor_wire::acting::{Preface, Rights};
use armor_wire::hello::{Refusal, RefusalCode};

use super::Agent;
use super::process::ProcessKey;
use crate::run::survivors;

/// The agent's answer to where a connection may lead.
pub(super) struct AgentReach {
    agent: Weak<Agent>,
    host: String,
    mark: String,
    from: String,
}

impl AgentReach {
    pub(super) fn new(agent: &Arc<Agent>) -> Self {
        Self {
            agent: Arc::downgrade(agent),
            host: agent.keys.host_name().to_owned(),
            mark: agent.mark.clone(),
            from: agent.arguments.from.clone(),
        }
    }

    /// The component of this agent that listens on a port.
    fn find_component(&self, port: u16) -> Option<ProcessKey> {
        let holder = find_holder(SocketAddr::from((Ipv4Addr::LOCALHOST, port)))?;
        let mark = survivors::read_mark(holder)?;
        let (system, rest) = mark.strip_prefix(&self.mark)?.split_once('/')?;
        let (component, _) = rest.split_once('/')?;
        Some(ProcessKey { system: system.to_owned(), component: component.to_owned() })
    }

    /// Notes where a component listens, for when this host is cut off.
    fn note_port(&self, key: &ProcessKey, port: u16) {
        let agent = self.agent.upgrade();
        if let Some(process) = agent.and_then(|agent| agent.processes.lock().get(key).cloned()) {
            process.set_port(port);
        }
    }

    fn is_in_system(&self, host: &str, system: &str) -> bool {
        let agent = self.agent.upgrade();
        let site = agent.and_then(|agent| agent.sites.lock().get(system).cloned());
        site.is_some_and(|site| site.leads_to(host))
    }
}

impl Reach for AgentReach {
    fn find_target(
        &self,
        client: &KeyHolder,
        address: &str,
        acts_for: Option<&Preface>,
    ) -> Result<Target, Refusal> {
        let refuse = |code, text: String| Err(Refusal::new(code, text));
        let KeyHolder { name, purpose } = client;
        if *purpose != KeyPurpose::Host {
            let text = format!(
                "{} runs components of systems of {}; connect to the gate there",
                self.host, self.from
            );
            return refuse(RefusalCode::WrongPurpose, text);
        }
        let port = address.rsplit_once(':').filter(|(host, _)| *host == self.host);
        let port = port.and_then(|(_, port)| port.parse::<u16>().ok());
        let Some(port) = port else {
            let text = format!("{address} is not {}:PORT", self.host);
            return refuse(RefusalCode::Malformed, text);
        };
        let Some(key) = self.find_component(port) else {
            let text = format!("no component of this agent listens on port {port}");
            return refuse(RefusalCode::UnknownData, text);
        };
        if !self.is_in_system(name, &key.system) {
            let text = format!("{name} is no host of the system {}", key.system);
            return refuse(RefusalCode::Role, text);
        }
        self.note_port(&key, port);
        let is_launcher = *name == self.from;
        let preface = match acts_for {
            Some(preface) if is_launcher => preface.clone(),
            Some(_) => {
                let text = format!("{name} may not forward connections of others");
                return refuse(RefusalCode::Role, text);
            }
            None if is_launcher => Preface { name: name.clone(), rights: Rights::Launcher },
            None => {
                let rights = Rights::Host { components: Vec::new() };
                Preface { name: name.clone(), rights }
            }
        };
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        Ok(Target::Process { address, preface })
    }

    fn find_gate(&self, _: &str) -> Option<Arc<GateClient>> {
        None
    }

    fn registry(&self) -> Option<SocketAddr> {
        None
    }
}
