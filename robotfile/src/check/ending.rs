//! A mission without a goal that stops somewhere: the place in which it stops was probably meant to
//! be the goal. A mission without a goal that repeats its places until it fails or is stopped needs no goal.

use std::collections::BTreeSet;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{ArcKind, Mission};

/// A sub-mission without a goal never leaves to the mission that includes it.
pub(super) fn check(mission: &Mission, is_main: bool, findings: &mut Findings) {
    if mission.goal.is_some() {
        return;
    }
    let Some(last) = find_last_place(mission) else { return };
    let name = &last.value;
    let message = format!("the mission has no goal, and no transition leads on from {name}");
    let finding = Finding::new(Code::NoGoal, &mission.at, message)
        .remedy(format!("write goal=\"{name}\" if the mission has succeeded there"));
    let finding = finding.related(&last.at, "this place");
    findings.push(if is_main { finding } else { finding.stops_transition() });
}

/// The first place in which the mission stops: a transition moves the tokens there, and neither a
/// transition nor the mission's end takes them away.
fn find_last_place(mission: &Mission) -> Option<&crate::source::Spanned<String>> {
    let arcs = mission.transitions.iter().flat_map(|transition| &transition.arcs);
    let left = arcs.filter(|arc| matches!(arc.kind, ArcKind::Take | ArcKind::Reset));
    let left = left.map(|arc| &arc.place);
    let entered = mission.submissions.iter().filter_map(|inner| inner.enter.as_ref());
    let left: BTreeSet<&str> =
        left.chain(entered).chain(&mission.safe).map(|place| place.value.as_str()).collect();
    let is_last = |place: &str| !left.contains(place);
    // Where a transition also puts a token into a place that is left, the mission continues there.
    let ends = mission.transitions.iter().filter(|transition| {
        transition.inputs().next().is_some()
            && transition.outputs().next().is_some()
            && transition.outputs().all(|arc| is_last(&arc.place.value))
    });
    let of_arcs = ends.flat_map(|transition| transition.outputs()).map(|arc| &arc.place.value);
    let of_inner = mission.submissions.iter().filter_map(|inner| inner.leave.as_ref());
    let of_inner = of_inner.map(|place| &place.value).filter(|place| is_last(place));
    let last = of_arcs.chain(of_inner).next()?;
    mission.place(last).map(|place| &place.name)
}
