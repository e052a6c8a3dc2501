//! Finds the single edit of a file with which a mission has no fault: edits are applied to the text
//! one after another, the likeliest first, and the whole is checked and proven again. An edit that
//! was tried is a certain remedy, and its place is that of the mistake.

mod candidates;
mod file_edit;
mod likeness;
#[cfg(test)]
mod tests;

use std::io::{self, ErrorKind};
use std::path::Path;

use armor_plan::Plan;
use armor_robotfile::{
    Code, Configuration, Finding, Findings, Manifests, Override, Reading, Severity, check, read,
};

use crate::proof::ProofEffort;
use crate::prove::prove_and_count;
use candidates::list_edits;
use file_edit::FileEdit;

/// The limits of the search. They count steps and no time, so that a file has the same findings on
/// every host, however busy it is.
const SEARCH_LIMITS: SearchSteps = SearchSteps {
    // A mission of 15 places and 20 transitions has about 1,000 candidates; most are refused by the
    // check alone, in a fraction of a millisecond.
    tries: 1_000,
    proofs: 150,
    // One proof of a mission of 15 places explores about 200.
    states: 300_000,
    // Checking a file again takes about 0.1 s per megabyte.
    bytes: 20 << 20,
};
/// Most edits that a remedy offers. If more are equally likely, it is not known what was meant.
const MAX_NAMED: usize = 3;
/// What a finding is called that is shown at the place of the mistake, and not at its own.
const SHOWN: &str = "here it shows";
/// The beginning of a message at a check, and of the same message at another place.
const THIS_CHECK: &str = "this check ";
const A_CHECK: &str = "a check ";
/// Most states and state classes of one proof: a millisecond or two.
const TRIED_EFFORT: ProofEffort = ProofEffort {
    states: 4_000,
    classes: 4_000,
    has_begun: false,
    skips_notes: true,
    explores_routes: false,
};

/// How a file is checked again after an edit.
pub struct Recheck<'a> {
    /// The values of the command line.
    pub overrides: &'a [Override],
    /// The manifests of all kinds, if they are known.
    pub manifests: Option<&'a Manifests>,
    /// Returns whether the result is no longer wanted, because the files have changed. It must not
    /// depend on the time: the findings would, too.
    pub is_cancelled: &'a dyn Fn() -> bool,
}

/// Steps of a search: those that are left, or those of one try.
#[derive(Clone, Copy, Debug)]
struct SearchSteps {
    /// Edits that are tried.
    tries: usize,
    /// Edits that are proven, each of which explores the states of the mission.
    proofs: usize,
    /// States and state classes that these proofs explore.
    states: u64,
    /// Bytes of the files that are read and checked again.
    bytes: usize,
}

impl SearchSteps {
    fn are_used_up(&self) -> bool {
        self.tries == 0 || self.proofs == 0 || self.states == 0 || self.bytes == 0
    }
}

/// Replaces the faults of a mission by one finding at the edit that removes all of them, if there is
/// such an edit. `reading` has been checked, and the results of the proof have been added.
pub fn explain_by_edit(reading: &mut Reading, recheck: &Recheck<'_>) {
    let Some(configuration) = &reading.configuration else { return };
    let faults: Vec<_> = faults(&reading.findings).cloned().collect();
    if !can_be_tried(&faults) || !recheck.has_only_moves(configuration) {
        return;
    }
    let found = recheck.find_edits(configuration, &faults);
    if (1..=MAX_NAMED).contains(&found.len()) {
        reading.findings.replace_faults(explained(faults, &found));
    }
}

/// The errors and warnings.
fn faults(findings: &Findings) -> impl Iterator<Item = &Finding> {
    findings.iter().filter(|finding| finding.severity() != Severity::Note)
}

/// Whether all faults are about how the tokens of a mission move. Any other fault is at its place
/// already, and hides whether an edit helps.
fn can_be_tried(faults: &[Finding]) -> bool {
    let is_shown = |fault: &Finding| {
        matches!(
            fault.code,
            Code::CheckFails
                | Code::GoalNeverReached
                | Code::Standstill
                | Code::GoalLost
                | Code::TwoTokens
                | Code::MarkedTogether
                | Code::FillsWithoutEnd
                | Code::ValuesContradict
                | Code::NeverFires
                | Code::Tie
                | Code::ReportNeverSent
                | Code::LoopInterrupted
                | Code::FrozenProducer
                | Code::GoalByFailure
                | Code::ChangesNothing
                | Code::EndlessLoop
                | Code::NoOutput
                | Code::UnreachablePlace
                | Code::ValueOutside
        )
    };
    let may_accompany = |fault: &Finding| {
        matches!(fault.code, Code::NoEffect | Code::EndUnawaited | Code::GuardConstant)
    };
    faults.iter().any(is_shown) && faults.iter().all(|it| is_shown(it) || may_accompany(it))
}

