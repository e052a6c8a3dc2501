//! A component that the mission waits for, and whose loop a frozen component interrupts: it
//! commands something, and would learn by what comes back that it is done, but nothing carries out
//! its commands.

use std::collections::{BTreeMap, BTreeSet};

use crate::check::activity::{Activity, needed_places};
use crate::check::graph::CheckGraph;
use crate::check::starved::is_about;
use crate::code::Code;
use crate::finding::{Finding, Findings};
use crate::mission::{Place, Transition};
use crate::model::{Link, System};

/// Links that are followed, so that the check takes milliseconds for any file.
const MAX_STEPS: usize = 2_000_000;
/// The cost of a frozen component on a circle: more than that of all active ones.
const FROZEN_COST: usize = 1 << 20;

/// Checks each component whose report the mission waits for.
pub(super) fn check(activity: &Activity<'_>, system: &System, findings: &mut Findings) {
    let names = system.components.iter().map(|component| component.name.value.as_str());
    let links = system
        .links
        .iter()
        .map(|link| (link.from.component.value.as_str(), link.to.component.value.as_str(), ()));
    let loops = Loops { activity, graph: CheckGraph::new(names, links) };
    let mut steps = 0;
    for (component, waiting) in awaited_components(activity) {
        let Some(places) = activity.places_of(component) else { continue };
        let mut broken = Vec::new();
        for place in places {
            steps += system.components.len() + system.links.len();
            match loops.frozen_in(component, place) {
                _ if steps > MAX_STEPS => return,
                // It has no loop, or works elsewhere in a whole one: there it carries out what it
                // prepares here.
                None => broken.clear(),
                Some(frozen) if frozen.is_empty() => broken.clear(),
                Some(frozen) => {
                    broken.push((*place, frozen));
                    continue;
                }
            }
            break;
        }
        let waits_in = |place: &str| waiting.iter().any(|it| needed_places(it).contains(place));
        for (place, frozen) in broken.iter().filter(|(place, _)| waits_in(place)) {
            let joins = |link: &&Link| {
                let ends = [link.from.component.value.as_str(), link.to.component.value.as_str()];
                ends.contains(&component) && frozen.iter().any(|it| ends.contains(it))
            };
            // That a link of it never delivers is the graver finding.
            let is_known = system.links.iter().filter(joins).any(|link| {
                findings.iter().any(|it| is_about(it, Code::FrozenProducer, &link.from.at))
            });
            if let Some(place) = activity.place(place).filter(|_| !is_known) {
                report_loop(component, place, frozen, findings);
            }
        }
    }
}

/// The components whose reports the mission waits for, each with the transitions that do.
fn awaited_components<'a>(activity: &Activity<'a>) -> BTreeMap<&'a str, Vec<&'a Transition>> {
    let mut awaited: BTreeMap<&str, Vec<_>> = BTreeMap::new();
    for transition in &activity.mission.transitions {
        if let Some(on) = &transition.on {
            awaited.entry(on.component.value.as_str()).or_default().push(transition);
        }
    }
    awaited
}

/// The links of a system, and when the components at their ends are active.
struct Loops<'a> {
    activity: &'a Activity<'a>,
    graph: CheckGraph<&'a str, ()>,
}

impl<'a> Loops<'a> {
    /// Returns the components that are frozen in the place, on the circle of links through the
    /// component with the fewest of them; none if it is on no circle.
    fn frozen_in(&self, component: &'a str, place: &str) -> Option<Vec<&'a str>> {
        let place = BTreeSet::from([place]);
        let is_frozen = |name: &&str| self.activity.may_be_active(name, &place) == Some(false);
        let cost = |name: &str| if is_frozen(&name) { FROZEN_COST } else { 1 };
        let circle = self.graph.cheapest_circle(component, cost)?;
        Some(circle.into_iter().filter(is_frozen).collect())
    }
}

fn report_loop(component: &str, place: &Place, frozen: &[&str], findings: &mut Findings) {
    let Some(named) = place.components.iter().find(|it| it.value == component) else { return };
    if findings.iter().any(|it| is_about(it, Code::Starved, &named.at)) {
        return;
    }
    let (frozen, are) = match frozen {
        [one] => ((*one).to_owned(), "is"),
        several => (several.join(" and "), "are"),
    };
    let place = &place.name.value;
    let message = format!(
        "{component} is active in {place} and the mission waits for its report, but {frozen}, through which its data come back to it, {are} frozen there"
    );
    let finding = Finding::new(Code::LoopInterrupted, &named.at, message);
    findings.push(finding.remedy(format!("activate {frozen} in {place} too")));
}
