//! The checks of a mission file: each holds, does not, or is not decided; never is one passed over.

use armor_robotfile::claim::{Claim, Statement};
use armor_robotfile::{Code, Finding, Findings, Spanned};

use crate::formula::PlaceFormula;
use crate::proof::Proof;
use crate::verdict::ClaimVerdict;

/// Between the sides of a check about what follows.
const LEADS_TO: &str = " leads to ";

impl Proof<'_> {
    pub(super) fn decide_claims(&self, findings: &mut Findings) {
        for text in &self.mission.checks {
            // What cannot be read, or names what is not there, is a finding already.
            let Ok(claim) = Claim::parse(&text.value) else { continue };
            if self.effort.has_begun && is_of_the_start(&claim.statement) {
                continue;
            }
            let Some(verdict) = self.decide_claim(&claim) else { continue };
            if matches!(verdict, ClaimVerdict::Holds) && !self.effort.has_begun {
                findings.extend(self.find_vacuous(text, &claim.statement));
            }
            findings.extend(finding(text, verdict));
        }
    }

    /// A check of what something leads to, which never comes, so that it holds whatever else happens.
    fn find_vacuous(&self, text: &Spanned<String>, statement: &Statement) -> Option<Finding> {
        let Statement::LeadsTo(from, _) = statement else { return None };
        let from = PlaceFormula::of(from, self.plan, self.analysed)?;
        let comes = |marking: &[u32]| self.holds(&from, marking);
        if !self.is_whole() || self.exploration.space.find(comes).is_some() {
            return None;
        }
        let before = text.value.split(LEADS_TO).next().unwrap_or_default().trim();
        let message =
            format!("this check states nothing: no sequence of firings comes to `{before}`");
        let finding = Finding::new(Code::CheckStatesNothing, &text.at, message).may_follow();
        Some(finding.remedy(
            "write what comes in the mission, let a transition lead to it, or remove the check",
        ))
    }
}

/// Whether it speaks of what comes after the start, and so may be behind a mission that runs.
fn is_of_the_start(statement: &Statement) -> bool {
    matches!(
        statement,
        Statement::Reachable(_)
            | Statement::Fires(_)
            | Statement::Eventually(_)
            | Statement::Duration { .. }
    )
}

fn finding(text: &Spanned<String>, verdict: ClaimVerdict) -> Option<Finding> {
    match verdict {
        ClaimVerdict::Holds => None,
        ClaimVerdict::Fails(failure) => {
            let message = format!("this check does not hold: {}", failure.reason);
            let finding = Finding::new(Code::CheckFails, &text.at, message).remedy(failure.remedy);
            let blamed = failure.blamed.iter();
            let mut finding = blamed.fold(finding, |it, (at, label)| it.related(at, label));
            finding.trace = failure.trace;
            Some(finding)
        }
        ClaimVerdict::Undecided(why) => {
            let message = format!("whether this holds could not be decided: {why}");
            let remedy = "prove it of a part of the mission, in a file of its own";
            Some(Finding::new(Code::CheckUndecided, &text.at, message).remedy(remedy))
        }
    }
}
