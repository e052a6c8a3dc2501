//! What tools are told: the parameters, what changed between versions, and how things stand.

use armor_wire::config::{Change, ConfigurationState, MAX_TOLD, Reply};
use armor_wire::hello::{Refusal, RefusalCode};

use super::{Action, Notice, Versions};
use crate::{answers, told};

impl Versions {
    pub(super) fn list(&self, request: u64, of: Option<&str>, from: u32) -> Reply {
        let components = &self.in_force.system.components;
        if let Some(name) = of.filter(|name| self.in_force.system.component(name).is_none()) {
            return Reply::Refused {
                request,
                refusal: answers::no_component(name, &self.in_force),
            };
        }
        let asked = components.iter().filter(|one| of.is_none_or(|name| one.name.value == name));
        let manifests = self.rules.manifests.as_ref();
        let mission = self.in_force.flattened().ok().flatten();
        let listed = |one| answers::listed(one, mission.as_ref(), manifests);
        let all: Vec<_> = asked.flat_map(listed).collect();
        let total = u32::try_from(all.len()).unwrap_or(u32::MAX);
        let parameters = all.into_iter().skip(from as usize).take(MAX_TOLD).collect();
        let refused = self.refused.is_some();
        Reply::Listed { request, version: self.number, refused, parameters, total }
    }

    pub(super) fn diff(&self, request: u64, from: Option<u64>, to: Option<u64>) -> Reply {
        let to = to.unwrap_or(self.number);
        let from = from.unwrap_or(to.saturating_sub(1));
        let version = |number| self.history.configuration(number);
        let (Some(before), Some(after)) = (version(from), version(to)) else {
            let (oldest, newest) = (self.history.oldest(), self.number);
            let text = if oldest == newest {
                format!("version {newest} is the only one there is: nothing has changed yet")
            } else {
                format!("versions {from} and {to} are not both held; {oldest} to {newest} are")
            };
            let refusal = Refusal::new(RefusalCode::UnknownData, text);
            return Reply::Refused { request, refusal };
        };
        let (changes, left_out) = told::changes(&before, &after, &self.rules);
        Reply::Differences { request, from, to, changes, left_out }
    }

    /// What changed with a version; nothing if the one before it is not known.
    pub(super) fn changes_of(&self, version: u64) -> (Vec<Change>, u32) {
        let one = |number| self.history.configuration(number);
        match (one(version.saturating_sub(1)), one(version)) {
            (Some(before), Some(after)) => told::changes(&before, &after, &self.rules),
            _ => (Vec::new(), 0),
        }
    }

    pub(super) fn state(&self) -> Action {
        let (findings, findings_left_out) =
            told::findings(self.refused.as_ref().unwrap_or(&self.warnings));
        let (changes, changes_left_out) = self.changes.clone();
        let files = self.in_force.sources.iter();
        let files = files.map(|source| self.rules.root.join(source.path()));
        Action::Tell(Notice::State(Box::new(ConfigurationState {
            stamp: 0.0,
            version: self.number,
            files: files.map(|file| file.to_string_lossy().into_owned()).collect(),
            refused: self.refused.is_some(),
            findings,
            findings_left_out,
            changes,
            changes_left_out,
        })))
    }
}
