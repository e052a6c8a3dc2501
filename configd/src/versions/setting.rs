//! Setting a parameter: the edit is made and checked here, written by the watching task, and in
//! force once it is on the disk. One after the other, so that each is checked against the result of
//! the one before it.

use std::collections::VecDeque;
use std::path::{Component, Path};

use armor_robotfile::{
    Code, Configuration, Document, Finding, Findings, NeededPath, Source, needed_paths,
};
use armor_wire::config::ConfigReply;
use armor_wire::peer::PeerId;

use super::{ConfigdAction, Versions, Write, send_reply};
use crate::history::KeptVersion;
use crate::{answers, records};

/// Most requests that wait for the one before them. A person has one, a script a few.
const MAX_WAITING: usize = 64;

/// A request to set a parameter.
pub(super) struct WantedSetting {
    pub(super) peer: PeerId,
    pub(super) request: u64,
    pub(super) component: String,
    pub(super) parameter: String,
    pub(super) value: Option<String>,
    /// The name of the client.
    pub(super) from: String,
    /// The holder of the key, if it came through a gate.
    pub(super) by: Option<String>,
}

impl WantedSetting {
    /// Who is recorded as the author of the change.
    fn set_by(&self) -> String {
        self.by.as_ref().unwrap_or(&self.from).clone()
    }
}

/// The requests that are not finished yet.
#[derive(Default)]
pub(super) struct SettingQueue {
    waiting: VecDeque<WantedSetting>,
    /// The one that is being written, and the version that will be in force with it.
    writing: Option<(WantedSetting, Configuration, Findings)>,
}

/// A write, and the version that will be in force with it.
struct Prepared {
    write: Write,
    configuration: Configuration,
    warnings: Findings,
}

/// Why nothing is written, with the findings if the file is the reason.
struct Rejected(String, Findings);

impl Versions {
    pub(super) fn set_parameter(&mut self, wanted: WantedSetting) -> Vec<ConfigdAction> {
        if self.settings.waiting.len() >= MAX_WAITING {
            let text = format!("{MAX_WAITING} other values are waiting to be written; try again");
            return vec![reject_setting(&wanted, text, &Findings::default())];
        }
        self.settings.waiting.push_back(wanted);
        self.settle_waiting()
    }

    /// Finishes the request whose write has ended, and starts the next one.
    pub(super) fn finish_write(&mut self, result: Result<Findings, String>) -> Vec<ConfigdAction> {
        let Some((wanted, configuration, warnings)) = self.settings.writing.take() else {
            return Vec::new();
        };
        let mut actions = match result {
            Err(reason) => vec![reject_setting(&wanted, reason, &Findings::default())],
            Ok(mut findings) => {
                findings.extend(warnings.without_known(&self.warnings).without_notes());
                let mut actions = self.take_version(configuration, warnings, wanted.set_by());
                let (request, version) = (wanted.request, self.number);
                let changes = self.changes.0.clone();
                if let Some(by) = &wanted.by {
                    let (component, parameter) = (&wanted.component, &wanted.parameter);
                    tracing::info!(version, "{by} has set {component}.{parameter}");
                }
                let (findings, _) = records::finding_records(&findings);
                let reply = ConfigReply::Set { request, version, changes, findings };
                actions.push(send_reply(wanted.peer, reply));
                actions
            }
        };
        actions.extend(self.settle_waiting());
        actions
    }

    /// Handles the waiting requests up to the next one that needs a write.
    fn settle_waiting(&mut self) -> Vec<ConfigdAction> {
        let mut actions = Vec::new();
        while self.settings.writing.is_none() {
            let Some(wanted) = self.settings.waiting.pop_front() else { break };
            match self.prepare_write(&wanted) {
                Ok(None) => {
                    let (request, version) = (wanted.request, self.number);
                    let (changes, findings) = (Vec::new(), Vec::new());
                    let reply = ConfigReply::Set { request, version, changes, findings };
                    actions.push(send_reply(wanted.peer, reply));
                }
                Err(Rejected(text, findings)) => {
                    actions.push(reject_setting(&wanted, text, &findings));
                }
                Ok(Some(Prepared { write, configuration, warnings })) => {
                    self.settings.writing = Some((wanted, configuration, warnings));
                    actions.push(ConfigdAction::Write(write));
                }
            }
        }
        actions
    }

