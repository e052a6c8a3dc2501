//! Adds the results of the proof to the findings of the file. A result that only follows from a
//! finding of the file, or from another result, is left out: when that is fixed, it is proven again.

use crate::claim::{Claim, Statement};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::Mission;
use crate::model::Configuration;
use crate::source::Location;

impl Findings {
    /// Adds the results of the proof of the mission that are new and do not follow from others.
    pub fn extend_proven(&mut self, proven: Self, configuration: &Configuration) {
        let mut proven: Vec<_> = proven.into_iter().collect();
        let causes: Vec<_> = self.iter().filter(|it| it.stops_transition).cloned().collect();
        if !causes.is_empty() {
            proven.retain(|result| result.code != Code::NeverFires);
        }
        if causes.iter().any(|cause| cause.code == Code::NoOutput) {
            proven.retain(|result| !matches!(result.code, Code::Standstill | Code::GoalLost));
        }
        if self.iter().any(|finding| finding.code == Code::NoSafePlace)
            && let Some(end) = configuration.mission.as_ref().and_then(Mission::find_unnamed_end)
        {
            let is_there =
                |result: &Finding| result.at.as_ref().is_some_and(|at| at.span == end.name.at.span);
            proven.retain(|result| result.code != Code::Standstill || !is_there(result));
        }
        if let Some(mission) = &configuration.mission {
            merge_after_goal(&mut proven, mission);
        }
        if proven.iter().any(|result| result.code == Code::GoalNeverReached) {
            self.keep_reason(&mut proven, &causes, configuration);
        }
        merge_witnesses(&mut proven);
        self.extend_new(proven);
    }

    /// Leaves out what follows from a goal that is never reached, and points to the reason for that
    /// if it is known.
    fn keep_reason(
        &mut self,
        proven: &mut Vec<Finding>,
        causes: &[Finding],
        configuration: &Configuration,
    ) {
        let goal = configuration.mission.as_ref().and_then(|mission| mission.goal.as_ref());
        let goal = goal.map_or("", |goal| goal.value.as_str());
        proven.retain(|result| match result.code {
            Code::NeverFires => false,
            Code::CheckFails => !waits_for(result, goal),
            _ => true,
        });
        // The transition that would leave a variable's domain does not fire.
        if proven.iter().any(|result| result.code == Code::ValueOutside) {
            proven.retain(|result| result.code != Code::GoalNeverReached);
        } else if let [cause] = causes
            && let Some(at) = &cause.at
        {
            self.retain(|finding| !(finding.stops_transition && finding.code == cause.code));
            for result in proven.iter_mut().filter(|it| it.code == Code::GoalNeverReached) {
                result.related.push((at.clone(), cause.message.clone()));
                result.remedy.clone_from(&cause.remedy);
            }
        }
    }
}

/// Merges transitions that never fire because they lead on from the goal, where the mission is over:
/// probably another place was meant. If checks fail that wait for something, which is an error, the
/// first of them is kept, with this reason.
fn merge_after_goal(proven: &mut Vec<Finding>, mission: &Mission) {
    let Some(goal) = &mission.goal else { return };
    let leads_on = |result: &Finding| {
        let at = result.at.as_ref().filter(|_| result.code == Code::NeverFires)?;
        mission.transitions.iter().find(|transition| {
            transition.name.at.span == at.span
                && transition.inputs().any(|arc| arc.place.value == goal.value)
        })
    };
    let Some(first) = proven.iter().find_map(leads_on) else { return };
    let name = first.name.value.clone();
    let reason = format!(
        "{name} never fires: it leads on from {0}, the goal, and the mission is over when {0} is \
         marked",
        goal.value
    );
    let remedy = "name another place as goal, or remove what leads on from it";
    let mut related: Vec<(Location, String)> = vec![(goal.at.clone(), "the goal".into())];
    let (ends, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|result| leads_on(result).is_some());
    let (checks, others): (Vec<_>, Vec<_>) =
        others.into_iter().partition(|result| find_awaited(result).is_some());
    let mut ends = ends.into_iter();
    let kept = match (checks.into_iter().next(), ends.next()) {
        (Some(check), end) => {
            related.extend(end.and_then(|end| end.at).map(|at| (at, reason)));
            Some(check)
        }
        (None, end) => end.map(|end| Finding { message: reason, ..end }),
    };
    let label = |at| (at, "nor does this one ever fire".to_owned());
    related.extend(ends.filter_map(|end| end.at).map(label));
    *proven = others;
    proven.extend(kept.map(|mut kept| {
        kept.remedy = remedy.into();
        kept.related.extend(related);
        kept
    }));
}

/// Merges results that the same firings show into one: the first check that fails, with the remedy of
/// the others. A mission that stands still makes its checks fail, for example.
fn merge_witnesses(proven: &mut Vec<Finding>) {
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
        let is_shown = matches!(
            other.code,
            Code::Standstill | Code::GoalLost | Code::TwoTokens | Code::MarkedTogether
        );
        match merged.iter_mut().find(|check| is_shown && check.trace == other.trace) {
            // The proof may find a meeting twice.
            Some(check) if check.related.iter().any(|(_, label)| *label == other.message) => {}
            Some(check) => {
                check.remedy = other.remedy;
                check.related.extend(other.at.map(|at| (at, other.message)));
                check.related.extend(other.related);
            }
            None => proven.push(other),
        }
    }
    proven.extend(merged);
}

/// Returns whether the check that fails waits for the place.
fn waits_for(result: &Finding, place: &str) -> bool {
    let is_it = |claim: Claim| claim.names().iter().any(|(_, name)| name.as_str() == place);
    find_awaited(result).is_some_and(is_it)
}

/// Returns the check that fails, if it waits for something to happen.
fn find_awaited(result: &Finding) -> Option<Claim> {
    let at = result.at.as_ref().filter(|_| result.code == Code::CheckFails)?;
    let mut of_xml = Findings::default();
    let claim = Claim::parse(&crate::start_tag::unescape(at, &mut of_xml)).ok()?;
    let is_awaited = matches!(
        claim.statement,
        Statement::Reachable(_)
            | Statement::AlwaysReachable(_)
            | Statement::Eventually(_)
            | Statement::LeadsTo(..)
            | Statement::Duration { .. }
    );
    is_awaited.then_some(claim)
}
