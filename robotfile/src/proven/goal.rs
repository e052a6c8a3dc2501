//! What follows from the place that is the goal: where it is marked, the mission is over.

use std::collections::BTreeSet;

use super::awaited::find_awaited;
use super::merging;
use crate::code::Code;
use crate::finding::Finding;
use crate::mission::{Mission, Submission, Transition};
use crate::source::{Location, Spanned};

/// The end of the message about a goal that is never reached because a start waits.
const ONE_WAITS: &str = "their components exclude each other";

/// Merges transitions that never fire because the mission is over before: they lead on from the
/// goal, or from a place that is marked together with it. Probably another place was meant. If checks
/// fail that wait for something, which is an error, the first of them is kept, with this reason.
pub(super) fn merge_after_goal(proven: &mut Vec<Finding>, mission: &Mission) {
    let Some(goal) = &mission.goal else { return };
    let leads_on = |result: &Finding| {
        let at = result.at.as_ref().filter(|_| result.code == Code::NeverFires)?;
        let enters = |it: &&Submission| {
            it.file.at.is_at(at) && it.enter.as_ref().is_some_and(|it| it.value == goal.value)
        };
        if let Some(entering) = mission.submissions.iter().find(enters) {
            return Some((&entering.file.value, AfterEnd::Goal));
        }
        let transition = mission.transitions.iter().find(|it| it.name.at.is_at(at))?;
        let after = find_place_after_end(transition, mission, &goal.value)?;
        Some((&transition.name.value, after))
    };
    let Some((name, after)) = proven.iter().find_map(leads_on) else { return };
    let goal_name = &goal.value;
    let reason = match after {
        AfterEnd::Goal => format!(
            "{name} never fires: it leads on from {goal_name}, the goal, and the mission is over \
             when {goal_name} is marked"
        ),
        AfterEnd::WithGoal(by) => format!(
            "{name} never fires: {} marks {goal_name}, the goal, too, so the mission is over then",
            by.name.value
        ),
    };
    let mut related: Vec<(Location, String)> = Vec::new();
    let remedy = match after {
        AfterEnd::Goal => {
            related.push((goal.at.clone(), "the goal".into()));
            "name another place as goal, or remove what leads on from it".to_owned()
        }
        AfterEnd::WithGoal(by) => {
            related.push((by.name.at.clone(), "this one ends the mission".into()));
            format!("remove {goal_name} from what {} leads to", by.name.value)
        }
    };
    let (ends, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|result| leads_on(result).is_some());
    let (checks, mut others): (Vec<_>, Vec<_>) =
        others.into_iter().partition(|result| find_awaited(result).is_some());
    others.retain(|result| !matches!(result.code, Code::Standstill | Code::GoalLost));
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
        kept.remedy = remedy;
        kept.related.extend(related);
        kept
    }));
}

/// Why a place is marked only when the mission is over.
enum AfterEnd<'a> {
    /// It is the goal.
    Goal,
    /// Each transition that marks it marks the goal, too; this is the first of them.
    WithGoal(&'a Transition),
}

/// Returns why the mission is over when a place is marked that the transition takes a token from.
fn find_place_after_end<'a>(
    transition: &Transition,
    mission: &'a Mission,
    goal: &str,
) -> Option<AfterEnd<'a>> {
    let mut needed = transition.inputs().chain(transition.reads());
    if needed.any(|arc| arc.place.value == goal) {
        return Some(AfterEnd::Goal);
    }
    transition.inputs().find_map(|arc| {
        let place = &arc.place.value;
        let is_initial = mission.place(place).is_none_or(|it| it.initial > 0);
        let marks = |it: &&Transition, name: &str| it.outputs().any(|arc| arc.place.value == name);
        let mut marking = mission.transitions.iter().filter(|it| marks(it, place)).peekable();
        let first = *marking.peek()?;
        (!is_initial && marking.all(|it| marks(&it, goal))).then_some(AfterEnd::WithGoal(first))
    })
}

/// Merges a mission that is over at its start with the checks that fail because of that. They are
/// errors, so the first of them is kept, with this reason. Returns whether it is over at its start.
pub(super) fn merge_over_at_start(proven: &mut Vec<Finding>) -> bool {
    let Some(at) = proven.iter().position(|result| result.code == Code::OverAtStart) else {
        return false;
    };
    let over = proven.remove(at);
    let (checks, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|result| result.code == Code::CheckFails);
    *proven = others;
    let mut checks = checks.into_iter();
    let kept = match checks.next() {
        None => over,
        Some(mut first) => {
            first.remedy = over.remedy;
            first.related.extend(over.at.map(|at| (at, over.message)));
            first.related.extend(merging::label_checks(checks));
            first
        }
    };
    proven.push(kept);
    true
}

/// Returns the transitions that never fire, for a known reason, and that lead to the goal: those that
/// lead directly to it, or else those that other transitions follow. `whole` is the mission with its
/// sub-missions.
pub(super) fn find_dead_before(
    proven: &[Finding],
    whole: Option<&Mission>,
    goal: &str,
) -> Vec<Finding> {
    let Some(whole) = whole else { return Vec::new() };
    let is_known = |it: &&Finding| it.code == Code::NeverFires && !it.related.is_empty();
    let of_places = |places: &BTreeSet<&str>| -> Vec<Finding> {
        let leads = |at: &Location| {
            let mut written = whole.transitions.iter().filter(|it| it.name.at.is_at(at));
            written.any(|it| it.outputs().any(|arc| places.contains(&*arc.place.value)))
        };
        let dead = proven.iter().filter(is_known);
        dead.filter(|it| it.at.as_ref().is_some_and(leads)).cloned().collect()
    };
    let mut places = BTreeSet::from([goal]);
    let direct = of_places(&places);
    if !direct.is_empty() {
        return direct;
    }
    loop {
        let leading = whole
            .transitions
            .iter()
            .filter(|it| it.outputs().any(|arc| places.contains(&*arc.place.value)));
        let before: BTreeSet<_> =
            leading.flat_map(Transition::inputs).map(|arc| arc.place.value.as_str()).collect();
        let count = places.len();
        places.extend(before);
        if places.len() == count {
            return of_places(&places);
        }
    }
}

