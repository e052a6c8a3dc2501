//! A firing that would take a variable out of its domain: it does not happen, and the mission goes to
//! its safe place. What the proof shows after it, and guards that the domain decides, follow from it.

use super::awaited::find_awaited;
use super::merging;
use crate::claim::Claim;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::Guard;
use crate::mission::Mission;
use crate::source::Location;

/// The end of a firing's name in a trace, if it would take a variable out of its domain.
const OUTSIDE: &str = "/outside";

impl Findings {
    /// Merges what follows from a value outside of a variable's domain.
    pub(super) fn merge_outside(&mut self, proven: &mut Vec<Finding>, mission: &Mission) {
        let Some(first) = proven.iter().position(|it| it.code == Code::ValueOutside) else {
            return;
        };
        let mut cause = proven.remove(first);
        // What no sequence of firings contains may come after a firing that does not happen.
        let is_never = |it: &Finding| it.trace.is_none() && find_awaited(it).is_some();
        let (after, others): (Vec<_>, Vec<_>) = std::mem::take(proven)
            .into_iter()
            .partition(|result| is_after_outside(result) || is_never(result));
        *proven = others;
        let checks = after.into_iter().filter(|result| result.code == Code::CheckFails);
        cause.related.extend(merging::label_checks(checks));
        if let Some(variable) = cause.at.as_ref().and_then(|at| find_variable(mission, at)) {
            let (same, others): (Vec<_>, Vec<_>) = std::mem::take(proven)
                .into_iter()
                .partition(|result| depends_on(result, variable, mission));
            *proven = others;
            let labels = same.into_iter().filter_map(|it| Some((it.at?, it.message)));
            cause.related.extend(labels);
            let is_decided = |finding: &Finding| {
                finding.code == Code::GuardConstant
                    && finding.at.as_ref().is_some_and(|at| compares(mission, at, variable))
            };
            let decided = self.iter().filter(|it| is_decided(it));
            let labels = decided.filter_map(|it| Some((it.at.clone()?, it.message.clone())));
            cause.related.extend(labels);
            self.retain(|finding| !is_decided(finding));
        }
        proven.insert(0, cause);
    }

    /// Returns the findings about a variable that nothing sets, where a transition never fires
    /// whose guard compares it.
    pub(super) fn find_unset(&self, proven: &[Finding], mission: &Mission) -> Vec<Finding> {
        let dead = proven.iter().filter(|it| it.code == Code::NeverFires);
        let dead: Vec<_> = dead.filter_map(|it| it.at.as_ref()).collect();
        let transitions = mission.transitions.iter();
        let guards: Vec<_> = transitions
            .filter(|it| dead.iter().any(|at| at.span == it.name.at.span))
            .filter_map(|it| it.when.as_ref())
            .collect();
        let stops = |finding: &&Finding| {
            let name = finding.at.as_ref().map_or("", Location::text);
            finding.code == Code::NothingSets
                && guards.iter().any(|when| compares(mission, &when.at, name))
        };
        self.iter().filter(stops).cloned().collect()
    }
}

fn is_after_outside(result: &Finding) -> bool {
    let mut firings = result.trace.iter().flat_map(|trace| &trace.firings);
    result.code != Code::ValueOutside && firings.any(|firing| firing.ends_with(OUTSIDE))
}

/// Returns whether the result only shows that the variable leaves its domain, too: another transition
/// would set it so, or one whose guard compares it never fires.
fn depends_on(result: &Finding, variable: &str, mission: &Mission) -> bool {
    let Some(at) = &result.at else { return false };
    match result.code {
        Code::ValueOutside => find_variable(mission, at) == Some(variable),
        Code::NeverFires => {
            let mut transitions = mission.transitions.iter();
            let written = transitions.find(|it| it.name.at.span == at.span);
            let when = written.and_then(|it| it.when.as_ref());
            when.is_some_and(|when| compares(mission, &when.at, variable))
        }
        _ => false,
    }
}

/// Returns the variable that is set by the text at this location.
fn find_variable<'a>(mission: &'a Mission, at: &Location) -> Option<&'a str> {
    let mut sets = mission.transitions.iter().flat_map(|transition| &transition.sets);
    let set = sets.find(|set| set.value.at.contains(at))?;
    Some(&set.variable.value)
}

/// Returns whether the guard at this location names the variable.
fn compares(mission: &Mission, at: &Location, variable: &str) -> bool {
    let names_it = |claim: Claim| claim.names().iter().any(|(_, name)| name.as_str() == variable);
    let in_check = mission
        .checks
        .iter()
        .any(|check| check.at.contains(at) && Claim::parse(&check.value).is_ok_and(names_it));
    let mut guards = mission.transitions.iter().flat_map(|transition| &transition.when);
    in_check
        || guards.any(|when| {
            when.at.contains(at)
                && Guard::parse(&when.value)
                    .is_ok_and(|guard| guard.names().iter().any(|name| name.as_str() == variable))
        })
}
