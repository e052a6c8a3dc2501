//! The requirements on a mission: unique names, places and components that exist, an initial place,
//! and places that do not activate exclusive components together.

mod places;
mod transitions;

use std::collections::{BTreeMap, BTreeSet};

use crate::check::names::{KnownNames, listed};
use crate::check::{exclusive, twice};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::flatten::is_state_machine;
use crate::manifests::Manifests;
use crate::mission::{Exclusive, Mission, Place, Submission, Transition};
use crate::model::{Configuration, System};
use crate::source::Spanned;

pub(super) fn check(
    configuration: &Configuration,
    manifests: Option<&Manifests>,
    findings: &mut Findings,
) {
    let system = &configuration.system;
    let places = configuration.missions().flat_map(|mission| &mission.places);
    let controlled = places.flat_map(|place| &place.components).map(|name| name.value.as_str());
    let controlled = controlled.collect();
    let is_complete = configuration.missions().all(|mission| {
        has_all_places(mission, system) && has_all_submissions(mission, configuration)
    });
    let fixed = find_fixed(system, manifests);
    for mission in configuration.missions() {
        let names = (&controlled, &fixed, is_complete);
        check_one(mission, system, names, configuration, findings);
    }
    if let Some(mission) = configuration.mission.as_ref().filter(|m| m.safe.is_none()) {
        let message = "the mission has no safe place to go to when something fails";
        let finding = Finding::new(Code::NoSafePlace, &mission.at, message);
        let remedy = match mission.find_unnamed_end() {
            Some(place) => format!(
                "write safe=\"{0}\" if the robot is safe in {0}; or add another place for this",
                place.name.value
            ),
            None => "add a place in which the robot is safe, usually one without components, and \
                     name it: <place name=\"hold\"/> and <mission safe=\"hold\">"
                .into(),
        };
        findings.push(finding.remedy(remedy));
    }
    findings.extend(configuration.mission.as_ref().and_then(find_shared_end));
    for inner in configuration.included.values().filter(|it| it.safe.is_none()) {
        findings.extend(find_standing_end(inner));
    }
}

/// Finds a goal that is named as the safe place, too, while an emergency, or the end of a task, leads to
/// another place that seems to be meant.
fn find_shared_end(mission: &Mission) -> Option<Finding> {
    let (goal, safe) = (mission.goal.as_ref()?, mission.safe.as_ref()?);
    let end = mission.find_unnamed_end().filter(|_| goal.value == safe.value)?;
    let leading = |place: &'_ str| {
        let place = place.to_owned();
        let leads = move |it: &&Transition| it.outputs().any(|arc| arc.place.value == place);
        mission.transitions.iter().filter(leads)
    };
    let is_done = |it: &Transition| it.on.as_ref().is_some_and(|on| on.event.value == "done");
    // Nothing but exits leads to the one that is named, and what is done leads to the other one.
    let is_goal_meant = leading(&end.name.value).any(is_done) && !leading(&safe.value).any(is_done);
    let is_safe_meant = mission.transitions.iter().any(|it| mission.is_meant_exit(it));
    if !is_goal_meant && !is_safe_meant {
        return None;
    }
    let message = format!(
        "{} is the goal and the safe place: when something fails, the mission ends as if it had \
         succeeded",
        safe.value
    );
    let (at, role) = if is_safe_meant { (&safe.at, "safe") } else { (&goal.at, "goal") };
    let finding = Finding::new(Code::NoSafePlace, at, message)
        .related(&end.name.at, "nothing leads on from this place");
    Some(finding.remedy(format!("did you mean {role}=\"{}\"?", end.name.value)))
}

/// Finds a place in which a sub-mission without a safe place stands still. If it has one token, no
/// other of its places is marked then, so the mission that includes it never continues.
fn find_standing_end(inner: &Mission) -> Option<Finding> {
    inner.goal.as_ref()?;
    let end = inner.find_unnamed_end().filter(|_| is_state_machine(inner))?;
    let name = &end.name.value;
    let failures = inner.places.iter().filter_map(|place| place.on_failure.as_ref());
    let moved = inner.transitions.iter().flat_map(|it| it.outputs()).map(|arc| &arc.place);
    moved.chain(failures).find(|place| place.value == *name)?;
    let message = format!(
        "this mission has no safe place: once {name} is marked, it stands still, and the mission \
         that includes it does not continue"
    );
    let finding = Finding::new(Code::NoSafePlace, &inner.at, message).remedy(format!(
        "write safe=\"{name}\" to end both missions in their safe places; or add a transition that \
         leads on from {name}"
    ));
    Some(finding.related(&end.name.at, "this place"))
}

