//! What a run plays from a recording, in place of components of its file.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::{Result, anyhow, bail};
use armor_recording::playback::{AwaitedLink, DataRename, PLAYBACK, PlayedComponent};
use armor_recording::{
    REPORTS, RecordedOutput, RecordedReport, RecordingSummary, describe_other_fields,
};
use armor_robotfile::{Configuration, Manifests, advise_similar};
use armor_wire::message::WireType;
use armor_wire::schema;

use super::arguments::PlayArguments;
use crate::print::print_notice;

/// The data that the time of a played system follows.
pub const PLAYBACK_CLOCK: &str = "playback.clock";
/// Names of recorded processes that a system needs itself, and does not take from a recording.
pub const NOT_PLAYED: [&str; 2] = ["configuration", "armor"];
/// The kind of a recorded component that no file names.
const UNKNOWN_KIND: &str = "recorded";
/// The executive, which is played if everything is.
const EXECUTIVE: &str = "executive";

/// See the module.
#[derive(Clone, Debug)]
pub struct PlayedRecording {
    /// The recording.
    pub path: PathBuf,
    /// The components that it plays.
    pub components: Vec<PlayedComponent>,
    /// The links that must exist before time begins.
    pub awaited: Vec<AwaitedLink>,
    /// Whether it plays everything: no component and no mission runs.
    pub is_alone: bool,
    /// Arguments of the player.
    arguments: Vec<OsString>,
}

impl PlayedRecording {
    /// Plays all of a recording. The kinds are those of the file, as far as it is known.
    pub fn of_everything(
        arguments: &PlayArguments,
        summary: &RecordingSummary,
        configuration: &Configuration,
    ) -> Self {
        let mut names: Vec<&str> = list_components(summary, &arguments.map).collect();
        names.sort_unstable();
        names.dedup();
        let components = names.into_iter().map(|name| {
            let known = configuration.system.component(name);
            let kind = match known {
                Some(component) => &component.kind.value,
                None if name == EXECUTIVE => EXECUTIVE,
                None => UNKNOWN_KIND,
            };
            PlayedComponent { name: name.into(), kind: kind.into(), controlled: false }
        });
        Self {
            path: arguments.recording.clone(),
            components: components.collect(),
            awaited: Vec::new(),
            is_alone: true,
            arguments: list_arguments(arguments),
        }
    }

    /// Plays some components, and lets the others of the file run.
    ///
    /// # Errors
    /// If the file has no such component, or the recording has not what the others need from it.
    pub fn of_components(
        arguments: &PlayArguments,
        summary: &RecordingSummary,
        configuration: &Configuration,
        manifests: &Manifests,
    ) -> Result<Self> {
        let (recording, file) = (arguments.recording.display(), &configuration.system);
        if arguments.replace.is_empty() {
            let mut names: Vec<_> = list_components(summary, &arguments.map)
                .filter(|name| file.component(name).is_some())
                .collect();
            names.dedup();
            bail!(
                "which components does {recording} replace? Give --replace NAME; it has {}",
                names.join(", ")
            );
        }
        if let Some(component) = file.component(PLAYBACK) {
            bail!(
                "{}: the name {PLAYBACK} belongs to the player; rename the component",
                component.name.at
            );
        }
        check_reports(summary)
            .map_err(|reason| anyhow!("{recording} cannot be played to a mission: {reason}"))?;
        let mut components: Vec<PlayedComponent> = Vec::new();
        for name in &arguments.replace {
            if components.iter().any(|component| component.name == *name) {
                continue;
            }
            if !list_components(summary, &arguments.map).any(|recorded| recorded == name) {
                print_notice(format!("{recording} has nothing of {name}: it publishes nothing"));
            }
            let known = file.components.iter().map(|component| component.name.value.as_str());
            let Some(component) = file.component(name) else {
                bail!(
                    "--replace {name}: no component is called that{}",
                    advise_similar(name, known)
                );
            };
            let kind = component.kind.value.clone();
            let controlled = configuration.commands(component);
            components.push(PlayedComponent { name: name.clone(), kind, controlled });
        }
        let is_replaced = |name: &String| arguments.replace.contains(name);
        let mut awaited = Vec::new();
        for link in &file.links {
            let (from, to) = (&link.from.component.value, &link.to.component.value);
            if !is_replaced(from) || is_replaced(to) {
                continue;
            }
            let data = link.from.data();
            check_output(&data, to, &link.to.port.value, summary, arguments, &|name| {
                manifests.get(&file.component(name)?.kind.value)
            })?;
            awaited.push(AwaitedLink { data, to: to.clone() });
        }
        for component in &file.components {
            let name = &component.name.value;
            if !is_replaced(name) {
                let to = armor_sdk::time_link(name);
                awaited.push(AwaitedLink { data: PLAYBACK_CLOCK.into(), to });
            }
        }
        let path = arguments.recording.clone();
        let arguments = list_arguments(arguments);
        Ok(Self { path, components, awaited, is_alone: false, arguments })
    }

