//! `armor player`: the process that plays a recording, as the launcher starts it for `armor play`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Result, anyhow};
use armor_recording::playback::{
    self, AwaitedLink, DataRename, PlaybackSpeed, PlayedComponent, PlayerOptions,
};
use clap::Args;

use super::serving::watch_for_signals;
use crate::arguments::{OutputFormat, default_registry, parse_duration, parse_pair};
use crate::exit::CommandEnding;
use crate::verb::Verb;

/// Play a recording into a system; started by `armor play`.
#[derive(Args, Debug)]
pub struct PlayerArguments {
    /// The recording.
    pub recording: PathBuf,
    /// Where the registry listens.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY", default_value_t = default_registry())]
    pub registry: SocketAddr,
    /// A component that is played, and its kind.
    #[arg(long = "component", value_name = "NAME=KIND", value_parser = parse_pair)]
    pub components: Vec<(String, String)>,
    /// One that the mission activates and freezes.
    #[arg(long, value_name = "NAME=KIND", value_parser = parse_pair)]
    pub controlled: Vec<(String, String)>,
    /// A link that must exist before time begins.
    #[arg(long = "await", value_name = "DATA=SUBSCRIBER", value_parser = parse_pair)]
    pub awaited: Vec<(String, String)>,
    /// Wait until the mission is played.
    #[arg(long)]
    pub await_mission: bool,
    /// How many times as fast as recorded.
    #[arg(long, value_name = "TIMES", default_value_t)]
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
    /// Stay at the end.
    #[arg(long)]
    pub stay: bool,
    /// Do not wait for components that are slow.
    #[arg(long)]
    pub realtime: bool,
    /// Play an output under another name.
    #[arg(long, value_name = "RECORDED=PLAYED")]
    pub map: Vec<DataRename>,
}

impl Verb for PlayerArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        Ok(run_player(self)?.into())
    }
}

fn run_player(arguments: PlayerArguments) -> Result<CommandEnding> {
    armor_sdk::log::init();
    let played = |controlled: bool| move |(name, kind)| PlayedComponent { name, kind, controlled };
    let components = arguments.components.into_iter().map(played(false));
    let controlled = arguments.controlled.into_iter().map(played(true));
    let options = PlayerOptions {
        recording: arguments.recording,
        registry: arguments.registry.to_string(),
        components: components.chain(controlled).collect(),
        renames: arguments.map,
        from_s: arguments.from.map_or(0.0, |from| from.as_secs_f64()),
        to_s: arguments.to.map(|to| to.as_secs_f64()),
        speed: arguments.speed,
        is_paused: arguments.paused,
        loops: arguments.loops,
        stays: arguments.stay,
        is_lossless: !arguments.realtime,
        awaited: arguments.awaited.into_iter().map(|(data, to)| AwaitedLink { data, to }).collect(),
        awaits_mission: arguments.await_mission,
    };
    let report = playback::play_recording(&options, watch_for_signals()?)
        .map_err(|fault| anyhow!("{fault}"))?;
    let mut text = format!("{} messages and {} reports", report.published, report.reported);
    let parts = [
        (report.withheld, "of components that were frozen"),
        (report.unreadable, "that cannot be read"),
        (report.damaged_chunks, "damaged parts of the file"),
        (report.of_other_type, "of another type than their output at the end"),
    ];
    for (count, what) in parts.into_iter().filter(|(count, _)| *count > 0) {
        text += &format!(", and {count} {what} not played");
    }
    tracing::info!("{text}; time has waited for the components for {:.1} s", report.waited_s);
    Ok(CommandEnding::Fine)
}
