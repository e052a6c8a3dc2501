//! `armor net`: Petri nets in files of others, and those of our missions: counted, checked,
//! converted.

pub mod arguments;
mod check;
mod convert;
mod info;
mod mission;
mod report;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use armor_petri::analysis::boundedness::{PumpingSequence, pumping_on_walks};
use armor_petri::analysis::invariants::PlaceBounds;
use armor_petri::analysis::{
    AnalysisBudget, Exhausted, ExplorationEnd as Explored, Space, explore_states,
};
use armor_petri::file::{NetFile, decode_text, pnml, tina};
use armor_petri::{Net, TransitionId};

use crate::arguments::Format;
use crate::exit::Ending;

/// Does what is asked.
///
/// # Errors
/// If a file cannot be read or written, or holds no net.
pub fn run(arguments: &arguments::Net, format: Format) -> Result<Ending> {
    match arguments {
        arguments::Net::Info { file, budget } => info::run(file, budget, format),
        arguments::Net::Check(check) => check::run(check, format),
        arguments::Net::Convert { from, to } => convert::run(from, to),
    }
}

/// The net in a file: `.net` is TINA's, all else PNML or a mission.
///
/// # Errors
/// If it cannot be read or holds no net, with line and column.
fn load(path: &Path) -> Result<NetFile> {
    let shown = path.display();
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {shown}"))?;
    let located = |error| anyhow!("{shown}:{error}");
    let text = decode_text(&bytes).map_err(located)?;
    match is_tina(path) {
        true => tina::read(&text).map_err(located),
        false if mission::is_mission(&text) => mission::read(path),
        false => pnml::read(&text).map_err(located),
    }
}

fn is_tina(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("net"))
}

/// What is known of a net's states.
struct Facts {
    bounds: PlaceBounds,
    /// How some place grows without end, if one does.
    pumping: Option<PumpingSequence>,
    /// The states, unless growth was found before any were gathered.
    space: Option<Space>,
    undecided: Option<Exhausted>,
}

impl Facts {
    /// Bounds from invariants, growth on a few walks, and then all states.
    fn gather(net: &Net, with_ways: bool, budget: &AnalysisBudget<'_>) -> Self {
        let bounds = PlaceBounds::of_net(net, budget.stop);
        if !bounds.is_bounded()
            && let Some(pumping) = pumping_on_walks(net)
        {
            return Self { bounds, pumping: Some(pumping), space: None, undecided: None };
        }
        let found = explore_states(net, &bounds, with_ways, budget);
        let (pumping, undecided) = match found.ending {
            Explored::Complete => (None, None),
            Explored::Unbounded(pumping) => (Some(pumping), None),
            Explored::Undecided(exhausted) => (None, Some(exhausted)),
        };
        Self { bounds, pumping, space: Some(found.space), undecided }
    }

    /// Whether the net is bounded, if that is known.
    fn bounded(&self) -> Option<bool> {
        match (&self.pumping, self.undecided) {
            (Some(_), _) => Some(false),
            (None, None) => Some(true),
            (None, Some(_)) => self.bounds.is_bounded().then_some(true),
        }
    }

    /// The states, if they are all.
    fn all_states(&self) -> Option<&Space> {
        self.space.as_ref().filter(|_| self.pumping.is_none() && self.undecided.is_none())
    }
}

/// Runs `work` with the budget of the command line.
fn within<T>(budget: &arguments::Limits, work: impl FnOnce(&AnalysisBudget<'_>) -> T) -> T {
    let start = Instant::now();
    let stop = || start.elapsed() >= budget.time_limit;
    work(&AnalysisBudget {
        states: budget.max_states,
        memory_bytes: budget.max_memory,
        stop: &stop,
    })
}

/// The option whose budget ran out.
fn option_of(exhausted: Exhausted) -> &'static str {
    match exhausted {
        Exhausted::States => "max-states",
        Exhausted::Memory => "max-memory",
        Exhausted::Time => "time-limit",
        Exhausted::Tokens => "tokens",
        Exhausted::Scale => "times",
    }
}

/// Names of transitions.
fn names(net: &Net, sequence: &[TransitionId]) -> Vec<String> {
    sequence.iter().map(|id| net.transition(*id).name.clone()).collect()
}

/// A firing sequence for people.
fn shown(net: &Net, sequence: &[TransitionId]) -> String {
    match sequence {
        [] => "(nothing)".into(),
        _ => names(net, sequence).join(" "),
    }
}

/// A number of bytes with its unit: `512MiB`, `2GB`, `100000`.
///
/// # Errors
/// If it is none.
pub fn bytes(text: &str) -> Result<u64> {
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
        let read = |text| bytes(text).ok();
        assert_eq!([read("1"), read("2KiB"), read("3 MB")], [Some(1), Some(2048), Some(3_000_000)]);
        assert_eq!([read(""), read("x"), read("1XB"), read("99999999999TiB")], [None; 4]);
    }
}
