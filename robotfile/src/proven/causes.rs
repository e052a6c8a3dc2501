//! Checks that fail because of something that is a finding already: a place that nothing leads to, a
//! transition that never fires, a sub-mission without the place that it begins in. The check is the
//! error, so it is kept, with that reason and its remedy.

use super::awaited::find_awaited;
use super::merging;
use crate::claim::Statement;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::Guard;
use crate::mission::{ArcKind, Mission, Transition};

impl Findings {
    /// Explains checks that fail because the mission does not continue, by the only finding of the
    /// file that stops a transition.
    pub(super) fn explain_checks(&mut self, proven: &mut Vec<Finding>) {
        let stopped: Vec<_> = self.iter().filter(|it| it.stops_transition).cloned().collect();
        let [cause] = stopped.as_slice() else { return };
        let of_cause = |check: &Finding| {
            let path =
                |finding: &Finding| finding.at.as_ref().map(|at| at.source.path().to_path_buf());
            path(check) == path(cause)
        };
        let (mut checks, others): (Vec<_>, Vec<_>) =
            std::mem::take(proven).into_iter().partition(|result| find_awaited(result).is_some());
        *proven = others;
        if checks.is_empty() {
            return;
        }
        checks.sort_by_key(|check| !of_cause(check));
        self.retain(|finding| !finding.stops_transition);
        proven.retain(|result| !matches!(result.code, Code::Standstill | Code::GoalLost));
        proven.extend(explain_first(checks, cause.clone()));
    }
}

impl Findings {
    /// Explains checks that fail because firings repeat forever, by a variable that nothing sets and
    /// that the guard of one of them compares.
    pub(super) fn explain_by_unset(&mut self, proven: &mut Vec<Finding>, mission: &Mission) {
        let mut unset = self.iter().filter(|finding| finding.code == Code::NothingSets);
        let (Some(cause), None) = (unset.next().cloned(), unset.next()) else { return };
        let name = cause.at.as_ref().map_or("", |at| at.text());
        let compares = |firing: &String| {
            let mut written = mission.transitions.iter().filter(|it| it.name.value == *firing);
            let mut guards =
                written.by_ref().filter_map(|it| Guard::parse(&it.when.as_ref()?.value).ok());
            guards.any(|guard| guard.names().iter().any(|it| it.as_str() == name))
        };
        let is_endless = |result: &Finding| {
            let circle = result.trace.iter().flat_map(|trace| &trace.circle);
            find_awaited(result).is_some() && circle.into_iter().any(compares)
        };
        let (checks, others): (Vec<_>, Vec<_>) =
            std::mem::take(proven).into_iter().partition(|result| is_endless(result));
        *proven = others;
        if !checks.is_empty() {
            self.retain(|finding| finding.code != Code::NothingSets);
            proven.extend(explain_first(checks, cause));
        }
    }
}

impl Findings {
    /// Explains what a sub-mission without a safe place does, which stands still in one of its places.
    pub(super) fn explain_by_inner_end(&mut self, proven: &mut Vec<Finding>, mission: &Mission) {
        let is_inner = |finding: &&Finding| {
            finding.code == Code::NoSafePlace
                && !finding.at.as_ref().is_some_and(|at| at.is_at(&mission.at))
        };
        let Some(cause) = self.iter().find(is_inner).cloned() else { return };
        let end = cause.related.first().map(|(at, _)| format!(".{}", at.text()));
        let is_there = |result: &Finding| {
            end.as_ref().is_some_and(|end| {
                let mut words = result.message.split([' ', ',', ';']);
                words.any(|word| word.ends_with(end))
            })
        };
        let (following, others): (Vec<_>, Vec<_>) =
            std::mem::take(proven).into_iter().partition(|result| {
                let stands = matches!(result.code, Code::Standstill | Code::GoalLost);
                (stands || find_awaited(result).is_some()) && is_there(result)
            });
        *proven = others;
        let checks = following.into_iter().filter(|it| it.code == Code::CheckFails);
        let first = explain_first(checks.collect(), cause.clone());
        if first.is_some() {
            let at = cause.at.as_ref();
            self.retain(|finding| {
                finding.code != Code::NoSafePlace
                    || !finding.at.as_ref().zip(at).is_some_and(|(one, other)| one.is_at(other))
            });
        }
        proven.extend(first);
    }

