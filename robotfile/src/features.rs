//! Which features a file uses beyond plain ArMoR. The whole format is read; the program that plays
//! a file specifies which features it supports. All others are refused by name, not ignored.

use std::fmt;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{ArcKind, Autonomy, Class, Mission, Transition};
use crate::model::{Configuration, Transport};
use crate::source::{Location, Spanned};

/// A feature of the format that not every program supports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Feature {
    /// `transport="udp"`.
    Udp,
    /// `<clock>`.
    Clock,
    /// `when="…"`.
    Guard,
    /// `<variable>` that follows data.
    Variable,
    /// `<variable>` without a source: nothing gives it a value.
    FreeVariable,
    /// An interval that is not one moment.
    Interval,
    /// `priority="n"`.
    Priority,
    /// `class="safety"`.
    SafetyClass,
    /// Weights above 1, or more than one token at the start.
    Weight,
    /// `<read>`.
    ReadArc,
    /// `<inhibitor>`.
    InhibitorArc,
    /// `<reset>`.
    ResetArc,
    /// `operator="true"`, `autonomy="…"`, `lost-link="…"`.
    Operator,
    /// `not-before`, `not-after`, `missed`.
    Date,
    /// `overrun="…"`.
    Overrun,
    /// `<submission>`.
    Submission,
    /// `<check>`.
    Check,
    /// `<parameter>` in a place.
    PlaceParameter,
    /// `period="…"`.
    Period,
    /// `resume="…"`.
    Resume,
}

impl fmt::Display for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Feature::Udp => "UDP (transport=\"udp\")",
            Feature::Clock => "time that follows data (<clock>)",
            Feature::Guard => "a guard (when=\"…\")",
            Feature::Variable => "a variable",
            Feature::FreeVariable => "a variable that follows no data (no source=\"…\")",
            Feature::Interval => "a firing interval",
            Feature::Priority => "a priority",
            Feature::SafetyClass => "class=\"safety\"",
            Feature::Weight => "more than one token",
            Feature::ReadArc => "a read arc",
            Feature::InhibitorArc => "an inhibitor arc",
            Feature::ResetArc => "a reset arc",
            Feature::Operator => "an operator's transition",
            Feature::Date => "an absolute date",
            Feature::Overrun => "a place for overruns",
            Feature::Submission => "a sub-mission",
            Feature::Check => "a check of the net",
            Feature::PlaceParameter => "a parameter set by a place",
            Feature::Period => "a period",
            Feature::Resume => "a policy for resuming",
        })
    }
}

impl Configuration {
    /// Every use of a feature, with where it is, in the order of the files: also in sub-missions.
    pub fn features(&self) -> Vec<Spanned<Feature>> {
        let mut used = Uses::default();
        for link in &self.system.links {
            let mut places = link.unusual.iter();
            used.next_of(link.transport == Transport::Udp, Feature::Udp, &mut places);
        }
        used.add_uses(Feature::Clock, self.system.clock.iter().map(|clock| &clock.source.at));
        self.missions().for_each(|mission| used.add_mission(mission));
        used.0
    }

    /// A finding for each feature that is used and is not among those `played`.
    pub fn refuse_unplayed(&self, played: &[Feature], findings: &mut Findings) {
        for used in self.features().into_iter().filter(|used| !played.contains(&used.value)) {
            let message = format!("{} is not supported by this version", used.value);
            let finding = Finding::new(Code::NotPlayed, &used.at, message);
            findings.push(finding.remedy("remove it, or use a version that supports it"));
        }
    }
}

#[derive(Default)]
struct Uses(Vec<Spanned<Feature>>);

impl Uses {
    fn add_uses<'a>(&mut self, feature: Feature, places: impl IntoIterator<Item = &'a Location>) {
        self.0.extend(places.into_iter().map(|at| Spanned::new(feature, at.clone())));
    }

    fn next_of<'a>(
        &mut self,
        used: bool,
        feature: Feature,
        places: &mut impl Iterator<Item = &'a Location>,
    ) {
        if used {
            self.add_uses(feature, places.next());
        }
    }

    fn add_mission(&mut self, mission: &Mission) {
        self.add_uses(Feature::Period, mission.period.iter().map(|period| &period.at));
        self.add_uses(Feature::Resume, mission.resume.iter().map(|resume| &resume.at));
        for variable in &mission.variables {
            let is_free = variable.source.is_none();
            let feature = if is_free { Feature::FreeVariable } else { Feature::Variable };
            self.add_uses(feature, [&variable.name.at]);
        }
        for place in &mission.places {
            let name = &place.name.at;
            self.add_uses(Feature::Weight, (place.initial > 1).then_some(name));
            self.add_uses(Feature::SafetyClass, (place.class == Class::Safety).then_some(name));
            let parameters = place.parameters.iter().map(|given| &given.parameter.name.at);
            self.add_uses(Feature::PlaceParameter, parameters);
        }
        mission.transitions.iter().for_each(|transition| self.add_transition(transition));
        self.add_uses(
            Feature::Submission,
            mission.submissions.iter().map(|submission| &submission.file.at),
        );
        self.add_uses(Feature::Check, mission.checks.iter().map(|check| &check.at));
    }

    fn add_transition(&mut self, transition: &Transition) {
        let name = &transition.name.at;
        for arc in &transition.arcs {
            let at = &arc.place.at;
            self.add_uses(Feature::Weight, (arc.weight > 1).then_some(at));
            self.add_uses(Feature::ReadArc, (arc.kind == ArcKind::Read).then_some(at));
            self.add_uses(Feature::InhibitorArc, (arc.kind == ArcKind::Inhibitor).then_some(at));
            self.add_uses(Feature::ResetArc, (arc.kind == ArcKind::Reset).then_some(at));
        }
        let loose = transition.interval.iter().filter(|i| i.latest != Some(i.earliest));
        self.add_uses(Feature::Interval, loose.map(|interval| &interval.at));
        self.add_uses(Feature::Guard, transition.when.iter().map(|when| &when.at));
        self.add_uses(Feature::Priority, (transition.priority != 0).then_some(name));
        self.add_uses(Feature::SafetyClass, (transition.class == Class::Safety).then_some(name));
        let manual = transition.autonomy != Autonomy::Auto;
        self.add_uses(
            Feature::Operator,
            manual.then_some(transition.autonomy_at.as_ref().unwrap_or(name)),
        );
        self.add_uses(Feature::Operator, transition.lost_link.iter().map(|lost| &lost.at));
        self.add_uses(Feature::Date, transition.not_before.iter().map(|date| &date.at));
        self.add_uses(Feature::Date, transition.not_after.iter().map(|date| &date.at));
        self.add_uses(Feature::Date, transition.missed.iter().map(|missed| &missed.at));
        self.add_uses(Feature::Overrun, transition.overrun.iter().map(|place| &place.at));
    }
}
