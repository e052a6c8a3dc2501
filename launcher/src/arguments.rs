//! The command line: what can be asked of `armor`, in the words of `armor --help`.

mod mission;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use armor_wire::name::{is_name, split_data};
use armor_wire::quantity;
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;

pub use mission::{By, Mission, Replay};

use crate::param::arguments::Param;

/// Robots from components: independent processes, direct links, and a mission that turns them on
/// and off.
#[derive(Debug, Parser)]
#[command(name = "armor", version, propagate_version = true)]
pub struct Arguments {
    /// What is printed: text for people, or JSON Lines on stdout for programs.
    #[arg(long, global = true, value_enum, default_value_t, value_name = "FORMAT")]
    pub format: Format,
    #[command(subcommand)]
    pub command: Command,
}

/// What is printed on stdout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people.
    #[default]
    Text,
    /// One JSON object per line.
    Json,
    /// Graphviz, for `armor graph` alone, so that no other command offers it.
    #[value(hide = true)]
    Dot,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Start a system and its mission, watch it, stop it in order.
    Run(Run),
    /// Check files and print all findings.
    Check(Check),
    /// Explain a finding of `armor check` by its code. Without CODE: list them.
    Explain {
        /// Such as E0103.
        code: Option<String>,
    },
    /// Lay files out in the one way: indentation, spaces, blank lines. What they say stays.
    Fmt(Fmt),
    /// Show the processes of a running system.
    Ps(Running),
    /// Show a kind of component: its ports and parameters. Without KIND: all kinds.
    Describe(Describe),
    /// Show the links of a running system, with what they sent, dropped and lost; `--format dot`
    /// for Graphviz.
    Graph(Running),
    /// Print data as it is published.
    Echo(Echo),
    /// Measure how often data is published.
    Hz(Hz),
    /// Look at the mission of a running system, and command it.
    #[command(subcommand)]
    Mission(Mission),
    /// Measure a trajectory by relations between scans or a reference, and a map by another map.
    Eval(crate::evaluate_cli::EvalArguments),
    /// Count, check and convert Petri nets in files: PNML, TINA's .net and missions.
    #[command(subcommand)]
    Net(crate::petri_cli::arguments::Net),
    /// See, set and compare the parameters of a running system, or of a file.
    #[command(subcommand)]
    Param(Param),
    /// Write the project of a new component.
    New(New),
    /// Print a completion script for a shell.
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// Run the registry by itself.
    Registry(Registry),
    /// Run the configuration daemon by itself.
    Configd(Configd),
    /// Run the executive by itself.
    Executive(Executive),
    /// Run one stock component by itself.
    Component(Component),
    /// Run a program that does not outlive its parent.
    #[command(hide = true)]
    Guard(Guard),
    /// Kill the groups named on stdin when stdin ends.
    #[command(hide = true)]
    Undertaker,
}

/// Which kinds of components there are beside the stock.
#[derive(Args, Clone, Debug, Default)]
pub struct Kinds {
    /// Folder of component executables; may be given several times.
    #[arg(long = "components", value_name = "DIR")]
    pub directories: Vec<PathBuf>,
}

#[derive(Args, Debug)]
pub struct Run {
    /// The system or mission file.
    pub file: PathBuf,
    /// Give a parameter another value than the file does.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    /// Stop after this time, such as 30s or 5min.
    #[arg(long = "for", value_name = "TIME", value_parser = duration)]
    pub time: Option<Duration>,
    /// Open no windows.
    #[arg(long)]
    pub headless: bool,
    /// Do not start this component: it is started by hand, maybe on another host.
    #[arg(long, value_name = "COMPONENT", value_parser = name)]
    pub without: Vec<String>,
    /// Folder for what the run produces. Default: out/NAME.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Go on with the unfinished mission in the folder, from where its journal ends.
    #[arg(long)]
    pub resume: bool,
    #[command(flatten)]
    pub kinds: Kinds,
    /// Where the registry listens. Default: port 7411 of this host, or the next free one.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub registry: Option<SocketAddr>,
    /// Call the system this instead of what the file says.
    #[arg(long, value_name = "NAME", value_parser = name)]
    pub system: Option<String>,
    /// Play absolute dates although no time service is known to keep this host's clock.
    #[arg(long)]
    pub trust_clock: bool,
}

#[derive(Args, Debug)]
pub struct Check {
    /// The system and mission files.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Fail on warnings too.
    #[arg(long)]
    pub strict: bool,
    /// Give a parameter another value than the file does.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    #[command(flatten)]
    pub kinds: Kinds,
}

#[derive(Args, Debug)]
pub struct Fmt {
    /// The files; - is stdin, written to stdout.
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// Change nothing; name the files that would change, and end with 1 if there are any.
    #[arg(long)]
    pub check: bool,
}

