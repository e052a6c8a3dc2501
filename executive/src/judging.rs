//! Whether a new version of the file can be played, and is safe from where the mission stands: pure
//! functions that take their time, to be called where nobody waits for them.

use crate::event::Event;
use crate::run::RunError;
use armor_plan::{Plan, Stand, Version, in_words};
use armor_proof::prove_from_here;
use armor_robotfile::{Code, Configuration, Finding, Findings, Severity, differences};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a proof may take before it counts as not found.
const PROOF_WITHIN: Duration = Duration::from_secs(5);

/// What the controller wants to know of a new version.
#[derive(Clone, Debug)]
pub enum Question {
    /// Whether it can be played by the components that run.
    Read {
        /// Names the answer.
        serial: u64,
        /// The version.
        version: Arc<Version>,
        /// What is played.
        running: Arc<Plan>,
    },
    /// Whether it is safe from where the mission stands.
    Prove {
        /// Names the answer.
        serial: u64,
        /// What is played.
        running: Arc<Plan>,
        /// What would be played.
        next: Arc<Plan>,
        /// Where it would stand.
        stand: Stand,
    },
}

/// The answer to a [`Question`].
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Which question it answers.
    pub serial: u64,
    /// What was found.
    pub found: Found,
}

/// What was found of a new version.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// It can be played, or why not.
    Read(Result<Offer, String>),
    /// Nothing bad follows from where the mission stands, or what does.
    Proven {
        /// Where that is.
        stand: Stand,
        /// In words, with a way there.
        verdict: Result<(), String>,
    },
}

/// A version that can be played.
#[derive(Clone, Debug)]
pub struct Offer {
    /// Its plan.
    pub plan: Arc<Plan>,
    /// What is not as before, in words.
    pub changes: Vec<String>,
}

impl PartialEq for Offer {
    fn eq(&self, other: &Self) -> bool {
        self.plan.version() == other.plan.version() && self.changes == other.changes
    }
}

impl Question {
    /// Finds the answer; that of a proof may take seconds. `clock_doubts` says why the host's clock
    /// may not be right, which is asked of a version that brings the first dates.
    pub fn answer(&self, clock_doubts: &dyn Fn() -> Option<String>) -> Event {
        Event::Answered(match self {
            Self::Read { serial, version, running } => {
                let found = running.read_next(version).and_then(|plan| {
                    let first_dates = plan.has_dates() && !running.has_dates();
                    match first_dates.then(clock_doubts).flatten() {
                        Some(doubts) => Err(RunError::Clock(doubts).to_string()),
                        None => Ok(Offer {
                            changes: changes(running.version(), version),
                            plan: Arc::new(plan),
                        }),
                    }
                });
                Answer { serial: *serial, found: Found::Read(found) }
            }
            Self::Prove { serial, running, next, stand } => {
                let verdict = judge(running, next, stand);
                let found = Found::Proven { stand: stand.clone(), verdict };
                Answer { serial: *serial, found }
            }
        })
    }
}

/// What is not as before, as far as both can be read.
fn changes(before: &Version, after: &Version) -> Vec<String> {
    match (before.configuration(), after.configuration()) {
        (Ok(before), Ok(after)) => {
            differences(&before, &after).iter().map(ToString::to_string).collect()
        }
        _ => Vec::new(),
    }
}

/// Whether nothing bad follows from a marking that does not follow from it already as things are.
fn judge(running: &Plan, next: &Plan, stand: &Stand) -> Result<(), String> {
    let configuration = next.version().configuration().map_err(in_words)?;
    let found = proven_from(&configuration, next, stand.clone());
    if found.is_empty() {
        return Ok(());
    }
    let before = next.stand_in(running, stand).zip(running.version().configuration().ok());
    let known = before.map_or_else(Vec::new, |(stand, configuration)| {
        proven_from(&configuration, running, stand)
    });
    let new: Vec<_> = found.iter().filter(|one| is_grave(one) || !is_known(one, &known)).collect();
    if new.is_empty() {
        return Ok(());
    }
    let said = new.iter().map(|finding| format!("{}: {}", finding.code.as_str(), finding.message));
    let said: Vec<_> = said.collect();
    Err(format!("from where the mission stands, {}", said.join("; ")))
}

/// Whether nothing bad follows from where tokens would be moved to that does not follow from where
/// they are; errors keep them from being moved even then.
pub(crate) fn judge_move(plan: &Plan, before: &Stand, after: &Stand) -> Result<(), String> {
    let configuration = plan.version().configuration().map_err(in_words)?;
    let found = proven_from(&configuration, plan, after.clone());
    if found.is_empty() {
        return Ok(());
    }
    let known = proven_from(&configuration, plan, before.clone());
    let is_new = |one: &&Finding| one.severity() == Severity::Error || !is_known(one, &known);
    let new: Vec<_> = found.iter().filter(is_new).collect();
    let said = new.iter().map(|finding| format!("{}: {}", finding.code.as_str(), finding.message));
    let said: Vec<_> = said.collect();
    if said.is_empty() { Ok(()) } else { Err(format!("from there, {}", said.join("; "))) }
}

/// What the proof finds from there on, but for what has been passed already.
fn proven_from(configuration: &Configuration, plan: &Plan, stand: Stand) -> Vec<Finding> {
    let start = Instant::now();
    let plan = plan.clone().starting_at(stand);
    let findings: Findings =
        prove_from_here(configuration, &plan, &|| start.elapsed() > PROOF_WITHIN);
    let bad = |finding: &&Finding| {
        finding.severity() != Severity::Note && finding.code != Code::NeverFires
    };
    findings.iter().filter(bad).cloned().collect()
}

/// What keeps a version from being taken even if it is no worse than the one that is played.
fn is_grave(finding: &Finding) -> bool {
    finding.severity() == Severity::Error || finding.code == Code::NotProven
}

/// Whether the mission that is played has the same fault at the same thing.
fn is_known(finding: &Finding, known: &[Finding]) -> bool {
    let about =
        |finding: &Finding| (finding.code, finding.at.as_ref().map(|at| at.text().to_owned()));
    known.iter().any(|other| about(other) == about(finding))
}
