//! The study: the verdict of the check, the result of the run, and the table of both.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::mutation::{Mutant, MutationKind};
use crate::trial::Outcome;
use crate::verdict::CheckVerdict;

/// Where a run of a mutant falls short of its example.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrialResult {
    /// The number of the mutant.
    pub number: usize,
    /// What is missing, in words; nothing if it behaves.
    pub missing: Vec<String>,
}

impl TrialResult {
    /// Compares the run of a mutant with that of its example.
    pub fn compare(number: usize, example: &Outcome, mutant: &Outcome) -> Self {
        let mut missing = Vec::new();
        if example.reached_goal && !mutant.reached_goal {
            missing.push(format!("goal: {}", mutant.ending));
        }
        // A link or component that the mutant adds has no counterpart that shows what it does.
        let dead = mutant.links.iter().filter(|(name, delivers)| {
            !**delivers && example.links.get(*name).copied().unwrap_or(true)
        });
        missing.extend(dead.map(|(name, _)| format!("link: {name}")));
        let idle = example.activated.difference(&mutant.activated);
        missing.extend(idle.map(|name| format!("component: {name}")));
        Self { number, missing }
    }

    /// As a line of the file of results.
    pub fn to_json(&self, what: &str) -> Value {
        json!({"mutant": self.number, "what": what, "missing": self.missing})
    }

    /// Reads such a line.
    pub fn from_json(line: &str) -> Option<Self> {
        let value: Value = serde_json::from_str(line).ok()?;
        let number = usize::try_from(value["mutant"].as_u64()?).ok()?;
        let missing = value["missing"].as_array()?.iter();
        let missing = missing.filter_map(|it| it.as_str().map(str::to_owned)).collect();
        Some(Self { number, missing })
    }
}

/// A mutant with what is known of it.
#[derive(Clone, Debug)]
pub struct StudiedMutant<'a> {
    /// The mutant.
    pub mutant: &'a Mutant,
    /// The verdict of the check.
    pub verdict: CheckVerdict,
    /// How its meaning differs from its example's; nothing if it means the same.
    pub changes: Vec<String>,
    /// Its run, if it was run.
    pub result: Option<TrialResult>,
}

/// The numbers of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowCounts {
    /// All mutants.
    pub all: usize,
    /// Refused with errors.
    pub refused: usize,
    /// Warned about.
    pub warned: usize,
    /// Passed; they mean the same as their example.
    pub same: usize,
    /// Passed with another meaning.
    pub other: usize,
    /// Of those, how many were run.
    pub run: usize,
    /// Of those that were run, how many are holes.
    pub holes: usize,
}

impl RowCounts {
    fn add_mutant(&mut self, studied: &StudiedMutant<'_>) {
        self.all += 1;
        match studied.verdict {
            CheckVerdict::Refused => self.refused += 1,
            CheckVerdict::Warned => self.warned += 1,
            CheckVerdict::Passed if studied.changes.is_empty() => self.same += 1,
            CheckVerdict::Passed => {
                self.other += 1;
                self.run += usize::from(studied.result.is_some());
                let is_hole = |result: &TrialResult| !result.missing.is_empty();
                self.holes += usize::from(studied.result.as_ref().is_some_and(is_hole));
            }
        }
    }

    fn as_line(&self, name: &str) -> String {
        let Self { all, refused, warned, same, other, run, holes } = self;
        format!("| {name} | {all} | {refused} | {warned} | {same} | {other} | {run} | {holes} |\n")
    }
}

/// Returns the counts by kind of mutation.
pub fn count_kinds(studied: &[StudiedMutant<'_>]) -> BTreeMap<MutationKind, RowCounts> {
    let mut rows: BTreeMap<_, RowCounts> = BTreeMap::new();
    for one in studied {
        rows.entry(one.mutant.kind).or_default().add_mutant(one);
    }
    rows
}

/// Returns the counts of all.
pub fn count_all(studied: &[StudiedMutant<'_>]) -> RowCounts {
    let mut counts = RowCounts::default();
    studied.iter().for_each(|one| counts.add_mutant(one));
    counts
}

/// Returns the table in Markdown.
pub fn format_table(studied: &[StudiedMutant<'_>]) -> String {
    let mut table = String::from(
        "| mutation | mutants | refused | warned | passed, same meaning | passed, another meaning | run | holes |\n\
         | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n",
    );
    for (kind, row) in count_kinds(studied) {
        table += &row.as_line(kind.in_words());
    }
    let all = count_all(studied);
    table += &all.as_line("all");
    if all.run > 0 {
        let share = 100.0 * all.holes as f64 / all.run as f64;
        let _ = writeln!(table, "\n{share:.0} % of the {} that were run are holes.", all.run);
    }
    table
}