#[derive(Args, Debug)]
pub struct Describe {
    /// The kind.
    pub kind: Option<String>,
    #[command(flatten)]
    pub kinds: Kinds,
}

/// Which running system is meant.
#[derive(Args, Clone, Debug, Default)]
pub struct Running {
    /// The system with this name; needed if several run.
    #[arg(long, value_name = "NAME")]
    pub system: Option<String>,
    /// The system whose registry listens here.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY")]
    pub registry: Option<SocketAddr>,
}

#[derive(Args, Debug)]
pub struct Echo {
    /// Unique name of the data, COMPONENT.OUTPUT.
    #[arg(value_parser = data)]
    pub data: String,
    /// Stop after so many.
    #[arg(long, short = 'n', value_name = "N")]
    pub count: Option<u64>,
    #[command(flatten)]
    pub running: Running,
}

#[derive(Args, Debug)]
pub struct Hz {
    /// Unique name of the data, COMPONENT.OUTPUT.
    #[arg(value_parser = data)]
    pub data: String,
    /// Stop after so many windows of one second.
    #[arg(long, short = 'n', value_name = "N")]
    pub count: Option<u64>,
    #[command(flatten)]
    pub running: Running,
}

#[derive(Args, Debug)]
pub struct New {
    /// Name of the component: its kind, its folder and its package.
    pub name: String,
    /// Folder to write. Default: NAME in the current one.
    #[arg(long, value_name = "DIR")]
    pub path: Option<PathBuf>,
    /// Folder of armor-sdk. Default: the one this program was built with.
    #[arg(long, value_name = "DIR")]
    pub sdk: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub struct Registry {
    /// Where it listens.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY", default_value_t = default_registry())]
    pub listen: SocketAddr,
}

#[derive(Args, Debug)]
pub struct Configd {
    /// The system or mission file.
    pub file: PathBuf,
    /// Where the registry listens.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY", default_value_t = default_registry())]
    pub registry: SocketAddr,
    /// Give a parameter another value than the file does.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    /// Folder in which accepted versions are kept, from which a restarted configd goes on. Default:
    /// `configd` in the folder of the run, $ARMOR_OUT.
    #[arg(long, value_name = "DIR")]
    pub versions: Option<PathBuf>,
    /// Where the file is not valid and no version is kept: refuse whoever asks until it is valid,
    /// and do not end.
    #[arg(long)]
    pub wait: bool,
    #[command(flatten)]
    pub kinds: Kinds,
}

#[derive(Args, Debug)]
pub struct Executive {
    /// The mission file.
    pub file: PathBuf,
    /// Where the registry listens.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY", default_value_t = default_registry())]
    pub registry: SocketAddr,
    /// Give a parameter another value than the file does.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    /// Folder of the versions that configd keeps: newer ones are taken over. Default:
    /// `$ARMOR_OUT/configd`; without it the mission stays as the file is now.
    #[arg(long, value_name = "DIR")]
    pub versions: Option<PathBuf>,
    /// File of the journal, from which a restarted executive goes on.
    #[arg(long, value_name = "FILE")]
    pub journal: Option<PathBuf>,
    /// The journal has been made already: where it is missing or empty it is lost, and the mission
    /// goes to its safe place instead of beginning again.
    #[arg(long)]
    pub resume: bool,
    /// Play absolute dates although no time service is known to keep this host's clock.
    #[arg(long)]
    pub trust_clock: bool,
}

#[derive(Args, Debug)]
#[command(disable_help_flag = true)]
pub struct Component {
    /// The kind, as `armor describe` lists it.
    #[arg(allow_hyphen_values = true)]
    pub kind: String,
    /// Passed on: --name NAME, --registry ADDRESS:PORT, --describe, --help.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub arguments: Vec<std::ffi::OsString>,
}

#[derive(Args, Debug)]
pub struct Guard {
    /// Process id of the parent that must be alive.
    pub parent: i32,
    /// The program and its arguments.
    #[arg(last = true, required = true)]
    pub program: Vec<std::ffi::OsString>,
}

fn default_registry() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], armor_wire::registry::DEFAULT_PORT))
}

pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let seconds = quantity::seconds(text).map_err(|e| e.to_string())?;
    Duration::try_from_secs_f64(seconds).map_err(|e| e.to_string())
}

fn data(text: &str) -> Result<String, String> {
    match split_data(text) {
        Some(_) => Ok(text.into()),
        None => {
            Err("write COMPONENT.OUTPUT; `armor graph` and `armor describe` show outputs".into())
        }
    }
}

fn name(text: &str) -> Result<String, String> {
    if is_name(text) {
        Ok(text.into())
    } else {
        Err("a name starts with a letter, followed by letters, digits, _ and -; at most 64 characters".into())
    }
}
