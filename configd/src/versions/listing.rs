//! Answers to tools: the list of parameters, the changes between versions, and the state notice.

use armor_robotfile::Configuration;
use armor_wire::config::{ChangeRecord, ConfigReply, ConfigurationState, MAX_RECORDS};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::registry::DataReader;

use super::{ConfigdAction, ConfigdClient, Notice, Versions};
use crate::{answers, records};

impl Versions {
    pub(super) fn list_parameters(&self, request: u64, of: Option<&str>, from: u32) -> ConfigReply {
        let components = &self.in_force.system.components;
        if let Some(name) = of.filter(|name| self.in_force.system.component(name).is_none()) {
            return ConfigReply::Refused {
                request,
                refusal: answers::no_component(name, &self.in_force),
            };
        }
        let asked = components.iter().filter(|one| of.is_none_or(|name| one.name.value == name));
        let manifests = self.rules.manifests.as_ref();
        let mission = self.in_force.flattened().ok().flatten();
        let listed = |one| answers::list_parameters(one, mission.as_ref(), manifests);
        let all: Vec<_> = asked.flat_map(listed).collect();
        let total = u32::try_from(all.len()).unwrap_or(u32::MAX);
        let parameters = all.into_iter().skip(from as usize).take(MAX_RECORDS).collect();
        let refused = self.refused.is_some();
        ConfigReply::Listed { request, version: self.number, refused, parameters, total }
    }

    pub(super) fn diff_versions(
        &self,
        request: u64,
        from: Option<u64>,
        to: Option<u64>,
    ) -> ConfigReply {
        let to = to.unwrap_or(self.number);
        let from = from.unwrap_or(to.saturating_sub(1));
        let version = |number| self.read_version(number);
        let (Some(before), Some(after)) = (version(from), version(to)) else {
            let (oldest, newest) = (self.history.oldest_number(), self.number);
            let text = if oldest == newest {
                format!("version {newest} is the only one there is: nothing has changed yet")
            } else {
                format!(
                    "versions {from} and {to} are not both kept; versions {oldest} to {newest} are"
                )
            };
            let refusal = Refusal::new(RefusalCode::UnknownData, text);
            return ConfigReply::Refused { request, refusal };
        };
        let (changes, left_out) = self.change_records(&before, &after);
        ConfigReply::Differences { request, from, to, changes, left_out }
    }

    /// Returns what changed with a version; nothing if the version before it is not kept.
    fn change_records(
        &self,
        before: &Configuration,
        after: &Configuration,
    ) -> (Vec<ChangeRecord>, u32) {
        let is_unrequested = |component: &str, parameter: &str| {
            let runs = |client: &&ConfigdClient| client.component == component;
            let mut running = self.clients.values().filter(runs).peekable();
            running.peek().is_some() && !running.any(|client| client.asked.contains(parameter))
        };
        records::change_records(before, after, &self.rules, &is_unrequested)
    }

    /// Returns the configuration of a version, without overrides.
    fn read_version(&self, number: u64) -> Option<Configuration> {
        let mut configuration = self.history.configuration(number)?;
        self.rules.fill_parameters(&mut configuration);
        Some(configuration)
    }

    pub(super) fn changes_of(&self, version: u64) -> (Vec<ChangeRecord>, u32) {
        let one = |number| self.read_version(number);
        match (one(version.saturating_sub(1)), one(version)) {
            (Some(before), Some(after)) => self.change_records(&before, &after),
            _ => (Vec::new(), 0),
        }
    }

    pub(super) fn readers_notice(&self) -> ConfigdAction {
        ConfigdAction::Tell(Notice::Readers(self.list_readers()))
    }

    pub(super) fn list_readers(&self) -> Vec<DataReader> {
        let (manifests, clock) = (self.rules.manifests.as_ref(), self.rules.clock.as_ref());
        answers::list_readers(&self.in_force, manifests, clock)
    }

    pub(super) fn state_notice(&self) -> ConfigdAction {
        let (findings, findings_left_out) =
            records::finding_records(self.refused.as_ref().unwrap_or(&self.warnings));
        let (changes, changes_left_out) = self.changes.clone();
        let files = self.in_force.sources.iter();
        let files = files.map(|source| self.rules.root.join(source.path()));
        ConfigdAction::Tell(Notice::State(Box::new(ConfigurationState {
            stamp: 0.0,
            version: self.number,
            files: files.map(|file| file.to_string_lossy().into_owned()).collect(),
            refused: self.refused.is_some(),
            findings,
            findings_left_out,
            changes,
            changes_left_out,
            set_by: self.set_by.clone(),
        })))
    }
}
