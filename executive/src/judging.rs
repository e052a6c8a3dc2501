//! Whether a new version of the file can be played, and is safe from where the mission stands: pure
//! functions that take their time, to be called on a thread of their own.

use crate::answer::{VersionAnswer, VersionFinding, VersionOffer};
use crate::event::ControllerEvent;
use crate::wall_clock::describe_doubts;
use armor_plan::{Plan, Stand, Version, in_words};
use armor_proof::prove_from_here;
use armor_robotfile::{Code, Configuration, Finding, Findings, Severity, differences};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a proof may take before it counts as not found.
const PROOF_WITHIN: Duration = Duration::from_secs(5);

/// What the controller wants to know of a new version.
#[derive(Clone, Debug)]
pub enum VersionQuestion {
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

impl VersionQuestion {
    /// Finds the answer; that of a proof may take seconds. `clock_doubts` returns why the host's clock
    /// may not be right; it is called for a version that brings the first dates.
    pub fn answer(&self, clock_doubts: &dyn Fn() -> Option<String>) -> ControllerEvent {
        ControllerEvent::Answered(match self {
            Self::Read { serial, version, running } => {
                let found = running.read_next(version).and_then(|plan| {
                    let first_dates = plan.has_dates() && !running.has_dates();
                    match first_dates.then(clock_doubts).flatten() {
                        Some(doubts) => Err(describe_doubts(&doubts)),
                        None => Ok(VersionOffer {
                            changes: describe_changes(running.version(), version),
                            plan: Arc::new(plan),
                        }),
                    }
                });
                VersionAnswer { serial: *serial, found: VersionFinding::Read(found) }
            }
            Self::Prove { serial, running, next, stand } => {
                let verdict = judge_version(running, next, stand);
                let found = VersionFinding::Proven { stand: stand.clone(), verdict };
                VersionAnswer { serial: *serial, found }
            }
        })
    }
}

/// Whether it is safe to move tokens: nothing bad follows from where they would be that does not
/// follow from where they are.
#[derive(Clone, Debug)]
pub struct MoveQuestion {
    /// Names the answer.
    pub serial: u64,
    pub(crate) plan: Arc<Plan>,
    pub(crate) before: Stand,
    pub(crate) after: Stand,
}

impl MoveQuestion {
    /// Finds the answer, which may take seconds.
    pub fn answer(&self) -> ControllerEvent {
        let verdict = judge_move(&self.plan, &self.before, &self.after);
        ControllerEvent::MoveJudged { serial: self.serial, verdict }
    }
}

/// What is not as before, as far as both can be read.
fn describe_changes(before: &Version, after: &Version) -> Vec<String> {
    match (before.configuration(), after.configuration()) {
        (Ok(before), Ok(after)) => {
            differences(&before, &after).iter().map(ToString::to_string).collect()
        }
        _ => Vec::new(),
    }
}

/// Whether nothing bad follows from a marking that does not follow from it already as things are.
fn judge_version(running: &Plan, next: &Plan, stand: &Stand) -> Result<(), String> {
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
    let found_words =
        new.iter().map(|finding| format!("{}: {}", finding.code.as_str(), finding.message));
    let found_words: Vec<_> = found_words.collect();
    Err(format!("from where the mission stands, {}", found_words.join("; ")))
}

/// Whether nothing bad follows from where tokens would be moved to that does not follow from where
/// they are; errors keep them from being moved even then.
fn judge_move(plan: &Plan, before: &Stand, after: &Stand) -> Result<(), String> {
    let configuration = plan.version().configuration().map_err(in_words)?;
    let found = proven_from(&configuration, plan, after.clone());
    if found.is_empty() {
        return Ok(());
    }
    let known = proven_from(&configuration, plan, before.clone());
    let is_new = |one: &&Finding| one.severity() == Severity::Error || !is_known(one, &known);
    let new: Vec<_> = found.iter().filter(is_new).collect();
    let found_words =
        new.iter().map(|finding| format!("{}: {}", finding.code.as_str(), finding.message));
    let found_words: Vec<_> = found_words.collect();
    if found_words.is_empty() {
        Ok(())
    } else {
        Err(format!("from there, {}", found_words.join("; ")))
    }
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
