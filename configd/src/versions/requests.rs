//! Connections of components and tools: their requests, and the changes of live parameters that
//! components are sent without one.

use std::collections::BTreeSet;
use std::net::SocketAddr;

use armor_robotfile::Configuration;
use armor_wire::acting::Preface;
use armor_wire::config::{Assigned, ComponentSettings, ConfigReply, ConfigRequest};
use armor_wire::hello::{Hello, Purpose, Refusal, RefusalCode, Welcome};
use armor_wire::peer::PeerId;

use super::setting::WantedSetting;
use super::{ConfigdAction, ConfigdClient, Versions, send_reply};
use crate::{answers, records};

impl Versions {
    pub(super) fn welcome_client(
        &mut self,
        peer: PeerId,
        address: SocketAddr,
        hello: &Hello,
        preface: Option<Preface>,
    ) -> ConfigdAction {
        if !matches!(hello.purpose, Purpose::Config) {
            tracing::warn!(%address, from = %hello.from, "refused: it did not come for configuration");
            let text = "this is configd; it serves configuration and nothing else";
            let refusal = Refusal::new(RefusalCode::WrongPurpose, text);
            return ConfigdAction::Peer(armor_wire::peer::PeerAction::Refuse { peer, refusal });
        }
        // A component that is not in the file yet may be in its next version.
        let (component, asked) = (hello.from.clone(), BTreeSet::new());
        self.clients.insert(peer, ConfigdClient { component, asked, preface });
        let welcome =
            Welcome { name: "configd".into(), instance: self.instance, schema: String::new() };
        ConfigdAction::Peer(armor_wire::peer::PeerAction::Welcome { peer, welcome })
    }

    pub(super) fn answer_request(
        &mut self,
        peer: PeerId,
        message: ConfigRequest,
    ) -> Vec<ConfigdAction> {
        if let Some(reply) = self.refuse_role(peer, &message) {
            return vec![send_reply(peer, reply)];
        }
        if !self.is_in_force() {
            if let (ConfigRequest::Parameter { name, .. }, Some(client)) =
                (&message, self.clients.get_mut(&peer))
            {
                // It may be live: a component that runs already then gets it with the next version.
                client.asked.insert(name.clone());
            }
            return self
                .no_version(&message)
                .map(|reply| send_reply(peer, reply))
                .into_iter()
                .collect();
        }
        let reply = match message {
            ConfigRequest::Settings { request } => self.answer_component(peer, request, None),
            ConfigRequest::Parameter { request, name } => {
                self.answer_component(peer, request, Some(name))
            }
            ConfigRequest::List { request, component, from } => {
                Some(self.list_parameters(request, component.as_deref(), from))
            }
            ConfigRequest::Diff { request, from, to } => {
                Some(self.diff_versions(request, from, to))
            }
            ConfigRequest::Set { request, component, parameter, value } => {
                let client = self.clients.get(&peer);
                let preface = client.and_then(|client| client.preface.clone());
                let from = client.map(|client| client.component.clone()).unwrap_or_default();
                let by = preface.map(|preface| preface.name);
                return self.set_parameter(WantedSetting {
                    peer,
                    request,
                    component,
                    parameter,
                    value,
                    from,
                    by,
                });
            }
            ConfigRequest::Beat => None,
        };
        reply.map(|reply| send_reply(peer, reply)).into_iter().collect()
    }

    /// Returns the answer to a request that the role of its sender does not allow.
    fn refuse_role(&mut self, peer: PeerId, message: &ConfigRequest) -> Option<ConfigReply> {
        let preface = self.clients.get(&peer)?.preface.as_ref()?;
        let refusal = preface.check(message).err()?;
        if self.role_faults.is_new(None, preface.name.clone()) {
            tracing::warn!("refused: {refusal}; further ones of that key are not logged");
        }
        Some(match message {
            ConfigRequest::Set { request, .. } => {
                let (text, findings) = (refusal.text, Vec::new());
                ConfigReply::Rejected { request: *request, text, findings, left_out: 0 }
            }
            ConfigRequest::Settings { request }
            | ConfigRequest::Parameter { request, .. }
            | ConfigRequest::List { request, .. }
            | ConfigRequest::Diff { request, .. } => {
                ConfigReply::Refused { request: *request, refusal }
            }
            ConfigRequest::Beat => return None,
        })
    }

