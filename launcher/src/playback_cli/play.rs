//! `armor play`: a recording in place of a system, or of some of its components.

use std::net::SocketAddr;
use std::path::{Component, Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_recording::playback::{DataRename, PlaybackSpeed};
use armor_recording::{Recording, RecordingSummary};
use armor_robotfile::Configuration;
use armor_wire::name::is_name;
use clap::Args;

use super::played::PlayedRecording;
use crate::arguments::{KindFolders, OutputFormat, parse_duration, parse_name};
use crate::check;
use crate::exit::CommandEnding;
use crate::kinds::Catalogue;
use crate::print::print_notice;
use crate::run::arguments::RunArguments;
use crate::run::run_checked;
use crate::verb::Verb;

/// The name of a played system that has none.
const UNNAMED: &str = "recording";

/// Play a recording: all of it, or in place of some components of a system.
///
/// Everything that is played has its recorded name, type and stamp, and system time is that of the
/// recording: components, mission and tools see what they would see of the robot. Time waits until
/// the components have taken what was published, so nothing is lost at any speed.
#[derive(Args, Debug)]
#[command(after_help = "`armor playback` pauses, steps, seeks and changes the speed meanwhile.

Exit codes: 0 the recording is over, or the mission has reached its goal; 1 the run failed; 3 the \
recording is over before the mission; 130 interrupted.

Examples:
  armor play drive.mcap                                  look at it with all tools
  armor play drive.mcap --speed 10 --from 2min --to 3min
  armor play drive.mcap robot.xml --replace simulator    the other components run
  armor play drive.mcap robot.xml --replace simulator --speed max")]
pub struct PlayArguments {
    /// The recording.
    pub recording: PathBuf,
    /// The file of the system whose other components run. Default: nothing runs, and everything is
    /// played.
    pub file: Option<PathBuf>,
    /// A component of the file that the recording replaces; may be given several times.
    #[arg(long, value_name = "COMPONENT", value_parser = parse_name, requires = "file")]
    pub replace: Vec<String>,
    /// How many times as fast as recorded: 0.5, 10, or max for as fast as it is taken.
    #[arg(long, value_name = "TIMES", default_value_t, allow_negative_numbers = true)]
    pub speed: PlaybackSpeed,
    /// Begin this time after the beginning.
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub from: Option<Duration>,
    /// End this time after the beginning.
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub to: Option<Duration>,
    /// Begin again at the end.
    #[arg(long = "loop")]
    pub loops: bool,
    /// Begin with a pause.
    #[arg(long)]
    pub paused: bool,
    /// Keep the last values at the end, until Ctrl-C.
    #[arg(long, conflicts_with = "loops")]
    pub stay: bool,
    /// Do not wait for components that are slow: they lose what they would lose on the robot.
    #[arg(long)]
    pub realtime: bool,
    /// Play an output under another name; may be given several times.
    #[arg(long, value_name = "RECORDED=PLAYED")]
    pub map: Vec<DataRename>,
    /// Override the value of a parameter in the file.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE", requires = "file")]
    pub overrides: Vec<String>,
    /// Open no windows.
    #[arg(long)]
    pub headless: bool,
    /// Do not show the status.
    #[arg(long, short)]
    pub quiet: bool,
    /// Folder for what the run produces. Default: out/NAME.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub kinds: KindFolders,
    /// Where the registry listens. Default: port 7411 of this host, or the next free one.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub registry: Option<SocketAddr>,
    /// Name of the system. Default: the name in the file.
    #[arg(long, value_name = "NAME", value_parser = parse_name)]
    pub system: Option<String>,
}

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
    if let Some(file) = arguments.file.clone() {
        let checked = check::load_file(&file, &arguments.overrides, &arguments.kinds)?;
        checked.print_problems(format);
        let Some(configuration) = checked.accepted() else {
            return Ok(CommandEnding::Failed);
        };
        let manifests = checked.catalogue.manifests();
        let played =
            PlayedRecording::of_components(&arguments, &summary, configuration, &manifests)?;
        let run = arguments.run_arguments(file);
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
    let run = arguments.run_arguments(file.clone());
    if !file.as_os_str().is_empty() {
        let checked = check::load_file(&file, &[], &arguments.kinds)?;
        if let Some(configuration) = checked.accepted() {
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
    run_checked(&run, &catalogue, &configuration, Some(&played), format)
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
    }
    Ok(())
}

impl PlayArguments {
    /// The run of which the recording is a part.
    fn run_arguments(&self, file: PathBuf) -> RunArguments {
        RunArguments {
            file,
            overrides: self.overrides.clone(),
            time: None,
            headless: self.headless,
            quiet: self.quiet,
            without: Vec::new(),
            out: self.out.clone(),
            resume: false,
            kinds: self.kinds.clone(),
            registry: self.registry,
            gate: None,
            keys: crate::keys_cli::KeysDirectory { keys: None },
            system: self.system.clone(),
            trust_clock: true,
        }
    }
}
