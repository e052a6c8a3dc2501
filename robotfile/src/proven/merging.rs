//! Results of one fault: shown by the same firings, by firings that end alike, or by a check that
//! asks for more than another one that fails.

use super::awaited::{find_awaited, read_claim};
use crate::claim::{Formula, Relation, Statement};
use crate::code::Code;
use crate::finding::{Finding, Severity};
use crate::findings::Findings;
use crate::mission::Mission;
use crate::source::Location;

/// Returns the locations of further checks that fail, with a label.
pub(super) fn label_checks(
    checks: impl Iterator<Item = Finding>,
) -> impl Iterator<Item = (Location, String)> {
    checks.filter_map(|check| check.at).map(|at| (at, "this check fails, too".to_owned()))
}

/// Merges results that the same firings show into one: the first check that fails, at the place that
/// the others name. A second token in a place makes checks fail, for example.
pub(super) fn merge_witnesses(proven: &mut Vec<Finding>) {
    let is_check = |result: &Finding| result.code == Code::CheckFails && result.trace.is_some();
    let (checks, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|result| is_check(result));
    let mut merged: Vec<Finding> = Vec::new();
    for check in checks {
        match merged.iter_mut().find(|first| first.trace == check.trace) {
            Some(first) => {
                let label = "this check fails by the same firings".to_owned();
                first.related.extend(check.at.map(|at| (at, label)));
            }
            None => merged.push(check),
        }
    }
    for other in others {
        let is_shown = has_too_many_tokens(&other);
        match merged.iter_mut().find(|check| is_shown && check.trace == other.trace) {
            // The proof may find a meeting twice.
            Some(check) if check.related.iter().any(|(_, label)| *label == other.message) => {}
            Some(check) if check.at.as_ref().and_then(read_claim).is_some() => {
                check.move_to_cause(other);
            }
            Some(check) => {
                check.related.extend(other.at.map(|at| (at, other.message)));
                check.related.extend(other.related);
            }
            None => proven.push(other),
        }
    }
    proven.extend(merged);
}

/// Merges places that hold two tokens, or that must not be marked together, after firings that end
/// with the same one: that one fires too early, or puts too many tokens.
pub(super) fn merge_last_firings(proven: &mut Vec<Finding>) {
    let mut merged: Vec<Finding> = Vec::new();
    for result in std::mem::take(proven) {
        let same = merged.iter_mut().find(|first| {
            let (last, of_first) = (find_last_firing(&result), find_last_firing(first));
            last.is_some() && last == of_first
        });
        match same {
            Some(first) => {
                first.related.extend(result.at.map(|at| (at, result.message)));
                first.related.extend(result.related);
            }
            None => merged.push(result),
        }
    }
    *proven = merged;
}

/// Returns the last firing that leads to too many tokens.
fn find_last_firing(result: &Finding) -> Option<&String> {
    let trace = result.trace.as_ref().filter(|_| has_too_many_tokens(result))?;
    trace.firings.last()
}

fn has_too_many_tokens(result: &Finding) -> bool {
    matches!(result.code, Code::TwoTokens | Code::MarkedTogether)
}

/// Merges checks that ask for more than another one that fails: what cannot always be reached does
/// not always happen, and has no longest time.
pub(super) fn merge_stronger_claims(proven: &mut Vec<Finding>) {
    let mut merged: Vec<Finding> = Vec::new();
    let mut claims: Vec<(usize, u8, Formula)> = Vec::new();
    let (mut checks, others): (Vec<_>, Vec<_>) = std::mem::take(proven)
        .into_iter()
        .partition(|result| find_awaited_formula(result).is_some());
    // Those that ask for less come first; among equals, the order of the file stays.
    checks.sort_by_key(|result| find_awaited_formula(result).map(|(strength, _)| strength));
    for check in checks {
        let Some((strength, formula)) = find_awaited_formula(&check) else { continue };
        let weaker = claims.iter().find(|(_, other, of)| *other < strength && *of == formula);
        match weaker {
            Some((first, ..)) => merged[*first].related.extend(label_checks([check].into_iter())),
            None => {
                claims.push((merged.len(), strength, formula));
                merged.push(check);
            }
        }
    }
    *proven = others;
    proven.extend(merged);
}

