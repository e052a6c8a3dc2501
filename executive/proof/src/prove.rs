//! Runs every examination of a mission and collects the findings.

use crate::analysed::Analysed;
use crate::proof::{Effort, Proof};
use armor_plan::Plan;
use armor_robotfile::{Configuration, Findings};

/// Proves the mission of a configuration, whose plan is `plan`, and what its files claim. `stop` is
/// asked now and then whether it has taken long enough.
pub fn prove(configuration: &Configuration, plan: &Plan, stop: &dyn Fn() -> bool) -> Findings {
    prove_within(configuration, plan, Effort::default(), stop)
}

/// The same of a mission that has begun, and whose plan starts where it stands: what is claimed of
/// its start (how long it takes, what it can come to) is left out.
pub fn prove_from_here(
    configuration: &Configuration,
    plan: &Plan,
    stop: &dyn Fn() -> bool,
) -> Findings {
    prove_within(configuration, plan, Effort { has_begun: true, ..Effort::default() }, stop)
}

pub(crate) fn prove_within(
    configuration: &Configuration,
    plan: &Plan,
    effort: Effort,
    stop: &dyn Fn() -> bool,
) -> Findings {
    let mut findings = Findings::default();
    let Ok(Some(mission)) = configuration.flattened() else { return findings };
    let Ok(analysed) = Analysed::of(plan) else { return findings };
    Proof::new(plan, &mission, &analysed, effort, stop).with_waits(&mut |proof, meeting| {
        // Of the net in which nobody waits: where they meet is a finding of its own.
        if let Some(plain) = meeting {
            plain.exclusions(&mut findings);
        }
        proof.general(&mut findings);
        if !effort.has_begun {
            findings.extend(proof.durations());
        }
        proof.not_followed(&mut findings);
        proof.claims(&mut findings);
    });
    // What a sub-mission's file claims is about that mission from its start, whoever puts it in.
    let effort = Effort { has_begun: false, ..effort };
    for inner in configuration.included.values().filter(|inner| !inner.checks.is_empty()) {
        let alone = Configuration { mission: Some(inner.clone()), ..configuration.clone() };
        let (Ok(Some(mission)), Ok(Some(plan))) = (alone.flattened(), Plan::of(&alone)) else {
            continue;
        };
        if let Ok(analysed) = Analysed::of(&plan) {
            let alone = Proof::new(&plan, &mission, &analysed, effort, stop);
            alone.with_waits(&mut |proof, _| proof.claims(&mut findings));
        }
    }
    findings
}