/// Returns the components that no mission may control, with what forbids it.
fn find_fixed<'a>(
    system: &'a System,
    manifests: Option<&Manifests>,
) -> BTreeMap<&'a str, FixedBy<'a>> {
    let components = system.components.iter();
    let fixed = components.filter_map(|component| {
        let kind = component.kind.value.as_str();
        let is_refused = || manifests?.get(kind).map(|manifest| !manifest.controllable);
        let by = match component.controllable {
            false => FixedBy::File,
            true if is_refused() == Some(true) => FixedBy::Kind(kind),
            true => return None,
        };
        Some((component.name.value.as_str(), by))
    });
    fixed.collect()
}

/// What forbids a mission to control a component.
#[derive(Clone, Copy)]
enum FixedBy<'a> {
    /// `controllable="false"`.
    File,
    /// The manifest of its kind.
    Kind(&'a str),
}

/// Returns whether all places and components that the mission names exist. If not, a component that
/// seems to be in no place may be in the one that is missing or misspelt.
fn has_all_places(mission: &Mission, system: &System) -> bool {
    let components: BTreeSet<_> =
        system.components.iter().map(|component| component.name.value.as_str()).collect();
    !mission.unreadable.in_start
        && has_named_places(mission)
        && mission
            .places
            .iter()
            .flat_map(|place| &place.components)
            .all(|name| components.contains(name.value.as_str()))
}

/// Returns whether all places that transitions of the mission name exist.
fn has_named_places(mission: &Mission) -> bool {
    let places: BTreeSet<_> =
        mission.places.iter().map(|place| place.name.value.as_str()).collect();
    let mut arcs = mission.transitions.iter().flat_map(|transition| &transition.arcs);
    arcs.all(|arc| places.contains(arc.place.value.as_str()))
}

/// Returns whether the files of all sub-missions were read.
fn has_all_submissions(mission: &Mission, configuration: &Configuration) -> bool {
    mission.submissions.iter().all(|inner| configuration.included.contains_key(&inner.path))
}

