//! The arguments of `armor play`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use armor_recording::playback::{DataRename, PlaybackSpeed};
use clap::Args;

use crate::arguments::{KindFolders, parse_duration, parse_name};

/// Play a recording: all of it, or in place of some components of a system.
///
/// Everything that is played has its recorded name, type and stamp, and system time is that of the
/// recording: components, mission and tools see what they would see of the robot. Time waits until
/// the components have taken what was published, so nothing is lost at any speed.
#[derive(Args, Debug)]
#[command(
    after_help = "In a terminal: space pauses and continues, . steps to the next message, the arrows
jump by 5 s and 1 min, + and - change the speed, q ends. `armor playback` does the same from
elsewhere.

Examples:
  armor play drive.mcap                                  look at it with all tools
  armor play drive.mcap --speed 10 --from 2min --to 3min
  armor play drive.mcap robot.xml --replace simulator    the other components run
  armor play drive.mcap robot.xml --replace simulator --speed max"
)]
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
    /// Folder for what the run produces. Default: out/NAME-played.
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
