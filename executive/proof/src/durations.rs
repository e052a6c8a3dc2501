//! How soon the goal can come, and how late the mission must be over: worth knowing, where it is
//! cheap to find out.

use std::collections::BTreeSet;

use armor_petri::TransitionId;
use armor_petri::analysis::durations::{Latest, TimedSequence, longest_time, shortest_time};
use armor_petri::analysis::rules::FiringRules;
use armor_robotfile::{Code, Finding, MissionDuration};

use crate::proof::Proof;
use armor_robotfile::time_in_words as time;

impl Proof<'_> {
    pub(super) fn find_durations(&self) -> Option<Finding> {
        let goal = self.plan.goal().filter(|_| self.analysed.loosened.is_empty())?;
        let classes = self.timed_if_small()?;
        let at_goal = |marking: &[u32]| marking[goal.index()] > 0;
        let is_over = |marking: &[u32]| self.is_over(marking);
        let least = shortest_time(self.net, classes, at_goal, &self.budget()).ok()??;
        if least.sequence.is_empty() {
            return None;
        }
        let most = longest_time(self.net, classes, is_over, &self.budget()).ok()?;
        let ends = |class: u32| is_over(classes.marking(class)) && !at_goal(classes.marking(class));
        let always_goal = !(0..classes.classes() as u32).any(ends);
        let name = self.net.place(goal);
        let message = self.in_words(name, &least, &most, always_goal);
        let at = self.mission.goal.as_ref().map_or(&self.mission.at, |goal| &goal.at);
        let mut finding = Finding::new(Code::Takes, at, message).remedy(
            "nothing needs to be done; a <check> such as duration(…) <= 20min holds it to that",
        );
        finding.takes = Some(self.as_data(&least, &most, always_goal));
        Some(finding)
    }

    fn in_words(
        &self,
        goal: &str,
        least: &TimedSequence,
        most: &Latest,
        always_goal: bool,
    ) -> String {
        let earliest = time(least.time);
        let begin = format!("{goal} comes after {earliest} at the earliest");
        match most {
            Latest::At(most) if always_goal && most.time == least.time => {
                format!("{goal} comes after {earliest}")
            }
            Latest::At(most) if always_goal => {
                format!("{goal} comes after {earliest} to {}", time(most.time))
            }
            Latest::At(most) => {
                format!("{begin}, and the mission is over after {} at the latest", time(most.time))
            }
            Latest::WithoutEnd(path) => {
                format!("{begin}; there is no latest end: {}", self.waits(path))
            }
            Latest::Circle(path, circle) => {
                let after =
                    if path.is_empty() { String::new() } else { self.after_firings(path) + " " };
                let meanwhile = match self.waits_during(path, circle) {
                    waits if waits.is_empty() => String::new(),
                    waits => {
                        format!(", while {} may be waited for without end", waits.join(" or "))
                    }
                };
                format!(
                    "{begin}; there is no latest end: {after}again and again {}{meanwhile}",
                    self.names(circle)
                )
            }
            Latest::DeadEnd(path) => {
                format!(
                    "{begin}; it need not end: {} nothing fires any more",
                    self.after_firings(path)
                )
            }
        }
    }

    /// The transitions that no firing of the circle disables and that need not fire: what is waited
    /// for, where the circle is only a clock next to it.
    fn waits_during(&self, path: &[TransitionId], circle: &[TransitionId]) -> Vec<&str> {
        let rules = FiringRules::new(self.net);
        let Some(mut marking) = rules.play(self.net.initial(), path) else { return Vec::new() };
        let mut waits: BTreeSet<_> = self.net.transition_ids().collect();
        let start = marking.clone();
        for &transition in circle {
            waits.retain(|id| *id != transition && rules.enabled(&marking, *id));
            if rules.fire(&mut marking, transition).is_none() {
                return Vec::new();
            }
        }
        self.name_waits(&start, |id| waits.contains(&id))
    }

    fn as_data(&self, least: &TimedSequence, most: &Latest, always_goal: bool) -> MissionDuration {
        let (longest_s, path, circle) = match most {
            Latest::At(most) => (Some(most.time.as_secs_f64()), &most.sequence[..], &[][..]),
            Latest::WithoutEnd(path) | Latest::DeadEnd(path) => (None, &path[..], &[][..]),
            Latest::Circle(path, circle) => (None, &path[..], &circle[..]),
        };
        MissionDuration {
            shortest_s: least.time.as_secs_f64(),
            shortest_trace: self.all_names(&least.sequence),
            longest_s,
            longest_trace: self.all_names(path),
            longest_circle: self.all_names(circle),
            always_goal,
        }
    }
}