fn check_one(
    mission: &Mission,
    system: &System,
    (controlled, fixed, is_complete): (&BTreeSet<&str>, &BTreeMap<&str, FixedBy<'_>>, bool),
    configuration: &Configuration,
    findings: &mut Findings,
) {
    let transitions = mission.transitions.iter().map(|transition| &transition.name);
    KnownNames::collect("transition", Code::DuplicateTransition, transitions, findings);
    let variables = mission.variables.iter().map(|variable| &variable.name);
    KnownNames::collect("variable", Code::DuplicateVariable, variables, findings);
    let known = MissionNames {
        is_complete,
        ..MissionNames::of(mission, system, (controlled, fixed), findings)
    };
    for place in [&mission.goal, &mission.safe].into_iter().flatten() {
        known.expect_place(place, findings);
    }
    for place in &mission.places {
        known.check_place(place, &mission.transitions, findings);
    }
    for transition in &mission.transitions {
        known.check_transition(transition, findings);
    }
    for exclusive in &mission.exclusives {
        known.check_exclusive(exclusive, findings);
    }
    for submission in &mission.submissions {
        let inner = configuration.included.get(&submission.path);
        for place in [&submission.enter, &submission.leave].into_iter().flatten() {
            known.expect_outer_place(place, submission, inner, findings);
        }
    }
    // A place that is missing may be the one to start in.
    if !mission.unreadable.in_start
        && has_named_places(mission)
        && !mission.places.iter().any(|place| place.initial > 0)
    {
        let finding =
            Finding::new(Code::NoInitialPlace, &mission.at, "no place is marked at the start");
        findings.push(finding.remedy("write initial=\"true\" on the place to start in"));
    }
    twice::submissions_once(mission, findings);
    exclusive::exclusives_kept(mission, findings);
    exclusive::exclusives_once(mission, findings);
}

/// The names that a mission may use, with their properties.
struct MissionNames<'a> {
    places: KnownNames<'a>,
    components: KnownNames<'a>,
    /// The components that no mission may control.
    fixed: &'a BTreeMap<&'a str, FixedBy<'a>>,
    /// The places that activate a component.
    active_in: BTreeMap<&'a str, BTreeSet<&'a str>>,
    /// The components in a place of any mission; the others are always active.
    controlled: &'a BTreeSet<&'a str>,
    /// Whether all places and sub-missions could be read.
    is_complete: bool,
    /// The places that name a component that does not exist: it may be any of them.
    doubtful: BTreeSet<&'a str>,
    /// The places that have a token at the start, or that a transition or sub-mission leads to.
    entered: BTreeSet<&'a str>,
    /// The components of which a place sets parameters, with the place.
    assigned: BTreeSet<(&'a str, &'a str)>,
    /// The reports that transitions wait for in each place: place, component, event.
    awaited: BTreeSet<(&'a str, &'a str, &'a str)>,
    /// The places that set parameters and activate no component: they have lost their components.
    lost: BTreeSet<&'a str>,
}

impl<'a> MissionNames<'a> {
    fn of(
        mission: &'a Mission,
        system: &'a System,
        (controlled, fixed): (&'a BTreeSet<&'a str>, &'a BTreeMap<&'a str, FixedBy<'a>>),
        findings: &mut Findings,
    ) -> Self {
        let places = mission.places.iter().map(|place| &place.name);
        let components = system.components.iter().map(|component| &component.name);
        let mut active_in: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for place in &mission.places {
            for component in &place.components {
                active_in.entry(&component.value).or_default().insert(&place.name.value);
            }
        }
        let names = system.components.iter().map(|component| component.name.value.as_str());
        let existing: BTreeSet<_> = names.collect();
        let is_doubtful = |place: &&Place| {
            !place.components.iter().all(|name| existing.contains(name.value.as_str()))
        };
        let doubtful = mission.places.iter().filter(is_doubtful);
        let assigned = mission.places.iter().flat_map(|place| {
            let given = place.parameters.iter();
            given.map(|given| (place.name.value.as_str(), given.component.value.as_str()))
        });
        let awaited = mission.transitions.iter().flat_map(|it| {
            let on =
                it.on.as_ref().map(|on| (on.component.value.as_str(), on.event.value.as_str()));
            let places = it.inputs().map(|arc| arc.place.value.as_str());
            places.filter_map(move |place| on.map(|(component, event)| (place, component, event)))
        });
        let is_lost = |place: &&Place| place.components.is_empty() && !place.parameters.is_empty();
        let lost = mission.places.iter().filter(is_lost).map(|place| place.name.value.as_str());
        let initial = mission.places.iter().filter(|place| place.initial > 0);
        let initial = initial.map(|place| place.name.value.as_str());
        let put = mission.transitions.iter().flat_map(|transition| transition.outputs());
        let put = put.map(|arc| arc.place.value.as_str());
        let left = mission.submissions.iter().filter_map(|submission| submission.leave.as_ref());
        let entered = initial.chain(put).chain(left.map(|place| place.value.as_str()));
        // Duplicates among the components are the system's findings.
        let unheard = &mut Findings::default();
        Self {
            places: KnownNames::collect("place", Code::DuplicatePlace, places, findings)
                .including(&mission.unreadable),
            components: KnownNames::collect(
                "component",
                Code::DuplicateComponent,
                components,
                unheard,
            )
            .including(&system.unreadable)
            .of_kinds(&system.components),
            fixed,
            active_in,
            controlled,
            is_complete: true,
            doubtful: doubtful.map(|place| place.name.value.as_str()).collect(),
            assigned: assigned.collect(),
            awaited: awaited.collect(),
            lost: lost.collect(),
            entered: entered.collect(),
        }
    }

    fn expect_place(&self, name: &Spanned<String>, findings: &mut Findings) {
        self.places.expect(name, Code::UnknownPlace, findings);
    }

    /// `in` and `out` of a sub-mission name places of the mission that includes it.
    fn expect_outer_place(
        &self,
        name: &Spanned<String>,
        submission: &Submission,
        inner: Option<&Mission>,
        findings: &mut Findings,
    ) {
        if self.places.known.contains_key(name.value.as_str())
            || inner.is_none_or(|inner| inner.place(&name.value).is_none())
        {
            return self.expect_place(name, findings);
        }
        let file = &submission.file.value;
        let message = format!("{} is a place of {file}, not of this mission", name.value);
        let remedy = format!(
            "in and out name the places of this mission before and after the sub-mission: {}",
            listed(self.places.known.keys().copied())
        );
        findings.push(Finding::new(Code::UnknownPlace, &name.at, message).remedy(remedy));
    }

    fn expect_component(&self, name: &Spanned<String>, findings: &mut Findings) -> bool {
        self.components.expect(name, Code::UnknownComponent, findings)
    }

    fn expect_controllable(&self, names: &[Spanned<String>], findings: &mut Findings) {
        for name in names {
            self.expect_component(name, findings);
            if let Some(by) = self.fixed.get(name.value.as_str()) {
                let remedy = match by {
                    FixedBy::File => "remove it here, or make it controllable",
                    FixedBy::Kind(_) => "remove it here: it is always active",
                };
                report_fixed(name, *by, remedy, findings);
            }
        }
    }

    fn check_exclusive(&self, exclusive: &Exclusive, findings: &mut Findings) {
        let components = &exclusive.components;
        if let Some(finding) = self.find_exclusive_places(exclusive) {
            findings.push(finding);
            return;
        }
        self.expect_controllable(components, findings);
        if components.len() < 2 {
            let message = "an exclusive set of one component excludes nothing";
            let finding = Finding::new(Code::ExclusiveAlone, &exclusive.at, message);
            findings.push(finding.remedy("name at least two components"));
            return;
        }
        let names = components.iter().filter(|name| {
            let name = name.value.as_str();
            self.components.known.contains_key(name) && !self.fixed.contains_key(name)
        });
        let is_free = |name: &&Spanned<String>| {
            self.is_complete && !self.controlled.contains(name.value.as_str())
        };
        for name in names.filter(is_free) {
            let message =
                format!("{} is in no place, so it is active together with the others", name.value);
            let finding = Finding::new(Code::ExclusiveTogether, &name.at, message);
            findings.push(finding.remedy("activate it in a place, or remove it from the set"));
        }
    }

    /// The finding for a set that names places instead of components.
    fn find_exclusive_places(&self, exclusive: &Exclusive) -> Option<Finding> {
        let is_place = |name: &&Spanned<String>| {
            let name = name.value.as_str();
            self.places.known.contains_key(name) && !self.components.known.contains_key(name)
        };
        let mut places = exclusive.components.iter().filter(is_place);
        let first = places.next()?;
        let message = format!("there is no component called {0}: {0} is a place", first.value);
        let active = self.active_in.iter().filter(|(_, places)| places.contains(&*first.value));
        let active: Vec<_> = active.map(|(component, _)| *component).collect();
        let remedy = match active.is_empty() {
            true => "name components that must not be active together".into(),
            false => format!(
                "name components that must not be active together; those of {}: {}",
                first.value,
                listed(active.into_iter())
            ),
        };
        let finding = Finding::new(Code::UnknownComponent, &first.at, message).remedy(remedy);
        Some(places.fold(finding, |finding, other| finding.related(&other.at, "and this one")))
    }

    fn is_active_in(&self, component: &str, place: &str) -> bool {
        self.active_in.get(component).is_some_and(|places| places.contains(place))
    }
}

fn report_fixed(name: &Spanned<String>, by: FixedBy<'_>, remedy: &str, findings: &mut Findings) {
    let component = &name.value;
    let message = match by {
        FixedBy::File => {
            format!("{component} has controllable=\"false\", so no mission may control it")
        }
        FixedBy::Kind(kind) => format!(
            "{component} is a {kind}, which may not be frozen, so no mission may control it"
        ),
    };
    findings.push(Finding::new(Code::NotControllable, &name.at, message).remedy(remedy));
}