    /// Whether a component of the file is played.
    pub fn replaces(&self, component: &str) -> bool {
        self.is_alone || self.components.iter().any(|played| played.name == component)
    }

    /// The arguments of the player's process, but for the registry.
    pub fn player_arguments(&self, awaits_mission: bool) -> Vec<OsString> {
        let mut arguments: Vec<OsString> = vec!["player".into(), self.path.clone().into()];
        for PlayedComponent { name, kind, controlled } in &self.components {
            let option = if *controlled { "--controlled" } else { "--component" };
            arguments.extend([option.into(), format!("{name}={kind}").into()]);
        }
        for AwaitedLink { data, to } in &self.awaited {
            arguments.extend(["--await".into(), format!("{data}={to}").into()]);
        }
        if awaits_mission {
            arguments.push("--await-mission".into());
        }
        arguments.extend(self.arguments.iter().cloned());
        arguments
    }
}

/// The components of a recording, under the names by which they are played.
fn list_components<'a>(
    summary: &'a RecordingSummary,
    renames: &'a [DataRename],
) -> impl Iterator<Item = &'a str> {
    let played = summary.outputs.iter().map(|output| {
        let rename = renames.iter().find(|rename| rename.recorded == output.data);
        rename.map_or(output.data.as_str(), |rename| &rename.played)
    });
    let names = played.filter_map(|data| data.split_once('.')).map(|(component, _)| component);
    names.filter(|name| !NOT_PLAYED.contains(name) && *name != PLAYBACK)
}

/// Checks that the reports of components can be read: a mission waits for them.
fn check_reports(summary: &RecordingSummary) -> Result<(), String> {
    let here = RecordedReport::schema().to_string();
    let reports = summary.outputs.iter().find(|output| output.data == REPORTS);
    match reports.filter(|output| output.schema != here) {
        None => Ok(()),
        Some(RecordedOutput { schema, type_name, .. }) => Err(format!(
            "{}; play it with the version that has recorded it",
            describe_other_fields(REPORTS, type_name, schema, &here)
        )),
    }
}

/// Checks that the recording has an output with the type that an input of a running component takes.
fn check_output<'a>(
    data: &str,
    consumer: &str,
    input: &str,
    summary: &RecordingSummary,
    arguments: &PlayArguments,
    find_manifest: &dyn Fn(&str) -> Option<&'a armor_wire::manifest::Manifest>,
) -> Result<()> {
    let recording = arguments.recording.display();
    let rename = arguments.map.iter().find(|rename| rename.played == data);
    let recorded = rename.map_or(data, |rename| &rename.recorded);
    let names = || summary.outputs.iter().map(|output| output.data.as_str());
    let is_renamed = rename.is_none() && arguments.map.iter().any(|it| it.recorded == data);
    let output = summary.outputs.iter().find(|output| output.data == recorded && !is_renamed);
    let Some(output) = output else {
        bail!(
            "{recording} has no {recorded}, which {consumer}.{input} takes{}; --map RECORDED={data} \
             plays another output in its place, and armor bag info shows all",
            if is_renamed { String::new() } else { advise_similar(recorded, names()) }
        );
    };
    let ports = find_manifest(consumer).into_iter().flat_map(|manifest| &manifest.inputs);
    let port = ports.filter(|port| port.id == input).find(|port| !port.is_any());
    if let Some(port) = port.filter(|port| port.schema != output.schema) {
        bail!(
            "{consumer}.{input} takes another type ({}), and {recorded} was recorded with other fields:\n{}\n\
             It is played as it was recorded: replace {consumer}, too, or run the version of it that takes \
             these fields; --map RECORDED={data} plays another output in its place",
            port.type_name,
            schema::difference((recorded, &output.schema), (consumer, &port.schema))
        );
    }
    Ok(())
}

fn list_arguments(play: &PlayArguments) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = vec!["--speed".into(), play.speed.to_string().into()];
    let seconds = |time: &std::time::Duration| OsString::from(format!("{}s", time.as_secs_f64()));
    arguments.extend(play.from.iter().flat_map(|from| ["--from".into(), seconds(from)]));
    arguments.extend(play.to.iter().flat_map(|to| ["--to".into(), seconds(to)]));
    for DataRename { recorded, played } in &play.map {
        arguments.extend(["--map".into(), format!("{recorded}={played}").into()]);
    }
    let switches = [
        (play.loops, "--loop"),
        (play.paused, "--paused"),
        (play.stay, "--stay"),
        (play.realtime, "--realtime"),
    ];
    arguments.extend(switches.into_iter().filter(|(is_on, _)| *is_on).map(|(_, name)| name.into()));
    arguments
}
