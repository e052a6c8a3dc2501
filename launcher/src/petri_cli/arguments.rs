//! What can be asked of `armor net`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};

use super::bytes;

/// What `armor net` is to do.
#[derive(Debug, Subcommand)]
pub enum Net {
    /// Count states and edges exactly, and the most tokens.
    Info {
        /// A .pnml or .net file, or a mission.
        file: PathBuf,
        #[command(flatten)]
        budget: Limits,
    },
    /// Say what is wrong, each thing with a firing sequence that shows it.
    Check(Check),
    /// Write the net in the format that the other file's name says: .pnml or .net.
    Convert {
        /// The file that is read.
        from: PathBuf,
        /// The file that is written.
        to: PathBuf,
    },
}

/// How much an answer may cost; an answer beyond is "undecided".
#[derive(Args, Clone, Debug)]
pub struct Limits {
    /// Keep no more states than this.
    #[arg(long, value_name = "N", default_value_t = u64::MAX, hide_default_value = true)]
    pub max_states: u64,
    /// Use no more memory for states than this.
    #[arg(long, value_name = "SIZE", default_value = "2GiB", value_parser = bytes)]
    pub max_memory: u64,
    /// Take no longer than this.
    #[arg(long, value_name = "TIME", default_value = "5min", value_parser = crate::arguments::duration)]
    pub time_limit: Duration,
}

/// What `armor net check` is to look at.
#[derive(Args, Debug)]
pub struct Check {
    /// A .pnml or .net file, or a mission.
    pub file: PathBuf,
    /// The place that must be reachable from everywhere, and to which durations are told.
    #[arg(long, value_name = "PLACE")]
    pub goal: Option<String>,
    /// Two places that must never be marked together; may be given several times.
    #[arg(long, num_args = 2, value_names = ["PLACE", "PLACE"])]
    pub exclusive: Vec<String>,
    /// Print the semiflows of places and transitions.
    #[arg(long)]
    pub invariants: bool,
    #[command(flatten)]
    pub budget: Limits,
}
