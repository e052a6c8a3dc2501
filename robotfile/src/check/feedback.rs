//! A component that the mission waits for, and whose loop a frozen component interrupts: it
//! commands something, and would learn by what comes back that it is done, but nothing carries out
//! its commands.

use std::collections::{BTreeMap, BTreeSet};

use crate::check::activity::{Activity, needed_places};
use crate::check::graph::CheckGraph;
use crate::check::starved::is_about;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
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
        let (mut whole, mut broken) = (Vec::new(), Vec::new());
        for place in places {
            steps += system.components.len() + system.links.len();
            if steps > MAX_STEPS {
                return;
            }
            match loops.frozen_in(component, place) {
                None => break,
                Some(frozen) if frozen.is_empty() => whole.push(*place),
                Some(frozen) => broken.push((*place, frozen)),
            }
        }
        let events = |place: &str| -> BTreeSet<&str> {
            let of_place = waiting.iter().filter(|it| needed_places(it).contains(place));
            of_place.filter_map(|it| Some(it.on.as_ref()?.event.value.as_str())).collect()
        };
        // What it reports in whole loops is done there; another report may be one that it has
        // prepared what is carried out there.
        let of_whole: BTreeSet<_> = whole.iter().flat_map(|place| events(place)).collect();
        broken.retain(|(place, _)| {
            let awaited = events(place);
            !awaited.is_empty() && (whole.is_empty() || !awaited.is_disjoint(&of_whole))
        });
        let Some((_, frozen)) = broken.first() else { continue };
        let joins = |link: &&Link| {
            let ends = [link.from.component.value.as_str(), link.to.component.value.as_str()];
            ends.contains(&component) && frozen.iter().any(|it| ends.contains(it))
        };
        // That a link of it never delivers is the graver finding.
        let is_known = system.links.iter().filter(joins).any(|link| {
            findings.iter().any(|it| is_about(it, Code::FrozenProducer, &link.from.at))
        });
        if !is_known {
            let places = broken.iter().filter_map(|(place, _)| activity.place(place)).collect();
            report_loop(component, places, frozen, findings);
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

fn report_loop(component: &str, places: Vec<&Place>, frozen: &[&str], findings: &mut Findings) {
    let named = places.into_iter().filter_map(|place| {
        let named = place.components.iter().find(|it| it.value == component)?;
        Some((place.name.value.as_str(), named))
    });
    let mut named = named
        .filter(|(_, named)| !findings.iter().any(|it| is_about(it, Code::Starved, &named.at)))
        .collect::<Vec<_>>()
        .into_iter();
    let Some((place, first)) = named.next() else { return };
    let names = frozen;
    let (frozen, are) = match names {
        [one] => ((*one).to_owned(), "is"),
        several => (several.join(" and "), "are"),
    };
    let message = format!(
        "{component} is active in {place} and the mission waits for its report, but {frozen}, through which its data come back to it, {are} frozen there"
    );
    let mut finding = Finding::new(Code::LoopInterrupted, &first.at, message);
    for (_, other) in named {
        finding = finding.related(&other.at, "and here");
    }
    findings.push(
        finding.remedy(format!("activate {frozen} in {place} too")).frozen(names.iter().copied()),
    );
}