    /// Explains checks that fail by a goal and a safe place that seem exchanged, or that are one place.
    pub(super) fn explain_by_exchange(&mut self, proven: &mut Vec<Finding>, mission: &Mission) {
        let is_check = |result: &Finding| result.code == Code::CheckFails;
        self.explain_by(Code::GoalExchanged, proven, is_check);
        let is_shared = |finding: &Finding| {
            let at = finding.at.as_ref().filter(|_| finding.code == Code::NoSafePlace);
            at.zip(mission.safe.as_ref()).is_some_and(|(at, safe)| at.is_at(&safe.at))
        };
        if self.iter().any(is_shared) {
            self.explain_by(Code::NoSafePlace, proven, is_check);
        }
    }

    /// Explains checks that fail because a transition fires that takes tokens from no place.
    pub(super) fn explain_by_missing_input(&mut self, proven: &mut Vec<Finding>) {
        let all = self.iter().filter(|finding| finding.code == Code::NoInput);
        let names: Vec<_> = all.filter_map(|it| Some(it.at.as_ref()?.text().to_owned())).collect();
        let [name] = names.as_slice() else { return };
        let fires = |result: &Finding| {
            let mut firings = result.trace.iter().flat_map(|trace| &trace.firings);
            result.code == Code::CheckFails && firings.any(|firing| firing == name)
        };
        self.explain_by(Code::NoInput, proven, fires);
    }

    /// Explains checks that fail, and transitions that never fire, by a transition that marks the goal
    /// while components still work.
    pub(super) fn explain_by_early_end(&mut self, proven: &mut Vec<Finding>) {
        if self.iter().any(|finding| finding.code == Code::EndsTooSoon) {
            proven.retain(|result| result.code != Code::NeverFires);
        }
        self.explain_by(Code::EndsTooSoon, proven, |result| find_awaited(result).is_some());
    }

    /// Explains results by the first finding of a code.
    fn explain_by(
        &mut self,
        code: Code,
        proven: &mut Vec<Finding>,
        follows: impl Fn(&Finding) -> bool,
    ) {
        let Some(cause) = self.iter().find(|finding| finding.code == code).cloned() else { return };
        let (following, others): (Vec<_>, Vec<_>) =
            std::mem::take(proven).into_iter().partition(|result| follows(result));
        *proven = others;
        if let Some(first) = explain_first(following, cause) {
            self.retain(|finding| finding.code != code);
            proven.push(first);
        }
    }
}

/// Explains checks that a transition fires by the finding that it never fires.
pub(super) fn explain_never_fired(proven: &mut Vec<Finding>) {
    let mut at = 0;
    while at < proven.len() {
        let Some(Statement::Fires(name)) = find_awaited(&proven[at]).map(|it| it.statement) else {
            at += 1;
            continue;
        };
        let begin = format!("{} never fires", name.as_str());
        let is_dead = |it: &Finding| it.code == Code::NeverFires && it.message.starts_with(&begin);
        let Some(dead) = proven.iter().position(is_dead) else {
            at += 1;
            continue;
        };
        let dead = proven.remove(dead);
        at -= usize::from(at >= proven.len() || find_awaited(&proven[at]).is_none());
        let check = &mut proven[at];
        check.remedy = dead.remedy;
        check.related.extend(dead.at.map(|at| (at, dead.message)));
        check.related.extend(dead.related);
        at += 1;
    }
}

/// Returns the first of the checks with its reason, and the others as further locations.
fn explain_first(checks: Vec<Finding>, cause: Finding) -> Option<Finding> {
    let mut checks = checks.into_iter();
    let mut first = checks.next()?;
    first.move_to_cause(cause);
    first.related.extend(merging::label_checks(checks));
    Some(first)
}