/// Returns what a check that fails waits for, and how much it asks for: a check fails if one of the
/// same formula fails that asks for less.
fn find_awaited_formula(result: &Finding) -> Option<(u8, Formula)> {
    let at = result.at.as_ref().filter(|_| result.code == Code::CheckFails)?;
    match read_claim(at)?.statement {
        Statement::Reachable(formula) => Some((0, formula)),
        Statement::AlwaysReachable(formula) => Some((1, formula)),
        Statement::Eventually(formula) => Some((2, formula)),
        Statement::Duration { until, relation: Relation::Less | Relation::LessOrEqual, .. } => {
            Some((3, until))
        }
        _ => None,
    }
}

/// Merges the checks that cannot be decided, or that a place is bounded, with the place that fills
/// without end.
pub(super) fn merge_filling(proven: &mut Vec<Finding>) {
    let Some(at) = proven.iter().position(|it| it.code == Code::FillsWithoutEnd) else { return };
    let filling = proven.remove(at);
    let place = filling.at.as_ref().map_or("", Location::text).to_owned();
    let is_bound = |result: &Finding| {
        let claim = result.at.as_ref().filter(|_| result.code == Code::CheckFails);
        claim.and_then(read_claim).is_some_and(
            |claim| matches!(claim.statement, Statement::Bounded(name, _) if name.as_str() == place),
        )
    };
    let follows = |result: &Finding| result.code == Code::CheckUndecided || is_bound(result);
    let (mut following, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(follows);
    *proven = others;
    let kept = match following.iter().position(is_bound) {
        Some(at) => {
            let mut bound = following.remove(at);
            bound.remedy.clone_from(&filling.remedy);
            bound.merge_place(filling);
            bound
        }
        None => filling,
    };
    proven.push(following.into_iter().fold(kept, |mut kept, other| {
        kept.merge_place(other);
        kept
    }));
}

/// Merges the checks that wait for something with the marking in which the mission stands still, or
/// from which it reaches no end: it never comes to what they wait for. A check that fails is an error,
/// so the finding is one, at the place where the mission is stuck.
pub(super) fn merge_stuck(proven: &mut Vec<Finding>) {
    let is_stuck = |result: &Finding| matches!(result.code, Code::Standstill | Code::GoalLost);
    let Some(at) = proven.iter().position(is_stuck) else { return };
    let stuck = proven.remove(at);
    let (waiting, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|it| find_awaited(it).is_some());
    *proven = others;
    let mut waiting = waiting.into_iter();
    let Some(mut first) = waiting.next() else { return proven.push(stuck) };
    first.trace.clone_from(&stuck.trace);
    first.move_to_cause(stuck);
    first.related.extend(label_checks(waiting));
    proven.push(first);
}

/// Merges checks that wait for something into the first: what keeps the mission from its end makes most
/// of them fail.
pub(super) fn merge_awaiting(proven: &mut Vec<Finding>) {
    let (awaiting, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|it| find_awaited(it).is_some());
    *proven = others;
    let mut awaiting = awaiting.into_iter();
    let Some(mut first) = awaiting.next() else { return };
    first.related.extend(label_checks(awaiting));
    proven.push(first);
}

/// Merges what follows from a second token in a place, such as one from a second initial place, into
/// one finding: the first error, or else the second token itself.
pub(super) fn merge_tokens(proven: &mut Vec<Finding>, mission: Option<&Mission>) {
    if !proven.iter().any(|result| result.code == Code::TwoTokens) {
        return;
    }
    let follows = |result: &Finding| {
        has_too_many_tokens(result)
            || matches!(
                result.code,
                Code::ValuesContradict
                    | Code::ValueOutside
                    | Code::CheckFails
                    | Code::CheckUndecided
                    | Code::Tie
            )
    };
    let (mut merged, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(follows);
    *proven = others;
    merged.sort_by_key(|result| match (result.severity(), result.code) {
        (Severity::Error, _) => 0,
        (_, Code::TwoTokens) => 1,
        _ => 2,
    });
    let mut merged = merged.into_iter();
    let Some(mut first) = merged.next() else { return };
    for other in merged {
        if other.code == Code::TwoTokens {
            first.remedy.clone_from(&other.remedy);
        }
        first.merge_place(other);
    }
    let initial = mission.iter().flat_map(|mission| &mission.places);
    let initial: Vec<_> =
        initial.filter(|place| place.initial > 0).map(|place| place.name.value.as_str()).collect();
    if initial.len() > 1 {
        let initial = initial.join(" and ");
        first.remedy =
            format!("the mission begins in {initial}: is that meant? If so, {}", first.remedy);
    }
    proven.push(first);
}

/// Whether the transition that is named at `at` has a guard in which one of the locations lies.
fn has_guard_in(mission: Option<&Mission>, at: &Location, inner: &[Location]) -> bool {
    let mut transitions = mission.iter().flat_map(|mission| &mission.transitions);
    let written = transitions.find(|it| it.name.at.is_at(at));
    written
        .and_then(|it| it.when.as_ref())
        .is_some_and(|when| inner.iter().any(|constant| when.at.contains(constant)))
}

/// Whether an attribute of a place or a transition is without effect.
fn is_without_effect_in_mission(finding: &Finding) -> bool {
    let Some(at) = finding.at.as_ref().filter(|_| finding.code == Code::NoEffect) else {
        return false;
    };
    let before = at.source.text().get(..at.span.start()).unwrap_or_default();
    let element = before.rsplit('<').next().unwrap_or_default();
    element.starts_with("transition") || element.starts_with("place")
}

/// Merges the transitions that never fire because a variable has the same values wherever they could:
/// one of their guards, or the value with which the variable begins, is wrong.
pub(super) fn merge_same_values(proven: &mut Vec<Finding>, mission: &Mission) {
    let values = |finding: &Finding| {
        let message = finding.message.as_str();
        let (_, values) = message.split_once(", because ")?;
        let values = values.strip_suffix(" there").filter(|it| it.contains(" is "))?;
        Some(values.to_owned()).filter(|_| finding.code == Code::NeverFires)
    };
    let mut merged: Vec<Finding> = Vec::new();
    for result in std::mem::take(proven) {
        let same = merged
            .iter_mut()
            .find(|first| values(&result).is_some_and(|own| values(first).as_ref() == Some(&own)));
        match same {
            Some(first) => first.merge_place(result),
            None => merged.push(result),
        }
    }
    for first in &mut merged {
        let Some(values) = values(first).filter(|_| first.related.len() > 1) else { continue };
        let (name, value) = values.split_once(" is ").unwrap_or_default();
        let variable = mission.variables.iter().find(|it| it.name.value == name);
        let Some(initial) = variable.and_then(|it| it.initial.as_ref()) else { continue };
        if initial.value.to_string() == value {
            first.related.push((initial.at.clone(), format!("{name} begins with {value}")));
            first.remedy = first.remedy.replace(", or let ", ", let ");
            first.remedy += ", or let it begin with another value";
        }
    }
    *proven = merged;
}

/// Merges the errors that tokens cause with a goal that is never reached because they went elsewhere.
pub(super) fn merge_token_faults(proven: &mut Vec<Finding>) {
    let (following, mut others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(is_token_fault);
    match others.iter_mut().find(|result| result.code == Code::GoalNeverReached) {
        Some(never) => following.into_iter().for_each(|other| never.merge_place(other)),
        None => others.extend(following),
    }
    *proven = others;
}

fn is_token_fault(result: &Finding) -> bool {
    let code = result.code;
    has_too_many_tokens(result)
        || matches!(code, Code::ValueOutside | Code::CheckFails | Code::FillsWithoutEnd)
}

impl Findings {
    /// Merges a transition that never fires, because another one always fires first, with too many
    /// tokens, or a check that fails, to which the firing of that other one leads: it lacks a condition
    /// or a place.
    pub(super) fn merge_preempted(&mut self, proven: &mut [Finding]) {
        let is_shown = |it: &&mut Finding| has_too_many_tokens(it) || it.code == Code::CheckFails;
        for result in proven.iter_mut().filter(is_shown) {
            let Some(trace) = &result.trace else { continue };
            let is_fired = |finding: &Finding| {
                finding.code == Code::NeverFires
                    && finding
                        .related
                        .iter()
                        .any(|(other, _)| trace.firings.iter().any(|it| it == other.text()))
            };
            let preempted: Vec<_> = self.iter().filter(|it| is_fired(it)).cloned().collect();
            self.retain(|finding| !is_fired(finding));
            for finding in preempted {
                if result.at.as_ref().and_then(read_claim).is_some() {
                    result.move_to_cause(finding);
                    continue;
                }
                result.related.extend(finding.at.map(|at| (at, finding.message)));
                result.related.extend(finding.related);
            }
        }
    }

    /// Merges checks that fail with the only warning about the mission: it is probably the reason, and
    /// its remedy is the one to begin with.
    pub(super) fn merge_only_fault(&mut self, proven: &mut [Finding]) {
        let is_fault = |finding: &&Finding| finding.severity() != Severity::Note;
        let mut faults = self.iter().filter(is_fault);
        let (Some(cause), None) = (faults.next().cloned(), faults.next()) else { return };
        let is_of_mission =
            cause.code.as_str().starts_with("W02") || is_without_effect_in_mission(&cause);
        let mut results = proven.iter_mut().filter(|it| it.severity() != Severity::Note);
        let (Some(check), None) = (results.next(), results.next()) else { return };
        let is_moved =
            check.code == Code::CheckFails && check.at.as_ref().and_then(read_claim).is_none();
        if !is_of_mission || (find_awaited(check).is_none() && !is_moved) {
            return;
        }
        check.move_to_cause(cause.clone());
        let span = |finding: &Finding| finding.at.as_ref().map(|at| at.span);
        self.retain(|finding| finding.code != cause.code || span(finding) != span(&cause));
    }

    /// Merges the errors that tokens cause with the only place that no transition leads to: they were
    /// probably to go there.
    pub(super) fn merge_unreached(&mut self, proven: &mut Vec<Finding>) {
        let mut unreached = self.iter().filter(|finding| finding.code == Code::UnreachablePlace);
        let (Some(cause), None) = (unreached.next().cloned(), unreached.next()) else { return };
        let (mut following, others): (Vec<_>, Vec<_>) =
            std::mem::take(proven).into_iter().partition(is_token_fault);
        *proven = others;
        following.sort_by_key(Finding::severity);
        let mut following = following.into_iter();
        let Some(mut first) = following.next() else { return };
        if first.severity() != Severity::Error {
            proven.push(first);
            proven.extend(following);
            return;
        }
        first.remedy.clone_from(&cause.remedy);
        first.merge_place(cause);
        following.for_each(|other| first.merge_place(other));
        self.retain(|finding| finding.code != Code::UnreachablePlace);
        proven.push(first);
    }

    /// Merges two transitions between which only the order decides with an error that the firing of
    /// one of them leads to: both lack the same condition. If a guard is known to be wrong, that is why
    /// they can fire together.
    pub(super) fn merge_ties(&mut self, proven: &mut Vec<Finding>, mission: Option<&Mission>) {
        let constant = self.iter().filter(|finding| finding.code == Code::GuardConstant);
        let constant: Vec<_> = constant.filter_map(|finding| finding.at.clone()).collect();
        proven.retain(|result| {
            let mut ends = result.at.iter().chain(result.related.iter().map(|(at, _)| at));
            // Nor does one fire whose guard is never true.
            !matches!(result.code, Code::Tie | Code::NeverFires)
                || !ends.any(|at| has_guard_in(mission, at, &constant))
        });
        let (mut ties, mut errors): (Vec<_>, Vec<_>) =
            std::mem::take(proven).into_iter().partition(|result| result.code == Code::Tie);
        let from_file = ties.len();
        ties.extend(self.iter().filter(|finding| finding.code == Code::Tie).cloned());
        let mut merged = Vec::new();
        for (number, tie) in ties.into_iter().enumerate() {
            let ends = || tie.at.iter().chain(tie.related.iter().map(|(at, _)| at));
            let is_cause = |error: &&mut Finding| {
                let mut firings = error.trace.iter().flat_map(|trace| &trace.firings);
                error.severity() == Severity::Error
                    && firings.any(|firing| ends().any(|at| at.text() == firing))
            };
            match errors.iter_mut().find(is_cause) {
                Some(error) => {
                    merged.extend(tie.at.as_ref().map(|at| at.span));
                    error.remedy.clone_from(&tie.remedy);
                    error.merge_place(tie);
                }
                None if number < from_file => errors.push(tie),
                None => {}
            }
        }
        self.retain(|finding| {
            finding.code != Code::Tie
                || !finding.at.as_ref().is_some_and(|at| merged.contains(&at.span))
        });
        *proven = errors;
    }
}
