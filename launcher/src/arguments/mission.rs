//! `armor mission`: what can be asked and ordered.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};

use super::{Running, duration};

#[derive(Debug, Subcommand)]
pub enum Mission {
    /// Show which places are marked, what can fire and by whom, and who commands.
    Show {
        /// Print again at every change.
        #[arg(long, short)]
        follow: bool,
        #[command(flatten)]
        running: Running,
    },
    /// Fire an operator's transition that is enabled.
    Fire {
        /// The transition.
        transition: String,
        #[command(flatten)]
        by: By,
    },
    /// Let clocks and components stop, but for those of the safety class.
    Pause(By),
    /// Go on after a pause, where everything stood.
    Resume(By),
    /// Go to the safe place.
    Safe(By),
    /// Move tokens while the mission is paused.
    Move {
        /// The place that loses them.
        from: String,
        /// The place that gets them.
        to: String,
        /// How many.
        #[arg(long, value_name = "N", default_value_t = 1)]
        tokens: u32,
        #[command(flatten)]
        by: By,
    },
    /// Let a transition fire that asks.
    Confirm {
        /// The transition.
        transition: String,
        #[command(flatten)]
        by: By,
    },
    /// Do not let a transition fire that asks.
    Decline {
        /// The transition.
        transition: String,
        #[command(flatten)]
        by: By,
    },
    /// Hold the command, and take orders from stdin, one a line, until its end. Killed, it is a
    /// lost link.
    Operate(By),
    /// Print the journal of a mission.
    Journal {
        /// The journal. Default: that of the running system.
        #[arg(long, value_name = "FILE")]
        journal: Option<PathBuf>,
        #[command(flatten)]
        running: Running,
    },
    /// Play a past mission from its journal, or a way that `armor check` shows, step by step.
    Replay(Replay),
}

/// Who orders, and of which system.
#[derive(Args, Clone, Debug)]
pub struct By {
    /// Take the command over from whoever holds it.
    #[arg(long)]
    pub take: bool,
    /// Who gives the order. Default: this user on this host.
    #[arg(long = "as", value_name = "NAME")]
    pub author: Option<String>,
    /// How long to wait for the answer.
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "5s")]
    pub within: Duration,
    #[command(flatten)]
    pub running: Running,
}

#[derive(Args, Debug)]
pub struct Replay {
    /// The journal: executive.journal in the folder of the run. With --fire, the mission file.
    #[arg(value_name = "JOURNAL|FILE")]
    pub journal: PathBuf,
    /// The mission file it was played from, for a journal that does not hold it.
    #[arg(conflicts_with = "fire")]
    pub file: Option<PathBuf>,
    /// Fire these transitions of the mission file, one after the other, and show the marking after
    /// each: nothing runs. Names as in the `way` of a finding, with spaces or commas between.
    #[arg(long, value_name = "TRANSITIONS")]
    pub fire: Option<String>,
    /// Give a parameter another value than the file does.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    /// Wait for Enter after each step.
    #[arg(long)]
    pub step: bool,
}