/// Explains checks that fail because the same firings continue forever, by a transition that would leave
/// them and never fires.
pub(super) fn explain_endless(proven: &mut Vec<Finding>, mission: &Mission) {
    let is_dead = |result: &&Finding| result.code == Code::NeverFires;
    let mut dead = proven.iter().filter(is_dead);
    let (Some(cause), None) = (dead.next().cloned(), dead.next()) else { return };
    let find =
        |is_it: &dyn Fn(&Transition) -> bool| mission.transitions.iter().find(|it| is_it(it));
    let at = |transition: &Transition| {
        cause.at.as_ref().is_some_and(|at| at.span == transition.name.at.span)
    };
    let Some(left) = find(&at) else { return };
    let shares_place = |firing: &String| {
        let fired = find(&|it: &Transition| it.name.value == *firing);
        fired.is_some_and(|fired| {
            fired.inputs().any(|arc| left.inputs().any(|it| it.place.value == arc.place.value))
        })
    };
    let is_endless = |result: &Finding| {
        let circle = result.trace.iter().flat_map(|trace| &trace.circle);
        find_awaited(result).is_some() && circle.into_iter().any(shares_place)
    };
    let (checks, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|result| is_endless(result));
    *proven = others;
    if !checks.is_empty() {
        proven.retain(|result| result.code != Code::NeverFires);
        proven.extend(explain_first(checks, cause));
    }
}

/// Explains checks that fail by a transition that leads on from the safe place, where the mission is
/// over: it was probably to lead there.
pub(super) fn explain_after_safe(proven: &mut Vec<Finding>, mission: &Mission) {
    let Some(safe) = &mission.safe else { return };
    let is_after = |result: &Finding| {
        let mut transitions = mission.transitions.iter();
        let is_it = |it: &&Transition| {
            result.at.as_ref().is_some_and(|at| at.span == it.name.at.span)
                && it.inputs().any(|arc| arc.place.value == safe.value)
        };
        result.code == Code::NeverFires && transitions.any(|it| is_it(&it))
    };
    let Some(cause) = proven.iter().find(|it| is_after(it)).cloned() else { return };
    let (checks, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|result| find_awaited(result).is_some());
    *proven = others;
    if !checks.is_empty() {
        proven.retain(|result| !is_after(result));
        proven.extend(explain_first(checks, cause));
    }
}

/// Explains what a sub-mission does that leads to a place but begins at the start, where transitions
/// lead to a place of which nothing takes the tokens: it was probably to begin there.
pub(super) fn explain_missing_entrance(proven: &mut Vec<Finding>, mission: &Mission) {
    let mut submissions = mission.submissions.iter();
    let Some(apart) = submissions.find(|it| it.enter.is_none() && it.leave.is_some()) else {
        return;
    };
    let Some(entrance) = find_dead_end(mission) else { return };
    let follows = |result: &Finding| {
        use Code::{
            CheckFails, GoalLost, GoalNeverReached, MarkedTogether, NeverFires, Standstill,
            TwoTokens, ValueOutside, ValuesContradict,
        };
        matches!(
            result.code,
            CheckFails
                | GoalLost
                | GoalNeverReached
                | MarkedTogether
                | NeverFires
                | Standstill
                | TwoTokens
                | ValueOutside
                | ValuesContradict
        )
    };
    let (mut following, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(follows);
    *proven = others;
    following.sort_by_key(|result| (result.severity(), find_awaited(result).is_none()));
    let mut following = following.into_iter();
    let Some(mut first) = following.next() else { return };
    let file = &apart.file;
    first.related.push((
        file.at.clone(),
        format!("{} has no in=\"…\", so it begins at the start", file.value),
    ));
    first.related.extend(merging::label_checks(following.filter(|it| find_awaited(it).is_some())));
    first.remedy = format!(
        "name the place that enters the sub-mission, in=\"{entrance}\", from which nothing leads on"
    );
    proven.push(first);
}

/// Returns the first place without components that a transition leads to and from which nothing
/// leads on, apart from goal and safe place.
fn find_dead_end(mission: &Mission) -> Option<&str> {
    let takes = |transition: &Transition, place: &str| {
        transition.arcs.iter().any(|arc| arc.kind != ArcKind::Put && arc.place.value == place)
    };
    let names = mission.places.iter().map(|place| place.name.value.as_str());
    let mut names = names.filter(|name| {
        let ends = mission.goal.iter().chain(&mission.safe);
        let entered = mission.submissions.iter().filter_map(|it| it.enter.as_ref());
        !ends.chain(entered).any(|end| end.value == *name)
    });
    names.find(|name| {
        let mut moves = mission.transitions.iter();
        moves.clone().any(|it| it.outputs().any(|arc| arc.place.value == *name))
            && !moves.any(|it| takes(it, name))
    })
}
