//! The arguments of `armor net`.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};

/// Count, check and convert Petri nets in files: PNML, TINA's .net, and missions.
#[derive(Debug, Subcommand)]
pub enum NetCommand {
    /// Count states and edges exactly, and the most tokens.
    Info {
        /// A .pnml or .net file, or a mission.
        file: PathBuf,
        #[command(flatten)]
        budget: ProofLimits,
    },
    /// Print the faults of the net, each with a firing sequence that shows it.
    Check(NetCheckArguments),
    /// Write the net in the format of the other file's name: .pnml or .net.
    Convert {
        /// The file that is read.
        from: PathBuf,
        /// The file that is written.
        to: PathBuf,
    },
}

/// Limits of an analysis; beyond them its answer is "undecided".
#[derive(Args, Clone, Debug)]
pub struct ProofLimits {
    /// Most states to keep.
    #[arg(long, value_name = "N", default_value_t = u64::MAX, hide_default_value = true)]
    pub max_states: u64,
    /// Most memory for states.
    #[arg(long, value_name = "SIZE", default_value = "2GiB", value_parser = parse_bytes)]
    pub max_memory: u64,
    /// Longest time.
    #[arg(long, value_name = "TIME", default_value = "5min", value_parser = crate::arguments::parse_duration)]
    pub time_limit: Duration,
}

/// The arguments of `armor net check`.
#[derive(Args, Debug)]
pub struct NetCheckArguments {
    /// A .pnml or .net file, or a mission.
    pub file: PathBuf,
    /// The place that must be reachable from every state; durations until it is marked are printed.
    #[arg(long, value_name = "PLACE")]
    pub goal: Option<String>,
    /// Two places that must never be marked together; may be given several times.
    #[arg(long, num_args = 2, value_names = ["PLACE", "PLACE"])]
    pub exclusive: Vec<String>,
    /// Print the semiflows of places and transitions.
    #[arg(long)]
    pub invariants: bool,
    #[command(flatten)]
    pub budget: ProofLimits,
}

/// Reads a number of bytes with its unit: `512MiB`, `2GB`, `100000`.
///
/// # Errors
/// If the text is not a size.
fn parse_bytes(text: &str) -> Result<u64> {
    let digits = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let factor: u64 = match unit.trim() {
        "" | "B" => 1,
        "kB" | "KB" => 1000,
        "MB" => 1_000_000,
        "GB" => 1_000_000_000,
        "KiB" | "K" | "k" => 1 << 10,
        "MiB" | "M" => 1 << 20,
        "GiB" | "G" => 1 << 30,
        "TiB" | "T" => 1 << 40,
        _ => bail!("write a size such as 512MiB or 2GiB"),
    };
    let number: u64 = number.parse().context("write a size such as 512MiB or 2GiB")?;
    number.checked_mul(factor).context("that is more bytes than there are")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units() {
        let read = |text| parse_bytes(text).ok();
        assert_eq!([read("1"), read("2KiB"), read("3 MB")], [Some(1), Some(2048), Some(3_000_000)]);
        assert_eq!([read(""), read("x"), read("1XB"), read("99999999999TiB")], [None; 4]);
    }
}