    /// Returns the answer to any request while no version is in force.
    fn no_version(&self, message: &ConfigRequest) -> Option<ConfigReply> {
        let request = match message {
            ConfigRequest::Settings { request }
            | ConfigRequest::Parameter { request, .. }
            | ConfigRequest::List { request, .. }
            | ConfigRequest::Diff { request, .. }
            | ConfigRequest::Set { request, .. } => *request,
            ConfigRequest::Beat => return None,
        };
        let first = self.refused.iter().flatten().next();
        let why = first.map(|finding| format!("; {finding}")).unwrap_or_default();
        let text = format!("there is no valid version of the file: fix it, and ask again{why}");
        Some(match message {
            ConfigRequest::Set { .. } => {
                let found = self.refused.clone().unwrap_or_default();
                let (findings, left_out) = records::finding_records(&found);
                ConfigReply::Rejected { request, text, findings, left_out }
            }
            _ => {
                let refusal = Refusal::new(RefusalCode::UnknownData, text);
                ConfigReply::Refused { request, refusal }
            }
        })
    }

    /// Answers a component's request about itself.
    fn answer_component(
        &mut self,
        peer: PeerId,
        request: u64,
        parameter: Option<String>,
    ) -> Option<ConfigReply> {
        let client = self.clients.get_mut(&peer)?;
        let name = &client.component;
        let Some(component) = self.in_force.system.component(name) else {
            let refusal = answers::no_component(name, &self.in_force);
            return Some(ConfigReply::Refused { request, refusal });
        };
        let Some(parameter) = parameter else {
            let commanded = self.roles.is_commanded(name);
            let settings =
                answers::component_settings(component, &self.in_force, commanded, self.number);
            let clock = self.rules.clock.clone().or(settings.clock);
            let settings = ComponentSettings { clock, ..settings };
            return Some(ConfigReply::Settings { request, settings });
        };
        let manifests = self.rules.manifests.as_ref();
        if let Some(refusal) = answers::no_parameter(component, &parameter, manifests) {
            return Some(ConfigReply::Refused { request, refusal });
        }
        let assigned = answers::assigned_value(component, &parameter, &self.rules.root);
        client.asked.insert(parameter.clone());
        Some(ConfigReply::Parameter { request, name: parameter, assigned })
    }

    /// Sends each live parameter that a component asked for and that is another one now.
    pub(super) fn changes_of_live_parameters(&self, before: &Configuration) -> Vec<ConfigdAction> {
        let mut actions = Vec::new();
        for (peer, client) in &self.clients {
            let component = |of: &Configuration| of.system.component(&client.component).cloned();
            let (old, Some(new)) = (component(before), component(&self.in_force)) else {
                continue;
            };
            let asked = client.asked.iter();
            for name in asked.filter(|name| self.rules.is_live(&new.kind.value, name)) {
                let was = old.as_ref();
                let was = was.map(|old| answers::assigned_value(old, name, &self.rules.root));
                let is = answers::assigned_value(&new, name, &self.rules.root);
                let value = |assigned: &Option<Assigned>| {
                    assigned.as_ref().map(|assigned| (assigned.text.clone(), assigned.base.clone()))
                };
                if was.is_none_or(|was| value(&was) != value(&is)) {
                    let message =
                        ConfigReply::Parameter { request: 0, name: name.clone(), assigned: is };
                    actions.push(send_reply(*peer, message));
                }
            }
        }
        actions
    }
}
