//! The arguments of `armor run`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::arguments::{KindFolders, parse_duration, parse_name};
use crate::keys_cli::KeysDirectory;

/// Start a system and its mission, watch it, and stop it in order.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor run robot.xml                             until its mission ends, or Ctrl-C
  armor run robot.xml --set driver.speed=40cm/s   with another value than the file's
  armor run robot.xml --headless --for 5min
  armor run robot.xml --resume                    continue after a power failure")]
pub struct RunArguments {
    /// The system or mission file.
    pub file: PathBuf,
    /// Override the value of a parameter in the file.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    /// Stop after this time, such as 30s or 5min.
    #[arg(long = "for", value_name = "TIME", value_parser = parse_duration)]
    pub time: Option<Duration>,
    /// Open no windows.
    #[arg(long)]
    pub headless: bool,
    /// Do not show the status: the line that is redrawn on a terminal, or plain lines on stderr.
    #[arg(long, short)]
    pub quiet: bool,
    /// Do not start this component: it is started by hand, perhaps on another host.
    #[arg(long, value_name = "COMPONENT", value_parser = parse_name)]
    pub without: Vec<String>,
    /// Folder for what the run produces. Default: out/NAME.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Continue the unfinished mission in the folder from the end of its journal.
    #[arg(long)]
    pub resume: bool,
    #[command(flatten)]
    pub kinds: KindFolders,
    /// Where the registry listens. Default: port 7411 of this host, or the next free one.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub registry: Option<SocketAddr>,
    /// Let people with keys reach the system from other hosts, through a gate that listens here.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub gate: Option<SocketAddr>,
    #[command(flatten)]
    pub keys: KeysDirectory,
    /// Name of the system. Default: the name in the file.
    #[arg(long, value_name = "NAME", value_parser = parse_name)]
    pub system: Option<String>,
    /// Accept absolute dates although no time service synchronizes this host's clock.
    #[arg(long)]
    pub trust_clock: bool,
}
