//! The checks of a mission file: each holds, does not, or is not decided; never is one passed over.

use armor_robotfile::claim::{Claim, Statement};
use armor_robotfile::{Code, Finding, Findings, Spanned};

use crate::proof::Proof;
use crate::verdict::ClaimVerdict;

impl Proof<'_> {
    pub(super) fn decide_claims(&self, findings: &mut Findings) {
        for text in &self.mission.checks {
            // What cannot be read, or names what is not there, is a finding already.
            let Ok(claim) = Claim::parse(&text.value) else { continue };
            if self.effort.has_begun && is_of_the_start(&claim.statement) {
                continue;
            }
            let Some(verdict) = self.decide_claim(&claim) else { continue };
            findings.extend(finding(text, verdict));
        }
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
