//! A transition that marks the goal or the safe place together with a place in which components work:
//! the mission is over, so they do nothing there.

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{Arc, Mission, Transition};
use crate::source::Spanned;

/// Checks the main mission: a sub-mission whose goal is marked continues in its other places.
pub(super) fn check(mission: &Mission, findings: &mut Findings) {
    for transition in &mission.transitions {
        report_cut_short(transition, mission, findings);
    }
}

fn report_cut_short(transition: &Transition, mission: &Mission, findings: &mut Findings) {
    let ends = [(&mission.goal, "the goal"), (&mission.safe, "the safe place")];
    let noun_of = |arc: &Arc| {
        let is_it = |place: &Option<Spanned<String>>| {
            place.as_ref().is_some_and(|place| place.value == arc.place.value)
        };
        ends.iter().find(|(place, _)| is_it(place)).map(|(_, noun)| noun)
    };
    let Some((end, noun)) = transition.outputs().find_map(|arc| Some((arc, noun_of(arc)?))) else {
        return;
    };
    let works = |arc: &&Arc| {
        arc.place.value != end.place.value
            && mission.place(&arc.place.value).is_some_and(|place| !place.components.is_empty())
    };
    let Some(work) = transition.outputs().find(works) else { return };
    let (name, end_name, place) = (&transition.name.value, &end.place.value, &work.place.value);
    let message = format!(
        "{name} marks {end_name}, {noun}, together with {place}: the mission is over, and nothing \
         works in {place}"
    );
    let finding = Finding::new(Code::EndsTooSoon, &end.place.at, message);
    findings.push(finding.remedy(format!(
        "lead it to {place} alone, and another transition from there to {end_name}; or to \
         {end_name} alone"
    )));
}