    /// Prepares and checks the write, if the file does not have the value already.
    fn prepare_write(&self, wanted: &WantedSetting) -> Result<Option<Prepared>, Rejected> {
        let source = self.source_of(wanted)?;
        let text = edit_text(source, wanted)?;
        if text == source.text() {
            return Ok(None);
        }
        let sources = self.in_force.sources.iter();
        let expected: Vec<_> =
            sources.map(|source| (source.path().to_path_buf(), source.text().to_owned())).collect();
        let mut files = expected.clone();
        for (_, old) in files.iter_mut().filter(|(path, _)| path == source.path()) {
            old.clone_from(&text);
        }
        let reading = KeptVersion { number: self.number + 1, files }.read_files();
        let judged = self.rules.judge_reading(reading).map_err(|findings| {
            Rejected("nothing was written: the file would not be valid".into(), findings)
        });
        let (configuration, warnings) = judged?;
        let needs = self.paths_of(wanted, &configuration);
        let write = Write { expected, file: source.path().to_path_buf(), text, needs };
        Ok(Some(Prepared { write, configuration, warnings }))
    }

    /// Returns the files that the new value names, apart from those that the component writes.
    fn paths_of(&self, wanted: &WantedSetting, configuration: &Configuration) -> Vec<NeededPath> {
        let (Some(value), Some(manifests)) = (&wanted.value, &self.rules.manifests) else {
            return Vec::new();
        };
        let mut paths = needed_paths(configuration, manifests);
        paths.retain(|path| path.is_value_of(&wanted.component, &wanted.parameter, value));
        paths.iter_mut().for_each(|path| path.path = self.rules.root.join(&path.path));
        paths
    }

    /// Returns the file that declares the component, if a value may be written into it.
    fn source_of(&self, wanted: &WantedSetting) -> Result<&Source, Rejected> {
        let WantedSetting { component, parameter, .. } = wanted;
        if let Some(findings) = &self.refused {
            let first = findings.iter().next().map(|first| format!(" ({first})"));
            let text = format!(
                "the file on the disk is not valid{}; fix it before anything is set in it",
                first.unwrap_or_default()
            );
            return Err(Rejected(text, findings.clone()));
        }
        let reject = |text: String| Err(Rejected(text, Findings::default()));
        let Some(found) = self.in_force.system.component(component) else {
            return reject(answers::no_component(component, &self.in_force).text);
        };
        if self.rules.is_overridden(component, parameter) {
            return reject(format!(
                "{component}.{parameter} is given by --set, which goes over the file as long as \
                 the system runs; run it without that"
            ));
        }
        let leaves = wanted.value.as_deref().is_some_and(leaves_run_folder);
        if leaves && self.rules.is_written(&found.kind.value, parameter) {
            let at = found.parameter(parameter).map_or(&found.name.at, |given| &given.value.at);
            return reject(format!(
                "{component} writes to {component}.{parameter}, so it can only be set to a path \
                 within the run's folder, such as `{parameter}`; a place outside it is for the \
                 file alone ({at})"
            ));
        }
        // A value of an unknown parameter is refused by the check; nothing would refuse its
        // removal.
        let is_there = wanted.value.is_some() || found.parameter(parameter).is_some();
        let unknown = answers::no_parameter(found, parameter, self.rules.manifests.as_ref());
        if let Some(refusal) = unknown.filter(|_| !is_there) {
            let mut findings = Findings::default();
            findings.push(Finding::new(Code::UnknownParameter, &found.name.at, refusal.text));
            return Err(Rejected("there is nothing to leave to its default".into(), findings));
        }
        Ok(&found.name.at.source)
    }
}

/// Whether a path may lead out of the folder that it is relative to.
fn leaves_run_folder(path: &str) -> bool {
    let mut parts = Path::new(path).components();
    parts.any(|part| !matches!(part, Component::Normal(_) | Component::CurDir))
}

/// The text of the file with the value in it.
fn edit_text(source: &Source, wanted: &WantedSetting) -> Result<String, Rejected> {
    let WantedSetting { component, parameter, value, .. } = wanted;
    let refused =
        |c: &char| (*c < ' ' && !"\t\n\r".contains(*c)) || matches!(c, '\u{fffe}' | '\u{ffff}');
    if let Some(c) = value.iter().flat_map(|value| value.chars()).find(refused) {
        let c = u32::from(c);
        let text = format!("the value contains U+{c:04X}, a character that XML does not allow");
        return Err(Rejected(text, Findings::default()));
    }
    let mut document = Document::open(source.path(), source.text().as_bytes())
        .map_err(|findings| Rejected("the file cannot be read".into(), findings))?;
    document
        .set_parameter(component, parameter, value.as_deref())
        .map_err(|error| Rejected(error.to_string(), Findings::default()))?;
    Ok(String::from_utf8_lossy(document.bytes()).into_owned())
}

fn reject_setting(wanted: &WantedSetting, text: String, findings: &Findings) -> ConfigdAction {
    let (findings, left_out) = records::finding_records(findings);
    send_reply(
        wanted.peer,
        ConfigReply::Rejected { request: wanted.request, text, findings, left_out },
    )
}
