//! Adds the results of the proof to the findings of the file. A result that only follows from a
//! finding of the file, or from another result, is left out: when that is fixed, it is proven again.

mod awaited;
mod causes;
mod goal;
mod merging;
mod outside;

use self::awaited::waits_for;
use crate::code::Code;
use crate::finding::{Finding, Severity};
use crate::findings::Findings;
use crate::mission::Mission;
use crate::model::Configuration;
use crate::source::Location;

impl Findings {
    /// Adds the results of the proof of the mission that are new and do not follow from others.
    pub fn extend_proven(&mut self, proven: Self, configuration: &Configuration) {
        let mut proven: Vec<_> = proven.into_iter().collect();
        let causes: Vec<_> = self.iter().filter(|it| it.stops_transition).cloned().collect();
        if let Some(mission) = &configuration.mission {
            // A guard is never true, because nothing sets its variable.
            let unset = self.find_unset(&proven, mission);
            if !unset.is_empty() && !proven.iter().any(|it| it.code == Code::GoalNeverReached) {
                proven.retain(|result| result.code != Code::NeverFires);
            }
        }
        if !causes.is_empty() {
            proven.retain(|result| result.code != Code::NeverFires);
        }
        let keeps_tokens = |cause: &Finding| {
            use Code::{NeverFires, NoOutput, Tie, UnreachablePlace};
            matches!(cause.code, NeverFires | NoOutput | Tie | UnreachablePlace)
        };
        if causes.iter().any(keeps_tokens) {
            proven.retain(|result| !matches!(result.code, Code::Standstill | Code::GoalLost));
        }
        let is_fault = |result: &Finding| result.severity() != Severity::Note;
        // An end may only seem to be without effect, because of any other fault.
        if proven.iter().any(|result| is_fault(result) && !result.may_follow) {
            self.retain(|finding| finding.code != Code::EndUnawaited);
        }
        let is_other = |result: &Finding| !result.may_follow && is_fault(result);
        if self.iter().any(is_fault) || proven.iter().any(is_other) {
            proven.retain(|result| !result.may_follow);
        }
        // What a check speaks of may never come because of any other fault.
        let is_reason = |it: &Finding| is_fault(it) && it.code != Code::CheckStatesNothing;
        if proven.iter().any(is_reason) {
            proven.retain(|result| result.code != Code::CheckStatesNothing);
        }
        // What never fires sets no variable.
        if proven.iter().any(|result| result.code == Code::NeverFires) {
            proven.retain(|result| !matches!(result.code, Code::NeverEqual | Code::SetUnchanged));
        }
        // A check that fails because of it is the graver finding.
        if proven.iter().any(|it| it.code == Code::CheckFails && it.message.contains("/on-failure"))
        {
            self.retain(|finding| finding.code != Code::FailsToItself);
        }
        // A count without its end makes the mission longer, too.
        if proven.iter().any(|result| result.code == Code::ValueOutside) {
            let is_longer =
                |it: &Finding| it.code == Code::CheckFails && it.message.contains(" can take ");
            proven.retain(|result| !is_longer(result));
        }
        // A period leaves the proof more to follow.
        if self.iter().any(|finding| finding.code == Code::ShorterThanPeriod) {
            proven.retain(|result| result.code != Code::CheckUndecided);
        }
        if let Some(mission) = &configuration.mission {
            self.explain_by_shared_end(&mut proven, mission);
            self.explain_by_missing_end(&mut proven, mission);
            self.explain_by_inner_end(&mut proven, mission);
            self.explain_by_exchange(&mut proven, mission);
            self.explain_by_missing_input(&mut proven);
            self.explain_by_early_end(&mut proven);
            self.explain_by_unset(&mut proven, mission);
            goal::merge_after_goal(&mut proven, mission);
            causes::explain_after_safe(&mut proven, mission);
            if goal::merge_over_at_start(&mut proven) {
                // Nothing leads to where the mark was before it was moved to the goal.
                self.retain(|finding| finding.code != Code::UnreachablePlace);
            }
            self.merge_outside(&mut proven, mission);
            causes::explain_missing_entrance(&mut proven, mission);
        }
        if proven.iter().any(|result| result.code == Code::GoalNeverReached) {
            self.keep_reason(&mut proven, &causes, configuration);
        } else {
            self.explain_checks(&mut proven);
            if let Some(mission) = &configuration.mission {
                causes::explain_endless(&mut proven, mission);
            }
        }
        self.drop_ties_of_dead(&proven);
        self.drop_ties_of_failures(&mut proven);
        causes::explain_never_fired(&mut proven);
        if let Some(mission) = &configuration.mission {
            merging::merge_same_values(&mut proven, mission);
        }
        merging::merge_witnesses(&mut proven);
        merging::merge_last_firings(&mut proven);
        merging::merge_stronger_claims(&mut proven);
        self.merge_preempted(&mut proven);
        merging::merge_stuck(&mut proven);
        merging::merge_tokens(&mut proven, configuration.mission.as_ref());
        merging::merge_filling(&mut proven);
        self.merge_unreached(&mut proven);
        self.merge_ties(&mut proven, configuration.mission.as_ref());
        merging::merge_awaiting(&mut proven);
        self.merge_only_fault(&mut proven);
        self.extend_new(proven);
        // A token that stays somewhere may follow from whatever else is wrong.
        if self.iter().any(is_fault) {
            self.retain(|finding| finding.code != Code::StaysThere);
        }
    }

