//! `armor play`: a recording in place of a system, or of some of its components.

use std::path::{Component, Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use armor_recording::playback::{DataRename, PLAYBACK};
use armor_recording::{Recording, RecordingSummary};
use armor_robotfile::Configuration;
use armor_wire::name::is_name;

use super::arguments::PlayArguments;
use super::played::{NOT_PLAYED, PlayedRecording};
use crate::arguments::OutputFormat;
use crate::check;
use crate::exit::CommandEnding;
use crate::kinds::Catalogue;
use crate::print::print_notice;
use crate::recording_cli::known_types::{KnownTypes, describe_change_within};
use crate::run::arguments::RunArguments;
use crate::run::run_checked;
use crate::verb::Verb;

/// The name of a played system that has none.
const UNNAMED: &str = "recording";

impl Verb for PlayArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(play_recording(self, format)?.into())
    }
}

fn play_recording(mut arguments: PlayArguments, format: OutputFormat) -> Result<CommandEnding> {
    let shown = arguments.recording.display().to_string();
    let not_readable = || format!("{shown} cannot be read as a recording");
    let mut recording = Recording::open(&arguments.recording).with_context(not_readable)?;
    arguments.recording = arguments.recording.canonicalize().with_context(not_readable)?;
    let summary = recording.summary().clone();
    check_part(&arguments, &summary)?;
    if !summary.is_complete {
        print_notice(format!("{shown} is not complete: it ends where its recorder was killed"));
    }
    if let Some(file) = arguments.file.clone() {
        let checked = check::load_file(&file, &arguments.overrides, &arguments.kinds)?;
        checked.print_problems(format);
        let Some(configuration) = checked.accepted() else {
            return Ok(CommandEnding::Failed);
        };
        let manifests = checked.catalogue.manifests();
        let played =
            PlayedRecording::of_components(&arguments, &summary, configuration, &manifests)?;
        let run = make_run_arguments(&arguments, file);
        return run_checked(&run, &checked.catalogue, configuration, Some(&played), format);
    }
    // The file of the recording, for the tools that show it; the recording is played without, too.
    let folder = tempfile::tempdir().context("no folder for the file of the recording")?;
    let mut file = PathBuf::new();
    for recorded in summary.files.clone() {
        let name = Path::new(&recorded.name);
        if !name.components().all(|part| matches!(part, Component::Normal(_))) {
            continue;
        }
        let bytes = recording.read_file(&recorded.name)?.unwrap_or_default();
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(folder.path()))?;
        std::fs::write(&path, bytes).with_context(|| path.display().to_string())?;
        if file.as_os_str().is_empty() {
            file = path;
        }
    }
    let name = summary.about.get("system").filter(|name| is_name(name));
    arguments.system = arguments.system.or(Some(name.map_or(UNNAMED, String::as_str).to_owned()));
    let run = make_run_arguments(&arguments, file.clone());
    if !file.as_os_str().is_empty() {
        let checked = check::load_file(&file, &[], &arguments.kinds)?;
        if let Some(configuration) = checked.accepted() {
            report_types(&summary, &checked.catalogue);
            let played = PlayedRecording::of_everything(&arguments, &summary, configuration);
            return run_checked(&run, &checked.catalogue, configuration, Some(&played), format);
        }
        print_notice(
            "the file in the recording is not valid here, so parameters are not shown; `armor check` \
             says why when it is given the file that was recorded",
        );
    }
    let configuration = Configuration::default();
    let played = PlayedRecording::of_everything(&arguments, &summary, &configuration);
    let catalogue = Catalogue::gather(&arguments.kinds.directories, std::iter::empty())?;
    report_types(&summary, &catalogue);
    run_checked(&run, &catalogue, &configuration, Some(&played), format)
}

/// Reports outputs whose types are not those of this program and its components: they are played with
/// their own.
fn report_types(summary: &RecordingSummary, catalogue: &Catalogue) {
    for change in summary.outputs.iter().filter_map(describe_change_within) {
        print_notice(format!("{change}; of these messages only the last form is played"));
    }
    for changed in KnownTypes::of_catalogue(catalogue).find_changed(summary) {
        print_notice(format!("{}; it is played as it was recorded", changed.describe()));
    }
}

fn check_part(arguments: &PlayArguments, summary: &RecordingSummary) -> Result<()> {
    let shown = arguments.recording.display();
    let (Some(begin_s), Some((_, end_s))) = (summary.begin_s(), summary.span_s) else {
        bail!("{shown} has no messages");
    };
    let length_s = end_s - begin_s;
    let from_s = arguments.from.map_or(0.0, |from| from.as_secs_f64());
    if from_s > length_s || arguments.to.is_some_and(|to| to.as_secs_f64() <= from_s) {
        bail!("nothing is in that part: {shown} has {length_s:.1} s");
    }
    let names = || summary.outputs.iter().map(|output| output.data.as_str());
    for DataRename { recorded, played } in &arguments.map {
        if !names().any(|name| name == recorded) {
            let advice = armor_robotfile::advise_similar(recorded, names());
            bail!("--map {recorded}={played}: {shown} has no {recorded}{advice}");
        }
        let component = played.split('.').next().unwrap_or_default();
        if component == PLAYBACK || NOT_PLAYED.contains(&component) {
            bail!("--map {recorded}={played}: the name {component} belongs to the system itself");
        }
        let is_renamed = |name: &str| arguments.map.iter().any(|rename| rename.recorded == name);
        let is_twice = arguments.map.iter().filter(|rename| rename.played == *played).count() > 1;
        if is_twice || (names().any(|name| name == played) && !is_renamed(played)) {
            bail!(
                "--map {recorded}={played}: {played} would be played twice; map that one to another \
                 name, or leave this out"
            );
        }
    }
    Ok(())
}

/// The run of which the recording is a part.
fn make_run_arguments(play: &PlayArguments, file: PathBuf) -> RunArguments {
    RunArguments {
        file,
        overrides: play.overrides.clone(),
        time: None,
        headless: play.headless,
        quiet: play.quiet,
        without: Vec::new(),
        out: play.out.clone(),
        resume: false,
        kinds: play.kinds.clone(),
        registry: play.registry,
        gate: None,
        keys: crate::keys_cli::KeysDirectory { keys: None },
        system: play.system.clone(),
        trust_clock: true,
    }
}
