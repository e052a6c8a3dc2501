//! Exclusive components: never active together in one place or at the start, and each set once.

use std::collections::{BTreeMap, BTreeSet};

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{Exclusive, Mission, Place};
use crate::source::Spanned;

/// Exclusive components neither in one place nor in two places of the start.
pub(super) fn exclusives_kept(mission: &Mission, findings: &mut Findings) {
    let mut sets: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (set, exclusive) in mission.exclusives.iter().enumerate() {
        for component in &exclusive.components {
            sets.entry(&component.value).or_default().push(set);
        }
    }
    // Lists and not maps: thousands of sets times thousands of places are read in a moment.
    let mut here = vec![None; mission.exclusives.len()];
    let mut at_start = vec![None; mission.exclusives.len()];
    let mut found: Vec<Meeting<'_>> = Vec::new();
    // Two components that several sets declare exclusive, or that are together in several places, are
    // one mistake.
    let mut reported = BTreeSet::new();
    for (number, place) in mission.places.iter().enumerate() {
        for component in &place.components {
            for set in sets.get(component.value.as_str()).into_iter().flatten() {
                let before = here[*set].replace((number, component));
                let other = before.filter(|(place, _)| *place == number);
                let other = other.or_else(|| {
                    let own = (number, component);
                    if place.initial > 0 { at_start[*set].replace(own) } else { None }
                });
                if let Some((there, other)) = other.filter(|(_, it)| it.value != component.value)
                    && reported.insert((&component.value, &other.value))
                {
                    let finding = if there == number {
                        find_together(component, other)
                    } else {
                        find_both_initial(component, other, place, &mission.places[there])
                    };
                    let at = &mission.exclusives[*set].at;
                    let finding = finding.related(at, "declared exclusive here");
                    let pair = [component.value.as_str(), other.value.as_str()];
                    let meeting = Meeting { pair, set: *set, places: [there, number], finding };
                    match found.iter_mut().find(|first| first.is_same(&meeting)) {
                        Some(first) => first.merge(meeting, place),
                        None => found.push(meeting),
                    }
                }
            }
        }
    }
    findings.extend(found.into_iter().map(|meeting| meeting.finding));
}

/// Two exclusive components that are together.
struct Meeting<'a> {
    pair: [&'a str; 2],
    set: usize,
    /// The places, by number, that activate them.
    places: [usize; 2],
    finding: Finding,
}

impl Meeting<'_> {
    /// Whether one mistake may cause both: a component in a set or a place to which it does not
    /// belong, or a place that is initial and should not be.
    fn is_same(&self, other: &Self) -> bool {
        let is_one_place = self.places[0] == self.places[1];
        let shares_name = self.pair.iter().any(|name| other.pair.contains(name));
        let is_same_place = self.places == other.places;
        (self.set == other.set && shares_name) || (is_same_place && (shares_name || !is_one_place))
    }

    fn merge(&mut self, other: Self, place: &Place) {
        if let Some(shared) = self.pair.iter().find(|name| other.pair.contains(name))
            && self.places[0] == self.places[1]
        {
            let place = &place.name.value;
            self.finding.remedy = match self.places == other.places {
                true => format!("remove {shared} from the components of {place}"),
                // One that is together with several of a set does not belong into it.
                false => format!("remove {shared} from the exclusive set"),
            };
        }
        self.finding.merge_place(other.finding);
    }
}

/// Two sets of the same components: the second one excludes nothing more.
pub(super) fn exclusives_once(mission: &Mission, findings: &mut Findings) {
    let mut seen: BTreeMap<BTreeSet<&str>, &Exclusive> = BTreeMap::new();
    for exclusive in &mission.exclusives {
        let names: BTreeSet<_> =
            exclusive.components.iter().map(|name| name.value.as_str()).collect();
        if let Some(first) = seen.get(&names).filter(|_| names.len() > 1) {
            let message = "these components are already exclusive";
            let finding = Finding::new(Code::ExclusiveTwice, &exclusive.at, message);
            let finding = finding.remedy("remove one of the two, or name other components");
            findings.push(finding.related(&first.at, "first here"));
        } else {
            seen.insert(names, exclusive);
        }
    }
}

fn find_together(component: &Spanned<String>, other: &Spanned<String>) -> Finding {
    let message = format!("{} would be active together with {}", component.value, other.value);
    Finding::new(Code::ExclusiveTogether, &component.at, message)
        .remedy("activate them in different places, or do not declare them exclusive")
        .related(&other.at, "with this one")
}

fn find_both_initial(
    component: &Spanned<String>,
    other: &Spanned<String>,
    place: &Place,
    there: &Place,
) -> Finding {
    let (place, there) = (&place.name, &there.name);
    let message = format!(
        "{} would be active together with {}: {} and {} are both initial",
        component.value, other.value, there.value, place.value
    );
    Finding::new(Code::ExclusiveTogether, &component.at, message)
        .remedy(format!("write initial=\"true\" only on {} or on {}", there.value, place.value))
        .related(&there.at, "initial")
        .related(&place.at, "initial too")
}
