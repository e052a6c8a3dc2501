//! Runs every examination of a mission and collects the findings.

use crate::analysed::Analysed;
use crate::proof::{Proof, ProofEffort};
use armor_plan::Plan;
use armor_robotfile::{Configuration, Findings, Mission, Severity};

/// Proves the mission of a configuration, whose plan is `plan`, and what its files claim. `stop` is
/// asked now and then whether it has taken long enough.
pub fn prove(configuration: &Configuration, plan: &Plan, stop: &dyn Fn() -> bool) -> Findings {
    prove_whole(configuration, plan, ProofEffort::default(), stop)
}

/// The same for a caller that needs no notes: how long the mission takes is not examined.
pub fn prove_without_notes(
    configuration: &Configuration,
    plan: &Plan,
    stop: &dyn Fn() -> bool,
) -> Findings {
    let effort = ProofEffort { skips_notes: true, ..ProofEffort::default() };
    prove_whole(configuration, plan, effort, stop).without_notes()
}

fn prove_whole(
    configuration: &Configuration,
    plan: &Plan,
    effort: ProofEffort,
    stop: &dyn Fn() -> bool,
) -> Findings {
    let found = prove_within(configuration, plan, effort, stop);
    let lacks_input =
        |mission: &Mission| mission.transitions.iter().any(|it| mission.lacks_input(it));
    if !configuration.missions().any(lacks_input) {
        return found;
    }
    // Such a transition is a finding already, and fills and interrupts everything.
    let mut errors = Findings::default();
    errors.extend(found.into_iter().filter(|finding| finding.severity() == Severity::Error));
    errors
}

/// The same of a mission that has begun, and whose plan starts where it stands: what is claimed of
/// its start (how long it takes, what it can come to) is left out.
pub fn prove_from_here(
    configuration: &Configuration,
    plan: &Plan,
    stop: &dyn Fn() -> bool,
) -> Findings {
    prove_within(
        configuration,
        plan,
        ProofEffort { has_begun: true, ..ProofEffort::default() },
        stop,
    )
}

pub(crate) fn prove_within(
    configuration: &Configuration,
    plan: &Plan,
    effort: ProofEffort,
    stop: &dyn Fn() -> bool,
) -> Findings {
    prove_and_count(configuration, plan, effort, stop).0
}

/// The findings, and how many states and state classes were explored for them.
pub(crate) fn prove_and_count(
    configuration: &Configuration,
    plan: &Plan,
    effort: ProofEffort,
    stop: &dyn Fn() -> bool,
) -> (Findings, u64) {
    let (mut findings, mut explored) = (Findings::default(), 0);
    let Ok(Some(mission)) = configuration.flattened() else { return (findings, explored) };
    let Ok(analysed) = Analysed::of(plan) else { return (findings, explored) };
    Proof::new(plan, &mission, &analysed, effort, stop).with_waits(&mut |proof, meeting| {
        // In the net in which no start waits: where exclusive components meet is a finding of its
        // own.
        if let Some(plain) = meeting {
            plain.find_meetings(&mut findings);
        }
        proof.examine_in_general(&mut findings);
        if !effort.has_begun && !effort.skips_notes {
            findings.extend(proof.find_durations());
        }
        proof.not_followed(&mut findings);
        proof.decide_claims(&mut findings);
        explored += proof.explored_states() + meeting.map_or(0, Proof::explored_states);
    });
    // The checks of a sub-mission's file are about that mission from its start, in whatever mission
    // it is used.
    let effort = ProofEffort { has_begun: false, ..effort };
    for inner in configuration.included.values().filter(|inner| !inner.checks.is_empty()) {
        let alone = Configuration { mission: Some(inner.clone()), ..configuration.clone() };
        let (Ok(Some(mission)), Ok(Some(plan))) = (alone.flattened(), Plan::of(&alone)) else {
            continue;
        };
        if let Ok(analysed) = Analysed::of(&plan) {
            let alone = Proof::new(&plan, &mission, &analysed, effort, stop);
            alone.with_waits(&mut |proof, meeting| {
                proof.decide_claims(&mut findings);
                explored += proof.explored_states() + meeting.map_or(0, Proof::explored_states);
            });
        }
    }
    (findings, explored)
}
