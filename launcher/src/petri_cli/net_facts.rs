//! Reading a net, and the analysis that `info` and `check` share.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use armor_petri::analysis::boundedness::{PumpingSequence, pumping_on_walks};
use armor_petri::analysis::invariants::PlaceBounds;
use armor_petri::analysis::{
    AnalysisBudget, Exhausted, ExplorationEnd as Explored, Space, explore_states,
};
use armor_petri::file::{NetFile, decode_text, pnml, tina};
use armor_petri::{Net, TransitionId};
use armor_robotfile::suggest_file;

use super::arguments::ProofLimits;
use super::mission::{is_mission, read_mission_net};

/// Reads the net of a file: `.net` is TINA's format, anything else PNML or a mission.
///
/// # Errors
/// If it cannot be read or contains no net, with line and column.
pub fn load_net(path: &Path) -> Result<NetFile> {
    let shown = path.display();
    let bytes = std::fs::read(path).with_context(|| {
        let advice = suggest_file(path).map(|advice| format!("; {advice}")).unwrap_or_default();
        format!("cannot read {shown}{advice}")
    })?;
    let located = |error| anyhow!("{shown}:{error}");
    let text = decode_text(&bytes).map_err(located)?;
    match is_tina(path) {
        true => tina::read(&text).map_err(located),
        false if is_mission(&text) => read_mission_net(path),
        false => pnml::read(&text).map_err(located),
    }
}

/// Returns whether a file name is one of TINA's.
pub fn is_tina(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("net"))
}

/// The analysis of a net's states.
pub struct NetFacts {
    /// PlaceBounds of places from invariants.
    pub bounds: PlaceBounds,
    /// A repeatable sequence under which a place grows without limit, if there is one.
    pub pumping: Option<PumpingSequence>,
    /// The states, unless growth was found before any were gathered.
    pub space: Option<Space>,
    /// The exhausted budget, if the analysis is incomplete.
    pub undecided: Option<Exhausted>,
}

impl NetFacts {
    /// Computes bounds from invariants, searches for growth on a few walks, and then explores all
    /// states.
    pub fn gather_facts(net: &Net, with_paths: bool, budget: &AnalysisBudget<'_>) -> Self {
        let bounds = PlaceBounds::of_net(net, budget.stop);
        if !bounds.is_bounded()
            && let Some(pumping) = pumping_on_walks(net)
        {
            return Self { bounds, pumping: Some(pumping), space: None, undecided: None };
        }
        let found = explore_states(net, &bounds, with_paths, budget);
        let (pumping, undecided) = match found.ending {
            Explored::Complete => (None, None),
            Explored::Unbounded(pumping) => (Some(pumping), None),
            Explored::Undecided(exhausted) => (None, Some(exhausted)),
        };
        Self { bounds, pumping, space: Some(found.space), undecided }
    }

    /// Returns whether the net is bounded, if that was decided.
    pub fn decide_bounds(&self) -> Option<bool> {
        match (&self.pumping, self.undecided) {
            (Some(_), _) => Some(false),
            (None, None) => Some(true),
            (None, Some(_)) => self.bounds.is_bounded().then_some(true),
        }
    }

    /// Returns the states, if all were explored.
    pub fn all_states(&self) -> Option<&Space> {
        self.space.as_ref().filter(|_| self.pumping.is_none() && self.undecided.is_none())
    }
}

/// Runs `work` with the budget of the command line.
pub fn run_within_budget<T>(
    budget: &ProofLimits,
    work: impl FnOnce(&AnalysisBudget<'_>) -> T,
) -> T {
    let start = Instant::now();
    let stop = || start.elapsed() >= budget.time_limit;
    work(&AnalysisBudget {
        states: budget.max_states,
        memory_bytes: budget.max_memory,
        stop: &stop,
        ..AnalysisBudget::UNLIMITED
    })
}

/// Returns the name of the option whose budget is exhausted.
pub fn option_of(exhausted: Exhausted) -> &'static str {
    match exhausted {
        Exhausted::States => "max-states",
        Exhausted::Memory => "max-memory",
        Exhausted::Time => "time-limit",
        Exhausted::Tokens => "tokens",
        Exhausted::Scale => "times",
    }
}

/// Returns the names of transitions.
pub fn name_all(net: &Net, sequence: &[TransitionId]) -> Vec<String> {
    sequence.iter().map(|id| net.transition(*id).name.clone()).collect()
}

/// Formats a firing sequence.
pub fn format_sequence(net: &Net, sequence: &[TransitionId]) -> String {
    match sequence {
        [] => "(nothing)".into(),
        _ => name_all(net, sequence).join(" "),
    }
}
