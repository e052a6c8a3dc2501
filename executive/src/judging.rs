//! Decides whether a new version of the file can be played, and whether it is safe from the current
//! marking. These are pure functions that may take seconds; call them on a thread of their own.

use crate::answer::{VersionAnswer, VersionFinding, VersionOffer};
use crate::event::ControllerEvent;
use crate::wall_clock::describe_doubts;
use armor_plan::{Plan, Stand, Version, in_words};
use armor_proof::prove_from_here;
use armor_robotfile::{Code, Configuration, Finding, Findings, Severity, differences};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a proof may take; what is undecided after that counts as not proven.
const PROOF_WITHIN: Duration = Duration::from_secs(5);

/// A question of the controller about a new version.
#[derive(Clone, Debug)]
pub enum VersionQuestion {
    /// Can the running components play it?
    Read {
        /// The number of the question; the answer has the same.
        serial: u64,
        /// The version.
        version: Arc<Version>,
        /// The plan in force.
        running: Arc<Plan>,
    },
    /// Is it safe to continue with it from the current marking?
    Prove {
        /// The number of the question; the answer has the same.
        serial: u64,
        /// The plan in force.
        running: Arc<Plan>,
        /// The plan of the new version.
        next: Arc<Plan>,
        /// The marking and variables that it would continue from.
        stand: Stand,
    },
}

impl VersionQuestion {
    /// Finds the answer; that of a proof may take seconds. `clock_doubts` returns why the host's
    /// clock may not be right; it is called for a version that brings the first dates.
    pub fn answer(&self, clock_doubts: &dyn Fn() -> Option<String>) -> ControllerEvent {
        ControllerEvent::Answered(match self {
            Self::Read { serial, version, running } => {
                let found = running.read_next(version).and_then(|plan| {
                    let first_dates = plan.has_dates() && !running.has_dates();
                    match first_dates.then(clock_doubts).flatten() {
                        Some(doubts) => Err(describe_doubts(&doubts)),
                        None => Ok(offer(running, plan)),
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

/// Is it safe to move tokens? It is if the marking after the move leads to no fault to which the
/// marking before it does not lead as well.
#[derive(Clone, Debug)]
pub struct MoveQuestion {
    /// The number of the question; the answer has the same.
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

/// Makes an offer of a plan: with its differences to the one in force, none if one of the versions cannot
/// be read.
fn offer(running: &Plan, plan: Plan) -> VersionOffer {
    let (before, after) = (running.version().configuration(), plan.version().configuration());
    let (changes, is_proven) = match (before, after) {
        (Ok(before), Ok(after)) => {
            let changes = differences(&before, &after).iter().map(ToString::to_string).collect();
            let is_same = running.differs_in_values_alone(&plan) && claim_the_same(&before, &after);
            (changes, is_same)
        }
        _ => (Vec::new(), false),
    };
    VersionOffer { plan: Arc::new(plan), changes, is_proven }
}

/// Whether the checks are the same, also those of sub-missions, which are about their missions from
/// the start.
fn claim_the_same(before: &Configuration, after: &Configuration) -> bool {
    fn checks(of: &Configuration) -> Vec<&str> {
        let checks = of.mission.iter().flat_map(|mission| &mission.checks);
        checks.map(|check| check.value.as_str()).collect()
    }
    let claims = |of: &Configuration| of.included.values().any(|it| !it.checks.is_empty());
    let others = |of: &Configuration| {
        let others = of.sources.iter().skip(1);
        others.map(|it| (it.path().to_owned(), it.text().to_owned())).collect::<Vec<_>>()
    };
    let have_claims = claims(before) || claims(after);
    checks(before) == checks(after) && (!have_claims || others(before) == others(after))
}

/// Proves the new version from `stand`. Faults that the running version has from there as well are
/// no reason to refuse it, unless they are grave.
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

/// Proves the plan from the marking after a move. Warnings that the marking before it has as well
/// are no reason to refuse the move; errors are.
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

/// Returns the faults that the proof finds from `stand` on. A transition that never fires from
/// there is none: the mission may be past it.
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

/// Whether a finding refuses a version even if the running version has the same fault.
fn is_grave(finding: &Finding) -> bool {
    finding.severity() == Severity::Error || finding.code == Code::NotProven
}

/// Whether `known` has a finding with the same code about the same part of the file.
fn is_known(finding: &Finding, known: &[Finding]) -> bool {
    let about =
        |finding: &Finding| (finding.code, finding.at.as_ref().map(|at| at.text().to_owned()));
    known.iter().any(|other| about(other) == about(finding))
}