    /// Leaves out that only the order decides between two transitions of which one never fires.
    fn drop_ties_of_dead(&mut self, proven: &[Finding]) {
        let dead = proven.iter().filter(|it| it.code == Code::NeverFires);
        let dead: Vec<_> = dead.filter_map(|it| it.at.as_ref().map(|at| at.span)).collect();
        self.retain(|finding| {
            let mut places = finding.at.iter().chain(finding.related.iter().map(|(at, _)| at));
            finding.code != Code::Tie || !places.any(|at| dead.contains(&at.span))
        });
    }

    /// Leaves out that the failure of a component lets two transitions fire, if one of them was probably
    /// to wait for its end.
    fn drop_ties_of_failures(&self, proven: &mut Vec<Finding>) {
        let doubted = self.iter().filter(|it| it.code == Code::DoneUnused);
        let doubted: Vec<_> = doubted.map(|it| it.message.clone()).collect();
        proven.retain(|result| {
            let mut ends = result.at.iter().chain(result.related.iter().map(|(at, _)| at));
            let is_doubted = |at: &Location| {
                let begin = format!("{} waits in ", at.text());
                doubted.iter().any(|message| message.starts_with(&begin))
            };
            result.code != Code::Tie || !ends.any(is_doubted)
        });
    }

    /// Leaves out that a token stays in the place that was probably meant as the goal, in place of the safe
    /// place.
    fn explain_by_shared_end(&self, proven: &mut Vec<Finding>, mission: &Mission) {
        let is_at_goal = |finding: &Finding| {
            let goal = mission.goal.as_ref();
            finding.code == Code::NoSafePlace
                && finding.at.as_ref().zip(goal).is_some_and(|(at, goal)| at.is_at(&goal.at))
        };
        if self.iter().any(is_at_goal) {
            use Code::{GoalLost, Standstill};
            proven.retain(|result| !matches!(result.code, Standstill | GoalLost));
        }
    }

    /// Leaves out what follows from a safe place that is not named, if a place is probably meant:
    /// that tokens stay there. A check that fails because it waits for that place is an error, so it
    /// is kept, with this reason.
    fn explain_by_missing_end(&mut self, proven: &mut Vec<Finding>, mission: &Mission) {
        let is_own = |finding: &&Finding| {
            finding.code == Code::NoSafePlace
                && finding.at.as_ref().is_some_and(|at| at.is_at(&mission.at))
        };
        let Some(cause) = self.iter().find(is_own).cloned() else { return };
        let Some(end) = mission.find_unnamed_end() else { return };
        proven.retain(|result| !matches!(result.code, Code::Standstill | Code::GoalLost));
        let is_end = |at: &Location| at.span == end.name.at.span;
        self.retain(|finding| {
            finding.code != Code::UnreachablePlace || !finding.at.as_ref().is_some_and(is_end)
        });
        let (checks, others): (Vec<_>, Vec<_>) = std::mem::take(proven)
            .into_iter()
            .partition(|result| waits_for(result, &end.name.value));
        *proven = others;
        let mut checks = checks.into_iter();
        let Some(mut first) = checks.next() else { return };
        first.remedy.clone_from(&cause.remedy);
        first.related.extend(cause.at.map(|at| (at, cause.message)));
        first.related.extend(merging::label_checks(checks));
        self.retain(|finding| finding.code != Code::NoSafePlace);
        proven.push(first);
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
        let whole = configuration.flattened().ok().flatten();
        let dead = goal::find_dead_before(proven, whole.as_ref(), goal);
        let unset = configuration.mission.as_ref().map(|it| self.find_unset(proven, it));
        let unset = unset.unwrap_or_default();
        let known = [causes, &unset, &dead].into_iter().find(|it| !it.is_empty());
        let causes = known.unwrap_or_default();
        proven.retain(|result| match result.code {
            Code::NeverFires => false,
            Code::CheckFails => !waits_for(result, goal),
            _ => true,
        });
        goal::explain_by_exclusion(proven);
        // The transition that would leave a variable's domain does not fire.
        if proven.iter().any(|result| result.code == Code::ValueOutside) {
            proven.retain(|result| result.code != Code::GoalNeverReached);
        } else if let [cause] = causes
            && let Some(at) = &cause.at
        {
            self.retain(|finding| {
                let is_cause = finding.stops_transition || !unset.is_empty();
                finding.code != cause.code || !is_cause
            });
            for result in proven.iter_mut().filter(|it| it.code == Code::GoalNeverReached) {
                result.related.push((at.clone(), cause.message.clone()));
                result.related.extend(cause.related.clone());
                result.remedy.clone_from(&cause.remedy);
            }
            goal::merge_checks_of(proven, at);
            if cause.code == Code::UnreachablePlace {
                merging::merge_token_faults(proven);
            }
        } else if let Some(mission) = &configuration.mission {
            goal::explain_by_submission(proven, mission);
            goal::advise_submission(proven, mission);
        }
        goal::merge_never_happens(proven);
    }
}
