//! The arguments of `armor mission`.

use std::path::PathBuf;
use std::time::Duration;

use armor_robotfile::Date;
use clap::{Args, Subcommand};

use crate::arguments::{KindFolders, RunningSystem, parse_duration, parse_name};

/// Show the mission of a running system, and command it.
#[derive(Debug, Subcommand)]
pub enum MissionCommand {
    /// Show the marked places, the enabled transitions, and the holder of the command.
    Show {
        /// Print again at every change. Values of data alone are none, except with --format json.
        #[arg(long, short)]
        follow: bool,
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Fire an operator's transition that is enabled.
    Fire {
        /// The transition.
        transition: String,
        #[command(flatten)]
        by: OrderArguments,
    },
    /// Stop clocks and components, except those of the safety class.
    Pause(OrderArguments),
    /// Continue after a pause, from the same state.
    Resume(OrderArguments),
    /// Go to the safe place.
    Safe(OrderArguments),
    /// Move tokens while the mission is paused.
    Move {
        /// The place they are taken from.
        from: String,
        /// The place they are put into.
        to: String,
        /// Number of tokens.
        #[arg(long, value_name = "N", default_value_t = 1)]
        tokens: u32,
        #[command(flatten)]
        by: OrderArguments,
    },
    /// Confirm a transition that asks for confirmation.
    Confirm {
        /// The transition.
        transition: String,
        #[command(flatten)]
        by: OrderArguments,
    },
    /// Decline a transition that asks for confirmation.
    Decline {
        /// The transition.
        transition: String,
        #[command(flatten)]
        by: OrderArguments,
    },
    /// Hold the command, and read orders from stdin, one per line, until its end. If this process
    /// is killed, the link counts as lost.
    Operate(OrderArguments),
    /// Print the journal of a mission, or verify it.
    #[command(args_conflicts_with_subcommands = true)]
    Journal {
        #[command(subcommand)]
        action: Option<JournalAction>,
        /// The journal, the folder of the run, or a recording (.mcap). Default: that of the running
        /// system.
        #[arg(value_name = "FILE|FOLDER")]
        path: Option<PathBuf>,
        /// The same, as an option.
        #[arg(long, value_name = "FILE|FOLDER", conflicts_with = "path")]
        journal: Option<PathBuf>,
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Print a mission file with its routes written out as places and transitions.
    Expand {
        /// The mission file.
        file: PathBuf,
    },
    /// Print when the steps of drawn routes end, at the earliest and at the latest, and how much time
    /// is left of each limit.
    Times {
        /// The mission file.
        file: PathBuf,
        /// When the mission begins, in UTC, such as 2026-11-21T14:30:00Z: times that depend on dates
        /// are then known.
        #[arg(long, value_name = "DATE")]
        begin: Option<Date>,
        /// Also print how probable it is that each limit is kept, and that robots meet: the speed of each
        /// drive is drawn 1000 times within the tolerance of its route.
        #[arg(long)]
        chances: bool,
        /// The seed of the draws: the same one gives the same chances.
        #[arg(long, value_name = "NUMBER", default_value_t = 1, requires = "chances")]
        seed: u64,
    },
    /// Rehearse a drawn mission in the simulator, faster than real time, and compare the times of its steps
    /// with those predicted.
    Rehearse(RehearseArguments),
    /// Replay a past mission from its journal, or a trace that `armor check` prints, step by step.
    Replay(ReplayArguments),
}

/// An action on a journal other than to print it.
#[derive(Debug, Subcommand)]
pub enum JournalAction {
    /// Check that every record is as it was written and that none is missing; report the first
    /// fault and its place.
    Verify {
        /// The journal, or the folder of the run.
        #[arg(value_name = "FILE|FOLDER")]
        path: PathBuf,
    },
}

/// The author of an order, and the system it is for.
#[derive(Args, Clone, Debug)]
pub struct OrderArguments {
    /// Take the command over from its holder.
    #[arg(long)]
    pub take: bool,
    /// Author of the order. Default: this user on this host.
    #[arg(long = "as", value_name = "NAME")]
    pub author: Option<String>,
    /// Longest time to wait for the answer.
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "5s")]
    pub within: Duration,
    #[command(flatten)]
    pub running: RunningSystem,
}

#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor mission rehearse robot.xml                      a file that has the simulator
  armor mission rehearse robot.xml --speed 5
  armor mission rehearse robot.xml --replace base --world hall.svg   one of a real robot")]
pub struct RehearseArguments {
    /// The mission file.
    pub file: PathBuf,
    /// How many times faster than real time, 0.1 to 20. If the components do not keep up on this host, it is
    /// rehearsed again at half the speed.
    #[arg(long, value_name = "TIMES", value_parser = parse_speed, default_value = "20")]
    pub speed: f64,
    /// The world of the simulator, instead of the file's: an SVG drawing, or the YAML of a grid map.
    #[arg(long, value_name = "FILE")]
    pub world: Option<PathBuf>,
    /// Let the simulator stand in for this component, which needs hardware; may be given several times.
    #[arg(long, value_name = "COMPONENT", value_parser = parse_name)]
    pub replace: Vec<String>,
    /// Override the value of a parameter in the file.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    /// Folder for the logs and the journal. Default: a temporary one.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub kinds: KindFolders,
}

fn parse_speed(text: &str) -> Result<f64, String> {
    let speed = text.parse::<f64>().ok().filter(|speed| (0.1..=20.0).contains(speed));
    speed.ok_or_else(|| "write a number from 0.1 to 20, such as 5".into())
}

#[derive(Args, Debug)]
pub struct ReplayArguments {
    /// The journal: executive.journal in the folder of the run. With --fire, the mission file.
    #[arg(value_name = "JOURNAL|FILE")]
    pub journal: PathBuf,
    /// The mission file it was played from, for a journal that does not contain it.
    #[arg(conflicts_with = "fire")]
    pub file: Option<PathBuf>,
    /// Fire these transitions of the mission file, one after the other, and show the marking after
    /// each; no component runs. Names as in the `trace` of a finding, separated by spaces or commas.
    #[arg(long, value_name = "TRANSITIONS")]
    pub fire: Option<String>,
    /// Override the value of a parameter in the file.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    /// Wait for Enter after each step.
    #[arg(long)]
    pub step: bool,
}
