//! Variables that transitions set, in what is proven: values outside of their domains, variables
//! that are not followed, and clocks that are followed only loosely because of them.

use armor_petri::TransitionId;
use armor_petri::analysis::rules::FiringRules;
use armor_robotfile::claim::{Claim, Statement};
use armor_robotfile::{Code, Finding, Findings, Location};

use crate::proof::Proof;
use crate::verdict::ClaimVerdict;

impl Proof<'_> {
    /// A finding for each transition that can take a variable out of its domain.
    pub(super) fn values_outside(&self, findings: &mut Findings) {
        let rules = FiringRules::new(self.net);
        let mut known = Vec::new();
        for &(copy, source) in &self.analysed.outside {
            if known.contains(&source) {
                continue;
            }
            let Some(seen) = self.find_witness(&|marking| rules.enabled(marking, copy)) else {
                continue;
            };
            known.push(source);
            let values: Vec<_> =
                self.analysed.values(&seen.marking).map(|(_, value)| value).collect();
            let Some((set, why)) = self.plan.outside(source, &values) else { continue };
            let message = format!("{} {why}", self.after_firings(&seen.path));
            let finding = Finding::new(Code::ValueOutside, self.at_set(source, set), message);
            let path = [&seen.path[..], &[copy]].concat();
            findings.push(finding.trace(self.trace_of(&path, &[])).remedy(
                "keep it from firing there with when=\"…\", or widen the domain of the variable",
            ));
        }
    }

    /// Where the value of a set is written.
    fn at_set(&self, transition: TransitionId, set: usize) -> &Location {
        let name = &self.plan.net().transition(transition).name;
        let written = self.mission.transitions.iter().find(|t| t.name.value == *name);
        let set = written.and_then(|t| t.sets.get(set));
        set.map_or_else(|| self.at_transition(name), |set| &set.value.at)
    }

    /// Reports which variables the proof does not follow.
    pub(super) fn not_followed(&self, findings: &mut Findings) {
        let Some(why) = &self.analysed.open else { return };
        let names: Vec<_> =
            why.counters.iter().map(|index| self.plan.counters()[*index].name.as_str()).collect();
        let verb = if names.len() == 1 { "is" } else { "are" };
        let transition = &self.plan.net().transition(why.transition).name;
        let message = format!(
            "{} {verb} not followed in the proof: {transition} depends on {} combinations of \
             their values",
            names.join(" and "),
            why.combinations
        );
        let finding = Finding::new(Code::ValuesOpen, self.at_transition(transition), message);
        findings.push(finding.remedy(
            "let them count to less, or compare them with numbers rather than with each other",
        ));
    }

    /// The verdict on a check. Where variables are not followed, or clocks only loosely, the net
    /// can do more than the mission can. Then only "this never happens" carries over to the
    /// mission.
    pub(super) fn decide_claim(&self, claim: &Claim) -> Option<ClaimVerdict> {
        let is_counter =
            |name: &str| self.plan.counters().iter().any(|counter| counter.name == name);
        let mut names = claim.names().into_iter();
        if self.analysed.open.is_some() && names.any(|(_, name)| is_counter(name.as_str())) {
            return Some(ClaimVerdict::Undecided("its variables are not followed".into()));
        }
        let verdict = self.decide_statement(&claim.statement)?;
        let why = match (&self.analysed.open, &self.analysed.loosened[..]) {
            (Some(_), _) => "it depends on variables that are not followed".to_owned(),
            (None, []) => return Some(verdict),
            (None, names) => format!(
                "it depends on how long {} has been enabled while variables that it speaks of \
                 change, and that is not followed",
                names.join(", ")
            ),
        };
        let is_sound = match (&claim.statement, &verdict) {
            (Statement::AlwaysReachable(_), _) => false,
            (Statement::Reachable(_) | Statement::Fires(_), verdict) => {
                matches!(verdict, ClaimVerdict::Fails(..))
            }
            (_, verdict) => matches!(verdict, ClaimVerdict::Holds),
        };
        Some(if is_sound { verdict } else { ClaimVerdict::Undecided(why) })
    }
}
