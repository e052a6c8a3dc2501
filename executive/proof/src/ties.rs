//! Transitions that the same report lets fire, and whose guards are true at the same time: only their
//! order in the file decides between them.

use armor_petri::TransitionId;
use armor_petri::analysis::rules::FiringRules;
use armor_robotfile::mission::{Autonomy, Transition};
use armor_robotfile::{Code, Finding, Findings};

use crate::proof::Proof;

/// Most pairs of transitions that are compared: each costs a pass through all states.
const MOST_COMPARED: usize = 32;
/// Most pairs of transitions that are looked at, so that it takes milliseconds for any file.
const MAX_PAIRS: usize = 100_000;

impl Proof<'_> {
    /// Finds them where the proof follows all that their guards name.
    pub(super) fn find_ties(&self, findings: &mut Findings) {
        if self.analysed.open.is_some() {
            return;
        }
        let reports = |id: &TransitionId| self.plan.transition(*id).on.is_some();
        let all: Vec<_> = self.plan.net().transition_ids().filter(reports).collect();
        let pairs = all
            .iter()
            .enumerate()
            .flat_map(|(at, first)| all[at + 1..].iter().map(move |second| (*first, *second)));
        let rivals =
            pairs.take(MAX_PAIRS).filter(|(first, second)| self.are_rivals(*first, *second));
        for (first, second) in rivals.take(MOST_COMPARED) {
            findings.extend(self.find_tie(first, second));
        }
    }

    /// Whether both take a token of the same place on the same report, with the same rank and time,
    /// and differ in guards that name followed variables alone.
    fn are_rivals(&self, first: TransitionId, second: TransitionId) -> bool {
        let ((a, b), net) =
            ((self.plan.transition(first), self.plan.transition(second)), self.plan.net());
        if a.on.is_none() || a.on != b.on {
            return false;
        }
        let (arcs, other) = (net.transition(first), net.transition(second));
        let shares = arcs.inputs.iter().any(|arc| other.inputs.iter().any(|it| it.0 == arc.0));
        let rank = |id| {
            (net.transition(id).class, net.transition(id).priority, net.transition(id).interval)
        };
        let is_followed = |id| {
            let guard = self.plan.transition(id).guard.as_ref();
            guard.is_none_or(|it| it.operands.iter().all(|operand| operand.counter().is_some()))
        };
        let (Some(one), Some(two)) = (self.written(first), self.written(second)) else {
            return false;
        };
        let is_free = |it: &Transition| {
            it.autonomy == Autonomy::Auto && it.not_before.is_none() && it.not_after.is_none()
        };
        let guard = |it: &Transition| it.when.as_ref().map(|when| when.value.clone());
        shares
            && rank(first) == rank(second)
            && is_followed(first)
            && is_followed(second)
            && is_free(one)
            && is_free(two)
            // Those with the same guard are found without the proof.
            && guard(one) != guard(two)
    }

    fn written(&self, id: TransitionId) -> Option<&Transition> {
        let name = &self.plan.net().transition(id).name;
        self.mission.transitions.iter().find(|it| it.name.value == *name)
    }

    fn find_tie(&self, first: TransitionId, second: TransitionId) -> Option<Finding> {
        let rules = FiringRules::new(self.net);
        let (ones, others) = (self.copies(first), self.copies(second));
        let fires = |marking: &[u32], copies: &[TransitionId]| {
            copies.iter().any(|copy| rules.enabled(marking, *copy))
        };
        let seen =
            self.find_witness(&|marking| fires(marking, &ones) && fires(marking, &others))?;
        let fires_alone = |copies: &[TransitionId], rival: &[TransitionId]| {
            let is_alone = |marking: &[u32]| fires(marking, copies) && !fires(marking, rival);
            self.find_witness(&is_alone).is_some()
        };
        // Also where it would take a variable out of its domain, which is a finding of its own.
        let add_outside = |copies: &[TransitionId], id: TransitionId| -> Vec<TransitionId> {
            let outside = self.analysed.outside.iter().filter(|it| it.1 == id).map(|it| it.0);
            copies.iter().copied().chain(outside).collect()
        };
        let (ones, others) = (add_outside(&ones, first), add_outside(&others, second));
        // With the priority on one of them, the other must still be able to fire somewhere.
        let may_prefer_first = fires_alone(&others, &ones);
        let may_prefer_second = fires_alone(&ones, &others);
        let (first, second) = (self.written(first)?, self.written(second)?);
        let message = format!(
            "{} and {} can fire at the same moment, and only the order in the file decides: {}, the \
             same report and their guards let both fire",
            first.name.value,
            second.name.value,
            self.after_firings(&seen.path)
        );
        let finding = Finding::new(Code::Tie, &second.name.at, message);
        let guards = "let their guards exclude each other";
        let name = |it: &Transition| it.name.value.clone();
        let rank = first.priority.saturating_add(1);
        let remedy = match (may_prefer_first, may_prefer_second) {
            (false, false) => guards.to_owned(),
            (true, true) => format!(
                "{guards}, or specify which one fires first: priority=\"{rank}\" on {} or {}",
                name(first),
                name(second)
            ),
            (is_first, _) => {
                let preferred = if is_first { first } else { second };
                format!(
                    "{guards}, or let {} fire first: priority=\"{rank}\" on it",
                    name(preferred)
                )
            }
        };
        Some(
            finding
                .related(&first.name.at, "this one fires first now")
                .trace(self.trace_of(&seen.path, &[]))
                .remedy(remedy),
        )
    }
}