/// Merges the checks of the file of a cause, a sub-mission, that wait for something, with the goal
/// that is never reached because of it.
pub(super) fn merge_checks_of(proven: &mut Vec<Finding>, cause: &Location) {
    let is_of_cause = |result: &Finding| {
        let path = result.at.as_ref().map(|at| at.source.path());
        find_awaited(result).is_some() && path == Some(cause.source.path())
    };
    let Some(at) = proven.iter().position(|it| it.code == Code::GoalNeverReached) else { return };
    let mut never = proven.remove(at);
    let (checks, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|result| is_of_cause(result));
    *proven = others;
    never.related.extend(merging::label_checks(checks.into_iter()));
    proven.push(never);
}

/// Merges places of exclusive components that are marked together with a goal that is never reached
/// because one of them waits for the other.
pub(super) fn explain_by_exclusion(proven: &mut Vec<Finding>) {
    // An emergency exit hides that the mission stands still there.
    let are_together = proven.iter().any(|result| result.code == Code::MarkedTogether);
    let waits = |result: &Finding| {
        result.code == Code::GoalNeverReached
            && (are_together || result.message.ends_with(ONE_WAITS))
    };
    let Some(at) = proven.iter().position(waits) else { return };
    let mut never = proven.remove(at);
    let (together, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|it| it.code == Code::MarkedTogether);
    *proven = others;
    if let Some(first) = together.first() {
        never.remedy = format!("{}, or do not declare the components exclusive", first.remedy);
    }
    let more = together.first().map(|first| first.related.clone()).unwrap_or_default();
    let labels = together.into_iter().filter_map(|it| Some((it.at?, it.message)));
    never.related.extend(labels.chain(more));
    proven.push(never);
}

/// Points to a sub-mission that nothing enters and that leads nowhere, as the reason why the goal is
/// never reached, and leaves out the checks that fail and what it does at the start.
pub(super) fn explain_by_submission(proven: &mut Vec<Finding>, mission: &Mission) {
    let mut submissions = mission.submissions.iter();
    let Some(apart) = submissions.find(|it| it.enter.is_none() && it.leave.is_none()) else {
        return;
    };
    let (checks, others): (Vec<_>, Vec<_>) =
        std::mem::take(proven).into_iter().partition(|result| result.code == Code::CheckFails);
    *proven = others;
    proven.retain(|result| !matches!(result.code, Code::MarkedTogether | Code::TwoTokens));
    let Some(never) = proven.iter_mut().find(|it| it.code == Code::GoalNeverReached) else {
        return;
    };
    let message = format!(
        "{} has neither in=… nor out=…, so it begins at the start and leads nowhere",
        apart.file.value
    );
    never.related.push((apart.file.at.clone(), message));
    never.related.extend(merging::label_checks(checks.into_iter()));
    never.remedy = "name the place that enters the sub-mission, in=\"…\", and the place that it \
                    leaves to, out=\"…\""
        .into();
}

/// Points to the sub-mission that should lead to the goal, if nothing else does.
pub(super) fn advise_submission(proven: &mut [Finding], mission: &Mission) {
    let Some(goal) = mission.goal.as_ref().map(|goal| &goal.value) else { return };
    let leads = |it: &Transition| it.outputs().any(|arc| arc.place.value == *goal);
    if mission.transitions.iter().any(leads) {
        return;
    }
    let advice = mission.submissions.iter().find_map(|submission| {
        let file = &submission.file;
        let enter = &submission.enter.as_ref()?.value;
        let is_safe = |place: &&Spanned<String>| {
            mission.safe.as_ref().is_some_and(|safe| safe.value == place.value)
        };
        let advice = match &submission.leave {
            Some(leave) if enter == goal => {
                format!("did you mean in=\"{}\" out=\"{enter}\" for {}?", leave.value, file.value)
            }
            None => format!("write out=\"{goal}\" if {} is to leave to it", file.value),
            Some(leave) if is_safe(&leave) => format!(
                "write out=\"{goal}\" if {} is to leave to it; or are goal=\"{}\" safe=\"{goal}\" \
                 meant?",
                file.value, leave.value
            ),
            Some(_) => return None,
        };
        Some((file.at.clone(), advice))
    });
    let Some((at, advice)) = advice else { return };
    for result in proven.iter_mut().filter(|it| it.code == Code::GoalNeverReached) {
        result.remedy.clone_from(&advice);
        result.related.push((at.clone(), "this sub-mission".into()));
    }
}

/// Merges checks that wait for what no sequence of firings contains with a goal that none leads to:
/// where the mission cannot come to its goal, it cannot come to what is on the path either.
pub(super) fn merge_never_happens(proven: &mut Vec<Finding>) {
    let Some(at) = proven.iter().position(|it| it.code == Code::GoalNeverReached) else { return };
    let mut never = proven.remove(at);
    let is_never = |result: &Finding| result.trace.is_none() && find_awaited(result).is_some();
    let (checks, others): (Vec<_>, Vec<_>) = std::mem::take(proven).into_iter().partition(is_never);
    *proven = others;
    never.related.extend(merging::label_checks(checks.into_iter()));
    proven.push(never);
}