impl Recheck<'_> {
    /// The likeliest edits that remove all faults: those that are equally likely.
    fn find_edits(&self, configuration: &Configuration, faults: &[Finding]) -> Vec<FileEdit> {
        let mut edits = list_edits(configuration, faults);
        edits.sort_by_key(|edit| (edit.rank, edit.distance));
        let size: usize = configuration.sources.iter().map(|source| source.text().len()).sum();
        let mut left = SEARCH_LIMITS;
        let mut found: Vec<FileEdit> = Vec::new();
        for edit in edits {
            let is_worse = found.first().is_some_and(|first| first.rank < edit.rank);
            if is_worse || found.len() > MAX_NAMED || left.are_used_up() || (self.is_cancelled)() {
                break;
            }
            // Two reasons may speak for one edit.
            let is_same = |it: &FileEdit| it.at.is_at(&edit.at) && it.result == edit.result;
            if found.iter().any(is_same) {
                continue;
            }
            left.tries -= 1;
            left.bytes = left.bytes.saturating_sub(size);
            if self.removes_faults(configuration, &edit, &mut left) {
                found.push(edit);
            }
        }
        found
    }

    /// Whether the check alone finds nothing but places and transitions that do not fit each other.
    /// What else it finds, such as a transition without a condition, names the mistake already.
    fn has_only_moves(&self, configuration: &Configuration) -> bool {
        let Some(reading) = self.reading_of(configuration, None) else { return false };
        let mut found = faults(&reading.findings);
        // Of two sub-missions in one place, one is too many.
        let is_of_file =
            |it: &Finding| it.at.as_ref().is_some_and(|at| at.text().ends_with(".xml"));
        found.all(|it| {
            (it.code == Code::Tie && !is_of_file(it))
                || matches!(
                    it.code,
                    Code::ReportNeverSent
                        | Code::LoopInterrupted
                        | Code::FrozenProducer
                        | Code::GoalByFailure
                        | Code::ChangesNothing
                        | Code::EndlessLoop
                        | Code::NeverFires
                        | Code::NoOutput
                        | Code::UnreachablePlace
                        | Code::NoEffect
                        | Code::EndUnawaited
                        | Code::GuardConstant
                )
        })
    }

    /// Checks the files again, with an edit. None if they cannot be read.
    fn reading_of(
        &self,
        configuration: &Configuration,
        edit: Option<&FileEdit>,
    ) -> Option<Reading> {
        let main = configuration.sources.first()?;
        let mut loader = |path: &Path| {
            let source = configuration.sources.iter().find(|source| source.path() == path);
            let source = source.ok_or_else(|| io::Error::from(ErrorKind::NotFound))?;
            let text = edit.map_or_else(|| source.text().to_owned(), |edit| edit.text_of(source));
            Ok(text.into_bytes())
        };
        let reading = read(main.path(), &mut loader);
        let is_read = reading.configuration.is_some() && !reading.findings.has_errors();
        is_read.then(|| check(reading, self.overrides, self.manifests))
    }

    /// Checks and proves the files with the edit.
    fn removes_faults(
        &self,
        configuration: &Configuration,
        edit: &FileEdit,
        left: &mut SearchSteps,
    ) -> bool {
        let Some(mut reading) = self.reading_of(configuration, Some(edit)) else { return false };
        if faults(&reading.findings).next().is_some() {
            return false;
        }
        let Some(edited) = &reading.configuration else { return false };
        let Ok(Some(plan)) = Plan::of(edited) else { return false };
        let (proven, explored) = prove_and_count(edited, &plan, TRIED_EFFORT, self.is_cancelled);
        left.proofs -= 1;
        left.states = left.states.saturating_sub(explored);
        reading.findings.extend_proven(proven, edited);
        faults(&reading.findings).next().is_none()
    }
}

/// The one finding: what the faults show, at the likeliest edit.
fn explained(mut faults: Vec<Finding>, found: &[FileEdit]) -> Finding {
    // What the mission does explains why a check fails; the error decides that the file is refused.
    faults.sort_by_key(|fault| match fault.code {
        Code::NoEffect | Code::EndUnawaited => (2, fault.severity()),
        Code::CheckFails => (1, fault.severity()),
        _ => (0, fault.severity()),
    });
    let code = faults.iter().map(|it| (it.severity(), it.code)).min_by_key(|it| it.0);
    let code = code.map_or(Code::CheckFails, |it| it.1);
    let message = faults.first().map_or("", |it| it.message.as_str());
    let at = &found[0].at;
    let mut finding = Finding::new(code, at, message.replacen(THIS_CHECK, A_CHECK, 1));
    for (number, fault) in faults.into_iter().enumerate() {
        let label = if number == 0 { SHOWN.to_owned() } else { fault.message };
        let own = fault.at.map(|at| (at, label));
        for (place, label) in own.into_iter().chain(fault.related) {
            let is_known = finding.related.iter().any(|known| known.0.is_at(&place));
            if !place.is_at(at) && !is_known {
                finding = finding.related(&place, label);
            }
        }
        finding.trace = finding.trace.take().or(fault.trace);
    }
    let offered = found.iter().filter_map(FileEdit::offered);
    finding.remedy(remedy_of(found)).offer(offered)
}

fn remedy_of(found: &[FileEdit]) -> String {
    if let Some((question, instead)) = &found[0].question {
        return format!("{question}: is that meant? If not, {instead}: then everything is proven");
    }
    // Two edits may differ only in how they write the same value.
    let mut words: Vec<_> = found.iter().map(FileEdit::in_words).collect();
    words.dedup();
    let words = words.join(", or ");
    match found[0].is_missing {
        true => format!("is {words} missing? With it, everything is proven"),
        false => format!("did you mean {words}? With it, everything is proven"),
    }
}
